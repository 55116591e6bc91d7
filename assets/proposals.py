"""What could be pinned at a place of a song: labels, styles and clips within reach, with what each would cost."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from assets.direction import Song as SongBeats
from assets.direction import stretch
from assets.graph_path import (
    SOFT_WISH,
    Catalogue,
    Direction,
    path_costs,
    pins_of,
    refuse_conflict,
    strength_price,
)
from kernels.graph.path import STEPS, first_beats, more_than_any
from kernels.graph.pins import Reach, admitted
from kernels.graph.program import Program
from kernels.graph.proposals import Proposals
from schemas.pins import PinWish, parse_pin
from schemas.settings import PathSettings, Settings

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


def place_of(text: str, song: SongBeats) -> Asked:
    """Find a place as a pin names it: ``42``, ``12.5-16``, ``beat:8``, ``bar:3-4``, ``start``, ``end``.

    Raises
    ------
    ValueError
        If it is none, or not in the song.
    """
    wish: PinWish = parse_pin(f"{text}=anything")
    first, last = stretch(wish, song)
    return Asked(text, first, last, float(max(song.grid_s[first], 0.0)), float(min(song.grid_s[last], song.duration_s)))


def propose(known: Catalogue, song: SongBeats, settings: Settings, asked: Direction, place: Asked) -> dict[str, Any]:
    """Price everything that could be pinned at a place, other pins kept.

    Parameters
    ----------
    known, song, settings, asked : as :func:`assets.graph_path.by_graph` has them
    place : Asked

    Returns
    -------
    dict
        ``best_cost``, and ``labels``, ``styles`` and ``clips``, the cheapest first: name, the pin to write,
        ``extra_cost`` over the best dance with the pins that are asked for already, and how many clips it has there;
        ``out_of_reach``, names by kind. Costs are those of the dynamic program: exact, all but the price of showing the
        same again over the whole song.

    Raises
    ------
    dg.Failure
        If the pins that are asked for cannot be kept.
    """
    solved = list(_solved(known, song, settings.path, asked))
    if not solved:
        return {"best_cost": None, "labels": [], "styles": [], "clips": [], "out_of_reach": {}}
    most = solved[0][1]
    found: dict[str, Any] = {"best_cost": solved[0][0].best_cost % most, "out_of_reach": {}}
    for kind in KINDS:
        names = getattr(known.nodes, "clip_id" if kind == "clip" else kind)
        rows, lost = [], []
        for name in np.unique(names[known.is_allowed]).tolist():
            if not name:
                continue
            nodes = (names == name) & known.is_allowed
            priced = _price(solved, place, nodes)
            if priced is None:
                lost.append(name)
                continue
            cost, outside, best_node = priced
            rows.append(
                {
                    kind: name,
                    "pin": f"{place.place}={_PREFIX[kind]}{name}",
                    "extra_cost": cost - found["best_cost"],
                    "steps_outside_warp_bounds": outside,
                    **_facts(known, nodes, best_node, kind),
                }
            )
        found[f"{kind}s"] = sorted(rows, key=lambda row: (row["steps_outside_warp_bounds"], row["extra_cost"]))
        found["out_of_reach"][f"{kind}s"] = lost
    return found


def _facts(known: Catalogue, nodes: NDArray[np.bool_], best: int | None, kind: str) -> Mapping[str, Any]:
    if kind == "clip":
        label, style = known.nodes.label[nodes][0], known.nodes.style[nodes][0]
        at_s = {} if best is None else {"clip_time_s": float(known.graph.time_s[best])}
        return {"label": str(label), "style": str(style), **at_s}
    cheapest = {} if best is None else {"cheapest_clip": str(known.nodes.clip_id[best])}
    return {"clip_count": len(np.unique(known.nodes.clip_id[nodes])), **cheapest}


def _price(
    solved: list[tuple[Proposals, float]], place: Asked, nodes: NDArray[np.bool_]
) -> tuple[float, int, int | None] | None:
    """Cost of dancing nodes at a place, steps outside the bounds, and where it begins; None where there is no way."""
    for proposals, most in solved:
        best = None
        if place.last == place.first + 1:
            through = proposals.through(place.first, nodes)
            best = int(np.argmin(through))
            cost = float(through[best])
        else:
            cost = proposals.within(place.first, place.last, nodes)
        if np.isfinite(cost):
            return cost % most, int(cost // most), best
    return None


def _solved(
    known: Catalogue, song: SongBeats, settings: PathSettings, asked: Direction
) -> Iterator[tuple[Proposals, float]]:
    """Solve the song as the search would: from first beats, then from any, past the bounds where there is no other way.

    The first one is the search's own; those after it are tried for what the ones before cannot have.
    """
    graph, costs = known.graph, path_costs(settings)
    n_nodes, n_beats = len(graph.clip_index), len(song.grid_s) - 1
    pins = pins_of(known, song, asked)
    mask = np.ascontiguousarray(np.broadcast_to(known.is_allowed, (n_beats, n_nodes)))
    wish = strength_price(known, song, settings)
    if pins and asked.is_soft:
        wish = wish + np.where(admitted(pins, n_beats, n_nodes), 0.0, SOFT_WISH)
    elif pins:
        refuse_conflict(known, song, pins, asked, costs)
        mask = mask & admitted(pins, n_beats, n_nodes)
    every = np.flatnonzero(known.is_allowed)
    reach = Reach(graph, song.grid_s, costs=costs, starts=every, allowed=known.is_allowed)
    if not reach.is_danceable:
        return
    most = more_than_any(graph, song.grid_s, costs=costs, interval_price=wish)
    is_begun = False
    for bounds, price in ((costs.hard_ratio, 0.0), (costs.last_resort_ratio, most)):
        program = Program(
            graph,
            song.grid_s,
            steps=STEPS,
            costs=costs,
            admissible=mask,
            bounds=bounds,
            outside_price=price,
            interval_price=wish,
        )
        for starts in (np.intersect1d(first_beats(graph), every), every):
            proposals = Proposals(program, starts)
            if is_begun or np.isfinite(proposals.best_cost):
                is_begun = True
                yield proposals, most
        if bounds == reach.bounds:
            return
