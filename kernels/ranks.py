"""Ranks of numbers, and whether two curves rise and fall together."""

from __future__ import annotations

import numpy as np

from kernels.types import Float


def mean_ranks(values: Float) -> Float:
    """Ranks from 1, ties given their mean rank.

    Parameters
    ----------
    values : (n,) float, finite

    Returns
    -------
    (n,) float64, 1 to n; empty for nothing
    """
    _, place, count = np.unique(values, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(count) - (count - 1) / 2)[place], np.float64)


def rank_correlation(x: Float, y: Float) -> float:
    """Spearman's rank correlation, ties given their mean rank.

    Parameters
    ----------
    x, y : (n,) float, finite

    Returns
    -------
    float, -1 to 1; 0 where n < 3 or either is constant
    """
    if len(x) < 3:
        return 0.0
    a, b = (mean_ranks(values) - (len(values) + 1) / 2 for values in (x, y))
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(np.clip(a @ b / size, -1.0, 1.0)) if size > 1e-12 else 0.0
