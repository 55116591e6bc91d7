"""The direction of one dance: pins of the brief and of the command, licences, which alternative."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from assets.dancing.refusal import RefusalError
from assets.sources.sources import Studio, brief_of, request_of
from schemas.keys import alternative_number
from schemas.pins import PinWish, parse_pin

SOFT_WISH = 1.0
"""Price of a beat that a soft wish would have otherwise, about that of a seam: equation 24 of [Xu2015]."""


@dataclass(frozen=True)
class Direction:
    """The direction of one dance.

    Parameters
    ----------
    wishes : pins, in the order given
    is_soft : whether they only cost where they are not kept
    allow : licences of the clips that may be danced; all where empty
    alternative : 1 for the best dance, 2 for the best that differs from it, and so on
    """

    wishes: tuple[PinWish, ...] = ()
    is_soft: bool = False
    allow: tuple[str, ...] = ()
    alternative: int = 1


def direction_of(studio: Studio, key: str, *, pins: Sequence[str] | None = None) -> Direction:
    """Gather the direction of a dance: pins of the brief and of the command, licences, which alternative.

    Parameters
    ----------
    studio : Studio
    key : ``<song>|<method>``
    pins : those beside the brief's, as typed; None for those that were asked for and remembered

    Raises
    ------
    RefusalError
        If a remembered pin is none.
    """
    song, method = key.split("|")
    brief = brief_of(studio, song)
    try:
        wishes = [*brief.pin, *(parse_pin(text) for text in (request_of(studio, key).pins if pins is None else pins))]
    except ValueError as error:
        raise RefusalError(str(error)) from error
    return Direction(
        tuple({wish.text: wish for wish in wishes}.values()),
        brief.pins == "soft",
        brief.allow,
        alternative_number(method),
    )
