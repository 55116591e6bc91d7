"""Every song of a studio danced by the motion graph, and the bars of a dance as one table.

    python benchmarks/dances.py [--studio DIR] [--frame-rate HZ] [--every N [--first I]] [--json]

The studio is built already (``odori build``), or is made of the real test data. Dances are chosen, assembled and judged
in memory with the settings of the studio; nothing is written. *Seams* are all seams of all songs: the peak of the jerk
from 0.1 s before a blend to 0.1 s after it, over the 99th percentile of the clips danced, at the dance's own pace; the
same choreography cut without blends stands beside. *Slide* is added to what the clips have themselves, per second of
contact. *Beats*: songs whose F at 70 ms by an observer that knows nothing of the plan is met by less than one in a
hundred dances whose beats are shifted at random in blocks of 4 s. *Stays* are the music beats from one seam to the
next. *Intensity* is the rank correlation of the music's strength and the speed of the joints, beat by beat.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parent))

from studio_dances import BuiltStudio, Danced, built, percentile

from assets.formats.settings_file import read_settings
from kernels.assembly import foot_quality, quality, seam_quality
from kernels.assembly.blend import assemble
from kernels.assembly.feet import lock_feet, planted_feet
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Float

_INTENSITY = "intensity_rank_correlation_ratio"


def judge(studio: BuiltStudio, danced: Danced, frame_rate_hz: float) -> tuple[dict[str, float], Float, Float]:
    """Assemble one dance and measure it: figures, seams, the same seams cut."""
    steps, clips, settings = danced.steps, studio.clips(danced.steps), studio.settings.dance
    end_s = float(steps.song_end_s[-1])
    dance = assemble(
        steps, clips, skeleton=CANONICAL, frame_rate_hz=frame_rate_hz, duration_s=end_s, shape=settings.blend_shape
    )
    if settings.lock_feet:
        dance = lock_feet(dance, planted_feet(dance, steps, clips))
    blended, cut = seam_quality.seam_ratios(dance, steps, clips, skeleton=CANONICAL)
    measures = [
        *quality.lag_measures(dance, steps, danced.heard_s),
        *quality.beat_measures(dance, danced.heard_s),
        *quality.warp_measures(steps),
        *foot_quality.foot_measures(dance, steps, clips),
        *foot_quality.knee_measures(dance, steps, clips),
        *quality.intensity_measures(dance, danced.strength, danced.grid_s),
        *foot_quality.slip_measures(dance, steps, clips),
    ]
    found = {m.name: m.value for m in measures}
    stays = stays_of(danced)
    facts = {
        "step_count": len(steps.clip_id),
        "clip_count": len(set(steps.clip_id)),
        "stay_count": len(stays),
        "stay_median_beats": percentile(stays, 50),
        "stay_short_count": int((stays < danced.stay_beats).sum()),
        "stay_of_one_or_two_count": int((stays < 3).sum()),
    }
    return found | facts, blended, cut


def stays_of(danced: Danced) -> Float:
    """Music beats from each seam of a dance to its next, (S,)."""
    seam_s = danced.steps.song_start_s[danced.steps.has_seam]
    return np.diff(np.searchsorted(danced.grid_s, seam_s + 1e-6)).astype(np.float64)


def bars(rows: dict[str, dict[str, float]], blended: Float, cut: Float) -> list[tuple[str, str, float, bool]]:
    """Judge the dances together: name, what is wanted, figure, whether it is met."""

    def of(name: str) -> Float:
        return np.array([row[name] for row in rows.values()])

    n_steps = of("step_count")
    easy = float((of("warp_easy_ratio") * n_steps).sum() / n_steps.sum())
    source = of("source_foot_slide_cm_per_s") * of("planted_s")
    added = float((of("added_foot_slide_cm_per_s") * of("planted_s")).sum() / source.sum())
    sure = float((of("beat_f_p_probability") < 0.01).mean())
    knees = percentile(of("knee_pop_ratio"), 50)
    n_stays = max(of("stay_count").sum(), 1)
    median, worst = percentile(blended, 50), float(blended.max(initial=0.0))
    return [
        ("seam_jerk_median_ratio", "at most 1.2", median, median <= 1.2),
        ("seam_jerk_p95_ratio", "", percentile(blended, 95), True),
        ("seam_jerk_worst_ratio", "at most 2.0", worst, worst <= 2.0),
        ("plain_cut_median_ratio", "", percentile(cut, 50), True),
        ("plain_cut_worst_ratio", "", float(cut.max(initial=0.0)), True),
        ("added_slide_ratio", "at most 0.10 of the clips' own", added, added <= 0.10),
        ("penetration_cm", "at most 1", float(of("penetration_cm").max()), bool(of("penetration_cm").max() <= 1)),
        ("knee_pop_ratio", "median of songs, at most 1.2", knees, knees <= 1.2),
        ("seam_foot_slip_worst_cm", "", float(of("seam_foot_slip_worst_cm").max()), True),
        ("warp_easy_ratio", "at least 0.95", easy, easy >= 0.95),
        ("songs_above_chance_ratio", "at least 0.80", sure, sure >= 0.80),
        ("intensity_rank_correlation_ratio", "median of songs", percentile(of(_INTENSITY), 50), True),
        ("intensity_p10_rank_correlation_ratio", "", percentile(of(_INTENSITY), 10), True),
        ("stay_short_ratio", "stays under path.stay_beats", float(of("stay_short_count").sum() / n_stays), True),
        ("stay_of_one_or_two_ratio", "", float(of("stay_of_one_or_two_count").sum() / n_stays), True),
        ("stay_median_beats", "median of songs", percentile(of("stay_median_beats"), 50), True),
    ]


def main() -> None:
    """Dance, judge, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--studio", type=Path, help="a built studio; else one of the real test data")
    parser.add_argument("--frame-rate", type=float, default=0.0, help="frames a second; else the studio's setting")
    parser.add_argument("--every", type=int, default=1, help="only every so many songs")
    parser.add_argument("--first", type=int, default=0, help="the first of them, from 0")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    options = parser.parse_args()
    with built(options.studio) as root:
        studio = BuiltStudio(root, read_settings(root / "odori.toml"))
        known, rows, blended, cut = studio.catalogue(), {}, [], []
        begin = time.process_time()
        for key in studio.songs[options.first :: options.every]:
            rate_hz = options.frame_rate or studio.settings.dance.frame_rate_hz
            rows[key], b, c = judge(studio, studio.dance(known, key), rate_hz)
            blended.append(b)
            cut.append(c)
            rows[key] |= {"seam_count": len(b), "seam_jerk_worst_ratio": float(b.max(initial=0.0))}
            if not options.json:
                _print_row(key, rows[key])
        spent_s = time.process_time() - begin
    found = bars(rows, np.concatenate(blended), np.concatenate(cut))
    if options.json:
        print(json.dumps({"songs": rows, **{name: value for name, _, value, _ in found}, "cpu_s": spent_s}))
        return
    print(f"\n{len(rows)} songs, {sum(len(b) for b in blended)} seams, {spent_s:.0f} CPU-s")
    for name, wanted, value, is_met in found:
        print(f"{name:28}{value:8.3f}  {wanted}{'' if is_met else '  MISSED'}")


def _print_row(key: str, row: dict[str, float]) -> None:
    print(
        f"{key[:44]:44} seams {row['seam_count']:3.0f} worst {row['seam_jerk_worst_ratio']:5.2f}  slide "
        f"{row['source_foot_slide_cm_per_s']:5.2f}{row['added_foot_slide_cm_per_s']:+6.2f} cm/s  deep "
        f"{row['penetration_cm']:5.2f} cm  easy {row['warp_easy_ratio']:.2f}  F {row['beat_f_ratio']:.2f} p "
        f"{row['beat_f_p_probability']:.3f}  strength {row[_INTENSITY]:+.2f}  short {row['stay_short_count']:.0f} of "
        f"{row['stay_count']:.0f} stays",
        flush=True,
    )


if __name__ == "__main__":
    main()
