"""Motion beats judged without labels: partners who dance together, made-up dancers with known beats, made-up motion.

``python benchmarks/motion_beats.py [FOLDER] [--methods pulse fft ...] [--made N] [--json]``. FOLDER holds BVH files of
couples whose names begin 60_NN (lead) and 61_NN (follow), the same NN the same frames, as CMU subjects 60 and 61; left
out, it is ``bvh_dance/cmu_salsa`` of the real test data. Every clip is looked at by itself. *Partners*: tempi equal up
to an octave within 4 %, and F of beats at 70 ms after the octave, beside its chance where each four seconds of beats
are shifted by an amount of their own. *Crops*: the first and last two thirds of a clip against the whole. *Known*: one
move at 60 to 180 a minute on three rigs, 24 to 120 Hz, noise to 2 cm. *Mixed*: which
made-up clips are said to have a pulse.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from motion_pulse_clips import known_dancers, mixed_clips

from assets.formats import bvh
from kernels import rotation
from kernels.assembly.quality import f_measure
from kernels.motion.dance_pulse import dance_pulse
from kernels.motion.motion_beats import BeatSettings, motion_beats
from kernels.skeleton.naming import map_joints
from kernels.skeleton.retarget import retarget
from kernels.types import Float

OCTAVES = (1.0, 2.0, 0.5)
Clip = tuple[Float, Float, float]


def beats_by(method: str) -> Callable[[Clip], Float]:
    """Tracker of a method as ``odori.toml`` names it: from positions, heading and rate to seconds."""

    def find(clip: Clip) -> Float:
        position, heading, rate_hz = clip
        if method == "pulse":
            return dance_pulse(position, rate_hz).time_s
        how = BeatSettings(method=method)  # type: ignore[arg-type]
        return motion_beats(position, rate_hz, heading_rad=heading, settings=how).time_s

    return find


def read(path: Path) -> Clip:
    """Bring a BVH file to canonical positions, heading and rate."""
    clip = bvh.to_clip(bvh.read(path)).clip
    motion = retarget(clip, map_joints(clip.skeleton))
    return motion.position_xyz_m, rotation.heading_rad(motion.rotation_wxyz[:, 0]), clip.frame_rate_hz


def tempo(beat_s: Float) -> float:
    """Mean tempo, 0 for fewer than three beats."""
    return 60.0 / float(np.polyfit(np.arange(len(beat_s)), beat_s, 1)[0]) if len(beat_s) > 2 else 0.0


def octave_of(one_bpm: float, other_bpm: float) -> float:
    """Octave by which two tempi agree within 4 %; 0 where they do not."""
    return next((o for o in OCTAVES if other_bpm and abs(one_bpm / (o * other_bpm) - 1) <= 0.04), 0.0)


def paired(one: Float, other: Float) -> tuple[Float, Float]:
    """Beats of two dancers at one level: every second beat of the faster, the half that agrees better."""
    ratio = tempo(one) / tempo(other)
    octave = min(OCTAVES, key=lambda o: abs(np.log(ratio / o)))
    pairs = {
        1.0: [(one, other)],
        2.0: [(one[k::2], other) for k in (0, 1)],
        0.5: [(one, other[k::2]) for k in (0, 1)],
    }[octave]
    return max(pairs, key=lambda pair: f_measure(pair[0], pair[1]))


def chance(one: Float, other: Float, *, draws: int = 100) -> float:
    """F where each four seconds of one dancer's beats are shifted by an amount of their own, up to half a beat."""
    rng, half_s = np.random.default_rng(0), float(np.median(np.diff(other))) / 2
    block = (other / 4.0).astype(np.int64)
    shifts = rng.uniform(-half_s, half_s, (draws, int(block.max()) + 1))
    shifted = (np.unique(np.maximum(other + shift[block], 0.0)) for shift in shifts)
    return float(np.mean([f_measure(one, moved) for moved in shifted]))


