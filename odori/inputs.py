"""What a person may have meant by an argument: paths, keys, pins, counts and numbers, each refused by its name."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Integral, Real
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from odori.exceptions import InputError

MOST_FRAMES_HZ = 240.0
"""Fastest stage, frames a second: as the setting ``dance.frame_rate_hz`` has it, by convention."""

WARMEST = 10.0
"""Highest temperature, as the command has it. Chosen by hand: dances drawn there follow no model any more."""


def path(name: str, value: Any) -> Path:  # noqa: ANN401 - whatever was given
    """Take a path.

    Parameters
    ----------
    name : of the argument
    value : str or path

    Raises
    ------
    InputError
        If it is neither, or empty.
    """
    if not isinstance(value, str | PathLike) or not isinstance(fspath(value), str) or not fspath(value):
        raise InputError(f"{name}: want a path, got {value!r}")
    return Path(fspath(value)).expanduser()


def key(name: str, value: Any) -> str:  # noqa: ANN401 - whatever was given
    """Take a key: text, a path, or a row that has a key.

    Parameters
    ----------
    name : of the argument
    value : str, path, or a row of a listing

    Raises
    ------
    InputError
        If it is none of these, or empty.
    """
    found = value if isinstance(value, str) else getattr(value, "key", None)
    if found is None and isinstance(value, PathLike):
        found = fspath(value)
    if not isinstance(found, str) or not found:
        raise InputError(f"{name}: want a key or the name of a file, got {value!r}")
    return found


def texts(name: str, value: Any) -> list[str]:  # noqa: ANN401 - whatever was given
    """Take one text or several; rows of a listing and proposals stand for their key and their pin.

    Parameters
    ----------
    name : of the argument
    value : one of them, an iterable of them, or None for none

    Raises
    ------
    InputError
        If one of them is no text.
    """
    if value is None:
        return []
    several = [value] if isinstance(value, str) or hasattr(value, "pin") or not isinstance(value, Iterable) else value
    found = [getattr(one, "pin", None) or getattr(one, "key", None) or one for one in several]
    for one in found:
        if not isinstance(one, str):
            raise InputError(f"{name}: want text, as it is typed, got {one!r}")
    return found


def count(name: str, value: Any, *, least: int = 1) -> int:  # noqa: ANN401 - whatever was given
    """Take a whole number.

    Parameters
    ----------
    name : of the argument
    value : int
    least : smallest that is meant

    Raises
    ------
    InputError
        If it is no whole number, or smaller.
    """
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise InputError(f"{name}: want a whole number >= {least}, got {value!r}")
    return int(value)


def number(name: str, value: Any, *, least: float, most: float) -> float:  # noqa: ANN401 - whatever was given
    """Take a number between bounds.

    Parameters
    ----------
    name : of the argument
    value : float or int
    least, most : bounds, themselves allowed

    Raises
    ------
    InputError
        If it is no number, or lies outside.
    """
    if isinstance(value, bool) or not isinstance(value, Real) or not least <= float(value) <= most:
        raise InputError(f"{name}: want a number from {least:g} to {most:g}, got {value!r}")
    return float(value)
