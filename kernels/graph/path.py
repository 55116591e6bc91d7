"""The best way through the motion graph for one song: a dynamic program over its beats.

After the search of [Xu2015] (equations 23 to 26), with every start as a source of one program instead of one program a
start, transitions that take no time, and costs for warp, half- and double-time, and repetition.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from kernels.graph.costs import PathCosts, is_within, rough_cost, usage_cost, weight_scale
from kernels.graph.program import Move, PathProgram, StepPrice
from kernels.graph.repetition import spread
from kernels.types import Choreography, Float, Int, MotionGraph
from kernels.warp import warp_cost

Mask = NDArray[np.bool_]

STEPS: tuple[tuple[int, int], ...] = ((1, 1), (2, 1), (1, 2))
"""Kinds of step, motion beats over music beats: beat on beat, double-time, half-time. By convention of dancers; the
first alone is in [Xu2015]."""


class InfeasiblePathError(ValueError):
    """No dance reaches the last beat.

    Parameters
    ----------
    beat_index : int
        Music beat where nothing goes on: no dance reaches a later one, or none starts (0).
    time_s : float, seconds of the song
    reason : "no_nodes", "no_start", "tempo" or "no_transition"
    message : str, what stopped it and what would help
    """

    def __init__(self, *, beat_index: int, time_s: float, reason: str, message: str) -> None:
        super().__init__(message)
        self.beat_index, self.time_s, self.reason = beat_index, time_s, reason


@dataclass(frozen=True, eq=False)
class Path:
    """Steps that cover every music interval once, in order.

    Parameters
    ----------
    source_node, end_node : (S,) int64
        The step dances from the one to the other, along one clip.
    beat_index : (S,) int64, music beat where it starts
    beat_span, motion_span : (S,) int64, >= 1, music and motion beats it covers
    has_transition : (S,) bool
        Whether it does not start where the step before ended.
    transition_cost, stay_cost, warp_cost, repetition_cost, stride_cost, beat_cost, diversity_cost, wish_cost :
        (S,) float64, >= 0
    warp_ratio : (S,) float64, song time ÷ clip time
    is_outside : (S,) bool, whether the ratio leaves the hard bounds
    """

    source_node: Int
    end_node: Int
    beat_index: Int
    beat_span: Int
    motion_span: Int
    has_transition: Mask
    transition_cost: Float
    stay_cost: Float
    warp_cost: Float
    repetition_cost: Float
    stride_cost: Float
    beat_cost: Float
    diversity_cost: Float
    wish_cost: Float
    warp_ratio: Float
    is_outside: Mask

    @property
    def total_cost(self) -> float:
        """Sum of all components over all steps."""
        parts = (
            self.transition_cost,
            self.stay_cost,
            self.warp_cost,
            self.repetition_cost,
            self.stride_cost,
            self.beat_cost,
            self.diversity_cost,
            self.wish_cost,
        )
        return float(sum(part.sum() for part in parts))


def find_path(
    graph: MotionGraph,
    beat_s: Float,
    *,
    costs: PathCosts | None = None,
    steps: tuple[tuple[int, int], ...] = STEPS,
    starts: Literal["first", "any"] | Int = "first",
    admissible: Mask | None = None,
    rounds: int = 3,
    strict: bool = False,
    stretch_price: Float | None = None,
    interval_price: Float | None = None,
    step_price: StepPrice | None = None,
) -> Path:
    """Find the cheapest dance for a song.

    Parameters
    ----------
    graph : MotionGraph of N nodes
    beat_s : (K + 1,) float, seconds, strictly increasing
        Music beats; the dance covers the K intervals between them.
    costs : PathCosts, or None for the defaults
    steps : kinds of step (m, d), m motion beats danced over d music beats, each >= 1, none twice
    starts : "first" (the first beat of every clip), "any", or (M,) int64 nodes
    admissible : (K, N) bool or None
        Whether music interval k may be danced with a step that starts at the node. None admits everything.
    rounds : int, >= 0
        How often a dance is made to spread repetition; 0 prices it within the program only.
    strict : bool
        Refuse a dance that leaves the hard warp bounds anywhere.
    stretch_price : (N,) float, >= 0, or None
        Price of dancing from a node to the next, each time: what makes a second dance differ from a first.
    interval_price : (K, N) float, >= 0, or None
        Price of dancing music interval k with a step that starts at the node: soft wishes.
    step_price : StepPrice or None
        Price of single steps, by music beat and kind; infinite forbids.

    Returns
    -------
    Path; without steps when there is no music interval

    Raises
    ------
    InfeasiblePathError
        If no dance reaches the last beat, or with ``strict`` none within the hard bounds: at which music beat nothing
        goes on, why, and what would help.
    ValueError
        If an argument is out of range.

    Notes
    -----
    *Program* (:mod:`kernels.graph.program`): exact, all starts at once, K · (M · N · |steps| + E) operations with M
    beats of a stay that is long enough, K · (M + 1) · N numbers kept. It runs from the last beat backwards, so that
    only nodes from which the last beat can still be reached ever have a cost: this loses fewer clips than pruning it
    to its strongly connected part, which forbids one-way streets even where the song ends before they do. Ties: no
    transition before any, then the lower clip and node, then the earlier kind.

    *Hard bounds.* Steps outside them are considered only when no dance stays inside; then the fewest possible are
    used, before any other cost counts, and ``is_outside`` tells which. Outside the last-resort bounds never.

    *Repetition.* Going back to what was just danced costs within the program (``jump_back``). How often a stretch is
    shown in the whole dance is no sum over steps, so no program of this size can price it: :mod:`repetition
    <kernels.graph.repetition>` improves the exact path without it, and the cheapest by total cost, repetition included,
    is returned.
    """
    costs = PathCosts() if costs is None else costs
    beat_s = np.asarray(beat_s, np.float64)
    n_nodes, n_beats = len(graph.clip_index), max(len(beat_s) - 1, 0)
    if beat_s.ndim != 1 or not np.isfinite(beat_s).all() or not (np.diff(beat_s) > 0).all():
        raise ValueError("beat_s: want finite, strictly increasing seconds; sort the beats and drop repeats")
    if not steps or len(set(steps)) != len(steps) or min(min(step) for step in steps) < 1:
        raise ValueError(f"steps: want different pairs (motion beats, music beats), each >= 1, got {steps}")
    if admissible is not None and admissible.shape != (n_beats, n_nodes):
        raise ValueError(f"admissible: want ({n_beats}, {n_nodes}), got {admissible.shape}")
    if stretch_price is not None and not (stretch_price.shape == (n_nodes,) and (stretch_price >= 0).all()):
        raise ValueError(f"stretch_price: want ({n_nodes},), >= 0, got {stretch_price.shape}")
    if interval_price is not None and not (interval_price.shape == (n_beats, n_nodes) and (interval_price >= 0).all()):
        raise ValueError(f"interval_price: want ({n_beats}, {n_nodes}), >= 0, got {interval_price.shape}")
    if rounds < 0:
        raise ValueError(f"rounds: want >= 0, got {rounds}")
    start = _starts(graph, starts)
    if n_beats == 0:
        return _evaluate(None, [], costs, graph)
    most = more_than_any(
        graph,
        beat_s,
        costs=costs,
        steps=steps,
        stretch_price=stretch_price,
        interval_price=interval_price,
        step_price=step_price,
    )
    for bounds, price in ((costs.hard_ratio, 0.0), (costs.last_resort_ratio, most)):
        program = PathProgram(
            graph,
            beat_s,
            steps=steps,
            costs=costs,
            admissible=admissible,
            bounds=bounds,
            outside_price=price,
            stretch_price=stretch_price,
            interval_price=interval_price,
            step_price=step_price,
        )
        whole = program.solve(0, n_beats, after={n_beats: program.at_the_end})
        if len(start) and np.isfinite(whole.start[0][start]).any():
            moves = program.decode(whole, first=0, last=n_beats, arrived=None, starts=start)

            def total(candidate: list[Move], program: PathProgram = program) -> float:
                path = _evaluate(program, candidate, costs, graph)
                return path.total_cost + most * int(path.is_outside.sum())

            return _evaluate(program, spread(program, whole, moves, start, rounds, total), costs, graph)
        if strict:
            break
    raise _explain(program, start, bounds)


def to_choreography(
    path: Path, graph: MotionGraph, *, beat_s: Float, clip_ids: tuple[str, ...], blend_s: float
) -> Choreography:
    """Write a path as the record that the assembler reads.

    Parameters
    ----------
    path : Path through ``graph``
    beat_s : (K + 1,) float, seconds, the beats it was found for
    clip_ids : name of each clip index
    blend_s : float, seconds of song, >= 0, width of a seam's blend

    Returns
    -------
    Choreography, one row a step
    """
    return Choreography(
        clip_id=tuple(clip_ids[clip] for clip in graph.clip_index[path.source_node]),
        song_start_s=beat_s[path.beat_index],
        song_end_s=beat_s[path.beat_index + path.beat_span],
        clip_start_s=graph.time_s[path.source_node],
        clip_end_s=graph.time_s[path.end_node],
        has_seam=path.has_transition,
        blend_s=np.where(path.has_transition, blend_s, 0.0),
    )


def first_beats(graph: MotionGraph) -> Int:
    """First beat of every clip, in order: nodes that no other leads to within its clip."""
    return np.setdiff1d(np.arange(len(graph.clip_index)), graph.next_node)


def _starts(graph: MotionGraph, starts: Literal["first", "any"] | Int) -> Int:
    n = len(graph.clip_index)
    if isinstance(starts, str):
        if starts == "any":
            return np.arange(n)
        if starts == "first":
            return first_beats(graph)
        raise ValueError(f"starts: want 'first', 'any' or nodes, got {starts!r}")
    nodes = np.unique(np.asarray(starts, np.int64))
    if len(nodes) and (nodes[0] < 0 or nodes[-1] >= n):
        raise ValueError(f"starts: want 0 <= node < {n}, got {nodes[0]} to {nodes[-1]}")
    return nodes


def more_than_any(
    graph: MotionGraph,
    beat_s: Float,
    *,
    costs: PathCosts,
    steps: tuple[tuple[int, int], ...] = STEPS,
    stretch_price: Float | None = None,
    interval_price: Float | None = None,
    step_price: StepPrice | None = None,
) -> float:
    """Price a step outside the hard bounds: more than any path can cost, repetition included.

    Parameters
    ----------
    graph, beat_s, costs, steps, stretch_price, interval_price, step_price : as :func:`find_path` has them

    Returns
    -------
    float, > 0
    """
    n_beats = len(beat_s) - 1
    longest = max(m for m, _ in steps)
    warp = float(warp_cost(np.array(costs.last_resort_ratio), costs.warp_weights).max())
    stride = max(costs.stride * abs(float(np.log2(m / d))) for m, d in steps)
    largest = float(graph.weight.max(initial=0.0))
    roughest = float(rough_cost(graph, costs).max(initial=0.0))
    seam = (
        costs.seam + costs.transition * largest / weight_scale(graph, costs) + roughest + costs.jump_back + costs.stay
    )
    missed = costs.missed_beat * max(d for _, d in steps)
    most = 1.0 + n_beats * (warp + stride + seam + missed + longest * costs.usage * n_beats * longest)
    if stretch_price is not None and stretch_price.size:
        most += n_beats * longest * float(stretch_price.max())
    if interval_price is not None and interval_price.size:
        most += n_beats * float(interval_price.max())
    for price in (step_price or {}).values():
        most += float(price[np.isfinite(price)].max(initial=0.0))
    return most


def _evaluate(program: PathProgram | None, moves: list[Move], costs: PathCosts, graph: MotionGraph) -> Path:
    """Price a row of moves step by step."""
    beat, source, kind = (np.array([move[i] for move in moves], np.int64) for i in range(3))
    if program is None or not moves:
        none, no = np.zeros(0, np.int64), np.zeros(0, bool)
        zero = np.zeros(0)
        return Path(none, none, none, none, none, no, zero, zero, zero, zero, zero, zero, zero, zero, zero, no)
    span = np.array([d for _, d in program.steps])[kind]
    end = np.array([program.end[k][u] for _, u, k in moves], np.int64)
    seams = np.append(False, source[1:] != end[:-1])
    edge = np.array([program.edge(v, u) for v, u in zip(end[:-1][seams[1:]], source[seams], strict=True)], np.int64)
    transition, repetition = np.zeros(len(moves)), np.zeros(len(moves))
    transition[seams], repetition[seams] = program.seam[edge], program.jump_back[edge]
    stay = np.zeros(len(moves))
    stay[seams] = program.hurry[np.minimum(np.diff(beat[seams], prepend=0), program.long_enough) - 1]
    shown, shown_by = program.stretches(moves)
    np.add.at(repetition, shown_by, usage_cost(shown, program.n_nodes, costs))
    diversity = np.zeros(len(moves))
    np.add.at(diversity, shown_by, program.price[shown])
    ratio = (program.beat_s[beat + span] - program.beat_s[beat]) / (graph.time_s[end] - graph.time_s[source])
    stride = np.array([program.stride[k] for k in kind])
    return Path(
        source_node=source,
        end_node=end,
        beat_index=beat,
        beat_span=span,
        motion_span=np.array([m for m, _ in program.steps])[kind],
        has_transition=seams,
        transition_cost=transition,
        stay_cost=stay,
        warp_cost=warp_cost(ratio, costs.warp_weights),
        repetition_cost=repetition,
        stride_cost=stride,
        beat_cost=np.array([program.missed[k][u] for _, u, k in moves]),
        diversity_cost=diversity,
        wish_cost=np.array([program.wish_cost(k, i, np.array([u]))[0] for k, u, i in moves]),
        warp_ratio=ratio,
        is_outside=~is_within(ratio, costs.hard_ratio),
    )


def _explain(program: PathProgram, start: Int, bounds: tuple[float, float]) -> InfeasiblePathError:
    """Say where and why no dance goes on, and what would help."""
    beat = program.furthest(start)
    time_s, last = float(program.beat_s[beat]), program.n_beats
    where = f"path: want a dance to music beat {last:.0f}, got none past beat {beat} ({time_s:.2f} s)"
    here = [(kind, program.step_cost(beat, kind)) for kind in range(len(program.steps))]
    if program.n_nodes == 0:
        reason, why = "no_nodes", "the motion graph has no node; add clips in which beats are found"
    elif len(start) == 0:
        reason, why = "no_start", "no node may begin; give starts"
    elif any(cost is not None and np.isfinite(cost).any() for _, cost in here):
        reason, why = (
            "no_transition",
            "clips that fit the song's tempo there cannot be reached: no transition leads from where the dances so far "
            "end; add clips, raise the graph's threshold, or let the dance begin anywhere",
        )
    else:
        reason, why = "tempo", _tempo(program, beat, bounds)
    return InfeasiblePathError(beat_index=beat, time_s=time_s, reason=reason, message=f"{where}: {why}")


def _tempo(program: PathProgram, beat: int, bounds: tuple[float, float]) -> str:
    """Compare the song's beats with what the clips can cover."""
    spans = []
    for (m, d), clip_s in zip(program.steps, program.clip_s, strict=True):
        clip_s = clip_s[np.isfinite(clip_s)]
        if beat + d <= program.n_beats and len(clip_s):
            low, high = bounds[0] * clip_s.min(), bounds[1] * clip_s.max()
            song_s = program.beat_s[beat + d] - program.beat_s[beat]
            spans.append(f"{d} music beats last {song_s:.3f} s, {m} motion beats can last {low:.3f} to {high:.3f} s")
    found = "; ".join(spans) if spans else "no clip has as many beats as a step needs"
    return (
        f"no clip fits the song's tempo (or is admitted) at warp {bounds[0]:g} to {bounds[1]:g}: {found}; add clips "
        "nearer to this tempo, set beats.octave in the song's brief, or widen the bounds"
    )
