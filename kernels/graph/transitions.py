"""Which beat may follow which: the nearest poses of all clips, and the ratio rule that joins them.

Conventions
-----------
Two stages. :func:`nearest` finds, row by row, the k nearest nodes of each node; it alone looks at distances, a row
never depends on another, and the answer is the same on every backend. :func:`connect` applies the threshold and makes
the edges; it is cheap and looks at no pose.

*Rule of the blend.* The blend of a transition i → j is centred on the beat: half of it needs frames of i's clip after
i, half of it frames of j's clip before j. Both must be at least ``min_margin_s``, in the clip's own time. Only edges a
dance can use are made: i must have a beat before it (it is danced to), j one after it (it is danced from).

*Rule of the jump.* No seam where a recording itself jerks by more than ``max_jerk_ratio`` times its clip's 99th
percentile: a large d(i) there would make the ratio of equation 19 small with everything.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.graph.beat_features import BeatFeatures
from kernels.graph.costs import PathCosts
from kernels.graph.distance import (
    Metric,
    PairDistance,
    PoseFeatures,
    error_bound,
    paired_distance,
    pose_distance,
)
from kernels.graph.nodes import BeatNodes
from kernels.graph.prune import has_endless_dance
from kernels.types import Float, Int, MotionGraph

Mask = NDArray[np.bool_]
_Pairs = tuple[Int, Int, Float, Float]


def blend_margin_s(blend_s: float, *, costs: PathCosts | None = None) -> float:
    """Clip time that half a blend needs, at the most a clip is usually sped up.

    Parameters
    ----------
    blend_s : float, seconds of song, >= 0
    costs : PathCosts, or None for the defaults
        Its soft bounds are what is usual.

    Returns
    -------
    float, seconds of a clip
    """
    costs = PathCosts() if costs is None else costs
    return blend_s / 2 / costs.soft_ratio[0]


N_NEAREST = 20
"""Transitions listed for each beat. Chosen by hand."""

GUARD_S = 0.5
"""How near two beats of one clip count as the same moment. Chosen by hand, about a beat."""

MIN_MARGIN_S = blend_margin_s(0.4)
"""Half of a blend of 0.4 s, by definition of the usual blend."""

RAISE = 1.25
"""What the threshold is raised by until a dance can go on. Chosen by hand."""

MAX_JERK_RATIO = 1.5
"""What a finished seam may have, agreed for its quality: no blend makes a rougher recording pass."""

THRESHOLD = 2.0
THRESHOLDS: dict[Metric, float] = {"position": THRESHOLD, "rotation": 1.0}
"""Default TH of equation 19 of [Xu2015], which gives no value. Measured on 60 blended seams of two real data sets for
each range of ratios: seams of larger weight show as jerks (docs/motion-graph.md)."""

LOCAL_BOUNDS: dict[Metric, tuple[float, float]] = {"position": (0.01**2, 0.3**2), "rotation": (0.03**2, 0.8**2)}
"""Least and most d(i). Frozen poses count as moving by a centimetre (0.03 rad, chosen by hand) across the beat: the
ratio of equation 19 would divide by nothing. A jump in a recording counts as no more than 0.3 m (0.8 rad), measured on
real clips as the fastest that bodies move on 99 beats of 100: it would be near to everything."""

_TILE = 2**22
_CHUNK = 2**13
_CROWD = 2**20
"""Distances and pairs held at a time. Chosen for memory, by hand: 32, 0.06 and 8 MiB of float64; changes no edge."""


@dataclass(frozen=True, eq=False)
class Nearest:
    """The nearest nodes of each node, sorted by row, then weight, then other.

    Parameters
    ----------
    row, other : (P,) int64, nodes
    distance : (P,) float64, d(row, other), in the metric's unit squared
    weight : (P,) float64, d(row, other) / (d(row) + d(other)): equation 20
    metric : "position" or "rotation"
    min_margin_s : float, seconds
    is_smooth : (N,) bool, of all nodes
        What the rows were made with: nearer pairs that only the rules of blend and jump forbid are listed beside the k
        nearest.
    """

    row: Int
    other: Int
    distance: Float
    weight: Float
    metric: Metric
    min_margin_s: float
    is_smooth: Mask


@dataclass(frozen=True, eq=False)
class Transitions:
    """The motion graph, and what it took.

    Parameters
    ----------
    graph : MotionGraph
    distance : (E,) float64, of each transition edge, in the metric's unit squared
    threshold_asked, threshold_used : float
        They differ where no dance could have gone on for ever with the threshold asked.
    is_endless : bool, whether a dance can go on for ever
    n_margin_removed : int, edges within the threshold that missing frames for a blend forbid
    n_jerk_removed : int, edges within the threshold that only a jump in a recording forbids
    """

    graph: MotionGraph
    distance: Float
    threshold_asked: float
    threshold_used: float
    is_endless: bool
    n_margin_removed: int
    n_jerk_removed: int


def find_transitions(
    features: BeatFeatures,
    nodes: BeatNodes,
    *,
    distance: PairDistance = pose_distance,
    threshold: float | None = None,
    n_nearest: int = N_NEAREST,
    guard_s: float = GUARD_S,
    min_margin_s: float = MIN_MARGIN_S,
    max_jerk_ratio: float = MAX_JERK_RATIO,
    local_bounds: tuple[float, float] | None = None,
) -> Transitions:
    """Make the motion graph of all beats: :func:`nearest`, then :func:`connect`; arguments and errors are theirs."""
    pairs = nearest(
        features,
        nodes,
        distance=distance,
        n_nearest=n_nearest,
        guard_s=guard_s,
        min_margin_s=min_margin_s,
        max_jerk_ratio=max_jerk_ratio,
        local_bounds=local_bounds,
    )
    return connect(nodes, pairs, threshold=threshold)


def nearest(
    features: BeatFeatures,
    nodes: BeatNodes,
    *,
    rows: Int | None = None,
    distance: PairDistance = pose_distance,
    n_nearest: int = N_NEAREST,
    guard_s: float = GUARD_S,
    min_margin_s: float = MIN_MARGIN_S,
    max_jerk_ratio: float = MAX_JERK_RATIO,
    local_bounds: tuple[float, float] | None = None,
) -> Nearest:
    """List the k nearest nodes of each node by equation 20, whatever their weight.

    Parameters
    ----------
    features : BeatFeatures of N nodes
    nodes : BeatNodes, N
    rows : (R,) int64, the nodes to list for, or None for all
    distance : PairDistance, :func:`kernels.graph.distance.pose_distance` or its twin on a device
    n_nearest : int, k >= 1
        Ties go to the lower node.
    guard_s : float, seconds, >= 0
        Nodes of the same clip nearer in time than this are the same moment, never a transition; nor is the next beat.
    min_margin_s : float, seconds, >= 0
        Frames a transition needs before and after it (module docstring).
    max_jerk_ratio : float, > 0
        Roughness of the recording up to which a beat may be a seam (module docstring); counts where it is known.
    local_bounds : (low, high), 0 < low <= high, in the metric's unit squared, or None for :data:`LOCAL_BOUNDS`
        Every d(i) is brought within these.

    Returns
    -------
    Nearest; empty when N is 0
        A node that may be left lists the nodes it can go to; one that cannot, but may be entered, lists those that can
        come to it. Time and memory: R·N distances in tiles of a few million, never the whole matrix.

    Raises
    ------
    ValueError
        If the lengths differ or an argument is out of range.

    Notes
    -----
    A backend in float32 only proposes: every pair that :func:`kernels.graph.distance.error_bound` cannot rule out is
    computed again by the reference, so that all backends list the same pairs with the same bits.
    """
    if len(features.pose) != len(nodes):
        raise ValueError(f"features: want {len(nodes)} beats as nodes has, got {len(features.pose)}")
    if n_nearest < 1:
        raise ValueError(f"n_nearest: want >= 1, got {n_nearest}")
    for name, value in (("guard_s", guard_s), ("min_margin_s", min_margin_s)):
        if not (np.isfinite(value) and value >= 0):
            raise ValueError(f"{name}: want finite, >= 0, got {value}")
    if not max_jerk_ratio > 0:
        raise ValueError(f"max_jerk_ratio: want > 0, got {max_jerk_ratio}")
    low, high = LOCAL_BOUNDS[features.pose.metric] if local_bounds is None else local_bounds
    if not (np.isfinite(high) and 0 < low <= high):
        raise ValueError(f"local_bounds: want 0 < low <= high, finite, got {(low, high)}")
    rows = np.arange(len(nodes)) if rows is None else np.asarray(rows, np.int64)
    local = np.clip(features.local_distance, low, high)
    roughness = features.jerk_ratio
    smooth = np.ones(len(nodes), bool) if roughness is None else roughness <= max_jerk_ratio
    search = _Search(features, local, nodes, distance, n_nearest, guard_s, min_margin_s, smooth)
    parts = list(search.tiles(rows))
    row, other, apart, weight = (np.concatenate([part[i] for part in parts]) for i in range(4))
    order = np.lexsort((other, weight, row))
    return Nearest(row[order], other[order], apart[order], weight[order], features.pose.metric, min_margin_s, smooth)


def connect(nodes: BeatNodes, pairs: Nearest, *, threshold: float | None = None) -> Transitions:
    """Join the listed pairs whose weight is below the threshold: equations 19 and 20 of [Xu2015].

    Parameters
    ----------
    nodes : BeatNodes, N
    pairs : Nearest of these nodes
    threshold : float, > 0, TH of equation 19, or None for :data:`THRESHOLDS`

    Returns
    -------
    Transitions; no edges when there are no pairs

    Raises
    ------
    ValueError
        If the threshold is not > 0.

    Notes
    -----
    *Symmetric closure*: a pair is joined if either node lists the other, so a node may have more than k edges, none
    fewer than the threshold leaves of its k. It is joined in both directions, save one that the rule of the blend
    forbids or that leads to the clip's next beat, which is no transition.

    When with the threshold asked no dance can go on for ever (no cycle), it is raised by steps of a quarter until one
    can. Where all pairs together make none, the threshold asked is kept.
    """
    threshold = THRESHOLDS[pairs.metric] if threshold is None else threshold
    if not (np.isfinite(threshold) and threshold > 0):
        raise ValueError(f"threshold: want finite, > 0, got {threshold}")
    asked = found = _join(nodes, pairs, threshold, threshold)
    while not found.is_endless and found.threshold_used <= pairs.weight.max(initial=0.0):
        found = _join(nodes, pairs, threshold, found.threshold_used * RAISE)
    return found if found.is_endless else asked


def _join(nodes: BeatNodes, pairs: Nearest, asked: float, used: float) -> Transitions:
    """Make the edges of the pairs below a threshold."""
    n = max(len(nodes), 1)
    near = pairs.weight < used
    row, other = pairs.row[near], pairs.other[near]
    _, first = np.unique(np.minimum(row, other) * n + np.maximum(row, other), return_index=True)
    source, target = np.concatenate([row[first], other[first]]), np.concatenate([other[first], row[first]])
    apart, weight = np.tile(pairs.distance[near][first], 2), np.tile(pairs.weight[near][first], 2)
    useful = nodes.may_leave()[source] & nodes.may_enter()[target] & (nodes.next_node[source] != target)
    roomy = nodes.may_leave(pairs.min_margin_s)[source] & nodes.may_enter(pairs.min_margin_s)[target]
    smooth = pairs.is_smooth[source] & pairs.is_smooth[target]
    edge = np.flatnonzero(useful & roomy & smooth)
    edge = edge[_by_source(source[edge], weight[edge], target[edge])]
    graph = MotionGraph(nodes.clip_index, nodes.time_s, nodes.next_node, source[edge], target[edge], weight[edge])
    return Transitions(
        graph=graph,
        distance=apart[edge],
        threshold_asked=asked,
        threshold_used=used,
        is_endless=has_endless_dance(graph),
        n_margin_removed=int((useful & ~roomy).sum()),
        n_jerk_removed=int((useful & roomy & ~smooth).sum()),
    )


def _by_source(source: Int, weight: Float, target: Int) -> Int:
    """Order by source, then weight, then target: one sort of whole numbers where no source has a weight twice."""
    ascending = np.argsort(weight)
    level = np.zeros(len(weight), np.int64)
    level[ascending[1:]] = np.cumsum(np.diff(weight[ascending]) != 0)
    key = source * max(len(weight), 1) + level
    order = np.argsort(key)
    if (np.diff(key[order]) == 0).any():
        order = np.lexsort((target, weight, source))
    return order


@dataclass(frozen=True, eq=False)
class _Search:
    """The rows of :func:`nearest`, tile by tile."""

    features: BeatFeatures
    local: Float
    nodes: BeatNodes
    distance: PairDistance
    n_nearest: int
    guard_s: float
    min_margin_s: float
    is_smooth: Mask

    def tiles(self, rows: Int) -> Iterator[_Pairs]:
        """Yield the listed pairs, a tile of rows at a time; first an empty one, so that there is always one."""
        nothing = np.zeros(0, np.int64)
        yield nothing, nothing, np.zeros(0), np.zeros(0)
        nodes, margin = self.nodes, self.min_margin_s
        leaves, enters = nodes.may_leave(margin) & self.is_smooth, nodes.may_enter(margin) & self.is_smooth
        first, last = nodes.same_moment(self.guard_s)
        for group, useful, allowed, step in (
            (rows[leaves[rows]], nodes.may_enter(), enters, nodes.next_node),
            (rows[~leaves[rows] & enters[rows]], nodes.may_leave(), leaves, nodes.previous_node),
        ):
            column = np.flatnonzero(useful)
            poses = self.features.pose.take(column)
            size = max(_TILE // max(len(column), 1), 1)
            for start in range(0, len(group) if len(column) else 0, size):
                row = group[start : start + size]
                excluded = np.stack([first[row], last[row], step[row], step[row] + 1], axis=1)
                yield self._tile(row, column, poses, allowed[column], np.searchsorted(column, excluded))

    def _tile(self, row: Int, column: Int, poses: PoseFeatures, allowed: Mask, excluded: Int) -> _Pairs:
        """List the pairs of some rows; per row, ``excluded`` has two ranges of columns that are no transition."""
        apart = self.distance(self.features.pose.take(row), poses)
        weight = apart / np.add.outer(self.local[row], self.local[column]).astype(apart.dtype)
        _exclude(weight, excluded)
        cut = self._cut(weight[:, allowed], self.local[row])
        r, c = np.nonzero((weight <= cut[:, None]) & np.isfinite(weight))
        crowded = np.bincount(r, minlength=len(row)) > 4 * self.n_nearest + 256
        r, c = r[~crowded[r]], c[~crowded[r]]
        is_exact = apart.dtype == np.float64
        distance = apart[r, c].astype(np.float64) if is_exact else self._paired(row[r], column[c])
        parts = [(r, c, distance)]
        most = max(_CROWD // len(column), 1)
        for block in np.split(np.flatnonzero(crowded), np.arange(most, int(crowded.sum()), most)):
            exact = apart[block] if is_exact else pose_distance(self.features.pose.take(row[block]), poses)
            parts += self._crowd(block, row[block], column, exact.astype(np.float64), allowed, excluded[block])
        r, c, distance = (np.concatenate([part[i] for part in parts]) for i in range(3))
        ratio = distance / (self.local[row[r]] + self.local[column[c]])
        order = np.lexsort((c, ratio, r))
        r, c, distance, ratio = r[order], c[order], distance[order], ratio[order]
        listed = rank_within(r, np.ones(len(r), bool)) < self.n_nearest
        listed |= (rank_within(r, allowed[c]) < self.n_nearest) & allowed[c]
        return row[r[listed]], column[c[listed]], distance[listed], ratio[listed]

    def _crowd(
        self, block: Int, row: Int, column: Int, exact: Float, allowed: Mask, excluded: Int
    ) -> list[tuple[Int, Int, Float]]:
        """Nearest columns of rows that have hundreds equally near, as poses frozen alike are."""
        ratio = exact / np.add.outer(self.local[row], self.local[column])
        _exclude(ratio, excluded)
        found = []
        for i, r in enumerate(block):
            order = np.argsort(ratio[i], kind="stable")
            order = order[np.isfinite(ratio[i, order])]
            order = order[np.cumsum(allowed[order]) - allowed[order] < self.n_nearest]
            found.append((np.full(len(order), r), order, exact[i, order]))
        return found

    def _cut(self, weight: NDArray[np.floating], local: Float) -> Float:
        """Weight up to which a pair may be among the k nearest of its row, given the backend's error."""
        k = self.n_nearest
        if weight.shape[1] < k:
            return np.full(len(weight), np.inf)
        kth = np.partition(weight, k - 1, axis=1)[:, k - 1].astype(np.float64)
        relative, absolute = error_bound(self.features.pose, weight.dtype)
        if weight.dtype == np.float64:
            return kth
        relative = relative + 2.0**-22  # the sum and the division of the ratio
        slack = absolute / np.sqrt(local + self.local.min())
        return np.asarray((((np.sqrt(kth) + slack) * (1 + relative) / (1 - relative)) + slack) ** 2, np.float64)

    def _paired(self, first: Int, second: Int) -> Float:
        """Compute distances of pairs of nodes by the reference."""
        pose = self.features.pose
        distance = np.zeros(len(first))
        for start in range(0, len(first), _CHUNK):
            part = slice(start, start + _CHUNK)
            distance[part] = paired_distance(pose.take(first[part]), pose.take(second[part]))
        return distance


def _exclude(weight: NDArray[np.floating], excluded: Int) -> None:
    """Set two ranges of columns of each row to infinity."""
    for r, (a, b, c, d) in enumerate(excluded.tolist()):
        weight[r, a:b] = np.inf
        weight[r, c:d] = np.inf


def rank_within(group: Int, counted: Mask) -> Int:
    """Count what comes before each entry in its group.

    Parameters
    ----------
    group : (P,) int64, ascending
    counted : (P,) bool, what counts

    Returns
    -------
    (P,) int64
    """
    before: Int = np.cumsum(counted) - counted
    is_first = np.append(True, group[1:] != group[:-1])[: len(group)]
    start = np.maximum.accumulate(np.where(is_first, np.arange(len(group)), 0)) if len(group) else group
    return before - before[start]
