"""The methods of choosing a dance, by name.

A new one is a file ``by_<name>.py`` with its :class:`Method`, and its name in :data:`schemas.settings.METHODS`.
"""

from __future__ import annotations

from importlib import import_module

from assets.dancing.asked import Direction
from assets.dancing.method import Method
from assets.dancing.refusal import RefusalError
from schemas import settings

# By name, so that no second list of them has to be kept.
METHODS: dict[str, Method] = {name: import_module(f"assets.dancing.by_{name}").METHOD for name in settings.METHODS}

USUAL = settings.METHODS[0]
MOST_ALTERNATIVES = 5
"""Dances of a song by one method, the best among them. Chosen by hand."""

ALTERNATIVES = tuple(
    f"{method.name}_{number}"
    for method in METHODS.values()
    if method.has_alternatives
    for number in range(2, MOST_ALTERNATIVES + 1)
)
"""The second to fifth dance of a song by methods that have them, each unlike those before it."""


def check_order(method: Method, song_id: str, direction: Direction) -> None:
    """Refuse what a method cannot do.

    Parameters
    ----------
    method : Method
    song_id : key of the song
    direction : what is asked of the dance

    Raises
    ------
    RefusalError
        If pins are asked of a method that keeps none.
    """
    if direction.wishes and not method.keeps_pins:
        able = [other.name for other in METHODS.values() if other.keeps_pins]
        ways = " or ".join(f"--method {name}" for name in able)
        raise RefusalError(f"{song_id}: pins are kept by the methods {' and '.join(able)}; dance it with {ways}")
