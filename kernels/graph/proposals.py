"""What could be danced at a moment of a song, and what it would cost: the candidates shown to a director.

After the candidate presentation unit of JP5778523B2. A forward and a backward pass of the dynamic program
(:mod:`kernels.graph.program`) meet in every step that covers the moment: their sum is the exact price of the cheapest
dance that takes the step there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kernels.graph.program import Program, Solution
from kernels.types import Float, Int

Mask = NDArray[np.bool_]


class Proposals:
    """A solved song that is asked what it would cost to dance something else at a moment.

    Parameters
    ----------
    program : Program of K music intervals and N nodes, with all that is fixed (pins, bounds, prices)
    starts : (M,) int64, nodes that may begin

    Notes
    -----
    Showing a stretch again (``usage``) has no price here: it is no sum over steps, so no program holds it. All other
    prices are those of :func:`kernels.graph.path.find_path`.
    """

    def __init__(self, program: Program, starts: Int) -> None:
        self._program, self._starts = program, starts
        n = program.n_beats
        self._whole: Solution = program.solve(0, n, after={n: np.zeros(program.n_nodes)})
        self._extra = program.stretch_price(None)
        self._source, self._target, self._edge_cost = program.transitions
        self._ready: list[Float] = []
        self._arrived = [np.full(program.n_nodes, np.inf) for _ in range(n + 1)]

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
        through = np.full(self._program.n_nodes, np.inf)
        for beat, kind, span in self._covering(interval):
            arrive = self._whole.arrive[beat + span]
            np.minimum(through, self._forward(beat) + self._step(beat, kind, arrive), out=through)
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
            start = np.full(program.n_nodes, np.inf)
            for kind, (_, span) in enumerate(program.steps):
                if beat + span in arrive:
                    np.minimum(start, self._step(beat, kind, arrive[beat + span]), out=start)
            arrive[beat] = program.relax(np.where(nodes, start, np.inf))
        best = np.inf
        for beat, kind, span in self._covering(first):
            total = self._forward(beat) + self._step(beat, kind, arrive[beat + span])
            best = min(best, float(total[nodes].min(initial=np.inf)))
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

    def _step(self, beat: int, kind: int, arrive: Float) -> Float:
        """Cost to go of a kind of step at a beat, by the node where it starts."""
        cost = self._program.step_cost(beat, kind)
        if cost is None:
            return np.full(self._program.n_nodes, np.inf)
        end = self._program.end[kind]
        return np.where(end >= 0, cost + self._extra[kind] + arrive[end], np.inf)

    def _forward(self, beat: int) -> Float:
        """Cost so far of being ready to start a step at a beat, by node; made as far as it is asked for."""
        program = self._program
        while len(self._ready) <= beat:
            at = len(self._ready)
            ready = self._arrived[at].copy()
            if at == 0:
                ready[self._starts] = 0.0
            elif len(self._source):
                np.minimum.at(ready, self._target, self._arrived[at][self._source] + self._edge_cost)
            self._ready.append(ready)
            for kind, (_, span) in enumerate(program.steps):
                cost = program.step_cost(at, kind)
                if cost is None:
                    continue
                end = program.end[kind]
                goes = np.flatnonzero((end >= 0) & np.isfinite(cost) & np.isfinite(ready))
                total = ready[goes] + cost[goes] + self._extra[kind][goes]
                np.minimum.at(self._arrived[at + span], end[goes], total)
        return self._ready[beat]
