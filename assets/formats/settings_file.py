"""``odori.toml`` and ``*.brief.toml``: TOML to the records of :mod:`schemas.settings`, every key checked."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from assets.formats.errors import FormatError
from schemas.settings import Brief, Settings

Record = TypeVar("Record")

_WORDS = {str: "a text in quotes", int: "a whole number", float: "a number", bool: "true or false"}


def parse(text: str, kind: type[Record], path: str = "odori.toml") -> Record:
    """Read TOML into a record of settings.

    Parameters
    ----------
    text : str
        TOML; empty gives every default.
    kind : Settings or Brief, or any record made of their kind of fields
    path : str
        Named in errors.

    Raises
    ------
    FormatError
        If it is no TOML, a key is unknown (the nearest known one is named), or a value is of the wrong type.
    """
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FormatError(path, 0, f"want TOML, got {error}") from error
    return _record(data, kind, path, "")


def read_settings(path: Path) -> Settings:
    """Read ``odori.toml``; every default where there is no such file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Settings

    Raises
    ------
    FormatError
        If the file is not UTF-8, or as :func:`parse`.
    OSError
        If it cannot be read.
    """
    return parse(_text(path), Settings, path.name)


def read_brief(path: Path) -> Brief:
    """Read a song's brief; every default where there is no such file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Brief

    Raises
    ------
    FormatError
        If the file is not UTF-8, or as :func:`parse`.
    OSError
        If it cannot be read.
    """
    return parse(_text(path), Brief, path.name)


def _text(path: Path) -> str:
    if not path.is_file():
        return ""
    try:
        return path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError(
            path.name, 0, f"want UTF-8, got byte {error.object[error.start]:#x}; save it as UTF-8"
        ) from error


def _record(data: Mapping[str, Any], kind: type[Record], path: str, section: str) -> Record:
    hints = get_type_hints(kind)
    known = {f.name: hints[f.name] for f in fields(kind)}  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for name, value in data.items():
        full = f"{section}.{name}" if section else name
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(known)}"
            raise FormatError(path, 0, f"want a known key, got {full!r}; {hint}")
        values[name] = _value(value, known[name], path, full)
    try:
        return kind(**values)
    except ValueError as error:
        raise FormatError(path, 0, f"[{section}] {error}" if section else str(error)) from error


def _value(value: Any, kind: Any, path: str, full: str) -> Any:  # noqa: ANN401 - TOML values are of any type
    if is_dataclass(kind):
        if not isinstance(value, dict):
            raise FormatError(path, 0, f"{full}: want a section [{full}], got {value!r}")
        return _record(value, kind, path, full)  # type: ignore[arg-type]
    if get_origin(kind) is tuple:
        item = get_args(kind)[0]
        if is_dataclass(item):
            if not isinstance(value, list) or not all(isinstance(v, dict) for v in value):
                raise FormatError(path, 0, f"{full}: want tables [[{full}]], got {value!r}")
            return tuple(_record(v, item, path, full) for v in value)  # type: ignore[arg-type]
        if not isinstance(value, list) or not all(isinstance(v, item) for v in value):
            raise FormatError(path, 0, f"{full}: want a list of texts, got {value!r}")
        return tuple(value)
    if get_origin(kind) is dict:
        if not isinstance(value, dict) or not all(isinstance(v, str) for v in value.values()):
            raise FormatError(path, 0, f'{full}: want a section of "name" = "name" lines, got {value!r}')
        return dict(value)
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise FormatError(path, 0, f"{full}: want {_WORDS[kind]}, got {value!r}")
    return value
