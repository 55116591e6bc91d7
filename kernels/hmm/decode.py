"""The most probable dance in recordings: the model of the dancer and what the recordings let be joined, in one program.

Viterbi over basic motions alone knows nothing of the recordings: what it chooses may have to be put together from
pieces that do not fit. Here the hidden state is a recorded motion. It pays, in natural log units, what its basic motion
pays by the model (transition, music), and beside that what can be seen of it: its pace and the beats on which it does
not visibly stop (:mod:`kernels.hmm.places`), a seam where it does not go on in its clip (:mod:`kernels.hmm.links`).

Conventions
-----------
``I`` recorded motions of ``K`` basic motions; a grid of ``G`` intervals, of which a motion takes 1 to ``D``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.hmm.instances import MOST_PRICED, Motions
from kernels.hmm.links import Links
from kernels.hmm.places import Places, finishing
from kernels.hmm.viterbi import InfeasibleSpansError, Spans
from kernels.types import Float, Int

FAR = 8.0
"""Price of a seam to any other motion: dear, but there is always one. Chosen by hand: eight of the smoothest seams."""

REPETITION = 0.25
"""Price of each earlier showing of a motion: a quarter of that in the choice of recordings, since here the model, too,
has its price. Chosen by hand."""
WINDOW, LOOK_AHEAD = 16, 12
"""Intervals that are danced at a time, and looked at beyond. Chosen by hand; looking farther was tried on three songs
of real clips and gained nothing."""


@dataclass(frozen=True, eq=False)
class Chain:
    """A dance as recorded motions, (S,) int64 each: the motion, the interval it starts with, intervals it takes."""

    motion: Int
    start: Int
    length: Int

    def spans(self, motions: Motions) -> Spans:
        """Tell the basic motions of the dance, and how long each lasts.

        Parameters
        ----------
        motions : the ones that are danced, of known states
        """
        return Spans(motions.state[self.motion], self.start, self.length)


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
