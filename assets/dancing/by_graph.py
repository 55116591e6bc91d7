"""A dance through the motion graph, as its director wants it: pins, licences, alternatives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import polars as pl
from numpy.typing import NDArray

from assets.dancing import licences, wishes
from assets.dancing.asked import SOFT_WISH, Direction
from assets.dancing.avoided import AvoidedSpan, touched
from assets.dancing.chosen_steps import ChosenSteps, Markdown
from assets.dancing.method import DanceOrder, Method
from assets.dancing.pose_pins import ClipPoses, to_pose_pins
from assets.dancing.refusal import RefusalError
from assets.dancing.wishes import GRAPH_PARTS, DirectionError, Nodes, PartNames
from assets.plots.dance import phrase_table
from assets.reading.clips import read_clips
from assets.reading.songs import PlayedSong, played_song
from assets.stamps import Stored
from assets.tables.graph import to_motion_graph
from kernels.assembly.timing import blend_widths, trim
from kernels.graph.alternatives import find_alternatives, shared_ratio, shown_price
from kernels.graph.costs import PathCosts, intensity_price
from kernels.graph.path import STEPS, InfeasiblePathError, Path, find_path, first_beats, to_choreography
from kernels.graph.pin_conflicts import Conflict, Pin, Reach, admitted, find_conflict, step_price
from kernels.graph.program import StepPrice
from kernels.graph.structure import structure_pins
from kernels.graph.transitions import THRESHOLD
from kernels.types import Choreography, Float, Int, MotionGraph
from schemas.keys import is_mirrored, seen_label, source_clip
from schemas.settings import DanceSettings, PathSettings, Settings

POSE_WEIGHT_PER_M = 100.0
"""Price of a pose a metre from the one that is wished, in the mean of its joints: some centimetres are worth a seam.
Chosen by hand: 1 a centimetre."""


@dataclass(frozen=True, eq=False)
class GraphCatalogue:
    """The motion graph as a director may use it: clips by index, and the facts of each node's clip.

    ``poses`` are what pins of a pose need; None where there are no such pins. ``starts`` are the first beats of the
    clips, where dances like to begin.
    """

    graph: MotionGraph
    clip_ids: tuple[str, ...]
    nodes: Nodes
    is_allowed: NDArray[np.bool_]
    poses: ClipPoses | None = None
    starts: Int | None = None


def catalogue(
    graph: MotionGraph,
    clip_ids: tuple[str, ...],
    clips: pl.DataFrame,
    allow: Sequence[str],
    *,
    poses: ClipPoses | None = None,
    avoid: Sequence[AvoidedSpan] = (),
    blend_s: float = 0.0,
) -> GraphCatalogue:
    """Join the graph with the facts of its clips, and take out what licences forbid and what is to be avoided.

    Parameters
    ----------
    graph : MotionGraph of N nodes
    clip_ids : by clip index
    clips : rows of the table ``clip``
    allow : see :class:`Direction`
    poses : see :class:`GraphCatalogue`
    avoid : stretches of clips that are not to be shown: no step goes through them
    blend_s : float, seconds, the usual blend, of which half is shown beyond a step

    Returns
    -------
    GraphCatalogue
        Without the transitions of clips that may not be changed, and without their mirror images: those are danced
        whole or not at all.
    """
    known = {row["clip_id"]: row for row in clips.iter_rows(named=True)}
    facts = [known[source_clip(clip)] for clip in clip_ids]
    facts = [row | {"label": seen_label(str(row["label"]), clip)} for row, clip in zip(facts, clip_ids, strict=True)]
    of_node = graph.clip_index
    licence = [str(row["licence"]) for row in facts]
    is_fixed = [not licences.may_be_joined(name) for name in licence]
    is_whole = np.array(is_fixed or [False])[of_node]
    free = ~(is_whole[graph.source] | is_whole[graph.target])
    clip_id, label, style = (
        np.array([str(row[c]) for row in facts] or [""])[of_node] for c in ("clip_id", "label", "style")
    )
    nodes = Nodes(clip_id, label, style, is_whole)
    may_be_danced = [
        licences.is_allowed(name, allow) and not (fixed and is_mirrored(clip))
        for name, fixed, clip in zip(licence, is_fixed, clip_ids, strict=True)
    ]
    is_allowed = np.array(may_be_danced or [True])[of_node]
    free_graph = replace(graph, source=graph.source[free], target=graph.target[free], weight=graph.weight[free])
    cut = without_stretches(free_graph, clip_ids, avoid, blend_s=blend_s)
    return GraphCatalogue(cut, clip_ids, nodes, is_allowed, poses, first_beats(graph))


def without_stretches(
    graph: MotionGraph, clip_ids: tuple[str, ...], avoid: Sequence[AvoidedSpan], *, blend_s: float
) -> MotionGraph:
    """End clips before what is to be avoided, and let them go on after it: no stretch between beats shows it.

    Parameters
    ----------
    graph, clip_ids, avoid, blend_s : as :func:`catalogue` has them

    Returns
    -------
    MotionGraph of the same nodes
    """
    here = np.flatnonzero(graph.next_node >= 0)
    names = [clip_ids[i] for i in graph.clip_index[here]]
    ends = graph.time_s[graph.next_node[here]]
    next_node = graph.next_node.copy()
    next_node[here[touched(avoid, names, graph.time_s[here], ends, blend_s=blend_s)]] = -1
    return replace(graph, next_node=next_node)


def poses_of(canonical_pose: Stored, settings: Settings) -> ClipPoses:
    """Make ready what pins of a pose need; poses are as near as the graph's own threshold says of positions."""
    graph = settings.motion_graph
    threshold = graph.threshold if graph.metric == "position" and graph.threshold else THRESHOLD
    return ClipPoses(canonical_pose, threshold)


