"""Runs: stretches of neighbouring frames that share a mark."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels.types import Int


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
