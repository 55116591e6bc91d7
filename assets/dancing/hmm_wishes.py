"""A director's pins on dances by the model: which recorded motions may be danced where, kept or refused."""

from collections.abc import Sequence

from assets.dancing import wishes
from assets.dancing.asked import SOFT_WISH, Direction
from assets.dancing.by_graph import conflicting, no_place
from assets.dancing.refusal import RefusalError
from assets.dancing.wishes import DirectionError, Nodes, PartNames
from assets.reading.songs import PlayedSong
from kernels.graph.pin_conflicts import Pin, find_conflict
from kernels.hmm.span_reach import SpanReach

MOTION_PARTS = PartNames("motions of known kinds", "row of motions")


def kept_or_refused(reach: SpanReach, nodes: Nodes, song: PlayedSong, asked: Direction) -> list[Pin]:
    """Bring pins onto beats and motions; hard pins can be kept together.

    Parameters
    ----------
    reach : SpanReach of the song
    nodes : clip, label and style of each recorded motion
    song : PlayedSong
    asked : Direction

    Returns
    -------
    list of Pin, by recorded motion

    Raises
    ------
    RefusalError
        Where a pin names no place of the song or a pose, or pins conflict; it holds the conflict and the ways
        out.
    """
    posed = [wish.text for wish in asked.wishes if wish.pose]
    if posed:
        raise RefusalError(
            f"{', '.join(posed)}: poses are pinned by the graph method alone; pin a clip, label or style, or dance it "
            "with --method graph",
            conflict=posed,
            ways_out=[],
        )
    try:
        pins = [wishes.to_pin(wish, song, nodes) for wish in asked.wishes]
    except DirectionError as error:
        raise no_place(error) from error
    conflict = None
    if pins and not asked.is_soft:
        conflict = find_conflict(reach, pins, choices=[nodes.instead_of(wish) for wish in asked.wishes])
    if conflict is not None:
        raise conflicting(conflict, pins, asked, song, nodes, MOTION_PARTS)
    return pins


def price(asked: Direction) -> float:
    """Price of a beat that a pin would have otherwise: infinite for one that is to be kept.

    Parameters
    ----------
    asked : Direction
    """
    return SOFT_WISH if asked.is_soft else float("inf")


def served(pins: Sequence[Pin], parts: int, start: int, length: int) -> str | None:
    """Name the pin that a span of the grid serves: the first of those it touches; None for none.

    Parameters
    ----------
    pins : in the order given
    parts : int, intervals of the grid to a beat
    start, length : int, intervals
    """
    return next((p.name for p in pins if start < p.last * parts and start + length > p.first * parts), None)