def by_graph(known: GraphCatalogue, song: PlayedSong, settings: Settings, asked: Direction) -> ChosenSteps:
    """Find the cheapest path through the motion graph for a song that keeps its pins.

    Raises
    ------
    RefusalError
        If no dance can be had, or not with these pins; it holds the conflict and the ways out.
    """
    graph = known.graph
    costs = path_costs(settings.path)
    pins = pins_of(known, song, asked)
    if not known.is_allowed.any() and len(known.is_allowed):
        raise RefusalError(f"no clip may be danced: none has a licence of {', '.join(asked.allow)}")
    strength = strength_price(known, song, settings.path)
    terms = terms_of(known, song, pins, asked, costs, strength)

    def find(price: Float, mask: NDArray[np.bool_]) -> Path:
        return search(
            graph,
            song.grid_s,
            costs,
            admissible=None if mask.all() else np.ascontiguousarray(mask),
            stretch_price=price if price.any() else None,
            interval_price=terms.interval_price if terms.interval_price.any() else None,
            step_price=terms.step_price,
            from_any=terms.from_any,
            first=known.starts,
        )

    found = find_alternatives(graph, asked.alternative, find=lambda price: find(price, terms.admissible))
    n_repeated = 0
    if settings.path.repeat == "structure" and song.repeats:
        own, n_repeated = structure_pins(
            found[-1], song.repeats, reach_of(known, song, costs), kept=[] if asked.is_soft else pins
        )
        again = terms.admissible & admitted(own, *terms.admissible.shape)
        price = shown_price(graph, found[:-1], diversity=1.0)
        found = [*found[:-1], find(price, again)] if own else found
    path = found[-1]
    steps, kept = chosen_steps(path, graph, song.grid_s, known.clip_ids, song.duration_s, settings.dance)
    spans = zip(path.beat_index.tolist(), path.beat_span.tolist(), path.source_node.tolist(), strict=True)
    intensity = np.array([strength[k : k + d, u].sum() for k, d, u in spans])
    columns = ("transition", "stay", "warp", "stride", "beat", "repetition", "diversity")
    every = {name: getattr(path, f"{name}_cost") for name in columns}
    every |= {"intensity": intensity, "wish": np.maximum(path.wish_cost - intensity, 0.0)}
    return ChosenSteps(
        steps,
        {f"{name}_cost": values[kept] for name, values in every.items()},
        {
            "cost": path.total_cost,
            "costs": ({name: float(values.sum()) for name, values in every.items()}),
            "seams": int(steps.has_seam.sum()),
            "clips": len(set(steps.clip_id)),
            "steps_outside_warp_bounds": int(path.is_outside[kept].sum()),
            "parts_danced_again": n_repeated,
            "shared_with_the_best": shared_ratio(graph, path, found[0]) if len(found) > 1 else 1.0,
            "pins": (kept_pins(pins, song, path, known)),
            "phrases": Markdown(phrase_table(steps)),
        },
        [pin_of_step(pins, int(k), int(d)) for k, d in zip(path.beat_index[kept], path.beat_span[kept], strict=True)],
    )


@dataclass(frozen=True, eq=False)
class PathTerms:
    """Pins and wishes as the search takes them: (K, N) admitted, (K, N) priced, and prices of single steps.

    ``from_any`` says whether a pose is wished for at the start.
    """

    admissible: NDArray[np.bool_]
    interval_price: Float
    step_price: StepPrice
    from_any: bool


