"""Feet of real dances, free and locked, at several frame rates: what moves through seams, what knees and seams pay.

    python benchmarks/feet.py [--studio DIR] [--songs N] [--rates HZ ...] [--json]

The studio is built already (``odori build``), or is made of the real test data. *Slip*: how far each ankle and each
toes joint that is planted in the clips from one end of a blend to the other moves over it, in centimetres. *Slide*: of
planted feet anywhere, over what the clips have themselves. *Jerk*: peaks at seams over the 99th percentile of the clips
danced. *Knees*: how abruptly they turn at one frame in a thousand, over the same of the clips; median, worst of songs.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parent))

from studio_dances import BuiltStudio, Danced, built, percentile

from assets.formats.settings_file import read_settings
from kernels.assembly.blend import assemble
from kernels.assembly.feet import lock_feet, planted_feet
from kernels.assembly.foot_quality import foot_measures, knee_measures, seam_slips
from kernels.assembly.seam_quality import peak_ratios
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Clip, Float

Figures = tuple[Float, Float, dict[str, float]]


def judge(danced: Danced, clips: dict[str, Clip], rate_hz: float) -> dict[str, Figures]:
    """Assemble one dance with free and with locked feet: slips, jerk at seams, measures."""
    steps = danced.steps
    end_s = float(steps.song_end_s[-1])
    free = assemble(steps, clips, skeleton=CANONICAL, frame_rate_hz=rate_hz, duration_s=end_s)
    planted = planted_feet(free, steps, clips)
    reach_s = steps.blend_s[steps.has_seam] / 2 + 0.1
    found = {}
    for name, dance in (("free", free), ("locked", lock_feet(free, planted))):
        measures = [*foot_measures(dance, steps, clips), *knee_measures(dance, steps, clips)]
        found[name] = (
            100 * seam_slips(dance, steps, planted),
            peak_ratios(dance, steps, clips, skeleton=CANONICAL, reach_s=reach_s),
            {m.name: m.value for m in measures},
        )
    return found


def row(name: str, rate_hz: float, judged: list[Figures]) -> dict[str, float | str]:
    """Put the dances of one rate together."""
    slip, jerk = (np.concatenate([j[i] for j in judged]) for i in (0, 1))

    def of(measure: str) -> Float:
        return np.array([measures[measure] for _, _, measures in judged])

    source = float((of("source_foot_slide_cm_per_s") * of("planted_s")).sum())
    return {
        "feet": name,
        "frame_rate_hz": rate_hz,
        "planted_count": float(len(slip)),
        "slip_median_cm": percentile(slip, 50),
        "slip_p95_cm": percentile(slip, 95),
        "slip_worst_cm": float(slip.max(initial=0.0)),
        "added_slide_ratio": float((of("added_foot_slide_cm_per_s") * of("planted_s")).sum()) / max(source, 1e-9),
        "penetration_cm": float(of("penetration_cm").max()),
        "jerk_median_ratio": percentile(jerk, 50),
        "jerk_p95_ratio": percentile(jerk, 95),
        "jerk_worst_ratio": float(jerk.max(initial=0.0)),
        "knee_pop_ratio": percentile(of("knee_pop_ratio"), 50),
        "knee_pop_worst_ratio": float(of("knee_pop_ratio").max()),
    }


def table(rows: list[dict[str, float | str]]) -> str:
    """Write the rows as Markdown."""
    head = "| feet | frames/s | slip, cm: median | p95 | worst | added slide | depth, cm | jerk: median | p95 | worst "
    lines = [head + "| knees: median | worst |", "|" + "---|" * 12]
    for r in rows:
        figures = [f"{value:.2f}" for key, value in list(r.items())[3:] if isinstance(value, float)]
        lines.append(f"| {r['feet']} | {r['frame_rate_hz']:g} | {' | '.join(figures)} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Dance, lock, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--studio", type=Path, help="a built studio; else one of the real test data")
    parser.add_argument("--songs", type=int, default=12, help="how many songs, evenly from all")
    parser.add_argument("--rates", type=float, nargs="+", default=[24.0, 30.0, 60.0, 120.0], help="frames a second")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    options = parser.parse_args()
    with built(options.studio) as root:
        studio = BuiltStudio(root, read_settings(root / "odori.toml"))
        known = studio.catalogue()
        songs = [studio.dance(known, key) for key in studio.songs[:: max(len(studio.songs) // options.songs, 1)]]
        every = [(danced, studio.clips(danced.steps)) for danced in songs]
    rows = []
    for rate_hz in options.rates:
        judged = [judge(danced, clips, rate_hz) for danced, clips in every]
        rows += [row(name, rate_hz, [j[name] for j in judged]) for name in ("free", "locked")]
    if options.json:
        print(json.dumps({"songs": len(every), "rows": rows}))
        return
    n_seams = sum(int(danced.steps.has_seam.sum()) for danced, _ in every)
    print(f"{table(rows)}\n{n_seams} seams of {len(every)} songs, {rows[0]['planted_count']:.0f} planted points")


if __name__ == "__main__":
    main()
