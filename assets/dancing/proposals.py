"""What could be pinned at a place of a song: labels, styles and clips within reach, with what each would cost."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from assets.dancing.asked import Direction, direction_of
from assets.dancing.avoided import AvoidedSpan
from assets.dancing.by_graph import (
    METHOD,
    GraphCatalogue,
    catalogue,
    path_costs,
    pins_of,
    poses_of,
    reach_of,
    search,
    strength_price,
    terms_of,
)
from assets.dancing.method import DanceOrder
from assets.dancing.refusal import RefusalError
from assets.dancing.wishes import stretch
from assets.dancing.without_flips import choose_without_flips
from assets.reading.clips import read_clips
from assets.reading.songs import PlayedSong, played_song
from assets.sources.sources import Studio, request_of
from assets.stamps import Stored
from assets.tables.graph import to_motion_graph
from assets.tables.music import to_music_beat
from kernels.graph.moment_candidates import Proposals, price_groups
from kernels.graph.path import STEPS, first_beats, more_than_any
from kernels.graph.pin_conflicts import admitted
from kernels.graph.program import PathProgram
from kernels.graph.structure import structure_pins
from schemas.keys import is_mirrored
from schemas.pins import PinWish, parse_pin
from schemas.settings import PathSettings, Settings

MOST_PROGRAMS = 100
"""Names of a kind that are priced over several intervals, those of the least bound first; the rest are told as such.
Chosen for time, by hand."""

KINDS = ("label", "style", "clip")
_PREFIX = {"label": "", "style": "style:", "clip": "clip:"}


@dataclass(frozen=True, eq=False)
class Asked:
    """A place of a song at which something may be pinned, in seconds and in music intervals first <= k < last."""

    place: str
    first: int
    last: int
    from_s: float
    to_s: float


def place_of(text: str, song: PlayedSong) -> Asked:
    """Find a place as a pin names it: ``42``, ``12.5-16``, ``beat:8``, ``bar:3-4``, ``start``, ``end``.

    Raises
    ------
    ValueError
        If it is none, or not in the song.
    """
    wish: PinWish = parse_pin(f"{text}=anything")
    first, last = stretch(wish, song)
    return Asked(text, first, last, float(max(song.grid_s[first], 0.0)), float(min(song.grid_s[last], song.duration_s)))


class PlaceError(ValueError):
    """A place that is none of the song's."""


INPUTS = (
    *("song", "music_beat", "music_feature", "music_repeat"),
    *("clip", "canonical_pose", "motion_graph_node", "motion_graph_edge"),
)
"""Tables that :func:`propose_at` reads."""


def propose_at(
    inputs: Mapping[str, Stored], studio: Studio, song: str, place: str, *, pins: Sequence[str] = ()
) -> dict[str, Any]:
    """Price everything that could be pinned at a place of a song, from the tables of its studio.

    Parameters
    ----------
    inputs : :data:`INPUTS` by name
    studio : Studio
    song : key
    place : as a pin names it
    pins : as typed, to be kept beside those of the brief

    Returns
    -------
    dict
        As :func:`propose`, and ``song``, ``place``, ``from_s``, ``to_s`` and ``pins``.

    Raises
    ------
    RefusalError
        If the song has no beats, or the pins cannot be kept.
    PlaceError
        If the place is none of the song's.
    """
    beats = to_music_beat(inputs["music_beat"].read(song))
    if len(beats.time_s) < 2:
        raise RefusalError(f"{song}: cannot be danced: it has no beats; name a beats file in its brief")
    duration_s = float(max(inputs["song"].read(song)["duration_s"].to_pylist()))
    feature, repeat = (inputs[name].read(song) for name in ("music_feature", "music_repeat"))
    played = played_song(beats, duration_s, feature=feature, repeat=repeat)
    try:
        at = place_of(place, played)
    except ValueError as error:
        raise PlaceError(str(error).replace(f"{place}=anything", place)) from error
    asked = direction_of(studio, f"{song}|graph", pins=pins)
    graph, clip_ids = to_motion_graph(inputs["motion_graph_node"].read(), inputs["motion_graph_edge"].read())
    poses = poses_of(inputs["canonical_pose"], studio.settings())
    settings = studio.settings()
    avoid = _avoided(inputs, DanceOrder(song, beats, duration_s, settings, asked), studio)
    known = catalogue(
        graph,
        clip_ids,
        read_clips(inputs["clip"]),
        asked.allow,
        poses=poses,
        avoid=avoid,
        blend_s=settings.dance.blend_s,
    )
    found = propose(known, played, settings, asked, at)
    said: dict[str, Any] = {"song": song, "place": place, "from_s": at.from_s, "to_s": at.to_s}
    return {**said, "pins": [wish.text for wish in asked.wishes], **found}


