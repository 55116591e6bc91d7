"""``clips.csv``: what a studio says of its clips, one row a file."""

from __future__ import annotations

import csv
import difflib
import io
import math
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from assets.formats.errors import FormatError

# Column names read for each fact, first one present wins; the first is ours.
COLUMNS: dict[str, tuple[str, ...]] = {
    "file": ("file", "path", "path_in_zip", "filename", "clip"),
    "label": ("label", "content", "class"),
    "style": ("style", "kind"),
    "subject": ("subject", "person", "performer", "actor"),
    "licence": ("licence", "license"),
    "performed_to": ("performed_to",),
    "performed_offset_s": ("performed_offset_s", "offset_s"),
    "health": ("health",),
    "start_s": ("start_s",),
    "end_s": ("end_s",),
}


@dataclass(frozen=True)
class Facts:
    """Facts of one clip; empty texts where the file has none.

    ``is_labelled`` is false where the label only stands in for one that was not said.
    ``performed_to`` is the song it was danced to (key, file name or stem; ``none`` for no song of the studio),
    ``performed_offset_s`` the time of the song at the clip's first frame. ``health`` is ``ok`` where the studio answers
    for the clip itself. What lies before ``start_s`` and after ``end_s`` is not danced; None where it is not said.
    """

    label: str = ""
    style: str = ""
    subject: str = ""
    licence: str = ""
    performed_to: str = ""
    performed_offset_s: float = 0.0
    is_labelled: bool = True
    health: str = ""
    start_s: float | None = None
    end_s: float | None = None


def is_clips_csv(name: str) -> bool:
    """Whether a file of this name says things of clips: ``clips.csv``, ``labels.csv``, ``labels_….csv``."""
    lower = name.lower()
    return lower == "clips.csv" or (lower.startswith("labels") and lower.endswith(".csv"))


def parse(data: bytes, path: str = "clips.csv") -> dict[str, Facts]:
    """Read the rows of a ``clips.csv``.

    Parameters
    ----------
    data : bytes
        UTF-8, with or without a byte-order mark; a header row with at least a file column (see :data:`COLUMNS`).
    path : str
        Named in errors.

    Returns
    -------
    dict
        From the file as written, with ``/`` between folders and accents put together, to its facts. Empty when there
        are no rows.

    Raises
    ------
    FormatError
        If it is not UTF-8, has no file column, names a file twice with different facts, an offset or a time is no
        number, a take ends before it starts, or a health is not ``ok``.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError(path, 0, f"want UTF-8, got byte {error.object[error.start]:#x}; save it as UTF-8") from error
    rows = csv.DictReader(io.StringIO(text, newline=""), skipinitialspace=True)
    try:
        header = [name.strip().lower() for name in rows.fieldnames or [] if name is not None]
        rows.fieldnames = header
        chosen = {fact: next((c for c in names if c in header), None) for fact, names in COLUMNS.items()}
        if chosen["file"] is None:
            raise FormatError(
                path, 1, f"want a column 'file', got {', '.join(header) or 'nothing'}; name the columns in row 1"
            )
        facts: dict[str, Facts] = {}
        for row in rows:
            file = _composed((row.get(chosen["file"]) or "").strip().replace("\\", "/"))
            if not file:
                continue
            texts: dict[str, Any] = {k: (row.get(c) or "").strip() for k, c in chosen.items() if c and k != "file"}
            offset_s = _seconds("performed_offset_s", texts.pop("performed_offset_s", ""), path, rows.line_num)
            said = Facts(**texts | _take(texts, path, rows.line_num), performed_offset_s=offset_s or 0.0)
            if facts.setdefault(file, said) != said:
                raise FormatError(path, rows.line_num, f"want each file once, got {file!r} again with other facts")
    except csv.Error as error:
        raise FormatError(path, rows.line_num, f"want comma-separated values, got {error}") from error
    return facts


def _composed(name: str) -> str:
    """Put accents and their letters together: some disks of macOS keep them apart, tables do not."""
    return unicodedata.normalize("NFC", name)


def _take(texts: Mapping[str, str], path: str, line: int) -> dict[str, Any]:
    """Read what a studio says of a take's health, and of where it starts and ends."""
    start_s, end_s = (_seconds(name, texts.get(name, ""), path, line) for name in ("start_s", "end_s"))
    if end_s is not None and end_s <= max(start_s or 0.0, 0.0):
        raise FormatError(
            path, line, f"want end_s after start_s, got {start_s or 0:g} to {end_s:g}; swap or correct them"
        )
    health = texts.get("health", "").lower()
    if health not in ("", "ok"):
        raise FormatError(path, line, f"want health 'ok' or nothing, got {health!r}; 'ok': dance it as it is")
    return {"health": health, "start_s": start_s, "end_s": end_s}


def _seconds(name: str, text: str, path: str, line: int) -> float | None:
    """Read a number of seconds; None where nothing is said."""
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise FormatError(path, line, f"want {name} in seconds, got {text!r}; write a number such as 1.25")
    return value


def misspelt_columns(data: bytes) -> dict[str, str]:
    """Name the columns nobody reads that are nearly one we read, which goes unnamed.

    Other columns are a data set's own business.

    Parameters
    ----------
    data : bytes, UTF-8; what is not is replaced

    Returns
    -------
    dict
        The column meant by the column found, in lower case. Empty where none is nearly one of ours, and for no table.
    """
    header = next(csv.reader(io.StringIO(data.decode("utf-8-sig", errors="replace"), newline="")), [])
    names = [name.strip().lower() for name in header]
    wanted = [ours[0] for ours in COLUMNS.values() if not set(ours) & set(names)]
    found = {name: difflib.get_close_matches(name, wanted, n=1, cutoff=0.75) for name in names if name}
    return {name: near[0] for name, near in found.items() if near}


def row_of(facts: Mapping[str, Facts], folders: Sequence[str], name: str) -> str | None:
    """Find the row of a ``clips.csv`` that speaks of a file.

    Rows may name the file alone or with some of its folders: the longest row that the file's path ends with counts.

    Parameters
    ----------
    facts : from :func:`parse`
    folders, name : the file's path, below ``clips/``

    Returns
    -------
    str or None
        The file as the row writes it; None when no row names it.
    """
    parts = [_composed(part) for part in (*folders, name)]
    for start in range(len(parts)):
        ending = "/".join(parts[start:])
        if ending in facts:
            return ending
    # A row may also carry folders the studio does not have: data sets list their files from their own root.
    endings = [key for key in facts if key.rsplit("/", 1)[-1] == parts[-1]]
    return endings[0] if len(endings) == 1 else None
