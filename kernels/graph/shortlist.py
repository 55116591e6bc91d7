"""The nearest nodes of each node, kept from one build to the next: one changed clip costs its own row and column.

Conventions
-----------
A shortlist holds more pairs than the graph uses, and knows per row up to which weight it is complete. When clips
change, their pairs are dropped and the new ones put in where they lie within what is complete; the nearest that the
graph uses are then picked from it, the same to the bit as from a search of everything. A row that has lost too many is
searched again, and counted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.graph.beat_features import BeatFeatures
from kernels.graph.distance import PairDistance, pose_distance
from kernels.graph.nodes import BeatNodes
from kernels.graph.transitions import LOCAL_BOUNDS, N_NEAREST, Nearest, nearest, rank_within
from kernels.types import Float, Int

Mask = NDArray[np.bool_]

SPARE = 4
"""Pairs kept a row, as a multiple of those the graph uses. Chosen by hand: three of four pairs may go before a row is
searched again; with one clip of 500 changed, none is."""

FEW_SHARE = 0.02
"""Share of pairs up to which they are put in one by one. Chosen for speed, by hand; changes no pair."""

LARGEST_SHARE = 0.25
"""Share of new nodes from which everything is searched again. Chosen for speed, by hand; changes no pair."""

_COLUMNS = ("row", "other", "distance", "weight")


@dataclass(frozen=True, eq=False)
class Shortlist:
    """Near pairs of N nodes, and how far they are complete.

    Parameters
    ----------
    pairs : Nearest, sorted by row, then weight, then other
    radius, allowed_radius : (N,) float64, > 0
        Every pair of the row that weighs less is listed; the second counts only pairs that the rules of blend and jump
        allow. Infinite where all are listed.
    """

    pairs: Nearest
    radius: Float
    allowed_radius: Float


@dataclass(frozen=True)
class Work:
    """What an update took: nodes whose row and column were computed, rows searched again, distances in all."""

    computed_nodes: int
    refilled_rows: int
    distances: int


def make_shortlist(
    features: BeatFeatures,
    nodes: BeatNodes,
    *,
    rows: Int | None = None,
    distance: PairDistance = pose_distance,
    n_nearest: int = N_NEAREST,
    **rules: Any,  # noqa: ANN401 - those of nearest
) -> Shortlist:
    """Search all rows, or some.

    Parameters
    ----------
    features, nodes, rows, distance, n_nearest, rules : as :func:`kernels.graph.transitions.nearest` has them

    Returns
    -------
    Shortlist; rows not searched have a radius of 0
    """
    n_listed = SPARE * n_nearest
    pairs = nearest(features, nodes, rows=rows, distance=distance, n_nearest=n_listed, **rules)
    radius, allowed_radius = np.zeros(len(nodes)), np.zeros(len(nodes))
    searched = np.arange(len(nodes)) if rows is None else rows
    for limit, counts in ((radius, np.ones(len(pairs.row), bool)), (allowed_radius, is_allowed(nodes, pairs))):
        limit[searched] = np.inf
        last = counts & (rank_within(pairs.row, counts) == n_listed - 1)
        limit[pairs.row[last]] = pairs.weight[last]
    return Shortlist(pairs, radius, allowed_radius)


def update_shortlist(
    old: Shortlist,
    old_node: Int,
    features: BeatFeatures,
    nodes: BeatNodes,
    *,
    distance: PairDistance = pose_distance,
    n_nearest: int = N_NEAREST,
    **rules: Any,  # noqa: ANN401 - those of nearest
) -> tuple[Shortlist, Work]:
    """Bring a shortlist up to date with changed clips.

    Parameters
    ----------
    old : Shortlist made with the same rules
    old_node : (N,) int64
        Which of the old nodes each node is, unchanged with its clip; -1 for new ones. Increasing where not -1.
    features, nodes : of the N nodes now
    distance, n_nearest, rules : as :func:`kernels.graph.transitions.nearest` has them

    Returns
    -------
    Shortlist, Work
        :func:`nearest_of` the one equals that of a shortlist made anew, to the bit.
    """
    n = len(nodes)
    new = np.flatnonzero(old_node < 0)
    if len(new) > LARGEST_SHARE * n or len(old.radius) == 0:
        whole = make_shortlist(features, nodes, distance=distance, n_nearest=n_nearest, **rules)
        return whole, Work(n, 0, n * n)
    own = make_shortlist(features, nodes, rows=new, distance=distance, n_nearest=n_nearest, **rules)
    smooth = own.pairs.is_smooth
    kept = np.flatnonzero(old_node >= 0)
    radius, allowed_radius = own.radius.copy(), own.allowed_radius.copy()
    radius[kept], allowed_radius[kept] = old.radius[old_node[kept]], old.allowed_radius[old_node[kept]]
    low, high = rules.get("local_bounds") or LOCAL_BOUNDS[features.pose.metric]
    local = np.clip(features.local_distance, low, high)
    rest = Shortlist(_kept_pairs(old, old_node, smooth), radius, allowed_radius)
    column = _column(features, local, nodes, new, kept, rest)
    found = Shortlist(_merged(rest.pairs, _sorted(column, own.pairs)), radius, allowed_radius)
    short = _too_short(found, nodes, n_nearest)
    if len(short):
        again = make_shortlist(features, nodes, rows=short, distance=distance, n_nearest=n_nearest, **rules)
        outside = np.ones(n, bool)
        outside[short] = False
        radius[short], allowed_radius[short] = again.radius[short], again.allowed_radius[short]
        others = _only(found.pairs, outside[found.pairs.row])
        found = Shortlist(_merged(others, again.pairs), radius, allowed_radius)
    return found, Work(len(new), len(short), (2 * len(new) + len(short)) * n)


def nearest_of(listed: Shortlist, nodes: BeatNodes, *, n_nearest: int = N_NEAREST) -> Nearest:
    """Pick the nearest that the graph uses.

    Parameters
    ----------
    listed : Shortlist made for as many
    nodes : BeatNodes
    n_nearest : int, >= 1

    Returns
    -------
    Nearest, as :func:`kernels.graph.transitions.nearest` finds them
    """
    pairs = listed.pairs
    allowed = is_allowed(nodes, pairs)
    used = rank_within(pairs.row, np.ones(len(pairs.row), bool)) < n_nearest
    used |= allowed & (rank_within(pairs.row, allowed) < n_nearest)
    return _only(pairs, used)


def is_allowed(nodes: BeatNodes, pairs: Nearest) -> Mask:
    """Whether the rules of blend and jump allow each pair, (P,) bool, seen from its row.

    Parameters
    ----------
    nodes : BeatNodes
    pairs : Nearest of them

    Returns
    -------
    (P,) bool
    """
    leaves, enters = _doors(nodes, pairs)
    return np.where(leaves[pairs.row], enters[pairs.other], leaves[pairs.other])


def _doors(nodes: BeatNodes, pairs: Nearest) -> tuple[Mask, Mask]:
    margin = pairs.min_margin_s
    return nodes.may_leave(margin) & pairs.is_smooth, nodes.may_enter(margin) & pairs.is_smooth


def _kept_pairs(old: Shortlist, old_node: Int, smooth: Mask) -> Nearest:
    """Pairs of unchanged nodes, renumbered; their order stays."""
    now = np.full(len(old.radius), -1)
    kept = np.flatnonzero(old_node >= 0)
    now[old_node[kept]] = kept
    pairs = old.pairs
    row, other = now[pairs.row], now[pairs.other]
    stays = (row >= 0) & (other >= 0)
    return Nearest(
        row[stays],
        other[stays],
        pairs.distance[stays],
        pairs.weight[stays],
        pairs.metric,
        pairs.min_margin_s,
        smooth,
    )


def _column(features: BeatFeatures, local: Float, nodes: BeatNodes, new: Int, kept: Int, rest: Shortlist) -> Nearest:
    """Pairs of unchanged rows with new nodes that lie within what the rows are complete to."""
    pairs, radius, allowed_radius = rest.pairs, rest.radius, rest.allowed_radius
    leaves, enters = _doors(nodes, pairs)
    kept = kept[leaves[kept] | enters[kept]]
    apart = pose_distance(features.pose.take(new), features.pose.take(kept)).T
    weight = apart / np.add.outer(local[kept], local[new])
    goes = leaves[kept][:, None]
    useful = np.where(goes, nodes.may_enter()[new], nodes.may_leave()[new])
    allowed = np.where(goes, enters[new], leaves[new])
    inside = useful & ((weight < radius[kept][:, None]) | (allowed & (weight < allowed_radius[kept][:, None])))
    r, c = np.nonzero(inside)
    return replace(pairs, row=kept[r], other=new[c], distance=apart[r, c], weight=weight[r, c])


def _sorted(one: Nearest, other: Nearest) -> Nearest:
    """Put pairs together in order."""
    row, node, distance, weight = (np.concatenate([getattr(p, c) for p in (one, other)]) for c in _COLUMNS)
    order = np.lexsort((node, weight, row))
    return replace(other, row=row[order], other=node[order], distance=distance[order], weight=weight[order])


def _merged(many: Nearest, few: Nearest) -> Nearest:
    """Put sorted pairs in among sorted pairs: one by one where they are few."""
    if len(few.row) > len(many.row) * FEW_SHARE:
        return _sorted(many, few)
    end = np.searchsorted(many.row, few.row, side="right")
    place = np.searchsorted(many.row, few.row, side="left")
    for i, (a, b) in enumerate(zip(place.tolist(), end.tolist(), strict=True)):
        segment = many.weight[a:b]
        first = a + int(np.searchsorted(segment, few.weight[i], side="left"))
        last = a + int(np.searchsorted(segment, few.weight[i], side="right"))
        place[i] = first + int(np.searchsorted(many.other[first:last], few.other[i]))
    row, other, distance, weight = (np.insert(getattr(many, c), place, getattr(few, c)) for c in _COLUMNS)
    return replace(few, row=row, other=other, distance=distance, weight=weight)


def _only(pairs: Nearest, mask: Mask) -> Nearest:
    row, other, distance, weight = (getattr(pairs, c)[mask] for c in _COLUMNS)
    return replace(pairs, row=row, other=other, distance=distance, weight=weight)


def _too_short(listed: Shortlist, nodes: BeatNodes, n_nearest: int) -> Int:
    """Rows that are not complete for as many as the graph uses, or have grown too long."""
    pairs, n = listed.pairs, len(nodes)
    allowed = is_allowed(nodes, pairs)
    short = np.bincount(pairs.row, minlength=n) > 4 * SPARE * n_nearest
    for radius, counts in ((listed.radius, np.ones(len(pairs.row), bool)), (listed.allowed_radius, allowed)):
        complete = counts & (pairs.weight < radius[pairs.row])
        short |= (np.bincount(pairs.row[complete], minlength=n) < n_nearest) & np.isfinite(radius)
    leaves, enters = _doors(nodes, pairs)
    return np.flatnonzero(short & (leaves | enters))
