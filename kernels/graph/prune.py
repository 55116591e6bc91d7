"""Which nodes are worth keeping, and what the catalogue loses with the others.

Conventions
-----------
A dance is a row of *steps*. A step dances from a beat to the next of the same clip; before it, one transition may jump
to another node. Where a dance can be is therefore told by the node where a step *ends*: from v the next step ends at
``next_node[v]``, or at ``next_node[u]`` after a transition from v to u. Two transitions never follow each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from kernels.types import Int, MotionGraph

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Pruned:
    """The nodes kept, and the loss.

    Parameters
    ----------
    is_kept : (N,) bool
    n_nodes_lost, n_clips_lost : int
        A clip is lost when none of its nodes is kept.
    lost_s : float, seconds of clip between consecutive beats that are not both kept
    total_s : float, seconds of clip between consecutive beats
    """

    is_kept: Mask
    n_nodes_lost: int
    n_clips_lost: int
    lost_s: float
    total_s: float


def keep_all(graph: MotionGraph) -> Pruned:
    """Keep every node: a loss of nothing, to compare with.

    Parameters
    ----------
    graph : MotionGraph

    Returns
    -------
    Pruned; empty for an empty graph
    """
    return _report(graph, np.ones(len(graph.clip_index), bool))


def remove_dead_ends(graph: MotionGraph) -> Pruned:
    """Remove nodes of degree one, again and again, until none is left: the pruning of [Xu2015].

    Parameters
    ----------
    graph : MotionGraph
        Degree counts the edge to the next beat, the one from the beat before, and each node joined by a transition in
        either direction. A node without any edge goes too.

    Returns
    -------
    Pruned; empty for an empty graph
    """
    n = len(graph.clip_index)
    (a, b), (c, d) = _joined(graph), _consecutive(graph)
    source, target = np.concatenate([a, b, c, d]), np.concatenate([b, a, d, c])
    neighbour = target[np.argsort(source, kind="stable")]
    degree = np.bincount(source, minlength=n)
    start = np.concatenate([[0], np.cumsum(degree)])
    kept = np.ones(n, bool)
    waiting = np.flatnonzero(degree <= 1).tolist()
    kept[waiting] = False
    while waiting:
        node = waiting.pop()
        for other in neighbour[start[node] : start[node + 1]]:
            degree[other] -= 1
            if kept[other] and degree[other] <= 1:
                kept[other] = False
                waiting.append(int(other))
    return _report(graph, kept)


def keep_strongest(graph: MotionGraph) -> Pruned:
    """Keep the largest strongly connected component: from every node kept every other can be danced to.

    The pruning of Kovar, Gleicher and Pighin [Kovar2002], on steps instead of bare edges (module docstring). Of
    components equally large, the one with the first node. Nothing is kept when no dance can come back to where it was.

    Parameters
    ----------
    graph : MotionGraph

    Returns
    -------
    Pruned; empty for an empty graph
    """
    component = _loops(graph)
    kept = np.zeros(len(graph.clip_index), bool)
    if (component >= 0).any():
        size = np.bincount(component[component >= 0])
        largest = component[(component >= 0) & (size[component] == size.max())][0]
        kept = component == largest
        # nodes entered by a transition and danced on from, inside the component
        after = graph.next_node[graph.target]
        kept[graph.target[kept[graph.source] & (after >= 0) & kept[after]]] = True
    return _report(graph, kept)


def keep_endless(graph: MotionGraph) -> Pruned:
    """Keep the nodes from which a dance can go on for ever.

    The default: it loses less than :func:`keep_strongest`, which also drops what can be danced once but not come back
    to, and unlike :func:`remove_dead_ends` leaves no node where a dance would get stuck.

    Parameters
    ----------
    graph : MotionGraph

    Returns
    -------
    Pruned; empty for an empty graph
    """
    n = len(graph.clip_index)
    start, end = _steps(graph)
    looping = np.flatnonzero(_loops(graph) >= 0)
    # backwards from every loop at once: one more node, n, steps into all of them
    source, target = np.concatenate([end, np.full(len(looping), n)]), np.concatenate([start, looping])
    order = breadth_first_order(_links(source, target, n + 1), n, directed=True, return_predecessors=False)
    kept = np.zeros(n + 1, bool)
    kept[order] = True
    return _report(graph, kept[:n])


def has_endless_dance(graph: MotionGraph) -> bool:
    """Whether any dance can go on for ever.

    Parameters
    ----------
    graph : MotionGraph

    Returns
    -------
    bool; False for an empty graph
    """
    return bool(keep_endless(graph).is_kept.any())


def _consecutive(graph: MotionGraph) -> tuple[Int, Int]:
    """Consecutive beats: node, next node."""
    node = np.flatnonzero(graph.next_node >= 0)
    return node, graph.next_node[node]


def _joined(graph: MotionGraph) -> tuple[Int, Int]:
    """Pairs joined by a transition, each once whichever directions it has."""
    low, high = np.minimum(graph.source, graph.target), np.maximum(graph.source, graph.target)
    n = max(len(graph.clip_index), 1)
    pair = np.unique(low * n + high)
    return pair // n, pair % n


def _steps(graph: MotionGraph) -> tuple[Int, Int]:
    """Where a step can end, and where the one after it can: (S,), (S,)."""
    node, following = _consecutive(graph)
    after = graph.next_node[graph.target]
    goes_on = after >= 0
    return np.concatenate([node, graph.source[goes_on]]), np.concatenate([following, after[goes_on]])


def _links(source: Int, target: Int, n: int) -> csr_array:
    return csr_array((np.ones(len(source), np.int32), (source, target)), shape=(n, n))


def _loops(graph: MotionGraph) -> Int:
    """Strongly connected component of the steps, (N,) int64; -1 where no dance comes back."""
    n = len(graph.clip_index)
    if n == 0:
        return np.zeros(0, np.int64)
    start, end = _steps(graph)
    _, component = connected_components(_links(start, end, n), directed=True, connection="strong")
    # a lone node is a component too: it comes back only by a step onto itself
    looping = np.bincount(component[start[component[start] == component[end]]], minlength=n) > 0
    return np.where(looping[component], component, -1).astype(np.int64)


def _report(graph: MotionGraph, kept: Mask) -> Pruned:
    node, following = _consecutive(graph)
    length_s = graph.time_s[following] - graph.time_s[node]
    lost = ~(kept[node] & kept[following])
    clips = np.unique(graph.clip_index)
    return Pruned(
        is_kept=kept,
        n_nodes_lost=int((~kept).sum()),
        n_clips_lost=len(clips) - len(np.unique(graph.clip_index[kept])),
        lost_s=float(length_s[lost].sum()),
        total_s=float(length_s.sum()),
    )
