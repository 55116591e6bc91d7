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
    """Distances by dynamic time warping over root-relative poses, a step of the path: (Q, N)."""
    flat = [
        [np.ascontiguousarray(normalise(m, per_frame=True)[::STEP].reshape(-1, m.shape[1] * 3)) for m in group]
        for group in (queries, motions)
    ]
    return np.array([[_warp(a, b) for b in flat[1]] for a in flat[0]])


@numba.njit(cache=True)
def _warp(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    n, m = len(a), len(b)
    total = np.full((n + 1, m + 1), np.inf)
    steps = np.zeros((n + 1, m + 1))
    total[0, 0] = 0.0
    for i in range(1, n + 1):
        for j in range(1, m + 1):
            cost = 0.0
            for k in range(a.shape[1]):
                cost += (a[i - 1, k] - b[j - 1, k]) ** 2
            best, pi, pj = total[i - 1, j - 1], i - 1, j - 1
            if total[i - 1, j] < best:
                best, pi, pj = total[i - 1, j], i - 1, j
            if total[i, j - 1] < best:
                best, pi, pj = total[i, j - 1], i, j - 1
            total[i, j] = best + np.sqrt(cost)
            steps[i, j] = steps[pi, pj] + 1
    return total[n, m] / steps[n, m]