def terms_of(
    known: GraphCatalogue, song: PlayedSong, pins: Sequence[Pin], asked: Direction, costs: PathCosts, strength: Float
) -> PathTerms:
    """Gather what a search is to keep and to pay; RefusalError where pins conflict."""
    mask = np.broadcast_to(known.is_allowed, (len(song.grid_s) - 1, len(known.is_allowed)))
    from_any = any(pin.steps and pin.first == 0 for pin in pins)
    if not asked.is_soft:
        if pins:
            refuse_conflict(known, song, pins, asked, costs)
            mask = mask & admitted(pins, *mask.shape)
        return PathTerms(mask, strength, step_price(pins), from_any)
    soft = [replace(pin, steps=_softened(pin)) for pin in pins]
    price = strength + np.where(admitted(pins, *mask.shape), 0.0, SOFT_WISH) if pins else strength
    return PathTerms(mask, price, step_price(soft), from_any)


def _softened(pin: Pin) -> StepPrice:
    """Price a wish for a pose: that of a beat where it is not kept, less where a pose near to it is shown."""
    return {
        (beat, kind): np.minimum(price, SOFT_WISH)
        for (beat, kind), price in pin.steps.items()
        if beat + STEPS[kind][1] > pin.first
    }


def reach_of(known: GraphCatalogue, song: PlayedSong, costs: PathCosts) -> Reach:
    """Make ready the question whether pins can be kept in a song."""
    starts = np.flatnonzero(known.is_allowed)
    return Reach(known.graph, song.grid_s, costs=costs, starts=starts, allowed=known.is_allowed)


def strength_price(known: GraphCatalogue, song: PlayedSong, settings: PathSettings) -> Float:
    """Price of movement unlike the music in strength, (K, N); zeros where the song's is not known."""
    if song.intensity is None or not settings.intensity_weight:
        return np.zeros((len(song.grid_s) - 1, len(known.graph.clip_index)))
    return intensity_price(song.intensity, known.graph, weight=settings.intensity_weight)


def pins_of(known: GraphCatalogue, song: PlayedSong, asked: Direction) -> list[Pin]:
    """Bring pins onto beats and nodes; RefusalError where a pin names no place of the song."""
    try:
        posed: dict[str, Pin] = {}
        if any(wish.pose for wish in asked.wishes):
            if known.poses is None:
                raise ValueError("poses: want those of the clips where a pin wishes for one, got none")
            where = (song, known.graph, known.clip_ids, known.poses)
            posed = to_pose_pins(asked.wishes, *where, weight=POSE_WEIGHT_PER_M)
        return [posed.get(wish.text) or wishes.to_pin(wish, song, known.nodes) for wish in asked.wishes]
    except DirectionError as error:
        raise no_place(error) from error


def no_place(error: DirectionError) -> RefusalError:
    """Say that a pin names no place of the song, for a person and for a machine."""
    return RefusalError(str(error), conflict=[str(error).partition(": ")[0]], ways_out=[])


def refuse_conflict(
    known: GraphCatalogue, song: PlayedSong, pins: Sequence[Pin], asked: Direction, costs: PathCosts
) -> None:
    """Raise RefusalError where pins cannot be kept, naming the fewest of them that cannot and what would help."""
    reach = reach_of(known, song, costs)
    usable = [replace(pin, nodes=pin.nodes & known.is_allowed) for pin in pins]
    if not reach.is_danceable:
        return  # the search says why there is no dance at all
    choices = [{n: m & known.is_allowed for n, m in known.nodes.instead_of(wish).items()} for wish in asked.wishes]
    conflict = find_conflict(reach, usable, choices=choices)
    if conflict is not None:
        raise conflicting(conflict, usable, asked, song, known.nodes)


def conflicting(
    conflict: Conflict,
    pins: Sequence[Pin],
    asked: Direction,
    song: PlayedSong,
    nodes: Nodes,
    parts: PartNames = GRAPH_PARTS,
) -> RefusalError:
    """Say which pins cannot be kept and what would help, for a person and for a machine."""
    told = wishes.sentences(conflict, pins, asked.wishes, song, nodes, parts)
    ways = [wishes.way_out(way, pins, asked.wishes, song) for way in conflict.ways_out]
    pinned = [asked.wishes[i].text for i in conflict.pin_index]
    return RefusalError("; ".join(told), conflict=pinned, why=told[0], ways_out=ways)


def pin_of_step(pins: Sequence[Pin], beat: int, span: int) -> str | None:
    """Name of the pin that a step serves: the first of those it touches; None for none."""
    return next((pin.name for pin in pins if beat < pin.last and beat + span > pin.first), None)


