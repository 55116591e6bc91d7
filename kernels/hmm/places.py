"""Where on a song's grid each recorded motion may be danced, and what it costs there by itself.

Conventions
-----------
``I`` recorded motions of ``K`` basic motions; a grid of ``G`` intervals, of which a motion takes 1 to ``D``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.hmm.durations import LEAST_WARP, MOST_WARP
from kernels.hmm.instances import PACE, Motions
from kernels.hmm.viterbi import InfeasibleSpansError
from kernels.types import Float, Int
from kernels.warp import warp_cost

MISSED_BEAT = 2.0
"""Price of a beat on which the body does not visibly stop. Chosen as by the motion graph (`missed_beat` of its
costs)."""

CROWDED = 6.0
"""Price of a seam at the very start or end of the song: its blend has no room. Chosen by hand: several seams."""


@dataclass(frozen=True, eq=False)
class Places:
    """What each motion costs by itself wherever it may be danced: for every start and length, motions and prices.

    ``at[k][d - 1]`` holds (n,) motions that may take the d intervals from k, and their (n,) prices.
    """

    at: Sequence[Sequence[tuple[Int, Float]]]

    @property
    def n_intervals(self) -> int:
        """Number of intervals, G."""
        return len(self.at)


def place(
    motions: Motions,
    grid_s: Float,
    log_music: Float,
    *,
    longest: int,
    is_beat: NDArray[np.bool_],
    accent: Float,
    warp_weight: float = 1.0,
) -> Places:
    """Price every motion in every place of the grid where it can be danced within the warp bounds.

    Parameters
    ----------
    motions : Motions of I, every state known
    grid_s : (G + L + 1,) float, seconds, increasing; L >= longest - 1 points beyond the grid
    log_music : (G, K) float, log likelihood of what is heard in each interval
    longest : int, D
    is_beat : (G + L + 1,) bool, whether a point of the grid is a beat
    accent : (I,) float, 0 to 1, how visibly the body stops at the end of each motion
    warp_weight : float, >= 0

    Returns
    -------
    Places
    """
    n_intervals = len(log_music)
    length_s = motions.end_s - motions.start_s
    order = np.argsort(length_s, kind="stable")
    ranked = length_s[order]
    heard = np.concatenate([np.zeros((1, log_music.shape[1])), np.cumsum(log_music, axis=0)])
    at = []
    for k in range(n_intervals):
        here = []
        for d in range(1, longest + 1):
            span_s = float(grid_s[k + d] - grid_s[k])
            a, b = np.searchsorted(ranked, [span_s / MOST_WARP, span_s / LEAST_WARP + 1e-12])
            fits = np.sort(order[a:b])
            end = min(k + d, n_intervals)
            price = warp_weight * warp_cost(span_s / length_s[fits], PACE)
            at_k = np.full(len(fits), k)
            price = price + missed_beats(is_beat, at_k, at_k + d, accent[fits])
            price = price - (heard[end] - heard[k])[motions.state[fits]]
            here.append((fits, price))
        at.append(here)
    return Places(at)


def missed_beats(is_beat: NDArray[np.bool_], start: Int, end: Int, accent: Float) -> Float:
    """Price the beats on which motions do not visibly stop: those they pass, and those they end on.

    Parameters
    ----------
    is_beat : (P,) bool, whether a point of the grid is a beat
    start, end : (n,) int64, points where motions start and end
    accent : (n,) float, 0 to 1, how visibly each stops at its end

    Returns
    -------
    (n,) float64, >= 0
    """
    counted = np.cumsum(is_beat)
    passed: Int = counted[end - 1] - counted[start]
    return np.asarray(MISSED_BEAT * (passed + is_beat[end] * (1.0 - accent)), np.float64)


def crowded_cost(grid_s: Float, end_s: float, *, blend_s: float) -> Float:
    """Price seams so near to the start or end of a song that half a blend has no room.

    Parameters
    ----------
    grid_s : (P,) float, seconds
    end_s : float, seconds, end of the song; it starts at 0
    blend_s : float, seconds, >= 0

    Returns
    -------
    (P,) float64, 0 to :data:`CROWDED`
    """
    room = np.clip(np.minimum(grid_s, end_s - grid_s) / max(blend_s / 2, 1e-9), 0.0, 1.0)
    return np.asarray(CROWDED * (1.0 - room), np.float64)


@dataclass(frozen=True, eq=False)
class MotionWish:
    """In the intervals first <= k < last only motions of the (I,) mask are wished for."""

    first: int
    last: int
    motions: NDArray[np.bool_]

    def touched_by(self, start: Int, length: Int) -> Int:
        """Count the intervals of the wish under spans, (n,) int64.

        Parameters
        ----------
        start, length : (n,) int64, intervals
        """
        return np.asarray(
            np.maximum(np.minimum(self.last, start + length) - np.maximum(self.first, start), 0), np.int64
        )


def keep_wishes(places: Places, wishes: Sequence[MotionWish], *, price: float = np.inf) -> Places:
    """Price what wishes do not admit, each interval; at an infinite price it is not danced at all.

    Parameters
    ----------
    places : Places
    wishes : in any order; where they overlap, each counts
    price : float, > 0

    Returns
    -------
    Places
    """
    at = []
    for k, here in enumerate(places.at):
        row = []
        for d, (fits, cost) in enumerate(here, start=1):
            for wish in wishes:
                n_touched = int(wish.touched_by(np.array(k), np.array(d)))
                if n_touched:
                    cost = np.where(wish.motions[fits], cost, cost + price * n_touched)
            kept = np.isfinite(cost)
            row.append((fits[kept], cost[kept]))
        at.append(row)
    return Places(at)


def unkept_cost(wishes: Sequence[MotionWish], start: Int, length: Int, motion: Int, *, price: float) -> Float:
    """Price what a dance shows in place of what is wished for.

    Parameters
    ----------
    wishes : in any order; where they overlap, each counts
    start, length : (S,) int64, intervals of its spans
    motion : (S,) int64, danced in each
    price : float, >= 0, of an interval

    Returns
    -------
    (S,) float64, >= 0; 0 without wishes
    """
    unkept = [wish.touched_by(start, length) * ~wish.motions[motion] for wish in wishes]
    return np.asarray(np.sum([price * n for n in unkept], axis=0) if unkept else np.zeros(len(start)), np.float64)


def finishing(places: Places) -> Places:
    """Take out what nothing could follow to the end of the grid.

    Parameters
    ----------
    places : Places

    Returns
    -------
    Places

    Raises
    ------
    InfeasibleSpansError
        If nothing covers the grid; ``interval`` is the farthest point that can be reached.
    """
    n = places.n_intervals
    ends = np.zeros(n + 1, bool)
    ends[n] = True
    for k in range(n - 1, -1, -1):
        ends[k] = any(len(fits) and ends[min(k + d, n)] for d, (fits, _) in enumerate(places.at[k], start=1))
    if not ends[0]:
        reached = [0]
        for k in range(n):
            if k in reached:
                reached += [min(k + d, n) for d, (fits, _) in enumerate(places.at[k], start=1) if len(fits)]
        raise InfeasibleSpansError(max(reached))
    return Places(
        [
            [
                (fits, cost) if ends[min(k + d, n)] else (fits[:0], cost[:0])
                for d, (fits, cost) in enumerate(row, start=1)
            ]
            for k, row in enumerate(places.at)
        ]
    )
