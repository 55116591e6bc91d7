"""Spreading a dance over the catalogue: the price of showing the same stretch again, taken over the whole song.

How often a stretch is shown is no sum over steps, so the exact program cannot price it. Here windows of a known dance
are solved again, each exactly, with every stretch priced at what one more showing would cost given the rest of the
dance.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from kernels.graph.program import Move, PathProgram, Solution
from kernels.types import Int

WINDOWS = (12, 6)
"""Music intervals solved at a time: wide windows find other ways, narrow ones see what comes twice nearby. Each begins
half a window after the one before. Chosen by hand; measured on 124 small random graphs, dances are the cheapest in 82
%."""


def spread(
    program: PathProgram,
    whole: Solution,
    moves: list[Move],
    starts: Int,
    rounds: int,
    total: Callable[[list[Move]], float],
) -> list[Move]:
    """Improve a dance by total cost, repetition included.

    Parameters
    ----------
    program : PathProgram
    whole : Solution over all beats, without prices
    moves : the dance decoded from it: optimal but for repetition
    starts : (M,) int64, nodes that may begin
    rounds : int, >= 0; 0 changes nothing
    total : true cost of a dance

    Returns
    -------
    The cheapest dance met, never worse than ``moves``. Deterministic.

    Notes
    -----
    Each round makes one dance, in three moves.

    1. *What is to come.* The whole song is solved with every stretch at a price: nothing in the first round, later the
       mean over the rounds so far of ``usage`` times its showings beyond the first. This tells a round that a tempting
       loop will be danced too often, which no window can see.
    2. *A dance made forwards.* Window by window from the song's start: a stretch costs ``usage`` times how often it was
       shown so far, what follows the window costs what the first move says. The first half of each window is kept.
    3. *Mending.* Each window, wide or narrow, that shows something twice is solved again between its neighbours, every
       stretch priced by its showings outside the window, and kept when the whole dance becomes cheaper.

    A dance that shows nothing twice ends the rounds. Within a window a stretch may still come twice at the price of
    once: the window is short, and going back in the same clip is priced by the program itself.
    """
    best, cost = moves, total(moves)
    if rounds == 0 or program.costs.usage == 0 or not (_uses(program, best) > 1).any():
        return best
    shown_again = np.zeros(program.n_nodes)
    for turn in range(1, rounds + 1):
        made = _sweep(program, _make_forwards(program, whole, starts), starts, total)
        made_cost = total(made)
        if made_cost < cost:
            best, cost = made, made_cost
        again = np.maximum(_uses(program, made) - 1, 0)
        if turn == rounds or not again.any():
            break
        shown_again += again
        end = {program.n_beats: program.at_the_end}
        whole = program.solve(0, program.n_beats, after=end, price=program.costs.usage * shown_again / turn)
    return best


def _sweep(program: PathProgram, moves: list[Move], starts: Int, total: Callable[[list[Move]], float]) -> list[Move]:
    """Mend all windows, wide ones first."""
    cost = total(moves)
    for window in WINDOWS:
        for begin in range(0, program.n_beats, window // 2):
            mended = _mend(program, moves, begin, begin + window, starts)
            if mended is not None and total(mended) < cost - 1e-9:
                moves, cost = mended, total(mended)
    return moves


def _uses(program: PathProgram, moves: list[Move]) -> Int:
    """How often each stretch is danced, (N,) by its first node."""
    return np.bincount(program.stretches(moves)[0], minlength=program.n_nodes)


def _make_forwards(program: PathProgram, whole: Solution, starts: Int) -> list[Move]:
    moves: list[Move] = []
    beat = 0
    arrived: tuple[int, int] | None = None
    used = np.zeros(program.n_nodes, np.int64)
    while beat < program.n_beats:
        last = min(beat + WINDOWS[0], program.n_beats)
        reach = max(d for _, d in program.steps)
        after = {k: whole.arrive[k] for k in range(last, min(last + reach, program.n_beats + 1))}
        price = np.asarray(program.costs.usage * used, np.float64)
        part = program.solve(beat, last, after=after, price=price)
        stop = last if last == program.n_beats else beat + WINDOWS[0] // 2
        new = program.decode(part, first=beat, last=stop, arrived=arrived, starts=starts, price=price)
        used += _uses(program, new)
        moves += new
        beat, node = program.ends(new[-1])
        arrived = node, program.beats_stayed(moves)
    return moves


def _mend(program: PathProgram, moves: list[Move], begin: int, end: int, starts: Int) -> list[Move] | None:
    """Solve one window again, the rest of the dance as it is; None where there is nothing to gain."""
    beats = np.array([beat for beat, _, _ in moves] + [program.n_beats])
    low = int(np.searchsorted(beats, begin))
    high = min(int(np.searchsorted(beats, end)), len(moves))
    if low >= high:
        return None
    inside, uses = moves[low:high], _uses(program, moves)
    shown = np.unique(program.stretches(inside)[0])
    if not (uses[shown] > 1).any():
        return None
    price = np.asarray(program.costs.usage * (uses - _uses(program, inside)), np.float64)
    first, last = int(beats[low]), int(beats[high])
    after = program.at_the_end
    if high < len(moves):
        after = program.arrive_before(moves[high][1], _to_next_transition(program, moves, high))
    part = program.solve(first, last, after={last: after}, price=price)
    arrived = (program.ends(moves[low - 1])[1], program.beats_stayed(moves[:low])) if low else None
    new = program.decode(part, first=first, last=last, arrived=arrived, starts=starts, price=price)
    return moves[:low] + new + moves[high:]


def _to_next_transition(program: PathProgram, moves: list[Move], index: int) -> int | None:
    """Music beats from a move's start to the next transition after it; None where none follows."""
    for before, after in itertools.pairwise(moves[index:]):
        if program.ends(before)[1] != after[1]:
            return after[0] - moves[index][0]
    return None
