"""What could be danced at a moment of a song, and what it would cost: the candidates shown to a director.

After the candidate presentation unit of [Xu2015]. A forward and a backward pass of the dynamic program
(:mod:`kernels.graph.program`) meet in every step that covers the moment: their sum is the exact price of the cheapest
dance that takes the step there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.graph.program import PathProgram, Solution
from kernels.types import Float, Int

Mask = NDArray[np.bool_]


class Proposals:
    """A solved song that is asked what it would cost to dance something else at a moment.

    Parameters
    ----------
    program : PathProgram of K music intervals and N nodes, with all that is fixed (pins, bounds, prices)
    starts : (M,) int64, nodes that may begin

    Notes
    -----
    Showing a stretch again (``usage``) has no price here: it is no sum over steps, so no program holds it. All other
    prices are those of :func:`kernels.graph.path.find_path`.
    """

    def __init__(self, program: PathProgram, starts: Int) -> None:
        self._program, self._starts = program, starts
        n = program.n_beats
        self._whole: Solution = program.solve(0, n, after={n: program.at_the_end})
        self._extra = program.stretch_price(None)
        self._source, self._target, self._edge_cost = program.transitions
        self._ready: list[Float] = []
        self._arrived: dict[int, Float] = {}

    @property
    def best_cost(self) -> float:
        """Cost of the cheapest dance; infinite where there is none."""
        start = self._whole.start.get(0)
        return float(start[self._starts].min(initial=np.inf)) if start is not None else np.inf

    def through(self, interval: int, nodes: Mask | None = None) -> Float:
        """Cost of the cheapest dance for each step that could cover a music interval.

        Parameters
        ----------
        interval : int, 0 <= interval < K
        nodes : (N,) bool or None
            Nodes such a step may start from; None for all.

        Returns
        -------
        (N,) float64
            By the node where the step starts; infinite where no dance has it.

        Raises
        ------
        ValueError
            If the interval is not in the song.
        """
        self._check(interval, interval + 1)
        program = self._program
        through = np.full(program.n_nodes, np.inf)
        for beat, kind, span in self._covering(interval):
            arrive = self._whole.arrive[beat + span]
            total = self._forward(beat) + program.step_total(beat, kind, arrive, self._extra)
            np.minimum(through, total.min(axis=0), out=through)
        return through if nodes is None else np.where(nodes, through, np.inf)

    def within(self, first: int, last: int, nodes: Mask) -> float:
        """Cost of the cheapest dance whose steps in some music intervals all start from some nodes.

        Parameters
        ----------
        first, last : int, 0 <= first < last <= K
            Music intervals first <= k < last; a step that reaches in from before or out behind counts.
        nodes : (N,) bool

        Returns
        -------
        float
            Infinite where there is no such dance.

        Raises
        ------
        ValueError
            If an interval is not in the song.
        """
        self._check(first, last)
        if last == first + 1:
            return float(self.through(first, nodes).min(initial=np.inf))
        program = self._program
        arrive: dict[int, Float] = {k: self._whole.arrive[k] for k in range(last, program.n_beats + 1)}
        for beat in range(last - 1, first, -1):
            arrive[beat] = program.relax(np.where(nodes, program.start_costs(beat, arrive, self._extra), np.inf))
        best = np.inf
        for beat, kind, span in self._covering(first):
            total = self._forward(beat) + program.step_total(beat, kind, arrive[beat + span], self._extra)
            best = min(best, float(total[:, nodes].min(initial=np.inf)))
        return best

    def _check(self, first: int, last: int) -> None:
        n = self._program.n_beats
        if not 0 <= first < last <= n:
            raise ValueError(f"first, last: want 0 <= first < last <= {n} music intervals, got {first} and {last}")

    def _covering(self, interval: int) -> Sequence[tuple[int, int, int]]:
        """List beat, kind and span of the steps that cover a music interval."""
        found = []
        for kind, (_, span) in enumerate(self._program.steps):
            for beat in range(max(interval - span + 1, 0), interval + 1):
                if beat + span <= self._program.n_beats:
                    found.append((beat, kind, span))
        return found

    def _forward(self, beat: int) -> Float:
        """Cost so far of being ready to start a step at a beat, (M + 1, N) by the beats of stay; made on demand."""
        program = self._program
        most = program.long_enough
        while len(self._ready) <= beat:
            at = len(self._ready)
            arrived = self._arrived.pop(at, np.full((most, program.n_nodes), np.inf))
            ready = np.vstack([np.full((1, program.n_nodes), np.inf), arrived])
            if at == 0:
                ready[0, self._starts] = 0.0
            elif len(self._source):
                left = (arrived + program.hurry[:, None]).min(axis=0)
                np.minimum.at(ready[0], self._target, left[self._source] + self._edge_cost)
            self._ready.append(ready)
            for kind, (_, span) in enumerate(program.steps):
                cost = program.step_cost(at, kind)
                if cost is None:
                    continue
                goes = np.flatnonzero(np.isfinite(cost) & np.isfinite(ready.min(axis=0)))
                total = ready[:, goes] + (cost + self._extra[kind])[goes]
                ends = program.end[kind][goes]
                here = self._arrived.setdefault(at + span, np.full((most, program.n_nodes), np.inf))
                for stayed, after in enumerate(program.stayed_after(kind)):
                    here[after, ends] = np.minimum(here[after, ends], total[stayed])
        return self._ready[beat]


@dataclass(frozen=True, eq=False)
class GroupPrices:
    """What it costs to dance nodes of each of G groups, (G,) each.

    Parameters
    ----------
    cost : float64, infinite where out of reach, or where not looked at
    node : int64, first node of the cheapest dance; -1 where not known
    is_left : bool, whether it was not looked at
    """

    cost: Float
    node: Int
    is_left: Mask


def price_groups(
    solved: Sequence[Proposals], first: int, last: int, group: Int, is_wanted: Mask, *, most: int
) -> GroupPrices:
    """Price dancing the nodes of each group in a stretch, by the first of some solved songs that can.

    Parameters
    ----------
    solved : Proposals of N nodes, the best first
    first, last : int, music intervals first <= k < last
    group : (N,) int64, 0 to G - 1
    is_wanted : (G,) bool
    most : int, >= 0
        Groups that each solved song prices over several intervals; the rest are left.

    Returns
    -------
    GroupPrices

    Notes
    -----
    Over several intervals each group takes a program of its own. The cheapest step in each interval is a bound that
    says which are worth it: those of the least bound, of equal ones the first.
    """
    n = len(is_wanted)
    prices = GroupPrices(np.full(n, np.inf), np.full(n, -1), np.zeros(n, bool))
    for proposals in solved:
        todo = is_wanted & np.isinf(prices.cost)
        bound = np.zeros(n)
        for interval in range(first, last):
            least, node = least_of_groups(proposals.through(interval), group, n)
            bound = np.maximum(bound, least)
        if last == first + 1:
            prices.cost[todo], prices.node[todo] = bound[todo], node[todo]
            continue
        likely = np.flatnonzero(todo & np.isfinite(bound))
        likely = likely[np.argsort(bound[likely], kind="stable")]
        for i in likely[:most].tolist():
            prices.cost[i] = proposals.within(first, last, group == i)
        prices.is_left[likely[most:]] = True
    prices.is_left[np.isfinite(prices.cost)] = False
    return prices


def least_of_groups(value: Float, group: Int, n_groups: int) -> tuple[Float, Int]:
    """Find the least value of each group.

    Parameters
    ----------
    value : (N,) float, not NaN
    group : (N,) int64, 0 to G - 1
    n_groups : int, G

    Returns
    -------
    least : (G,) float64, infinite for a group without values
    index : (G,) int64, the first that has it; -1 for none
    """
    order = np.lexsort((np.arange(len(group)), value, group))
    least, index = np.full(n_groups, np.inf), np.full(n_groups, -1)
    of, first = np.unique(group[order], return_index=True)
    least[of], index[of] = value[order[first]], order[first]
    return least, index
