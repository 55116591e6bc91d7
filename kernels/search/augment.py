"""The same motion otherwise: mirrored, faster or slower, a part of it, not quite exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kernels.search.normalise import RATE_HZ
from kernels.skeleton.canonical import MIRRORED_JOINT
from kernels.types import Float


@dataclass(frozen=True)
class Augmentation:
    """How far a motion may be changed and still be the same action.

    Parameters
    ----------
    stretch_ratio : most change of pace, either way
    least_part_ratio : least share of a clip that is left of it
    joint_noise_m : deviation of a joint's place, the same for all frames; a third of it differs frame by frame
    """

    stretch_ratio: float = 1.2
    least_part_ratio: float = 0.7
    joint_noise_m: float = 0.02


def mirror(position_xyz_m: Float) -> Float:
    """Reflect left to right: (F, 22, 3) to the same shape."""
    return np.asarray(position_xyz_m[:, MIRRORED_JOINT] * np.array([-1.0, 1.0, 1.0]))


def vary(position_xyz_m: Float, rng: np.random.Generator, how: Augmentation, *, longest: int) -> Float:
    """Draw another take of a motion.

    Parameters
    ----------
    position_xyz_m : (T, 22, 3) float, metres, at :data:`~kernels.search.normalise.RATE_HZ`, T >= 1
    rng : numpy.random.Generator
    how : Augmentation
    longest : int, frames
        No more come back.

    Returns
    -------
    (T', 22, 3) float64, 1 <= T' <= longest
    """
    n = len(position_xyz_m)
    pace = np.exp(rng.uniform(-1, 1) * np.log(how.stretch_ratio))
    least = min(n, max(int(n * how.least_part_ratio), int(RATE_HZ / 2)))
    n_taken = min(int(rng.integers(least, n + 1)), int(longest * pace))
    start = int(rng.integers(0, n - n_taken + 1))
    at = start + np.arange(max(min(int((n_taken - 1) / pace) + 1, longest), 1)) * pace
    frame = np.minimum(at.astype(np.int64), max(n - 2, 0))
    share = (at - frame)[:, None, None]
    taken = position_xyz_m[frame] * (1 - share) + position_xyz_m[np.minimum(frame + 1, n - 1)] * share
    joints = rng.normal(0.0, how.joint_noise_m, (1, *taken.shape[1:]))
    return np.asarray(taken + joints + rng.normal(0.0, how.joint_noise_m / 3, taken.shape))
