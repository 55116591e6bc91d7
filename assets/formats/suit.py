"""Recordings of a magnetic motion-capture suit: read from Parquet or CSV whatever their form, written in one.

Conventions
-----------
Two forms are known by their columns: one row a frame and sensor (:mod:`assets.formats.suit_long`), which is also the
form written, and one row a reading with columns for every station (:mod:`assets.formats.suit_wide`).
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import pyarrow.csv as pc_csv
import pyarrow.parquet as pq

from assets.formats import suit_columns, suit_long, suit_wide
from assets.formats.suit_columns import MAX_BYTES, Columns
from assets.formats.suit_long import WANTED, Suit
from kernels.calibration.records import Recording

SUFFIXES = (".parquet", ".csv")
_FIRST_BYTES = 1 << 14
"""Of a CSV, among which its first line is looked for. Chosen by hand."""


def is_recording(path: Path | str) -> bool:
    """Whether a CSV's first line has the columns of a recording, complete or not; a Parquet file always counts.

    Nothing but the first line is read. False for a file that cannot be opened.

    Parameters
    ----------
    path : file
    """
    path = Path(path)
    if path.suffix.lower() == ".parquet":
        return True
    try:
        with path.open("rb") as file:
            start = file.read(_FIRST_BYTES)
    except OSError:
        return False
    if start[:2] in (b"\xff\xfe", b"\xfe\xff"):
        start = start[: len(start) // 2 * 2].decode("utf-16", "replace").encode()
    _, names, _ = suit_columns.header_of(start)
    return suit_long.is_long(names) or suit_wide.is_wide(names)


def read(
    path: Path | str, *, sensors: Mapping[str, str] | None = None, unit: str = "auto", max_bytes: int = MAX_BYTES
) -> Suit:
    """Read a recording.

    Parameters
    ----------
    path : file
    sensors : names of sensors in the file to ours, the user's own; wins
    unit : "m", "cm", "mm", "in", or "auto"
        Of lengths whose columns do not say; see :func:`assets.formats.suit_wide.parse`.
    max_bytes : int
        Larger files are refused before they are read.

    Returns
    -------
    Suit
        The sensors in the file's order, whichever and however many they are.

    Raises
    ------
    FormatError
        If it is too large, empty, cut short, no recording, or its rows contradict each other.
    OSError
        If it cannot be opened.
    """
    return parse(suit_columns.read(path, max_bytes=max_bytes), sensors=sensors, unit=unit)


def parse(columns: Columns, *, sensors: Mapping[str, str] | None = None, unit: str = "auto") -> Suit:
    """Read the columns of a recording.

    Parameters
    ----------
    columns : of the file, as read
    sensors, unit : as for :func:`read`

    Returns
    -------
    Suit

    Raises
    ------
    FormatError
        If the columns are those of neither form, or their rows contradict each other.
    """
    own = dict(sensors or {})
    if suit_long.is_long(columns.names):
        return suit_long.parse(columns, own)
    if suit_wide.is_wide(columns.names):
        return suit_wide.parse(columns, own, unit=unit)
    shown = ", ".join(columns.names[:12]) + (", …" if len(columns.names) > 12 else "")
    raise columns.error(
        None, f"want a suit recording with the columns {WANTED}, got {shown}; this is no recording, or name them so"
    )


def format_parquet(recording: Recording) -> bytes:
    """Write a recording as Parquet in the long form; the same recording gives the same bytes.

    Parameters
    ----------
    recording : Recording of F frames and S sensors

    Returns
    -------
    bytes
        F S rows.
    """
    sink = io.BytesIO()
    pq.write_table(
        suit_long.to_table(recording), sink, compression="zstd", use_dictionary=["frame", "time_s", "sensor"]
    )
    return sink.getvalue()


def format_csv(recording: Recording) -> bytes:
    """Write a recording as CSV in the long form; the same recording gives the same bytes.

    Parameters
    ----------
    recording : Recording of F frames and S sensors

    Returns
    -------
    bytes
        A header and F S lines.
    """
    sink = io.BytesIO()
    pc_csv.write_csv(suit_long.to_table(recording), sink, pc_csv.WriteOptions(quoting_style="none"))
    return sink.getvalue()