def partners(folder: Path, find: Callable[[Clip], Float]) -> dict[str, object]:
    """Judge couples, and crops of each of their clips."""
    rows, crops, spent = [], [], 0.0
    for lead in sorted(folder.glob("60_*.bvh")):
        follows = sorted(folder.glob(f"61_{lead.stem[3:5]}*.bvh"))
        if not follows:
            continue
        clips = read(lead), read(follows[0])
        start = time.process_time()
        one, other = (find(clip) for clip in clips)
        spent += time.process_time() - start
        for clip, whole in zip(clips, (one, other), strict=True):
            n = len(clip[0])
            for part in (slice(0, 2 * n // 3), slice(n // 3, n)):
                found = find((clip[0][part], clip[1][part], clip[2]))
                crops.append(octave_of(tempo(found), tempo(whole)) > 0)
        f, by_chance = 0.0, 0.0
        if min(len(one), len(other)) > 2:
            pair = paired(one, other)
            f, by_chance = f_measure(*pair), chance(*pair)
        agrees = octave_of(tempo(one), tempo(other)) > 0
        row = {
            "take": lead.stem[3:5],
            "lead_bpm": tempo(one),
            "follow_bpm": tempo(other),
            "f": f,
            "chance_f": by_chance,
        }
        rows.append(row | {"tempi_agree": agrees})
    return {
        "couples": rows,
        "couple_count": len(rows),
        "agreeing_count": sum(bool(row["tempi_agree"]) for row in rows),
        "mean_f": float(np.mean([row["f"] for row in rows])) if rows else 0.0,
        "mean_chance_f": float(np.mean([row["chance_f"] for row in rows])) if rows else 0.0,
        "crops_agreeing_ratio": float(np.mean(crops)) if crops else 0.0,
        "cpu_s_per_clip": spent / max(2 * len(rows), 1),
    }


def known(find: Callable[[Clip], Float], n: int) -> dict[str, float]:
    """Judge even made-up dancers: tempo up to an octave within 2 %, octave, phase within a frame."""
    tempo_right, octave_right, phase_right, found_any = [], [], [], []
    for made in known_dancers(n):
        found = find((made.position_m, np.zeros(len(made.position_m)), made.frame_rate_hz))
        found_any.append(len(found) > 2)
        ratio = tempo(found) / made.true_bpm
        tempo_right.append(any(abs(ratio / o - 1) <= 0.02 for o in OCTAVES))
        octave_right.append(abs(ratio - 1) <= 0.04)
        if octave_right[-1]:
            off = found[:, None] - made.beat_s
            nearest = np.take_along_axis(off, np.abs(off).argmin(axis=1)[:, None], axis=1)
            phase_right.append(abs(float(np.median(nearest))) <= 1.0 / made.frame_rate_hz)
    return {
        "with_beats_ratio": float(np.mean(found_any)),
        "tempo_within_2_percent_ratio": float(np.mean(tempo_right)),
        "octave_right_ratio": float(np.mean(octave_right)),
        "phase_within_a_frame_ratio": float(np.mean(phase_right)) if phase_right else 0.0,
    }


def mixed(find: Callable[[Clip], Float], n: int) -> dict[str, float]:
    """Count made-up clips that get beats, by kind: dances, moves at no tempo, aimless motion."""
    has: dict[str, list[bool]] = {}
    for made in mixed_clips(n, seed=2):
        found = find((made.position_m, np.zeros(len(made.position_m)), made.frame_rate_hz))
        has.setdefault(made.kind, []).append(len(found) > 2)
    return {f"{kind}_with_beats_ratio": float(np.mean(values)) for kind, values in sorted(has.items())}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--methods", nargs="+", default=["pulse", "fft"], choices=["pulse", "fft", "autocorrelation"])
    parser.add_argument("--made", type=int, default=210, help="made-up clips of each sort; 0 for none")
    parser.add_argument("--json", action="store_true", help="one JSON object instead of a table")
    arguments = parser.parse_args()
    data = Path(os.environ.get("ODORI_TEST_DATA", Path(__file__).parents[2] / "shared" / "data"))
    folder = arguments.folder or data / "bvh_dance" / "cmu_salsa"
    figures: dict[str, dict[str, object]] = {}
    for method in arguments.methods:
        find = beats_by(method)
        figures[method] = {"partners": partners(folder, find)}
        if arguments.made:
            figures[method] |= {"known": known(find, arguments.made), "mixed": mixed(find, arguments.made)}
    if arguments.json:
        print(json.dumps(figures, indent=1))
        return
    for method, found in figures.items():
        for sort, values in found.items():
            for name, value in values.items():  # type: ignore[attr-defined]
                if name == "couples":
                    for row in value:
                        print(method, *(f"{v:.2f}" if isinstance(v, float) else v for v in row.values()))
                else:
                    print(method, sort, name, f"{value:.3f}" if isinstance(value, float) else value)


if __name__ == "__main__":
    main()
