"""Pins: what a director wants danced when, kept as promises or refused with the smallest set that cannot be.

A pin admits some nodes in some music intervals; :func:`kernels.graph.path.find_path` then dances nothing else there.
Whether pins can be kept asks for no prices, only for reachability, so a whole song is answered in milliseconds and
sets of pins can be tried one after the other.

[Xu2015] gives labelled beats a soft attribute value instead (equations 23 to 26): a dance may ignore it when a seam
costs more.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from kernels.graph.costs import PathCosts
from kernels.graph.path import STEPS
from kernels.graph.program import PathProgram, StepPrice
from kernels.types import Float, Int, MotionGraph

Mask = NDArray[np.bool_]

FURTHEST_SHIFT = 16
"""Beats by which a way out may move a pin. Chosen by hand: four bars of four."""


@dataclass(frozen=True, eq=False)
class Pin:
    """What may be danced in a stretch of the song.

    Parameters
    ----------
    name : how a person calls it
    first, last : int, music intervals first <= k < last
    nodes : (N,) bool, where a step in those intervals may start
    steps : StepPrice
        What single steps pay for keeping the pin; infinite where they would not keep it.
    steps_at : the same for a pin that begins on another beat, or None where there is none

    Raises
    ------
    ValueError
        If the stretch is empty or begins before the song.
    """

    name: str
    first: int
    last: int
    nodes: Mask
    steps: StepPrice = field(default_factory=dict)
    steps_at: Callable[[int], StepPrice] | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.first < self.last:
            raise ValueError(f"{self.name}: want 0 <= first < last music interval, got {self.first} to {self.last}")

    def moved(self, beats: int) -> Pin:
        """Give the same wish some beats later."""
        first = self.first + beats
        steps = self.steps if self.steps_at is None else self.steps_at(first)
        return replace(self, first=first, last=self.last + beats, steps=steps)

    def sources(self, interval: int) -> Mask:
        """Nodes that a step which covers a music interval may start from, (N,) bool."""
        here = [
            np.isfinite(price) for (beat, kind), price in self.steps.items() if beat <= interval < beat + STEPS[kind][1]
        ]
        return self.nodes & np.any(here, axis=0) if here else self.nodes

    def instead(self, nodes: Mask) -> Pin:
        """Wish for steps from these nodes in the same place."""
        return replace(self, nodes=nodes, steps={}, steps_at=None)


@dataclass(frozen=True)
class WayOut:
    """A change of one pin that would do.

    Parameters
    ----------
    pin_index : int
    shift_beats : int, music beats later; 0 where the wish changes instead
    choice : name of what could be danced there instead, or ""
    """

    pin_index: int
    shift_beats: int
    choice: str


@dataclass(frozen=True)
class Conflict:
    """Why pins cannot be kept.

    Parameters
    ----------
    pin_index : the fewest pins that cannot be kept together, in the order given
    reason : "nothing" (no node is admitted), "tempo" (none fits the beats there within the bounds), "start" (none can
        be reached from the start in time, or the end from it), "same_time" (each can be kept, but no node is admitted
        by all of those that meet in one interval), or "path" (each can be kept, not all of them)
    ways_out : nearest first, at most one shift and one choice a pin; empty where none was found
    has_more : whether other pins conflict even without any one of these; ways out are then of this conflict alone
    """

    pin_index: tuple[int, ...]
    reason: str
    ways_out: tuple[WayOut, ...]
    has_more: bool = False


def admitted(pins: Sequence[Pin], n_intervals: int, n_nodes: int) -> Mask:
    """Which node may be danced in which music interval.

    Parameters
    ----------
    pins : in any order; where they overlap, all must hold
    n_intervals, n_nodes : int, K and N

    Returns
    -------
    (K, N) bool; all True without pins

    Raises
    ------
    ValueError
        If a pin lies beyond the song or admits other nodes than N.
    """
    mask = np.ones((n_intervals, n_nodes), bool)
    for pin in pins:
        if pin.last > n_intervals:
            raise ValueError(f"{pin.name}: want a place before music beat {n_intervals}, got {pin.first} to {pin.last}")
        if pin.nodes.shape != (n_nodes,):
            raise ValueError(f"{pin.name}: want ({n_nodes},) nodes, got {pin.nodes.shape}")
        mask[pin.first : pin.last] &= pin.nodes
    return mask


class Danceable(Protocol):
    """What answers whether pins can be kept; pins count in music intervals."""

    n_intervals: int

    def keeps(self, pins: Sequence[Pin]) -> bool:
        """Whether some dance of the whole song keeps all of these."""
        ...

    def fits(self, pin: Pin) -> bool:
        """Whether each interval of a pin has something that is admitted and in tempo, reached or not."""
        ...


def step_price(pins: Sequence[Pin]) -> StepPrice:
    """Sum what single steps pay for pins."""
    found: dict[tuple[int, int], Float] = {}
    for pin in pins:
        for place, price in pin.steps.items():
            found[place] = found[place] + price if place in found else price
    return found


class Reach:
    """Whether a dance of a song can keep pins: the reachability part of the path's program, asked many times.

    Parameters
    ----------
    graph : MotionGraph of N nodes
    beat_s : (K + 1,) float64, seconds, strictly increasing
    costs : PathCosts, for its bounds
    steps : kinds of step (m, d)
    starts : (M,) int64, nodes that may begin
    allowed : (N,) bool or None, nodes that may be danced at all; None allows every one

    Notes
    -----
    Bounds on the warp are the hard ones where the song can be danced within them at all, else the last-resort ones:
    pins never make a dance leave bounds that it keeps without them.
    """

    def __init__(
        self,
        graph: MotionGraph,
        beat_s: Float,
        *,
        costs: PathCosts,
        starts: Int,
        allowed: Mask | None = None,
        steps: tuple[tuple[int, int], ...] = STEPS,
    ) -> None:
        self._starts, self._steps = starts, steps
        self._allowed = np.ones(len(graph.clip_index), bool) if allowed is None else allowed
        self.n_intervals, self.n_nodes = len(beat_s) - 1, len(graph.clip_index)
        for self.bounds in (costs.hard_ratio, costs.last_resort_ratio):
            program = PathProgram(
                graph, beat_s, steps=steps, costs=costs, admissible=None, bounds=self.bounds, outside_price=0.0
            )
            self._source, self._target, self._end = graph.source, graph.target, program.end
            self._fits = [[self._fit(program, k, kind) for kind in range(len(steps))] for k in range(self.n_intervals)]
            self.is_danceable = self.keeps(())
            if self.is_danceable:
                break

    def _fit(self, program: PathProgram, beat: int, kind: int) -> Mask | None:
        cost = program.step_cost(beat, kind)
        return None if cost is None else np.isfinite(cost) & self._allowed

    def keeps(self, pins: Sequence[Pin]) -> bool:
        """Whether some dance of the whole song keeps all of these."""
        return bool(self.arrivals(pins)[-1].any())

    def arrivals(self, pins: Sequence[Pin]) -> Mask:
        """Nodes where a step may have ended by each beat, keeping the pins until then: (K + 1, N) bool."""
        mask, price = admitted(pins, self.n_intervals, self.n_nodes), step_price(pins)
        arrived = np.zeros((self.n_intervals + 1, self.n_nodes), bool)
        for beat, fits in enumerate(self._fits):
            ready = arrived[beat].copy()
            ready[self._target[arrived[beat][self._source]]] = True
            if beat == 0:
                ready[self._starts] = True
            if not ready.any():
                continue
            for kind, ((_, span), end, fit) in enumerate(zip(self._steps, self._end, fits, strict=True)):
                if fit is not None:
                    can = ready & fit & mask[beat : beat + span].all(axis=0)
                    if (beat, kind) in price:
                        can &= np.isfinite(price[beat, kind])
                    arrived[beat + span][end[can]] = True
        return arrived

    def fits(self, pin: Pin) -> bool:
        """Whether each interval of a pin has a node that is admitted and in tempo, reached or not."""
        for k in range(pin.first, pin.last):
            covered = False
            for start in range(max(k - max(d for _, d in self._steps) + 1, 0), k + 1):
                for kind, ((_, span), fit) in enumerate(zip(self._steps, self._fits[start], strict=True)):
                    if fit is not None and start + span > k:
                        is_shown = np.isfinite(pin.steps[start, kind]) if (start, kind) in pin.steps else True
                        covered |= bool((fit & pin.nodes & is_shown).any())
            if not covered:
                return False
        return True


def find_conflict(
    reach: Danceable, pins: Sequence[Pin], *, choices: Sequence[Mapping[str, Mask]] | None = None
) -> Conflict | None:
    """Find the fewest pins that cannot be kept together, and what would help.

    Parameters
    ----------
    reach : Danceable, of a song that can be danced without pins
    pins : as the director gave them
    choices : for each pin, other wishes to try in its place, by name: (N,) bool; the first that does is taken

    Returns
    -------
    Conflict, or None when all pins can be kept
        Of several smallest sets the first, pins in the order given.

    Notes
    -----
    A set that cannot be kept cannot be kept with more in it. So every conflict has one of the pins that a largest set
    which *can* be kept leaves out: the smallest conflict is a smallest set that hits all of what such sets leave out.
    Those are found one by one: the smallest set that hits all that is known either conflicts and is the answer, or
    grows to another set that can be kept [Ignatiev2015]. Trying all sets by size instead would take years for twenty
    pins that only together conflict.
    """
    if reach.keeps(pins):
        return None
    left_out: list[frozenset[int]] = []
    while True:
        smallest = _first_hitting(left_out)
        if not reach.keeps([pins[i] for i in smallest]):
            break
        kept = set(smallest)
        for index in range(len(pins)):
            if index not in kept and reach.keeps([pins[i] for i in sorted(kept | {index})]):
                kept.add(index)
        left_out.append(frozenset(range(len(pins))) - kept)
    without = [[other for i, other in enumerate(pins) if i != index] for index in smallest]
    return Conflict(
        smallest,
        _reason(reach, [pins[i] for i in smallest]),
        _ways_out(reach, pins, smallest, choices),
        not any(reach.keeps(rest) for rest in without),
    )


def _first_hitting(sets: Sequence[frozenset[int]]) -> tuple[int, ...]:
    """Find the smallest set that has a member of each, of several the first; in ascending order."""

    def hits(rest: Sequence[frozenset[int]], size: int) -> tuple[int, ...] | None:
        if not rest:
            return ()
        for first in sorted(frozenset().union(*rest)) if size else ():
            # What lies below the first one taken is no longer to be had.
            left = [frozenset(i for i in members if i > first) for members in rest if first not in members]
            more = hits(left, size - 1) if all(left) else None
            if more is not None:
                return (first, *more)
        return None

    return next(found for size in itertools.count() if (found := hits(sets, size)) is not None)


def _reason(reach: Danceable, pins: Sequence[Pin]) -> str:
    if len(pins) > 1:
        meet = range(max(pin.first for pin in pins), min(pin.last for pin in pins))
        is_empty = any(not np.all([pin.sources(k) for pin in pins], axis=0).any() for k in meet)
        return "same_time" if is_empty else "path"
    if not pins[0].nodes.any():
        return "nothing"
    return "start" if reach.fits(pins[0]) else "tempo"


def _ways_out(
    reach: Danceable, pins: Sequence[Pin], conflict: tuple[int, ...], choices: Sequence[Mapping[str, Mask]] | None
) -> tuple[WayOut, ...]:
    """Try to move each conflicting pin, nearest beats first, and to ask for something else there."""
    found: list[WayOut] = []
    for index in conflict:
        pin = pins[index]
        rest = [other for i, other in enumerate(pins) if i != index]
        if not reach.keeps(rest):  # another conflict is left: mend this one first
            rest = [pins[i] for i in conflict if i != index]
        if pin.nodes.any():
            for shift in sorted(range(-FURTHEST_SHIFT, FURTHEST_SHIFT + 1), key=lambda n: (abs(n), n)):
                first, last = pin.first + shift, pin.last + shift
                inside = shift and first >= 0 and last <= reach.n_intervals
                if inside and reach.keeps([*rest, pin.moved(shift)]):
                    found.append(WayOut(index, shift, ""))
                    break
        for name, nodes in (choices[index] if choices else {}).items():
            differs = not np.array_equal(nodes, pin.nodes)
            if differs and reach.keeps([*rest, pin.instead(nodes)]):
                found.append(WayOut(index, 0, name))
                break
    return tuple(sorted(found, key=lambda way: (way.choice != "", abs(way.shift_beats), way.pin_index)))
