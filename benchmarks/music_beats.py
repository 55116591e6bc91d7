"""Beats found against beats known: a row a song for our tracker and for librosa's.

``python benchmarks/music_beats.py [FOLDER] [--json] [--write]``. FOLDER holds songs beside their ``.beats`` files; left
out, it is
``audio_beats`` of the real test data (ODORI_TEST_DATA, else ``../shared/data``). ``--write`` puts the table into
``docs/music-beats.md``. Scores are mir_eval's with its own defaults but without trimming the first five seconds.
"""

from __future__ import annotations

import argparse
import json
import os
import time
import warnings
from dataclasses import asdict, dataclass
from pathlib import Path

import mir_eval
import numpy as np

from assets.formats import audio, beats_file
from kernels.music.beats import TRACKERS, track_beats
from kernels.types import BeatGrid

REPOSITORY = Path(__file__).parents[1]
PAGE = REPOSITORY / "docs" / "music-beats.md"
BEGIN, END = "<!-- table: begin -->\n", "<!-- table: end -->"


@dataclass(frozen=True)
class Row:
    """Scores of one tracker on one song; ``downbeat_f`` is None where the truth has no bars."""

    song: str
    tracker: str
    f: float
    cmlt: float
    amlt: float
    downbeat_f: float | None
    true_bpm: float
    found_bpm: float
    lag_ms: float
    seconds_per_minute: float


def score(song: str, tracker: str, truth: BeatGrid, found: BeatGrid, *, seconds_per_minute: float) -> Row:
    """Compare beats found with beats known."""
    true_s, found_s = truth.time_s, found.time_s
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # mir_eval warns of empty beats and scores them 0
        f = mir_eval.beat.f_measure(true_s, found_s)
        _, cmlt, _, amlt = mir_eval.beat.continuity(true_s, found_s)
        true_down = true_s[truth.beat_in_bar_number == 1]
        found_down = found_s[found.beat_in_bar_number == 1]
        down = mir_eval.beat.f_measure(true_down, found_down) if len(true_down) > 1 else None
    off_s = found_s[np.abs(found_s[:, None] - true_s).argmin(axis=0)] - true_s if len(found_s) else np.zeros(0)
    off_s = off_s[np.abs(off_s) < 0.07]
    return Row(
        song=song,
        tracker=tracker,
        f=float(f),
        cmlt=float(cmlt),
        amlt=float(amlt),
        downbeat_f=None if down is None else float(down),
        true_bpm=60 / float(np.median(np.diff(true_s))),
        found_bpm=60 / float(np.median(np.diff(found_s))) if len(found_s) > 1 else 0.0,
        lag_ms=1000 * float(np.median(off_s)) if len(off_s) else 0.0,
        seconds_per_minute=seconds_per_minute,
    )


def measure(folder: Path) -> list[Row]:
    """Run both trackers on every song that has a beats file beside it."""
    rows = []
    for tracker in TRACKERS:
        track_beats(np.random.default_rng(0).uniform(-1, 1, (44100, 1)), 44100, tracker=tracker)  # loads and compiles
        for truth_path in sorted(folder.glob("*.beats")):
            songs = [p for p in sorted(folder.glob(truth_path.stem + ".*")) if p.suffix in (".wav", ".ogg", ".mp3")]
            if not songs:
                continue
            sound = audio.read(songs[0])
            start = time.perf_counter()
            found = track_beats(sound.samples, sound.sample_rate_hz, tracker=tracker).grid
            spent = (time.perf_counter() - start) * 60 / sound.duration_s
            rows.append(score(truth_path.stem, tracker, beats_file.read(truth_path), found, seconds_per_minute=spent))
    return rows


def mean(rows: list[Row]) -> dict[str, float]:
    """Average the scores of a tracker over its songs."""
    down = [row.downbeat_f for row in rows if row.downbeat_f is not None]
    return {
        "f": float(np.mean([row.f for row in rows])),
        "cmlt": float(np.mean([row.cmlt for row in rows])),
        "amlt": float(np.mean([row.amlt for row in rows])),
        "downbeat_f": float(np.mean(down)) if down else float("nan"),
        "seconds_per_minute": float(np.mean([row.seconds_per_minute for row in rows])),
    }


def table(rows: list[Row]) -> str:
    """Lay the rows out as Markdown, ours beside librosa's."""
    ours = {row.song: row for row in rows if row.tracker == TRACKERS[0]}
    theirs = {row.song: row for row in rows if row.tracker == TRACKERS[1]}
    lines = [
        "| song | true tempo | found | F | CMLt | AMLt | downbeat F | lag, ms | librosa F | CMLt | AMLt |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for song, row in ours.items():
        down = "" if row.downbeat_f is None else f"{row.downbeat_f:.2f}"
        other = theirs[song]
        lines.append(
            f"| {song} | {row.true_bpm:.0f} | {row.found_bpm:.0f} | {row.f:.2f} | {row.cmlt:.2f} | {row.amlt:.2f} | "
            f"{down} | {row.lag_ms:.0f} | {other.f:.2f} | {other.cmlt:.2f} | {other.amlt:.2f} |"
        )
    us, them = mean(list(ours.values())), mean(list(theirs.values()))
    lines.append(
        f"| **mean of {len(ours)}** | | | **{us['f']:.3f}** | **{us['cmlt']:.3f}** | **{us['amlt']:.3f}** | "
        f"**{us['downbeat_f']:.3f}** | | {them['f']:.3f} | {them['cmlt']:.3f} | {them['amlt']:.3f} |"
    )
    lines.append(
        f"\nSeconds of one core a minute of sound: {us['seconds_per_minute']:.2f}, "
        f"librosa {them['seconds_per_minute']:.2f} once compiled.\n"
    )
    return "\n".join(lines)


def main() -> None:
    """Measure, print, and write the page when asked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--json", action="store_true", help="one JSON object instead of the table")
    parser.add_argument("--write", action="store_true", help=f"put the table into {PAGE.relative_to(REPOSITORY)}")
    arguments = parser.parse_args()
    data = Path(os.environ.get("ODORI_TEST_DATA", REPOSITORY.parent / "shared" / "data"))
    folder = arguments.folder or data / "audio_beats"
    if not list(folder.glob("*.beats")):
        raise SystemExit(f"no songs with beats in {folder}; name a folder, or one of test data in ODORI_TEST_DATA")
    rows = measure(folder)
    if arguments.json:
        means = {tracker: mean([row for row in rows if row.tracker == tracker]) for tracker in TRACKERS}
        print(json.dumps({"songs": [asdict(row) for row in rows], "mean": means}, indent=1))
    else:
        print(table(rows))
    if arguments.write:
        page = PAGE.read_text("utf-8")
        head, _, rest = page.partition(BEGIN)
        PAGE.write_text(head + BEGIN + table(rows) + END + rest.partition(END)[2], "utf-8")


if __name__ == "__main__":
    main()
