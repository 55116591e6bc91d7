"""Flips of the dances of a studio, as first chosen and after what flips was avoided.

    python benchmarks/flips.py [--studio DIR] [--method NAME] [--frame-rate HZ] [--every N [--first I]] [--json]

The studio is built already, for the method too, or is made of the real test data (the graph's alone). Dances are chosen
and assembled in memory with the settings of the studio; nothing is written. A *flip* is what
``kernels/assembly/one_frame_flips.py`` says; *furthest* is the furthest move of a joint in a frame over the fastest
frame of the clips shown, at the dance's pace. What is left is said with time and clip.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parent))

from studio_dances import BuiltStudio, built

from assets.dancing.asked import Direction
from assets.dancing.assembled import assemble_steps
from assets.dancing.chosen_steps import ChosenSteps
from assets.dancing.method import DanceOrder
from assets.dancing.methods import METHODS, USUAL
from assets.dancing.refusal import RefusalError
from assets.dancing.without_flips import choose_without_flips
from assets.formats.settings_file import read_settings
from assets.reading.clips import load_fences
from kernels.assembly.one_frame_flips import find_flips, furthest_move
from kernels.skeleton.canonical import CANONICAL


def measure(studio: BuiltStudio, key: str, way: str, rate_hz: float) -> dict[str, object]:
    """Dance a song by a method; flips before and after, searches, seconds."""
    method, song = METHODS[way], studio.song(key)
    inputs = {name: studio.stored(name) for name in method.inputs}
    order = DanceOrder(key, song.beats, song.duration_s, studio.settings, Direction())
    begin = time.process_time()
    first = method.choose(inputs, order)
    chosen_s = time.process_time() - begin

    def choose(given: object, asked: DanceOrder) -> ChosenSteps:
        return first if not asked.avoid else method.choose(inputs, asked)

    found = choose_without_flips(replace(method, choose=choose), inputs, order, frame_rate_hz=rate_hz)
    spent_s = time.process_time() - begin
    count, ratio = {}, {}
    for name, chosen in (("first", first), ("after", found)):
        dance = assemble_steps(chosen.steps, inputs["canonical_pose"], studio.settings.dance, frame_rate_hz=rate_hz)
        count[name] = len(find_flips(dance.rotation_wxyz, CANONICAL.parent, rate_hz))
        clips, fenced = studio.clips(chosen.steps), load_fences(inputs["canonical_pose"], chosen.steps)
        moved = furthest_move(dance, chosen.steps, clips, skeleton=CANONICAL, fenced=fenced)
        ratio[name] = moved.ratio if moved else 0.0
    return {
        "flips_first_count": count["first"],
        "flips_after_count": count["after"],
        "searches_again_count": found.metadata["searches_again"],
        "avoided_count": len(found.avoided),
        "furthest_first_ratio": ratio["first"],
        "furthest_after_ratio": ratio["after"],
        "choosing_cpu_s": chosen_s,
        "whole_cpu_s": spent_s,
        "left": found.metadata["flips_left"],
    }


def main() -> None:
    """Dance, look, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--studio", type=Path, help="a built studio; else one of the real test data")
    parser.add_argument("--method", default=USUAL, choices=list(METHODS), help="by which the songs are danced")
    parser.add_argument("--frame-rate", type=float, default=0.0, help="frames a second; else the studio's setting")
    parser.add_argument("--every", type=int, default=1, help="only every so many songs")
    parser.add_argument("--first", type=int, default=0, help="the first of them, from 0")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    options = parser.parse_args()
    rows: dict[str, dict[str, object]] = {}
    with built(options.studio) as root:
        studio = BuiltStudio(root, read_settings(root / "odori.toml"))
        rate_hz = options.frame_rate or studio.settings.dance.frame_rate_hz
        for key in studio.songs[options.first :: options.every]:
            try:
                row = rows[key] = measure(studio, key, options.method, rate_hz)
            except RefusalError as refused:
                print(f"{key[:44]:44} refused: {refused}", file=sys.stderr, flush=True)
                continue
            if not options.json:
                print(
                    f"{key[:44]:44} flips {row['flips_first_count']:3} → {row['flips_after_count']:2}  searches "
                    f"{row['searches_again_count']}  avoided {row['avoided_count']:2}  furthest "
                    f"{row['furthest_first_ratio']:.2f} → {row['furthest_after_ratio']:.2f}  "
                    f"{row['choosing_cpu_s']:.1f} → {row['whole_cpu_s']:.1f} CPU-s",
                    *(f"\n    {sentence}" for sentence in row["left"]),  # type: ignore[attr-defined]
                    flush=True,
                )
    total = {name: sum(int(row[name]) for row in rows.values()) for name in ("flips_first_count", "flips_after_count")}  # type: ignore[call-overload]
    print(json.dumps({"songs": rows, **total}) if options.json else f"{len(rows)} songs: {total}")


if __name__ == "__main__":
    main()
