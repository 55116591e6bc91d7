"""Shapes and widths of blends compared on the dances of a studio, seam by seam.

    python benchmarks/seams.py [--studio DIR] [--songs N] [--frame-rate HZ] [--json] [--write]

The same choreographies, by the studio's settings, are joined in every shape at every width; a plain cut is among them.
*Jerk*: the peak from 0.1 s before a blend of 0.4 s to 0.1 s after it (the same stretch for every width), over the 99th
percentile inside the clips danced, at the dance's own pace. *At the seam*: within 0.1 s of it. *Speed*: how fast the
joints move within 0.1 s of the seam, over what both clips do there on average: below 1 a blend levels the motion. Feet
are not locked: what is compared is the blend. ``--write`` puts the table into ``docs/seams.md``.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parent))

from studio_dances import REPOSITORY, BuiltStudio, Danced, built, percentile

from assets.formats.settings_file import read_settings
from kernels.assembly.blend import assemble
from kernels.assembly.joins import SHAPES
from kernels.assembly.seam_quality import peak_ratios, phrases_alone
from kernels.assembly.timing import blend_widths
from kernels.motion.velocity import mean_speed
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Clip, Float

WIDTHS_S = (0.2, 0.4, 0.6)
PAGE = REPOSITORY / "docs" / "seams.md"
BEGIN, END = "<!-- table: begin -->\n", "<!-- table: end -->"


def compare(danced: Danced, clips: dict[str, Clip], shape: str, width_s: float, rate_hz: float) -> list[Float]:
    """Join one dance in one way: jerk around each seam, jerk at it, speed at it."""
    steps = danced.steps
    width = blend_widths(steps.song_start_s, steps.song_end_s, steps.has_seam, wanted_s=width_s)
    steps = replace(steps, blend_s=width)
    end_s = float(steps.song_end_s[-1])
    dance = assemble(steps, clips, skeleton=CANONICAL, frame_rate_hz=rate_hz, duration_s=end_s, shape=shape)
    alone = np.zeros(len(dance.time_s))
    for frame, position in phrases_alone(dance, steps, clips, skeleton=CANONICAL):
        alone[frame] = mean_speed(position, rate_hz, smoothing_s=0)
    moved = mean_speed(dance.position_xyz_m, rate_hz, smoothing_s=0)
    at_s = steps.song_start_s[steps.has_seam]
    near = [np.abs(dance.time_s - s) <= 0.1 for s in at_s]
    speed = [moved[n].mean() / max(alone[n].mean(), 1e-6) for n in near]
    around, at = (peak_ratios(dance, steps, clips, skeleton=CANONICAL, reach_s=reach_s) for reach_s in (0.3, 0.1))
    return [around, at, np.array(speed)]


def measure(studio: BuiltStudio, n_songs: int, rate_hz: float) -> list[dict[str, object]]:
    """Join every dance in every way."""
    known = studio.catalogue()
    songs = [studio.dance(known, key) for key in studio.songs[:: max(len(studio.songs) // n_songs, 1)]]
    every = [(danced, studio.clips(danced.steps)) for danced in songs]
    rows = []
    for shape, width_s in [("cut", 0.0), *((s, w) for s in SHAPES for w in WIDTHS_S)]:
        found = [compare(d, clips, "slerp" if shape == "cut" else shape, width_s, rate_hz) for d, clips in every]
        around, at, speed = (np.concatenate([f[i] for f in found]) for i in range(3))
        rows.append(
            {
                "shape": shape,
                "width_s": width_s,
                "seam_count": len(around),
                "median_ratio": percentile(around, 50),
                "p95_ratio": percentile(around, 95),
                "worst_ratio": float(around.max(initial=0)),
                "at_seam_median_ratio": percentile(at, 50),
                "at_seam_p95_ratio": percentile(at, 95),
                "at_seam_worst_ratio": float(at.max(initial=0)),
                "speed_ratio": percentile(speed, 50),
            }
        )
    return rows


def table(rows: list[dict[str, object]], n_songs: int) -> str:
    """Lay the rows out as Markdown."""
    lines = [
        "| shape | width, s | jerk around the seam: median | p95 | worst | at the seam: median | p95 | worst | speed |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    names = ("median_ratio", "p95_ratio", "worst_ratio", "at_seam_median_ratio", "at_seam_p95_ratio")
    for row in rows:
        figures = " | ".join(f"{row[name]:.2f}" for name in (*names, "at_seam_worst_ratio", "speed_ratio"))
        lines.append(f"| {row['shape']} | {row['width_s']} | {figures} |")
    return "\n".join(lines) + f"\n\n{rows[0]['seam_count']} seams of {n_songs} songs.\n"


def main() -> None:
    """Compare, print, and write the page when asked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--studio", type=Path, help="a built studio; else one of the real test data")
    parser.add_argument("--songs", type=int, default=12, help="how many songs, evenly from all")
    parser.add_argument("--frame-rate", type=float, default=30.0, help="frames a second")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    parser.add_argument("--write", action="store_true", help=f"put the table into {PAGE.relative_to(REPOSITORY)}")
    options = parser.parse_args()
    with built(options.studio) as root:
        studio = BuiltStudio(root, read_settings(root / "odori.toml"))
        rows = measure(studio, options.songs, options.frame_rate)
        n_songs = len(studio.songs[:: max(len(studio.songs) // options.songs, 1)])
    text = table(rows, n_songs)
    print(json.dumps({"rows": rows, "songs": n_songs}) if options.json else text)
    if options.write:
        head, _, rest = PAGE.read_text("utf-8").partition(BEGIN)
        PAGE.write_text(head + BEGIN + text + END + rest.partition(END)[2], "utf-8")


if __name__ == "__main__":
    main()
