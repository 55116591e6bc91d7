"""Whether a piece of motion rises and falls with the music: histograms of intensity, and its order in time.

In [Shiratori2006] matches are chosen by the Bhattacharyya coefficient of the histograms of motion and music intensity.
A histogram cannot tell a crescendo from a decrescendo, so the rank correlation of the two curves, beat by beat, stands
beside it (ours).
"""

from __future__ import annotations

import numpy as np

from kernels.types import Float, Int

N_BINS = 10
"""Of a histogram of intensity. Chosen by hand: [Shiratori2006] and [Yagi2009] leave it open."""


def quantile_edges(values: Float, *, n_bins: int = N_BINS) -> Float:
    """Edges that cut values into bins of equal mass.

    Parameters
    ----------
    values : (n,) float
    n_bins : int, >= 2

    Returns
    -------
    (n_bins - 1,) float64, not falling; zeros without values

    Raises
    ------
    ValueError
        If there are fewer than two bins.
    """
    if n_bins < 2:
        raise ValueError(f"n_bins: want >= 2, got {n_bins}; one bin holds everything")
    if not len(values):
        return np.zeros(n_bins - 1)
    return np.asarray(np.quantile(values, np.arange(1, n_bins) / n_bins), np.float64)


def histogram(values: Float, edges: Float) -> Float:
    """Share of values in each bin.

    Parameters
    ----------
    values : (n,) float
    edges : (b - 1,) float, not falling
        A value on an edge counts above it.

    Returns
    -------
    (b,) float64, sum 1; zeros without values
    """
    count = np.bincount(np.searchsorted(edges, values, side="right"), minlength=len(edges) + 1)
    return np.asarray(count / max(len(values), 1), np.float64)


def bhattacharyya(p: Float, q: Float) -> float:
    """Bhattacharyya coefficient of two histograms: sum of sqrt(p q); 1 where they are equal, 0 where disjoint.

    [Bhattacharyya1943].

    Parameters
    ----------
    p, q : (b,) float, >= 0, shares of sum 1, of :func:`histogram`

    Returns
    -------
    float, 0 to 1; 0 where either is of no values
    """
    return float(np.sqrt(p * q).sum())


def beat_means(values: Float, edge: Int) -> Float:
    """Mean of each stretch between neighbouring edges.

    Parameters
    ----------
    values : (F,) float
    edge : (B + 1,) int, rising, within 0 to F

    Returns
    -------
    (B,) float64; the value at its start for a stretch of no frame, 0 where F is 0
    """
    if not len(values):
        return np.zeros(max(len(edge) - 1, 0))
    total = np.concatenate([[0.0], np.cumsum(values)])
    start = np.minimum(edge[:-1], len(values) - 1)
    end = np.maximum(np.minimum(edge[1:], len(values)), start + 1)
    return np.asarray((total[end] - total[start]) / (end - start), np.float64)


def agreement(coefficient: float, correlation: float) -> float:
    """Agreement of intensity, 0 to 1: the mean of the Bhattacharyya coefficient and (1 + rank correlation) / 2.

    Parameters
    ----------
    coefficient : float, 0 to 1, of :func:`bhattacharyya`
    correlation : float, -1 to 1, of :func:`kernels.ranks.rank_correlation`

    Returns
    -------
    float, 0 to 1
    """
    return (coefficient + (1.0 + correlation) / 2.0) / 2.0
