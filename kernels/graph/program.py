"""The dynamic program: cost to go from every node at every beat of the song.

Conventions
-----------
K music intervals between the beats g_0 < … < g_K. A *step* (m, d) begins at node u on beat k, dances m motion beats of
u's clip and ends on beat k + d. A *stay* lasts from one transition to the next; r counts the music beats since the last
one, up to M, where a stay is long enough. Two costs to go::

    start[r, k, u]  = min over steps of  cost(k, u, step) + price(u, step) + arrive[r + d, k + d, u after m beats]
    arrive[r, k, v] = min(start[r, k, v], stay_cost(r) + min over transitions v → u of  cost(v → u) + start[0, k, u])

with r + d taken as M where it is more. The inner minimum does not depend on r, so a beat costs M · N · |steps| + E
operations, not M · E. The first stay begins with the song (r = 0); the last may end with it however short it is.

A cost is finite exactly where the last beat can still be reached: the recursion runs backwards, so it *is* the backward
reachability, and a decoded path can only use such nodes. No state exists for a step that is outside the bounds, or for
one that ``admissible`` forbids.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.graph.costs import (
    PathCosts,
    beat_cost,
    hurry_cost,
    is_within,
    jump_back_cost,
    rough_cost,
    stride_cost,
    transition_cost,
)
from kernels.types import Float, Int, MotionGraph
from kernels.warp import warp_cost

Mask = NDArray[np.bool_]
Move = tuple[int, int, int]
"""One step of a path: music beat, node, index of the kind of step."""

StepPrice = Mapping[tuple[int, int], Float]
"""By music beat and kind of step, (N,) by the node where the step starts: its price, infinite where it is forbidden."""


@dataclass(frozen=True, eq=False)
class Solution:
    """Costs to go of the beats of a window, by beat; float64, infinite where there is no way on.

    Parameters
    ----------
    start : by beat, (N,), of starting a step right after a transition, or where the song begins
    arrive : by beat, (M, N), of having arrived with 1, 2, … M music beats since the last transition
    """

    start: Mapping[int, Float]
    arrive: Mapping[int, Float]


def step_ends(graph: MotionGraph, steps: Sequence[tuple[int, int]]) -> list[Int]:
    """Node where each kind of step (m, d) ends by the one where it starts, (N,) each; -1 where its clip is over."""
    ends = []
    for motion_beats, _ in steps:
        end = np.arange(len(graph.clip_index))
        for _ in range(motion_beats):
            end = np.where(end >= 0, graph.next_node[end], -1)
        ends.append(end)
    return ends


class PathProgram:
    """A graph, a song and prices, made ready.

    Parameters
    ----------
    graph : MotionGraph of N nodes
    beat_s : (K + 1,) float64, seconds, strictly increasing
    steps : kinds of step (m, d), motion beats and music beats, each >= 1
    costs : PathCosts
    admissible : (K, N) bool or None
        Whether music interval k may be danced with a step that starts at the node; a step must be admitted in every
        interval that it covers. None admits all.
    bounds : (low, high), warp ratios allowed
    outside_price : float, >= 0
        Added to a step outside the hard bounds: larger than any path costs otherwise, it makes their number the first
        thing to be minimised.
    stretch_price : (N,) float64, >= 0, or None
        Added to every stretch between a node and the next, whenever it is danced.
    interval_price : (K, N) float, >= 0, or None
        Added where music interval k is danced with a step that starts at the node.
    step_price : StepPrice
        Added to single steps.
    """

    def __init__(
        self,
        graph: MotionGraph,
        beat_s: Float,
        *,
        steps: tuple[tuple[int, int], ...],
        costs: PathCosts,
        admissible: Mask | None,
        bounds: tuple[float, float],
        outside_price: float,
        stretch_price: Float | None = None,
        interval_price: Float | None = None,
        step_price: StepPrice | None = None,
    ) -> None:
        self.graph, self.beat_s, self.steps, self.costs = graph, beat_s, steps, costs
        self.n_nodes, self.n_beats = len(graph.clip_index), len(beat_s) - 1
        self._admissible, self._bounds, self._outside_price = admissible, bounds, outside_price
        order = np.lexsort((graph.target, graph.source))
        self._source, self._target = graph.source[order], graph.target[order]
        self.seam = (transition_cost(graph, costs) + rough_cost(graph, costs))[order]
        self.jump_back = jump_back_cost(graph, costs)[order]
        self._edge_cost = self.seam + self.jump_back
        self._leaving, self._first_edge = np.unique(self._source, return_index=True)
        self._edge_of = np.searchsorted(self._source, np.arange(self.n_nodes + 1))
        self.stride = [stride_cost(m, d, costs) for m, d in steps]
        self.end = step_ends(graph, steps)
        self.clip_s = [np.where(end >= 0, graph.time_s[end] - graph.time_s, np.inf) for end in self.end]
        self._interval_price = interval_price
        self._step_price = {} if step_price is None else step_price
        self.price = np.zeros(self.n_nodes) if stretch_price is None else stretch_price
        self.missed = [beat_cost(graph, end, d, costs) for end, (_, d) in zip(self.end, steps, strict=True)]
        self.hurry = hurry_cost(costs)
        self.long_enough = len(self.hurry)

    @property
    def transitions(self) -> tuple[Int, Int, Float]:
        """Source, target and cost of every transition, sorted by source, then target; (E,) each."""
        return self._source, self._target, self._edge_cost

    def step_cost(self, beat: int, kind: int, nodes: Int | slice = slice(None)) -> Float | None:
        """Cost of a kind of step at a beat, one a node: warp, stride, missed beats; infinite where it cannot be danced.

        None where the step would pass the last beat.
        """
        music_beats = self.steps[kind][1]
        if beat + music_beats > self.n_beats:
            return None
        ratio = (self.beat_s[beat + music_beats] - self.beat_s[beat]) / self.clip_s[kind][nodes]
        fits = is_within(ratio, self._bounds)
        if self._admissible is not None:
            fits &= self._admissible[beat : beat + music_beats, nodes].all(axis=0)
        cost = np.full(ratio.shape, np.inf)
        cost[fits] = (
            warp_cost(ratio[fits], self.costs.warp_weights) + self.stride[kind] + self.missed[kind][nodes][fits]
        )
        if self._interval_price is not None or self._step_price:
            cost += self.wish_cost(beat, kind, nodes)
        if self._outside_price:
            cost[fits & ~is_within(ratio, self.costs.hard_ratio)] += self._outside_price
        return cost

    def wish_cost(self, beat: int, kind: int, nodes: Int | slice = slice(None)) -> Float:
        """Price of a kind of step by what is wished of its music intervals and of itself; zeros where nothing is."""
        cost = np.zeros(len(np.arange(self.n_nodes)[nodes]))
        if self._interval_price is not None:
            cost += self._interval_price[beat : beat + self.steps[kind][1], nodes].sum(axis=0)
        if (beat, kind) in self._step_price:
            cost += self._step_price[beat, kind][nodes]
        return cost

    @property
    def at_the_end(self) -> Float:
        """Cost to go on arrival at the song's last beat: none, (M, N)."""
        return np.zeros((self.long_enough, self.n_nodes))

    def relax(self, start: Float) -> Float:
        """Cost on arrival, (M, N), from the costs (M + 1, N) of starting a step: with the best transition, or none."""
        arrive = start[1:].copy()
        if len(self._source):
            best = np.minimum.reduceat(self._edge_cost + start[0][self._target], self._first_edge)
            jump = self.hurry[:, None] + best
            arrive[:, self._leaving] = np.minimum(arrive[:, self._leaving], jump)
        return arrive

    def arrive_before(self, node: int, stay: int | None) -> Float:
        """Cost of going on as a known dance does, by how and where the step before ended, (M, N).

        Parameters
        ----------
        node : where its next step starts
        stay : music beats from there to its next transition; None where there is none before the song ends
        """
        cost = np.full((self.long_enough, self.n_nodes), np.inf)
        edge = np.flatnonzero(self._target == node)
        since = np.arange(1, self.long_enough + 1)
        cost[:, self._source[edge]] = self.hurry[:, None] + self._edge_cost[edge] + self.hurried(0, stay)
        cost[:, node] = [self.hurried(int(r), stay) for r in since]
        return cost

    def hurried(self, since: int, stay: int | None) -> float:
        """Price of the transition that ends a stay, ``stay`` beats on from ``since``; 0 for None, the song's end."""
        return 0.0 if stay is None else float(self.hurry[min(since + stay, self.long_enough) - 1])

    def start_costs(self, beat: int, arrive: Mapping[int, Float], extra: list[Float]) -> Float:
        """Cost of starting a step at a beat, (M + 1, N), from those on arrival: for r = 0, 1, … M beats of stay."""
        start = np.full((self.long_enough + 1, self.n_nodes), np.inf)
        for kind, (_, music_beats) in enumerate(self.steps):
            if beat + music_beats in arrive:
                np.minimum(start, self.step_total(beat, kind, arrive[beat + music_beats], extra), out=start)
        return start

    def step_total(self, beat: int, kind: int, arrive: Float, extra: list[Float]) -> Float:
        """Cost to go of starting one kind of step at a beat, (M + 1, N), from those (M, N) where it ends."""
        start = np.full((self.long_enough + 1, self.n_nodes), np.inf)
        cost = self.step_cost(beat, kind)
        if cost is not None:
            fits = np.flatnonzero(np.isfinite(cost))
            total = (cost + extra[kind])[fits] + arrive[:, self.end[kind][fits]]
            start[:, fits] = total[self.stayed_after(kind)]
        return start

    def stayed_after(self, kind: int) -> Int:
        """Row of ``arrive`` that a kind of step leads to from each row of the costs of starting it, (M + 1,)."""
        stayed = np.arange(self.long_enough + 1) + self.steps[kind][1]
        return np.asarray(np.minimum(stayed, self.long_enough) - 1, np.int64)

    def solve(self, first: int, last: int, *, after: Mapping[int, Float], price: Float | None = None) -> Solution:
        """Run the recursion over the beats first <= k < last.

        Parameters
        ----------
        first, last : int, 0 <= first <= last <= K
        after : by beat >= last, (M, N) float64, cost to go on arrival there; a beat left out cannot be stepped onto
        price : (N,) float64 or None
            Added to every stretch between a node and the next, beside the program's own.

        Returns
        -------
        Solution; ``arrive`` has the beats of ``after`` too
        """
        start: dict[int, Float] = {}
        arrive: dict[int, Float] = dict(after)
        extra = self.stretch_price(price)
        for beat in range(last - 1, first - 1, -1):
            ready = self.start_costs(beat, arrive, extra)
            arrive[beat] = self.relax(ready)
            start[beat] = ready[0].copy()
        return Solution(start, arrive)

    def decode(
        self,
        solution: Solution,
        *,
        first: int,
        last: int,
        arrived: tuple[int, int] | None,
        starts: Int,
        price: Float | None = None,
    ) -> list[Move]:
        """Walk a solution forwards from beat ``first`` until a step ends on or after beat ``last``.

        Parameters
        ----------
        arrived : node where the step before ended and :meth:`beats_stayed` there, or None at the song's first beat:
            then one of ``starts`` begins
        price : as given to :meth:`solve`

        Returns
        -------
        The moves, in order. Of equal costs: no transition before any, then the lower node, then the earlier kind.
        """
        extra = self.stretch_price(price)
        beat, moves = first, []

        def step(node: int, stayed: int) -> tuple[int, float]:
            kind, best = -1, np.inf
            for option, (_, music_beats) in enumerate(self.steps):
                to = beat + music_beats
                cost = self.step_cost(beat, option, np.array([node])) if to in solution.arrive else None
                if cost is not None and np.isfinite(cost[0]):
                    after = solution.arrive[to][self.stayed_after(option)[stayed], self.end[option][node]]
                    total = cost[0] + extra[option][node] + after
                    if total < best:
                        kind, best = option, total
            return kind, best

        if arrived is None:
            node, stayed = int(starts[np.argmin(solution.start[first][starts])]), 0
        else:
            node, stayed = arrived
        is_free = arrived is None  # the song's first step has no transition before it
        while beat < last:
            kind, cost = step(node, stayed)
            edge = slice(self._edge_of[node], self._edge_of[node + 1])
            if not is_free and edge.start < edge.stop:
                jump = self._edge_cost[edge] + solution.start[beat][self._target[edge]]
                if self.hurry[stayed - 1] + jump.min() < cost:
                    node, stayed = int(self._target[edge][np.argmin(jump)]), 0
                    kind, _ = step(node, stayed)
            moves.append((beat, node, kind))
            is_free = False
            stayed = min(stayed + self.steps[kind][1], self.long_enough)
            beat, node = self.ends(moves[-1])
        return moves

    def beats_stayed(self, moves: list[Move]) -> int:
        """Music beats from the last transition of a dance so far, or from its start, to its end; at most M."""
        stayed = 0
        for index in range(len(moves) - 1, -1, -1):
            stayed += self.steps[moves[index][2]][1]
            if stayed >= self.long_enough or (index and self.ends(moves[index - 1])[1] != moves[index][1]):
                break
        return min(stayed, self.long_enough)

    def ends(self, move: Move) -> tuple[int, int]:
        """Beat and node where a move ends."""
        beat, node, kind = move
        return beat + self.steps[kind][1], int(self.end[kind][node])

    def stretch_price(self, price: Float | None) -> list[Float]:
        """Sum the prices of the stretches of each kind of step, the program's own and these: one (N,) a kind."""
        price = self.price if price is None else self.price + price
        prices = []
        for motion_beats, _ in self.steps:
            total, node = np.zeros(self.n_nodes), np.arange(self.n_nodes)
            for _ in range(motion_beats):
                total += price[node]
                node = np.where(self.graph.next_node[node] >= 0, self.graph.next_node[node], node)
            prices.append(total)
        return prices

    def stretches(self, moves: list[Move]) -> tuple[Int, Int]:
        """First nodes of the stretches danced, in order, and the index of the move of each."""
        node, move = [], []
        for index, (_, at, kind) in enumerate(moves):
            for _ in range(self.steps[kind][0]):
                node.append(at)
                move.append(index)
                at = int(self.graph.next_node[at])
        return np.array(node, np.int64), np.array(move, np.int64)

    def edge(self, source: int, target: int) -> int:
        """Index of a transition in :attr:`seam` and :attr:`jump_back`."""
        low, high = self._edge_of[source], self._edge_of[source + 1]
        return int(low + np.searchsorted(self._target[low:high], target))

    def furthest(self, starts: Int) -> int:
        """Last music beat that a dance from ``starts`` reaches; 0 when none begins."""
        arrived = np.zeros((self.n_beats + 1, self.n_nodes), bool)
        beat = 0
        for at in range(self.n_beats):
            ready = arrived[at].copy()
            ready[self._target[arrived[at][self._source]]] = True
            if at == 0:
                ready[starts] = True
            if not ready.any():
                continue
            beat = at
            for kind, (_, music_beats) in enumerate(self.steps):
                cost = self.step_cost(at, kind)
                if cost is not None:
                    arrived[at + music_beats][self.end[kind][ready & np.isfinite(cost)]] = True
        return self.n_beats if arrived[-1].any() else beat
