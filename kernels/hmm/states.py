"""Basic motions: clusters of motions by their three key poses, the states of the model.

After [Kameda2009], who cluster by k-means; how many clusters, and where they start, is ours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from kernels.types import Float, Int

SIZES: tuple[int, ...] = (2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 16, 20, 24, 32, 48, 64)
"""Numbers of states that are tried. Chosen by hand: each for few, in steps of a third to a half for many."""

FEWEST_EACH = 12
"""No more states are tried than leave so many motions to each on average: fewer cannot be counted. Chosen by hand."""

CLEAR, ALIKE_RATIO = 0.7, 0.97
"""Clearness (the simplified silhouette of [Hruschka2004]) from which motions fall into kinds by themselves: then the
clearest number of states is taken, of numbers almost as clear (at least so much of it) the largest. Chosen by hand;
made-up performers of 8 states are found so."""

CLEAR_RATIO = 0.7
"""Else, as with most dancers, the largest number of states is chosen that is at least so clear as the clearest: finer
states follow the dancer more closely, and cutting across no kinds they lose nothing. The share is chosen by hand."""

MOST_DIMENSIONS = 24
"""Principal components that motions are clustered by. Chosen for speed, by hand."""

STARTS, MOST_ROUNDS = 8, 100
"""Of k-means: the best of so many starts is taken, each of so many rounds at most. Chosen by hand."""

MOST_TRIED = 1500
"""Numbers of states are tried on so many motions, taken evenly from all. Chosen for speed, by hand."""

REACH = 1.5
"""A motion that was not clustered belongs to a state within so many times the reach of its own motions. Chosen by
hand."""


@dataclass(frozen=True, eq=False)
class States:
    """Basic motions.

    Parameters
    ----------
    centroid : (K, D) float64
    reach : (K,) float64, >= 0
        95th percentile of the distances of a state's motions from its centroid.
    count : (K,) int64, >= 1, motions of each; the most frequent state comes first
    tried : (number of states, clearness) of every number that was tried
    """

    centroid: Float
    reach: Float
    count: Int
    tried: tuple[tuple[int, float], ...] = ()


def cluster(vectors: Float, *, n_states: int = 0, seed: int = 0) -> States:
    """Cluster motions into basic motions.

    Parameters
    ----------
    vectors : (N, D) float, N >= 1, finite
    n_states : int, >= 0
        0: chosen among :data:`SIZES` by clearness (the simplified silhouette): the clearest (or almost) where that is
        at least :data:`CLEAR`, else the largest at least :data:`CLEAR_RATIO` as clear as the clearest; with
        :data:`FEWEST_EACH` motions a state on average.
    seed : int

    Returns
    -------
    States
        Fewer than asked for where there are not so many different motions. The same input gives the same bytes.

    Raises
    ------
    ValueError
        If there is no motion, a value is not finite, or the number is negative.

    Notes
    -----
    K-means runs on the leading principal components (99.5 % of the variance, at most 24). It starts eight times by
    k-means++ and keeps the tightest. A cluster that loses its motions takes the motion farthest from its own centroid.
    """
    if vectors.ndim != 2 or len(vectors) < 1:
        raise ValueError(f"vectors: want (N, D) with N >= 1, got {vectors.shape}; add clips that move")
    if not np.isfinite(vectors).all():
        raise ValueError("vectors: want finite values")
    if n_states < 0:
        raise ValueError(f"n_states: want >= 0, got {n_states}")
    with threadpool_limits(limits=1):
        low = _principal(vectors)
        n_different = len(np.unique(np.round(low, 9), axis=0))
        if n_states:
            sizes = [min(n_states, n_different)]
        else:
            sizes = [k for k in SIZES if k <= min(len(vectors) // FEWEST_EACH, n_different - 1)] or [1]
        some = low[:: max(-(-len(low) // MOST_TRIED), 1)]
        tried = tuple((k, clearness(some, k_means(some, k, seed=seed), k)) for k in sizes)
        label = k_means(low, _chosen(tried), seed=seed)
    return _states(vectors, label, tried)


def _chosen(tried: tuple[tuple[int, float], ...]) -> int:
    best = max(clear for _, clear in tried)
    if best >= CLEAR:
        return max(k for k, clear in tried if clear >= ALIKE_RATIO * best)
    return max(k for k, clear in tried if clear >= CLEAR_RATIO * best)


def _principal(vectors: Float) -> Float:
    centred = vectors - vectors.mean(axis=0)
    value, axis = np.linalg.eigh(centred.T @ centred)
    share = np.cumsum(value[::-1]) / max(float(value.sum()), 1e-30)
    n = min(int(np.searchsorted(share, 0.995)) + 1, MOST_DIMENSIONS, vectors.shape[1])
    kept = axis[:, ::-1][:, :n]
    # The sign of an axis is arbitrary: its largest part is made positive.
    sign = np.sign(kept[np.abs(kept).argmax(axis=0), np.arange(n)])
    return np.asarray(centred @ (kept * sign), np.float64)


def k_means(points: Float, k: int, *, seed: int = 0) -> Int:
    """Cluster points by Lloyd's algorithm [Lloyd1982] from several k-means++ starts [Arthur2007].

    Parameters
    ----------
    points : (N, D) float, N >= k
    k : int, >= 1
    seed : int

    Returns
    -------
    (N,) int64, cluster of each; every cluster has a point where there are k different points
    """
    rng = np.random.default_rng(seed)
    best, least = np.zeros(len(points), np.int64), np.inf
    for _ in range(STARTS if k > 1 else 1):
        label, total = _lloyd(points, _plus_plus(points, k, rng))
        if total < least - 1e-12:
            best, least = label, total
    return best


def _plus_plus(points: Float, k: int, rng: np.random.Generator) -> Float:
    """Spread k first centres by the squared distance from those before [Arthur2007]."""
    chosen = [int(rng.integers(len(points)))]
    apart = ((points - points[chosen[0]]) ** 2).sum(axis=1)
    while len(chosen) < k:
        reached = np.cumsum(apart)
        at = int(np.searchsorted(reached, rng.random() * reached[-1], side="right"))
        chosen.append(min(at, len(points) - 1))
        apart = np.minimum(apart, ((points - points[chosen[-1]]) ** 2).sum(axis=1))
    return points[chosen].copy()


def _lloyd(points: Float, centre: Float) -> tuple[Int, float]:
    label = np.full(len(points), -1, np.int64)
    apart = np.zeros(len(points))
    for _ in range(MOST_ROUNDS):
        square = squared_distances(points, centre)
        now = square.argmin(axis=1)
        apart = square[np.arange(len(points)), now]
        count = np.bincount(now, minlength=len(centre))
        for empty in np.flatnonzero(count == 0):
            far = int(np.argmax(np.where(count[now] > 1, apart, -1.0)))
            count[now[far]] -= 1
            now[far], apart[far], count[empty] = empty, 0.0, 1
        if (now == label).all():
            break
        label = now
        for d in range(points.shape[1]):
            centre[:, d] = np.bincount(label, weights=points[:, d], minlength=len(centre)) / count
    return label, float(apart.sum())


def squared_distances(points: Float, centre: Float) -> Float:
    """Squared distances of (N, D) points from (K, D) centres, (N, K) float64, >= 0."""
    cross = points @ centre.T
    return np.asarray(
        np.maximum((points**2).sum(axis=1)[:, None] + (centre**2).sum(axis=1)[None] - 2 * cross, 0.0), np.float64
    )


def clearness(points: Float, label: Int, k: int) -> float:
    """Measure how clear clusters are: the silhouette by centroids, mean of (b - a) / max(a, b).

    Parameters
    ----------
    points : (N, D) float
    label : (N,) int64, 0 to k - 1
    k : int, >= 1

    Returns
    -------
    float, -1 to 1
        a is a point's distance from its own centroid, b from the nearest other one [Hruschka2004]; 0 for a
        single cluster.
    """
    if k < 2:
        return 0.0
    centre = np.stack([points[label == i].mean(axis=0) for i in range(k)])
    apart = np.sqrt(squared_distances(points, centre))
    own = apart[np.arange(len(points)), label].copy()
    apart[np.arange(len(points)), label] = np.inf
    other = apart.min(axis=1)
    return float(np.mean((other - own) / np.maximum(np.maximum(own, other), 1e-12)))


def _states(vectors: Float, label: Int, tried: tuple[tuple[int, float], ...]) -> States:
    count = np.bincount(label)
    centre = np.stack([vectors[label == i].mean(axis=0) for i in range(len(count))])
    order = np.lexsort((*centre.T[::-1], -count))
    apart = np.linalg.norm(vectors - centre[label], axis=1)
    reach = np.array([np.percentile(apart[label == i], 95.0) for i in order])
    return States(centre[order], reach, count[order], tried)


def assign(vectors: Float, states: States) -> tuple[Int, Float]:
    """Find the basic motion of each motion.

    Parameters
    ----------
    vectors : (N, D) float
    states : States of K

    Returns
    -------
    state_index : (N,) int64
        The nearest state; -1 where it is farther than :data:`REACH` times the state's own reach: a motion the model
        does not know.
    distance : (N,) float64, metres, from that state's centroid
    """
    if not len(vectors) or not len(states.centroid):
        return np.full(len(vectors), -1, np.int64), np.full(len(vectors), np.inf)
    square = squared_distances(vectors, states.centroid)
    nearest = square.argmin(axis=1)
    apart = np.sqrt(square[np.arange(len(vectors)), nearest])
    bound = REACH * states.reach[nearest] + 1e-3
    return np.where(apart <= bound, nearest, -1), apart
