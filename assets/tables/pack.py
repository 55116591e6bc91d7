"""Arrays to Arrow columns and back: what every table is packed with.

Conventions: per-joint values are ``list<fixed_size_list<float32>[3 or 4]>``; one row a frame; tables of several clips
are the clips' rows one after the other, in the order given.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from kernels.types import Float
from schemas.fields import QUATERNION, VECTOR
from schemas.keys import mirrored
from schemas.table import Table


def from_rows(table: Table, rows: Sequence[Mapping[str, Any]]) -> pa.Table:
    """Pack rows of plain values; the table's own columns, in its order."""
    return table.check(pa.Table.from_pylist([dict(row) for row in rows], schema=table.arrow))


def concat(table: Table, parts: Iterable[pa.Table]) -> pa.Table:
    """Put tables of one kind under each other; empty for none. Metadata is the first part's."""
    found = list(parts)
    if not found:
        return table.empty()
    merged = pa.concat_tables([p.replace_schema_metadata(found[0].schema.metadata) for p in found])
    return table.check(merged.combine_chunks())


def by_clip(table: pa.Table, column: str = "clip_id") -> dict[str, pa.Table]:
    """Split a table whose rows of one clip stand together into clips, in order.

    Raises
    ------
    ValueError
        If a clip's rows are scattered.
    """
    if table.num_rows == 0:
        return {}
    key = table[column].combine_chunks()
    is_new = np.append(True, pc.not_equal(key[1:], key[:-1]).to_numpy(zero_copy_only=False))
    start = np.flatnonzero(is_new)
    end = np.append(start[1:], table.num_rows)
    parts = {key[int(s)].as_py(): table.slice(s, e - s) for s, e in zip(start, end, strict=True)}
    if len(parts) != len(start):
        raise ValueError(f"{column}: want the rows of one clip together, got them scattered; sort the table")
    return parts


def read_rows(rows: pa.Table) -> pa.Table:
    """Take the rows of clips or of songs that were read; others were refused."""
    return rows.filter(pc.equal(rows["state"], "read"))


def vectors(values: Float) -> pa.Array:
    """Pack (F, J, n) as a list of J fixed-size lists a row, float32."""
    f, j, n = values.shape
    flat = pa.array(np.ascontiguousarray(values, np.float32).reshape(-1))
    item = pa.FixedSizeListArray.from_arrays(flat, type={3: VECTOR, 4: QUATERNION}[n])
    offsets = pa.array(np.arange(f + 1, dtype=np.int32) * j)
    return pa.ListArray.from_arrays(offsets, item, type=pa.list_({3: VECTOR, 4: QUATERNION}[n]))


def vector(values: Float) -> pa.Array:
    """Pack (F, 3) as one fixed-size list a row, float32."""
    return pa.FixedSizeListArray.from_arrays(
        pa.array(np.ascontiguousarray(values, np.float32).reshape(-1)), type=VECTOR
    )


def quaternion(values: Float) -> pa.Array:
    """Pack (F, 4) as one fixed-size list a row, float32."""
    return pa.FixedSizeListArray.from_arrays(
        pa.array(np.ascontiguousarray(values, np.float32).reshape(-1)), type=QUATERNION
    )


def to_array(column: pa.ChunkedArray) -> Float:
    """Unpack a column of vectors or of lists of vectors to (F, n) or (F, J, n) float64.

    An empty column of lists comes back as (0, 0, n).
    """
    array = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    f = len(array)
    is_nested = pa.types.is_list(array.type)
    item = array.flatten() if is_nested else array
    n = item.type.list_size
    flat = np.asarray(item.flatten(), np.float64)
    return flat.reshape((f, -1, n) if is_nested and f else (0, 0, n) if is_nested else (f, n))


def to_numbers(column: pa.ChunkedArray) -> NDArray[Any]:
    """Unpack a column of plain values."""
    return np.asarray(column.to_numpy())


def frame_rate_hz(rows: pa.Table) -> float:
    """Frame rate of one clip's rows, read from their times; 1 Hz for a single frame."""
    time_s = to_numbers(rows["time_s"])
    return float(np.round((len(time_s) - 1) / (time_s[-1] - time_s[0]), 6)) if len(time_s) > 1 else 1.0


def clip_names(rows: pa.Table) -> list[str]:
    """Names of the clips of rows that say whether they are mirrored."""
    pairs = zip(rows["clip_id"].to_pylist(), rows["is_mirrored"].to_pylist(), strict=True)
    return [mirrored(clip) if is_image else clip for clip, is_image in pairs]
