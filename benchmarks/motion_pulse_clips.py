"""Made-up clips with a pulse and without, as many and as hard as wanted: what the pulse is tuned and judged on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from kernels.skeleton import kinematics
from kernels.skeleton.naming import map_joints
from kernels.skeleton.retarget import retarget
from kernels.synthetic import rigs
from kernels.synthetic.dancer import MOVES, take
from kernels.synthetic.social_dancer import STEPS, aimless, breathing_beats, danced, uneven_beats
from kernels.types import Clip, Float

RIGS = {
    "canonical": rigs.RigPlan(),
    "a_pose": rigs.RigPlan(axes=rigs.a_pose(), stretch={"leftUpperArm": 1.2, "rightUpperArm": 1.2}),
    "along_bones": rigs.RigPlan(axes=rigs.along_bones(), without=("upperChest",), has_root=True),
}


@dataclass(frozen=True, eq=False)
class MadeClip:
    """A made-up clip: what it is, its true beats (empty without a pulse), and its canonical positions."""

    kind: str
    beat_s: Float
    frame_rate_hz: float
    position_m: Float

    @property
    def true_bpm(self) -> float:
        """Mean tempo of the beats; 0 without."""
        return 60.0 / float(np.mean(np.diff(self.beat_s))) if len(self.beat_s) else 0.0


def known_dancers(n: int, *, seed: int = 0) -> Iterator[MadeClip]:
    """Even dancers of one move at 60 to 180 a minute, 24 to 120 Hz, noise to 2 cm a joint, on three rigs in turn."""
    labels = sorted(set(MOVES) - {"idle"})
    for i in range(n):
        rng = np.random.default_rng([seed, i])
        label, rig = labels[i % len(labels)], sorted(RIGS)[i % len(RIGS)]
        rate_hz, noise_m = float(rng.choice([24, 25, 30, 50, 60, 100, 120])), float(rng.choice([0, 0.002, 0.005, 0.02]))
        made = take(
            label,
            n_beats=int(rng.integers(12, 32)),
            interval_s=60.0 / float(rng.uniform(60, 180)),
            first_beat_s=float(rng.uniform(0.1, 0.6)),
            frame_rate_hz=rate_hz,
            size=float(rng.uniform(0.6, 1.2)),
            turned_rad=float(rng.uniform(-3, 3)),
        )
        position = _seen(made.clip, rig)
        yield MadeClip(label, made.beat_s, rate_hz, position + noise_m * rng.normal(size=position.shape))


def mixed_clips(n: int, *, seed: int) -> Iterator[MadeClip]:
    """Three dances, loose, distracted, breathing or plain, to one of moves at no tempo and one of aimless motion."""
    for i in range(n):
        rng = np.random.default_rng([seed, i])
        rate_hz, duration_s = float(rng.choice([24, 30, 60, 120])), float(np.exp(rng.uniform(np.log(4), np.log(30))))
        kind = str(rng.choice(["dance", "dance", "dance", "uneven", "aimless"]))
        own, size = int(rng.integers(1 << 30)), float(rng.uniform(0.5, 1.2))
        beat_s = np.zeros(0)
        if kind == "aimless":
            clip = aimless(duration_s, frame_rate_hz=rate_hz, seed=own, size=float(rng.choice([0.05, 0.3, 1.0, 1.5])))
        else:
            step_s = 60.0 / float(rng.uniform(60, 115))
            if kind == "dance":
                depth, first_s = float(rng.choice([0, 0, 0.02, 0.04])), float(rng.uniform(0, 0.6))
                beat_s = breathing_beats(duration_s, interval_s=step_s, depth_ratio=depth, first_s=first_s)
            spread = float(rng.uniform(0.2, 0.5))
            clip = danced(
                [str(label) for label in rng.choice(sorted(STEPS), int(rng.choice([1, 3])))],
                beat_s
                if kind == "dance"
                else uneven_beats(duration_s, interval_s=step_s, spread_ratio=spread, seed=own),
                frame_rate_hz=rate_hz,
                duration_s=duration_s,
                size=size,
                looseness_beats=float(rng.choice([0, 0.04, 0.08, 0.12])),
                distraction=float(rng.choice([0, 0.3, 0.6, 1.0, 1.5])),
                seed=own,
            )
        position = kinematics.place(clip)[0]
        noise_m = float(rng.choice([0, 0.001, 0.003, 0.01]))
        yield MadeClip(kind, beat_s, rate_hz, position + noise_m * rng.normal(size=position.shape))


def _seen(clip: Clip, rig: str) -> Float:
    """Canonical positions of a motion that came on a rig."""
    put = rigs.author(clip, RIGS[rig])
    return retarget(put, map_joints(put.skeleton)).position_xyz_m
