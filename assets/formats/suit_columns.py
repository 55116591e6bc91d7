"""The columns of a suit recording, from Parquet or CSV: read whole, refused with the line where they cannot be.

Knows how columns are stored; what they mean is the business of :mod:`assets.formats.suit_long` and
:mod:`assets.formats.suit_wide`.
"""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pc_csv
import pyarrow.parquet as pq

from assets.formats.errors import FormatError, check_size
from kernels.types import Float

MAX_BYTES = 1 << 30
"""Chosen by hand: hours of a recording."""

# Two hours of 17 sensors at 240 Hz, chosen by hand; a Parquet file of a few bytes can claim far more.
MAX_ROWS = 30_000_000
_MAGIC = {
    b"\x1f\x8b": "a file packed by gzip (unpack it)",
    b"PK\x03\x04": "a zip archive or a spreadsheet (unpack it)",
    b"\x28\xb5\x2f\xfd": "a file packed by Zstandard (unpack it)",
    b"\x02P": "C3D markers (odori reads sensors with place and orientation)",
}
_AGAIN = "\0"
_NOTHING = ["", "nan", "NaN", "NAN", "NA", "null", "NULL", "None", "-"]
_TRUE, _FALSE = {"true", "t", "yes", "y", "1", "1.0", "ok", "valid"}, {"false", "f", "no", "n", "0", "0.0", "invalid"}


@dataclass(frozen=True, eq=False)
class Columns:
    """A table of a file, columns by name in lower case.

    Parameters
    ----------
    path : str
        Named in messages.
    table : pyarrow.Table
    first_line : int
        Line of the first row in a text file; 0 where rows have no lines.
    said : metadata of a Parquet file, or nothing
    """

    path: str
    table: pa.Table
    first_line: int
    said: dict[str, str]

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
        return list(self.table.column_names)

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return int(self.table.num_rows)

    def error(self, row: int | None, what: str) -> FormatError:
        """Make the error about a row or the whole file, for the caller to raise.

        Parameters
        ----------
        row : int or None
            From 0; None for the file. In a text file the message names the row's line.
        what : the sentence
        """
        if row is None:
            return FormatError(self.path, 0, what)
        if self.first_line:
            return FormatError(self.path, self.first_line + int(row), what)
        return FormatError(self.path, 0, f"row {int(row) + 1}: {what}")

    def numbers(self, name: str) -> Float:
        """Read a column as numbers.

        Parameters
        ----------
        name : one of the columns

        Returns
        -------
        (N,) float64
            NaN where nothing stands.

        Raises
        ------
        FormatError
            If the file has the column twice, or a value is no number: then with its row.
        """
        if any(other.startswith(name + _AGAIN) for other in self.names):
            raise self.error(None, f"want the column {name!r} once, got it again; name the columns apart")
        column = self.table[name]
        if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type)):
            column = self._cast(name, column)
        return np.asarray(column.cast(pa.float64()).to_numpy(), np.float64)

    def _cast(self, name: str, column: pa.ChunkedArray) -> pa.ChunkedArray:
        if not (pa.types.is_string(column.type) or pa.types.is_large_string(column.type)):
            raise self.error(None, f"column {name!r}: want numbers, got {column.type}; write it as a number")
        values = column.to_pylist()
        for row, value in enumerate(values):
            if value is not None and value.strip() not in _NOTHING:
                try:
                    float(value)
                except ValueError:
                    raise self.error(row, f"column {name!r}: want a number, got {value!r}; mend the row") from None
        return pa.chunked_array([[None if v is None or v.strip() in _NOTHING else float(v) for v in values]])

    def texts(self, name: str) -> tuple[np.ndarray, list[str]]:
        """Read a column of names.

        Parameters
        ----------
        name : one of the columns

        Returns
        -------
        (N,) int64
            Which of the names each row has.
        list of str
            The names in order of appearance, without spaces around them.

        Raises
        ------
        FormatError
            With the row where no name stands.
        """
        column = self.table[name]
        if not (pa.types.is_string(column.type) or pa.types.is_dictionary(column.type)):
            column = pc.cast(column, pa.string())
        if column.null_count:
            row = int(np.flatnonzero(pc.is_null(column).to_numpy())[0])
            raise self.error(row, f"column {name!r}: want the name of a sensor, got nothing; mend the row")
        encoded = column.combine_chunks()
        if isinstance(encoded, pa.ChunkedArray):
            encoded = encoded.chunk(0)
        if not pa.types.is_dictionary(encoded.type):
            encoded = encoded.dictionary_encode()
        names = [str(v).strip() for v in encoded.dictionary.to_pylist()]
        return np.asarray(encoded.indices.to_numpy(zero_copy_only=False), np.int64), names

    def flags(self, name: str) -> np.ndarray:
        """Read a column of yes and no.

        Parameters
        ----------
        name : one of the columns

        Returns
        -------
        (N,) bool
            False where nothing stands in a column of numbers or truths.

        Raises
        ------
        FormatError
            With the row that says neither.
        """
        column = self.table[name]
        if pa.types.is_boolean(column.type):
            return np.asarray(column.fill_null(False).to_numpy(), bool)
        if pa.types.is_integer(column.type) or pa.types.is_floating(column.type):
            values = self.numbers(name)
            strange = ~np.isin(values, (0.0, 1.0)) & np.isfinite(values)
            if strange.any():
                row = int(np.flatnonzero(strange)[0])
                raise self.error(row, f"column {name!r}: want true or false, got {values[row]:g}; write 1 or 0")
            return np.asarray(values == 1.0)
        words = [str(v).strip().lower() for v in column.to_pylist()]
        for row, word in enumerate(words):
            if word not in _TRUE and word not in _FALSE:
                raise self.error(row, f"column {name!r}: want true or false, got {word!r}; write 1 or 0")
        return np.array([word in _TRUE for word in words], bool)


