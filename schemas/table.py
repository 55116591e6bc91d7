"""A table: its name, version, key and columns, each column with its unit and meaning."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import pyarrow as pa


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Parameters
    ----------
    name : str
        Ends in the unit where there is one (see ``UNIT_SUFFIXES``).
    type : pyarrow.DataType
    meaning : str
        One sentence.
    is_optional : bool
        Whether null is allowed.
    values : closed list of allowed strings, or empty for any
    """

    name: str
    type: pa.DataType
    meaning: str
    is_optional: bool = False
    values: tuple[str, ...] = ()

    @property
    def unit(self) -> str:
        """Unit by the name's suffix, or ``""``."""
        for suffix, unit in UNIT_SUFFIXES.items():
            if self.name.endswith(suffix):
                return unit
        return ""

    @property
    def arrow(self) -> pa.Field:
        """The Arrow field, with unit and meaning as metadata."""
        metadata = {"meaning": self.meaning} | ({"unit": self.unit} if self.unit else {})
        return pa.field(self.name, self.type, nullable=self.is_optional, metadata=metadata)


# Longest suffix first: `_m_per_s` before `_s`.
UNIT_SUFFIXES: dict[str, str] = {
    "_rad_per_s": "rad/s",
    "_m_per_s3": "m/s3",
    "_m_per_s2": "m/s2",
    "_m_per_s": "m/s",
    "_xyz_m": "m",
    "_wxyz": "unit quaternion",
    "_probability": "1",
    "_ratio": "1",
    "_rad": "rad",
    "_bpm": "1/min",
    "_hz": "Hz",
    "_db": "dB",
    "_s": "s",
    "_m": "m",
}


@dataclass(frozen=True)
class Table:
    """A declared table.

    Parameters
    ----------
    name : str
        Also the asset's name and the folder's.
    version : int
        Rises when a column's meaning, type or the key changes.
    meaning : str
        What one row is.
    key : names of the columns that tell rows apart
    columns : in order
    """

    name: str
    version: int
    meaning: str
    key: tuple[str, ...]
    columns: tuple[Column, ...]

    @cached_property
    def arrow(self) -> pa.Schema:
        """The Arrow schema, with table name and version as metadata."""
        metadata = {"table": self.name, "version": str(self.version)}
        return pa.schema([c.arrow for c in self.columns], metadata=metadata)

    def empty(self, metadata: Mapping[str, str] | None = None) -> pa.Table:
        """Make a table of no rows.

        Parameters
        ----------
        metadata : as ``extra`` of :meth:`with_metadata`; None for none
        """
        return self.with_metadata(self.arrow.empty_table(), metadata or {})

    def with_metadata(self, table: pa.Table, extra: Mapping[str, str]) -> pa.Table:
        """Put this schema's metadata on a table, and more beside it (for example ``joints``).

        Parameters
        ----------
        table : pyarrow.Table
            Not checked; metadata it had is dropped.
        extra : texts by name; they win

        Returns
        -------
        pyarrow.Table
            The same rows.
        """
        return table.replace_schema_metadata(
            {**(self.arrow.metadata or {}), **{k.encode(): v for k, v in extra.items()}}
        )

    def check(self, table: pa.Table) -> pa.Table:
        """Return the table if it has this shape.

        Parameters
        ----------
        table : pyarrow.Table

        Returns
        -------
        pyarrow.Table
            The same rows; the schema's own field metadata is put back where an operation lost it.

        Raises
        ------
        ValueError
            If columns, types, nulls, closed lists, the table's name or its key do not fit.
        """
        if table.schema.names != self.arrow.names:
            raise ValueError(f"{self.name}: want columns {self.arrow.names}, got {table.schema.names}")
        for column in self.columns:
            got = table.schema.field(column.name).type
            if got != column.type:
                raise ValueError(f"{self.name}.{column.name}: want {column.type}, got {got}")
            values = table[column.name]
            if not column.is_optional and values.null_count:
                raise ValueError(f"{self.name}.{column.name}: want no nulls, got {values.null_count}")
            if column.values:
                strange = set(values.unique().to_pylist()) - {*column.values, None}
                if strange:
                    raise ValueError(f"{self.name}.{column.name}: want one of {column.values}, got {sorted(strange)}")
        metadata = {k.decode(): v.decode() for k, v in (table.schema.metadata or {}).items()}
        if metadata.get("table", self.name) != self.name:
            raise ValueError(f"{self.name}: got the table {metadata['table']!r}; check which asset is read")
        if self.key and table.num_rows != table.select(list(self.key)).group_by(list(self.key)).aggregate([]).num_rows:
            raise ValueError(f"{self.name}: the key {self.key} is not unique; two rows tell the same thing")
        return pa.table(table.columns, schema=self.arrow).replace_schema_metadata(
            {**metadata, "table": self.name, "version": str(self.version)}
        )
