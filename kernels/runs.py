"""Runs: stretches of neighbouring frames that share a mark."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels.types import Float, Int


def runs_of(is_marked: NDArray[np.bool_]) -> Int:
    """Find the stretches of neighbouring marked frames.

    Parameters
    ----------
    is_marked : (F,) bool

    Returns
    -------
    (R, 2) int64, first and last frame of each stretch, both within it, in order
        (0, 2) where nothing is marked.
    """
    edge = np.diff(np.concatenate([[False], np.asarray(is_marked, bool), [False]]).astype(np.int8))
    return np.stack([np.flatnonzero(edge == 1), np.flatnonzero(edge == -1) - 1], axis=1).astype(np.int64)


def touches(is_marked: NDArray[np.bool_], frame_rate_hz: float, start_s: Float, end_s: Float) -> NDArray[np.bool_]:
    """Say which intervals of time touch a marked frame.

    Parameters
    ----------
    is_marked : (F,) bool
    frame_rate_hz : float, > 0
    start_s, end_s : (N,) float, seconds from the first frame, start <= end

    Returns
    -------
    (N,) bool
        The frames just before and just after an interval count: what lies between two frames is made of both.
    """
    before = np.append(0, np.cumsum(is_marked))
    first = np.clip(np.floor(np.asarray(start_s) * frame_rate_hz + 1e-6).astype(np.int64), 0, len(is_marked))
    end = np.clip(np.ceil(np.asarray(end_s) * frame_rate_hz - 1e-6).astype(np.int64) + 1, 0, len(is_marked))
    return np.asarray(before[np.maximum(end, first)] > before[first], np.bool_)