def header_of(data: bytes) -> tuple[str, list[str], int]:
    """Find the first line of a text that is no comment: its separator, its names in lower case, and its number from 1.

    Parameters
    ----------
    data : bytes, UTF-8 with or without a byte-order mark; only the start of a file need be given

    Returns
    -------
    str, list of str, int
        No names where the text is empty.
    """
    text = data.decode("utf-8-sig", "replace")
    for number, line in enumerate(text.splitlines(), start=1):
        if line.strip() and not line.lstrip().startswith("#"):
            separator = max(",;\t", key=line.count)
            names = next(csv.reader([line], delimiter=separator), [])
            return separator, [name.strip().lower() for name in names], number
    return ",", [], 1


def read(path: Path | str, *, max_bytes: int = MAX_BYTES) -> Columns:
    """Read the columns of a Parquet or CSV file, told apart by content.

    Parameters
    ----------
    path : file
    max_bytes : int
        A larger file is refused unread.

    Returns
    -------
    Columns

    Raises
    ------
    FormatError
        If it is too large, empty, cut short or no table.
    OSError
        If it cannot be opened.
    """
    path = Path(path)
    if check_size(path, max_bytes=max_bytes) == 0:
        raise FormatError(str(path), 0, "want a recording, got an empty file; export it again")
    with path.open("rb") as file:
        start = file.read(4)
    if start == b"PAR1" or path.suffix.lower() == ".parquet":
        return _parquet(path, str(path))
    return parse_csv(path.read_bytes(), str(path))


def _parquet(path: Path, name: str) -> Columns:
    try:
        file = pq.ParquetFile(path)
        if file.metadata.num_rows > MAX_ROWS:
            raise FormatError(
                name, 0, f"want at most {MAX_ROWS} rows, got {file.metadata.num_rows}; cut the recording into takes"
            )
        table = file.read()
    except (pa.ArrowInvalid, pa.ArrowNotImplementedError, OSError) as error:
        if isinstance(error, OSError) and error.errno is not None:  # the disk's own words; damage has no number
            raise
        said = str(error).splitlines()[0]
        raise FormatError(
            name, 0, f"want a whole Parquet file, got one that ends early: {said}; copy it again"
        ) from error
    told = {k.decode(): v.decode("utf-8", "replace") for k, v in (table.schema.metadata or {}).items()}
    return Columns(name, _lowered(table, name), 0, told)


def parse_csv(data: bytes, path: str = "") -> Columns:
    """Read the columns of a CSV: commas, semicolons (then with decimal commas allowed) or tabs; UTF-8 or UTF-16.

    Parameters
    ----------
    data : bytes
    path : str
        Named in messages.

    Returns
    -------
    Columns

    Raises
    ------
    FormatError
        With the line that has more or fewer values than the header, or if there is no header or no row.
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        data = data.decode("utf-16", "replace").encode()
    separator, names, line = header_of(data[: 1 << 16])
    if len(names) < 2 or b"\0" in data[:4096]:
        raise FormatError(path, 0, f"want a table with commas between columns, got {_shown(data)}; export it as CSV")
    is_comma_decimal = separator == ";" and re.search(rb"\d,\d", data[: 1 << 16]) is not None
    try:
        table = pc_csv.read_csv(
            io.BytesIO(data),
            read_options=pc_csv.ReadOptions(skip_rows=line - 1, use_threads=False),
            parse_options=pc_csv.ParseOptions(delimiter=separator),
            convert_options=pc_csv.ConvertOptions(
                null_values=_NOTHING, strings_can_be_null=True, decimal_point="," if is_comma_decimal else "."
            ),
        )
    except pa.ArrowInvalid as error:
        raise _ragged(data, path, separator, len(names), line, error) from error
    return Columns(path, _lowered(table, path), line + 1, {})


def _lowered(table: pa.Table, path: str) -> pa.Table:
    names: list[str] = []
    for name in table.column_names:  # of two columns of one name the second is refused only where one of them is read
        plain = name.strip().lower()
        names.append(plain if plain not in names else f"{plain}{_AGAIN}{names.count(plain)}")
    if table.num_rows == 0:
        raise FormatError(path, 0, "want at least one row below the header, got none; export the recording again")
    return table.rename_columns(names)


def _ragged(data: bytes, path: str, separator: str, n_columns: int, header_line: int, error: Exception) -> FormatError:
    """Find the line that has too few or too many values."""
    text = io.StringIO(data.decode("utf-8-sig", "replace"), newline="")
    rows = csv.reader(text, delimiter=separator)
    for row in rows:
        if rows.line_num > header_line and row and len(row) != n_columns:
            is_cut = not data.endswith(b"\n") and next(rows, None) is None
            remedy = "the file was cut short; copy it again" if is_cut else "mend the line"
            return FormatError(path, rows.line_num, f"want {n_columns} values, got {len(row)}; {remedy}")
    return FormatError(path, 0, f"want comma-separated values, got {str(error).splitlines()[0]}; export it again")


def _shown(data: bytes) -> str:
    """Say what a file begins with."""
    for magic, name in _MAGIC.items():
        if data.startswith(magic):
            return name
    if b"\0" in data[:4096]:
        return "binary data"
    start = data[:40].split(b"\n")[0]
    return repr(start.decode("utf-8", "replace")) if start else "nothing"


def column(columns: Columns, *spellings: str) -> str | None:
    """Find the first spelling that the file has.

    Parameters
    ----------
    columns : Columns
    spellings : str
        In lower case, the best first.

    Returns
    -------
    str or None
        None where it has none of them.
    """
    return next((name for name in spellings if name in columns.names), None)
