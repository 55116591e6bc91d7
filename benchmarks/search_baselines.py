"""What motion search has to beat: the mean and deviation of the pose, and dynamic time warping."""

from collections.abc import Sequence

import numba
import numpy as np
from numpy.typing import NDArray

from kernels.search.normalise import normalise

STEP = 2
"""Every second frame of 15 Hz counts for the warping; with all of them it ranks alike and takes four times as long."""


def mean_and_deviation(motions: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Describe motions (T, 22, 3) by the mean and deviation of their root-relative pose: (N, 132)."""
    flat = [normalise(motion, per_frame=True).reshape(len(motion), -1) for motion in motions]
    return np.array([np.concatenate([pose.mean(axis=0), pose.std(axis=0)]) for pose in flat])


def warped(queries: Sequence[NDArray[np.float64]], motions: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Distances by dynamic time warping over poses about the root, facing as in the first frame: (Q, N)."""
    flat = [[_poses(motion) for motion in group] for group in (queries, motions)]
    return np.array([[_warp(a, b) for b in flat[1]] for a in flat[0]])


def _poses(motion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Root-relative poses that keep their turning: with each frame faced alike, the warping finds far less."""
    path = normalise(motion)[::STEP]
    return np.ascontiguousarray((path - path[:, :1] * np.array([1.0, 0.0, 1.0])).reshape(len(path), -1))


@numba.njit(cache=True)
def _warp(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Cost of the cheapest path over n + m: over the path's own length, detours would make it cheaper."""
    n, m = len(a), len(b)
    total = np.full((n + 1, m + 1), np.inf)
    total[0, 0] = 0.0
    for i in range(1, n + 1):
        for j in range(1, m + 1):
            cost = 0.0
            for k in range(a.shape[1]):
                cost += (a[i - 1, k] - b[j - 1, k]) ** 2
            total[i, j] = np.sqrt(cost) + min(total[i - 1, j - 1], total[i - 1, j], total[i, j - 1])
    return total[n, m] / (n + m)
