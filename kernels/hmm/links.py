"""Which recorded motion may follow which, and at what price: its own continuation, and the cheapest seams."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.hmm.instances import Motions
from kernels.hmm.seams import Ends, seam_cost
from kernels.types import Float, Int

N_NEAREST, N_EACH_STATE = 24, 48
"""Links of each motion: to so many whose seams are cheapest, and to so many shared evenly among all basic motions.
Chosen by hand; five times as many were tried on three songs of real clips and gave the same dances."""

BLOCK = 256
"""Motions whose seams to all others are priced at a time. Chosen for memory, by hand; changes no link."""


@dataclass(frozen=True, eq=False)
class Links:
    """Which motion may follow which, by target: those into motion j are ``first[j]`` to ``first[j + 1]``.

    Parameters
    ----------
    first : (I + 1,) int64
    source : (E,) int64, motions that end
    cost : (E,) float64, model and seam together
    is_seam : (E,) bool, whether the source does not go on in the target
    """

    first: Int
    source: Int
    cost: Float
    is_seam: NDArray[np.bool_]


def link(motions: Motions, ends: Ends, log_transition: Float, *, seam_weight: float) -> Links:
    """Link every motion to the one that goes on in its clip, and to those that are cheapest to cut to.

    Parameters
    ----------
    motions : Motions of I, every state known
    ends : Ends of them
    log_transition : (K, K) float
    seam_weight : float, >= 0

    Returns
    -------
    Links
    """
    n, state = len(motions.state), motions.state
    each = [np.flatnonzero(state == k) for k in range(len(log_transition))]
    n_each = max(N_EACH_STATE // max(len(each), 1), 1)
    after = motions.following
    parts = [(np.flatnonzero(after >= 0), after[after >= 0], np.zeros(int((after >= 0).sum())))]
    for start in range(0, n, BLOCK):
        row = np.arange(start, min(start + BLOCK, n))
        cost = seam_weight * seam_cost(ends, row, np.arange(n))
        cost[row - start, row] = np.inf  # not the same over again
        picked = [_cheapest(cost, np.arange(n), N_NEAREST), *(_cheapest(cost, of, n_each) for of in each if len(of))]
        column = np.concatenate(picked, axis=1)
        source = np.repeat(row, column.shape[1])
        parts.append((source, column.reshape(-1), cost[source - start, column.reshape(-1)]))
    source, target, cost = (np.concatenate([p[i] for p in parts]) for i in range(3))
    # Of links between the same two motions the cheapest stays.
    order = np.lexsort((cost, source, target))
    source, target, cost = source[order], target[order], cost[order]
    kept = np.append(True, (np.diff(source) != 0) | (np.diff(target) != 0)) & np.isfinite(cost)
    source, target, cost = source[kept], target[kept], cost[kept]
    first = np.searchsorted(target, np.arange(n + 1))
    return Links(first, source, cost - log_transition[state[source], state[target]], after[source] != target)


def _cheapest(cost: Float, column: Int, n: int) -> Int:
    """Of some columns the n cheapest of each row, (rows, min(n, columns))."""
    if len(column) <= n:
        return np.broadcast_to(column, (len(cost), len(column)))
    return np.asarray(column[np.argpartition(cost[:, column], n - 1, axis=1)[:, :n]], np.int64)