def _avoided(inputs: Mapping[str, Stored], order: DanceOrder, studio: Studio) -> tuple[AvoidedSpan, ...]:
    """Find what the dance without another pin avoids, so that its cost is the one told."""
    rate_hz = request_of(studio, f"{order.song_id}|{METHOD.name}").frame_rate_hz
    try:
        return choose_without_flips(METHOD, inputs, order, frame_rate_hz=rate_hz).avoided
    except RefusalError:
        return ()


def propose(
    known: GraphCatalogue, song: PlayedSong, settings: Settings, asked: Direction, place: Asked
) -> dict[str, Any]:
    """Price everything that could be pinned at a place, other pins kept.

    Parameters
    ----------
    known, song, settings, asked : as :func:`assets.dancing.by_graph.by_graph` has them
    place : Asked

    Returns
    -------
    dict
        ``best_cost``: cost of the best dance with the pins asked for already. ``labels``, ``styles``, ``clips``: rows,
        the cheapest first, of name, the pin to write, ``extra_cost`` over ``best_cost``, and how many clips it has
        there. ``out_of_reach``: names by kind that no dance can show there. ``unpriced_labels``, ``unpriced_styles``,
        ``unpriced_clips``: names beyond :data:`MOST_PROGRAMS`, where the place has more candidates.

    Notes
    -----
    Costs are those of the dynamic program. They are exact but for repetition, which is counted as in the best dance.
    With ``repeat = "structure"`` other places where the song repeats are taken from the best dance; the intervals of
    the place, and those that must show the same, are free.

    Raises
    ------
    RefusalError
        If the pins that are asked for cannot be kept.
    """
    solved = list(_solved(known, song, settings.path, asked, place))
    if not solved:
        return {"best_cost": None, "labels": [], "styles": [], "clips": [], "out_of_reach": {}}
    most = solved[0][1]
    found: dict[str, Any] = {"best_cost": solved[0][0].best_cost % most, "out_of_reach": {}}
    for kind in KINDS:
        every = getattr(known.nodes, "clip_id" if kind == "clip" else kind)
        names, first, group = np.unique(every, return_index=True, return_inverse=True)
        is_named = (names != "") & (np.bincount(group, known.is_allowed, minlength=len(names)) > 0)
        prices = price_groups([p for p, _ in solved], place.first, place.last, group, is_named, most=MOST_PROGRAMS)
        rows = [
            {
                kind: str(names[i]),
                "pin": pin_text(place.place, kind, str(names[i])),
                "extra_cost": float(prices.cost[i] % most) - found["best_cost"],
                "steps_outside_warp_bounds": int(prices.cost[i] // most),
                **(
                    _of_clip(known, place, first[i], prices.node[i])
                    if kind == "clip"
                    else _of_many(known, group == i, prices.node[i])
                ),
            }
            for i in np.flatnonzero(is_named & np.isfinite(prices.cost)).tolist()
        ]
        found[f"{kind}s"] = sorted(rows, key=lambda row: (row["steps_outside_warp_bounds"], row["extra_cost"]))
        found["out_of_reach"][f"{kind}s"] = names[is_named & np.isinf(prices.cost) & ~prices.is_left].tolist()
        found[f"unpriced_{kind}s"] = names[prices.is_left].tolist()
    return found


def pin_text(place: str, kind: str, name: str) -> str:
    """Write a pin as it is typed.

    Parameters
    ----------
    place : as a pin names it
    kind : of :data:`KINDS`
    name : of the label, the style or the clip
    """
    return f"{place}={_PREFIX[kind]}{name}"


def _of_clip(known: GraphCatalogue, place: Asked, node: int, best: int) -> Mapping[str, Any]:
    """Describe what is seen of a clip where it is cheapest; a pin cannot name the pose of a mirror image."""
    shown = node if best < 0 else best
    told = {"label": str(known.nodes.label[shown]), "style": str(known.nodes.style[shown])}
    if best < 0:
        return told
    at_s = float(known.graph.time_s[best])
    is_image = is_mirrored(known.clip_ids[known.graph.clip_index[best]])
    pose = {} if is_image else {"pose_pin": f"{place.place}=pose:{known.nodes.clip_id[best]}@{at_s:.3f}"}
    return {**told, "clip_time_s": at_s, "is_mirrored": is_image, **pose}


def _of_many(known: GraphCatalogue, nodes: NDArray[np.bool_], best: int) -> Mapping[str, Any]:
    cheapest = {} if best < 0 else {"cheapest_clip": str(known.nodes.clip_id[best])}
    return {"clip_count": len(np.unique(known.nodes.clip_id[nodes])), **cheapest}


def _solved(
    known: GraphCatalogue, song: PlayedSong, settings: PathSettings, asked: Direction, place: Asked
) -> Iterator[tuple[Proposals, float]]:
    """Solve the song as the search would: from first beats, then from any, past the bounds where there is no other way.

    The first one is the search's own; those after it are tried for what the ones before cannot have.
    """
    graph, costs = known.graph, path_costs(settings)
    pins = pins_of(known, song, asked)
    terms = terms_of(known, song, pins, asked, costs, strength_price(known, song, settings))
    mask = np.ascontiguousarray(terms.admissible)
    every = np.flatnonzero(known.is_allowed)
    reach = reach_of(known, song, costs)
    if not reach.is_danceable:
        return
    wished: dict[str, Any] = {"interval_price": terms.interval_price, "step_price": terms.step_price}
    if settings.repeat == "structure" and song.repeats:
        best = search(graph, song.grid_s, costs, admissible=mask, from_any=terms.from_any, **wished)
        own, _ = structure_pins(best, song.repeats, reach, kept=[] if asked.is_soft else pins)
        free = _shown_with(place, song)
        mask = mask & admitted([pin for pin in own if pin.first not in free], *mask.shape)
    most = more_than_any(graph, song.grid_s, costs=costs, **wished)
    is_begun = False
    for bounds, price in ((costs.hard_ratio, 0.0), (costs.last_resort_ratio, most)):
        program = PathProgram(
            graph,
            song.grid_s,
            steps=STEPS,
            costs=costs,
            admissible=mask,
            bounds=bounds,
            outside_price=price,
            **wished,
        )
        first = (
            []
            if terms.from_any
            else [np.intersect1d(first_beats(graph) if known.starts is None else known.starts, every)]
        )
        for starts in (*first, every):
            proposals = Proposals(program, starts)
            if is_begun or np.isfinite(proposals.best_cost):
                is_begun = True
                yield proposals, most
        if bounds == reach.bounds:
            return


def _shown_with(place: Asked, song: PlayedSong) -> set[int]:
    """Music intervals of a place, and all that repeat them or that they repeat."""
    found = set(range(place.first, place.last))
    while True:
        more = {
            other
            for r in song.repeats
            for later in range(r.first, r.last)
            for k, other in ((later, r.source + later - r.first), (r.source + later - r.first, later))
            if k in found
        }
        if more <= found:
            return found
        found |= more
