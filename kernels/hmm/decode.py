"""The most probable dance in recordings: the model of the dancer and what the recordings let be joined, in one program.

Viterbi over basic motions alone knows nothing of the recordings: what it chooses may have to be put together from
pieces that do not fit. Here the hidden state is a recorded motion. It pays, in natural log units, what its basic motion
pays by the model (transition, music), and beside that what can be seen of it: its pace, a seam where it does not go on
in its clip, a beat on which the body does not visibly stop.

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
from kernels.hmm.instances import MOST_PRICED, Motions, warp_cost
from kernels.hmm.seams import Ends, seam_cost
from kernels.hmm.viterbi import InfeasibleSpansError
from kernels.types import Float, Int

N_NEAREST, N_EACH_STATE = 24, 48
"""Links of each motion: to so many whose seams are cheapest, and to so many shared evenly among all basic motions."""

FAR = 8.0
"""Price of a seam to any other motion: dear, but there is always one."""

MISSED_BEAT = 2.0
"""Price of a beat on which the body does not visibly stop."""

CROWDED = 6.0
"""Price of a seam at the very start or end of the song: its blend has no room."""

REPETITION = 0.25
WINDOW, LOOK_AHEAD = 16, 12
"""Intervals that are danced at a time, and looked at beyond."""

BLOCK = 256


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


@dataclass(frozen=True, eq=False)
class Chain:
    """A dance as recorded motions, (S,) int64 each: the motion, the interval it starts with, intervals it takes."""

    motion: Int
    start: Int
    length: Int


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
            price = warp_weight * warp_cost(np.asarray(span_s), length_s[fits])
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
class Wish:
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


def keep_wishes(places: Places, wishes: Sequence[Wish], *, price: float = np.inf) -> Places:
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


def decode(
    motions: Motions,
    links: Links,
    places: Places,
    log_initial: Float,
    log_transition: Float,
    *,
    price: Float,
    crowded: Float,
    before: int | None = None,
) -> tuple[Chain, float]:
    """Find the dance that costs least.

    Parameters
    ----------
    motions : Motions of I, every state known
    links : Links between them
    places : Places
    log_initial, log_transition : (K,) and (K, K) float, natural log
    price : (I,) float
        What each motion costs beside, wherever it is danced.
    crowded : (G,) float, >= 0
        What a seam at each point of the grid costs beside.
    before : int or None, the motion that ends where the grid starts

    Returns
    -------
    Chain, and its cost

    Raises
    ------
    InfeasibleSpansError
        If no sequence of motions covers the grid.
    """
    n_all, n = places.n_intervals, len(motions.state)
    far = _Far(motions, log_transition)
    score = np.full((n_all + 1, n), np.inf)
    came, length = np.zeros((n_all + 1, n), np.int32), np.zeros((n_all + 1, n), np.int32)
    linked = np.flatnonzero(np.diff(links.first))
    score[0] = np.inf if before is None else np.where(np.arange(n) == before, 0.0, np.inf)
    for k in range(n_all):
        if np.isfinite(score[k]).any():
            enter = far.enter(score[k]) + crowded[k]
            into = score[k][links.source] + links.cost + (crowded[k] * links.is_seam if crowded[k] else 0.0)
            best = np.minimum.reduceat(into, links.first[linked]) if len(linked) else np.zeros(0)
            enter[linked] = np.minimum(enter[linked], best)
        elif k == 0:
            enter = -log_initial[motions.state]
        else:
            continue
        enter = enter + price
        for d, (fits, cost) in enumerate(places.at[k], start=1):
            end = min(k + d, n_all)
            value = enter[fits] + cost
            better = value < score[end][fits]
            here = fits[better]
            score[end][here], came[end][here], length[end][here] = value[better], k, d
    if not np.isfinite(score[n_all]).any():
        reached = np.isfinite(score).any(axis=1)
        raise InfeasibleSpansError(int(np.flatnonzero(reached)[-1]) if reached.any() else 0)
    return _back(score, came, length, links, far, crowded), float(score[n_all].min())


class _Far:
    """Seams to motions that are no neighbours: from the cheapest motion of each basic motion to all of another."""

    def __init__(self, motions: Motions, log_transition: Float) -> None:
        self.state, self.log_transition = motions.state, log_transition
        self.members = [np.flatnonzero(motions.state == k) for k in range(len(log_transition))]

    def enter(self, score: Float) -> Float:
        best = np.array([score[m].min() if len(m) else np.inf for m in self.members])
        return np.asarray(((best[:, None] - self.log_transition).min(axis=0) + FAR)[self.state], np.float64)

    def source(self, score: Float, target: int) -> tuple[int, float]:
        cost = score - self.log_transition[self.state, self.state[target]] + FAR
        at = int(np.argmin(cost))
        return at, float(cost[at])


def _back(
    score: Float, came: NDArray[np.int32], length: NDArray[np.int32], links: Links, far: _Far, crowded: Float
) -> Chain:
    """Follow the cheapest dance from its end to its start."""
    at = len(score) - 1
    motion = int(np.argmin(score[at]))
    found: list[tuple[int, int, int]] = []
    while True:
        start = int(came[at, motion])
        found.append((motion, start, int(length[at, motion])))
        if start == 0:
            break
        here = slice(int(links.first[motion]), int(links.first[motion + 1]))
        into = score[start][links.source[here]] + links.cost[here] + crowded[start] * links.is_seam[here]
        source, cost = far.source(score[start], motion)
        if len(into) and into.min() <= cost + crowded[start]:
            source = int(links.source[here][int(np.argmin(into))])
        motion, at = source, start
    rows = np.array(found[::-1], np.int64)
    return Chain(rows[:, 0], rows[:, 1], rows[:, 2])


def decode_varied(
    motions: Motions,
    links: Links,
    places: Places,
    log_initial: Float,
    log_transition: Float,
    *,
    price: Float,
    crowded: Float,
    repetition_weight: float,
) -> Chain:
    """Find a dance that costs little, showing the same again priced.

    Repetition is no sum over neighbours: the dance is made forwards, window by window, each with a look ahead, and
    every motion is dearer by how often earlier windows showed it.

    Parameters
    ----------
    motions, links, places, log_initial, log_transition, price, crowded : as :func:`decode`
    repetition_weight : float, >= 0
        Scales the price of a motion that was shown before, :data:`REPETITION` for each time, of at most
        :data:`MOST_PRICED` times.

    Returns
    -------
    Chain

    Raises
    ------
    InfeasibleSpansError
        As :func:`decode`.
    """
    n_all, open_ = places.n_intervals, finishing(places)
    shown = np.zeros(len(motions.state), np.int64)
    found: list[tuple[int, int, int]] = []
    at, last = 0, None
    while at < n_all:
        ahead = min(at + WINDOW + LOOK_AHEAD, n_all)
        chain, _ = decode(
            motions,
            links,
            Places(open_.at[at:ahead]),
            log_initial,
            log_transition,
            price=price + REPETITION * repetition_weight * np.minimum(shown, MOST_PRICED),
            crowded=crowded[at:],
            before=last,
        )
        rows = zip(chain.motion.tolist(), (chain.start + at).tolist(), chain.length.tolist(), strict=True)
        kept = [row for row in rows if row[1] < at + WINDOW]
        found += kept
        last, start, length = kept[-1]
        at = start + length
        np.add.at(shown, [row[0] for row in kept], 1)
    return Chain(*np.array(found, np.int64).reshape(-1, 3).T)


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
