"""Which nodes of the motion graph show a pose: as near as a seam would join them, priced as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.graph.beat_features import BeatFeatures
from kernels.graph.distance import pose_distance
from kernels.graph.path import STEPS
from kernels.graph.pin_conflicts import Pin
from kernels.graph.program import StepPrice, step_ends
from kernels.graph.transitions import LOCAL_BOUNDS, N_NEAREST
from kernels.types import Float, MotionGraph

Mask = NDArray[np.bool_]

ON_TIME_S = 1e-6
"""A moment this near to a beat is on it, seconds. Chosen above the rounding of stored times, and far below a frame."""

SHOWN_SLACK_S = 0.05
"""So much further from its own moment a clip may be in a finished dance: its frames and its warp. Chosen by hand."""


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


def own_moments(off_s: Float) -> Mask:
    """Find the moments of a clip that come nearest to one of its own.

    Parameters
    ----------
    off_s : (..., N) float, seconds, >= 0
        How far each is from it; infinite for what is of another clip, or cannot be danced.

    Returns
    -------
    (..., N) bool
        In each row the least, and what is within :data:`ON_TIME_S` of it; none where all are infinite.
    """
    least = off_s.min(axis=-1, keepdims=True, initial=np.inf)
    return np.asarray(np.isfinite(off_s) & (off_s <= least + ON_TIME_S), bool)


def is_own_moment(shown_s: float, at_s: float, beat_s: Float) -> bool:
    """Whether a clip shows its own moment as nearly as its beats let it.

    Parameters
    ----------
    shown_s, at_s : float, seconds of the clip: what is shown, and what is wished
    beat_s : (B,) float, seconds, increasing; beats of the clip that can be danced

    Returns
    -------
    bool
        Whether the two are no further apart than the wish is from the nearest beat, or half of the longest interval,
        and :data:`SHOWN_SLACK_S`; without beats, than that alone.
    """
    reach_s = max(np.abs(beat_s - at_s).min(), np.diff(beat_s).max(initial=0.0) / 2) if len(beat_s) else 0.0
    return bool(abs(shown_s - at_s) <= reach_s + SHOWN_SLACK_S)


@dataclass(frozen=True, eq=False)
class SongMoment:
    """A moment of a song: the beat it is on, or the steps that may pass over it and when in their clips.

    Parameters
    ----------
    first : int, music interval of the moment, or the one that begins with its beat; the last where that ends the song
    beat : int, beat the moment is on; -1 where it is between two
    steps : S music beats and kinds of step; none where the moment is on a beat
    times_s : (S, N) float64, seconds of the clip when each step passes it from each node; NaN where its clip is over
    """

    first: int
    beat: int
    steps: Sequence[tuple[int, int]]
    times_s: Float


def song_moment(graph: MotionGraph, grid_s: Float, moment_s: float) -> SongMoment:
    """Find what may be danced at a moment.

    Parameters
    ----------
    graph : MotionGraph of N nodes
    grid_s : (K + 1,) float, seconds, increasing, K >= 1; beats of the song
    moment_s : float, seconds, ``grid_s[0]`` to ``grid_s[-1]``

    Returns
    -------
    SongMoment
        On the nearest beat where that is within :data:`ON_TIME_S`.
    """
    last = len(grid_s) - 1
    near = int(np.argmin(np.abs(grid_s - moment_s)))
    if abs(grid_s[near] - moment_s) <= ON_TIME_S:
        return SongMoment(min(near, last - 1), near, [], np.zeros((0, len(graph.time_s))))
    first = int(np.searchsorted(grid_s, moment_s)) - 1
    steps, rows = [], []
    for kind, ((_, d), end) in enumerate(zip(STEPS, step_ends(graph, STEPS), strict=True)):
        for at in range(max(first - d + 1, 0), min(first, last - d) + 1):
            part = (moment_s - grid_s[at]) / (grid_s[at + d] - grid_s[at])
            clip_s = graph.time_s[end] - graph.time_s if len(end) else graph.time_s
            rows.append(np.where(end >= 0, graph.time_s + part * clip_s, np.nan))
            steps.append((at, kind))
    return SongMoment(first, -1, steps, np.array(rows).reshape(len(rows), len(graph.time_s)))


@dataclass(frozen=True, eq=False)
class PosePrice:
    """What it costs to show a pose: that of a clip at a moment.

    Parameters
    ----------
    is_clip : (N,) bool, nodes of that clip
    at_s : float, seconds of the clip
    threshold : float, > 0, ratio below which poses are alike
    weight_per_m : float, >= 0
    """

    is_clip: Mask
    at_s: float
    threshold: float
    weight_per_m: float

    def of(self, apart: Float, shown_s: Float, is_usable: Mask) -> Float:
        """Price what nodes show.

        Parameters
        ----------
        apart : (2, ..., N) float, :func:`pose_ratio` and metres; infinite for no pose
        shown_s : (N,) or (..., N) float, seconds of each node's clip
        is_usable : (N,) or (..., N) bool, whether it can be danced

        Returns
        -------
        (..., N) float64
            :func:`pose_price`; the usable moment of its own clip that comes nearest is admitted however far.
        """
        off_s = np.where(self.is_clip & is_usable, np.abs(shown_s - self.at_s), np.inf)
        return pose_price(
            apart[0], apart[1], own_moments(off_s), threshold=self.threshold, weight_per_m=self.weight_per_m
        )


def pose_pin(
    name: str, graph: MotionGraph, moment: SongMoment, price: PosePrice, at_nodes: Float, passing: Float, *, last: int
) -> Pin:
    """Make the pin of a pose.

    Parameters
    ----------
    name : how a person calls it
    graph : MotionGraph of N nodes
    moment : SongMoment of S steps
    price : PosePrice
    at_nodes, passing : (2, N) and (2, S, N) float
        :func:`pose_ratio` and metres of what nodes show, and of what steps show as they pass the moment.
    last : int, beat that ends the song

    Returns
    -------
    Pin
        Moved to other beats it asks for the pose there: of a step that starts on the beat, on the last beat of one that
        ends there.
    """
    can_end = np.isin(np.arange(len(graph.time_s)), graph.next_node)
    starting, ending = (price.of(at_nodes, graph.time_s, can) for can in (graph.next_node >= 0, can_end))

    def steps_at(beat: int) -> StepPrice:
        return pose_steps(graph, beat, ending if beat == last else starting, last)

    steps = steps_at(moment.beat) if not moment.steps else {}
    if moment.steps:
        passed = price.of(passing, moment.times_s, np.isfinite(moment.times_s))
        steps = dict(zip(moment.steps, passed, strict=True))
    every = np.ones(len(graph.time_s), bool)
    return Pin(name, moment.first, moment.first + 1, every, steps, steps_at)


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