def kept_pins(pins: Sequence[Pin], song: PlayedSong, path: Path, known: GraphCatalogue) -> list[dict[str, object]]:
    """Facts of each pin for machines: whether it is kept, from when to when, by which clips."""
    clip: dict[int, str] = {}
    node: dict[int, int] = {}
    missed: set[str] = set()
    for k, d, m, u in zip(
        *(column.tolist() for column in (path.beat_index, path.beat_span, path.motion_span, path.source_node)),
        strict=True,
    ):
        step = (k, STEPS.index((m, d)))
        missed |= {pin.name for pin in pins if step in pin.steps and not np.isfinite(pin.steps[step][u])}
        for interval in range(k, k + d):
            clip[interval], node[interval] = source_clip(known.clip_ids[known.graph.clip_index[u]]), u
    facts = wishes.kept(pins, song, clip)
    for pin, fact in zip(pins, facts, strict=True):
        is_admitted = all(pin.nodes[node[k]] for k in range(pin.first, pin.last))
        fact["is_kept"] = bool(is_admitted and pin.name not in missed)
    return facts


def path_costs(settings: PathSettings) -> PathCosts:
    """Weigh the usual prices as the settings say."""
    usual = PathCosts()
    return replace(
        usual,
        transition=usual.transition * settings.transition_weight,
        warp=usual.warp * settings.warp_weight,
        usage=usual.usage * settings.repetition_weight,
        seam=settings.seam_cost,
        stay=settings.stay_cost,
        stay_beats=settings.stay_beats,
        missed_beat=usual.missed_beat * settings.beat_weight,
        jump_back=usual.jump_back * settings.repetition_weight,
    )


def search(
    graph: MotionGraph,
    beat_s: Float,
    costs: PathCosts,
    *,
    from_any: bool = False,
    first: Int | None = None,
    **wanted: Any,  # noqa: ANN401 - find_path's
) -> Path:
    """Find the path within the hard bounds from the first beat of a clip, else from any beat, else past bounds.

    Where ``from_any``, the first beat of a clip is not preferred: a pose is wished for at the start. ``first`` are the
    first beats of the clips; the graph's own for None.
    """
    reason: InfeasiblePathError | None = None
    each: list[Literal["first", "any"] | Int] = ["any"] if from_any else ["first" if first is None else first, "any"]
    for starts, strict in ((starts, strict) for strict in (True, False) for starts in each):
        try:
            return find_path(graph, beat_s, costs=costs, starts=starts, strict=strict, **wanted)
        except InfeasiblePathError as error:
            reason = error
            if error.reason == "no_nodes":
                break
    nothing = reason is not None and reason.reason == "no_nodes"
    raise RefusalError(f"no clip can be danced: {reason}" if nothing else str(reason))


def chosen_steps(
    path: Path, graph: MotionGraph, beat_s: Float, clip_ids: tuple[str, ...], duration_s: float, settings: DanceSettings
) -> tuple[Choreography, Int]:
    """Cut the path to the song and give its seams their blends; the steps, and which of the path's they are."""
    steps = to_choreography(path, graph, beat_s=beat_s, clip_ids=clip_ids, blend_s=settings.blend_s)
    steps, kept = trim(steps, duration_s)
    width = blend_widths(steps.song_start_s, steps.song_end_s, steps.has_seam, wanted_s=settings.blend_s)
    return replace(steps, blend_s=width), kept


def choose(inputs: Mapping[str, Stored], order: DanceOrder) -> ChosenSteps:
    """Find the best way through the stored motion graph; see :class:`assets.dancing.method.Method`.

    Parameters
    ----------
    inputs : the tables of :data:`METHOD`, by name
    order : DanceOrder

    Raises
    ------
    RefusalError
        As :func:`by_graph`.
    """
    graph, clip_ids = to_motion_graph(inputs["motion_graph_node"].read(), inputs["motion_graph_edge"].read())
    poses = poses_of(inputs["canonical_pose"], order.settings)
    known = catalogue(
        graph,
        clip_ids,
        read_clips(inputs["clip"]),
        order.direction.allow,
        poses=poses,
        avoid=order.avoid,
        blend_s=order.settings.dance.blend_s,
    )
    feature, repeat = (inputs[name].read(order.song_id) for name in ("music_feature", "music_repeat"))
    song = played_song(order.beats, order.duration_s, feature=feature, repeat=repeat)
    return by_graph(known, song, order.settings, order.direction)


METHOD = Method(
    name="graph",
    version="6",
    inputs=("clip", "motion_graph_node", "motion_graph_edge", "canonical_pose", "music_feature", "music_repeat"),
    settings=("path", "dance.blend_s"),
    choose=choose,
    has_alternatives=True,
)
