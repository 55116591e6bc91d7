"""Which nodes of the motion graph show a pose: as near as a seam would join them, priced as one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels.graph.beat_features import BeatFeatures
from kernels.graph.distance import pose_distance
from kernels.graph.path import STEPS
from kernels.graph.program import StepPrice, step_ends
from kernels.graph.transitions import LOCAL_BOUNDS, N_NEAREST
from kernels.types import Float, MotionGraph

Mask = NDArray[np.bool_]


def pose_ratio(wanted: BeatFeatures, shown: BeatFeatures) -> Float:
    """Distance of poses as the graph weighs seams: d(i, j) / (d(i) + d(j)), equation 20 of [Xu2015].

    Parameters
    ----------
    wanted : BeatFeatures of n poses
    shown : BeatFeatures of N poses, made alike

    Returns
    -------
    (n, N) float64, >= 0; d(i) and d(j) bounded as for seams
    """
    low, high = LOCAL_BOUNDS[wanted.pose.metric]
    moves = np.add.outer(np.clip(wanted.local_distance, low, high), np.clip(shown.local_distance, low, high))
    return np.asarray(pose_distance(wanted.pose, shown.pose) / moves, np.float64)


def furthest_ratio(ratio: Float, threshold: float) -> float:
    """How far a pose may be: the threshold, or where nothing is within it the twentieth nearest.

    Parameters
    ----------
    ratio : (N,) float, infinite for no pose
    threshold : float, > 0

    Returns
    -------
    float; the threshold where there is no pose at all
    """
    known = np.sort(ratio[np.isfinite(ratio)])
    if not len(known) or known[0] < threshold:
        return threshold
    return float(known[min(N_NEAREST, len(known)) - 1])


def pose_price(ratio: Float, apart_m: Float, is_own: Mask, *, threshold: float, weight_per_m: float) -> Float:
    """Price of showing poses in place of the one that is wished.

    Parameters
    ----------
    ratio : (..., N) float, :func:`pose_ratio`, infinite for no pose
    apart_m : (..., N) float, metres, root of the distance itself: a ratio favours quick moments over near ones
    is_own : (..., N) bool, admitted however far
    threshold : float, > 0
    weight_per_m : float, >= 0

    Returns
    -------
    (..., N) float64
        ``weight_per_m`` times the distance where the ratio is below the threshold or :func:`furthest_ratio`, or the
        pose is its own; infinite elsewhere.
    """
    limit = furthest_ratio(np.where(is_own, 0.0, ratio).ravel(), threshold)
    is_near = (ratio < threshold) | (ratio <= limit) if limit > threshold else ratio < threshold
    is_shown = (is_near | is_own) & np.isfinite(ratio)
    return np.where(is_shown, weight_per_m * np.where(is_shown, apart_m, 0.0), np.inf)


def pose_steps(graph: MotionGraph, beat: int, price: Float, n_intervals: int) -> StepPrice:
    """Price steps by the pose they show on a music beat.

    Parameters
    ----------
    graph : MotionGraph of N nodes
    beat : int, 0 <= beat <= K
    price : (N,) float64, of showing each node's pose; infinite where it is too far from what is wished
    n_intervals : int, K

    Returns
    -------
    StepPrice
        The step that begins on the beat pays; on the last beat the one that ends. The step that ends on the beat must
        end near enough too, so that a seam there blends two poses as wished; none may pass over the beat.
    """
    found: dict[tuple[int, int], Float] = {}
    for kind, ((_, d), end) in enumerate(zip(STEPS, step_ends(graph, STEPS), strict=True)):
        for at in range(max(beat - d + 1, 0), beat):
            found[at, kind] = np.full(len(price), np.inf)
        if beat + d <= n_intervals:
            found[beat, kind] = price
        if beat - d >= 0:
            ends = np.where(end >= 0, price[end], np.inf) if len(price) else price
            found[beat - d, kind] = ends if beat == n_intervals else np.where(np.isfinite(ends), 0.0, np.inf)
    return found
