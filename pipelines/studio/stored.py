"""Tables of the lake as assets and methods of dancing read them: by partition, or some clips of one."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import pyarrow as pa

from assets.stamps import Stamp
from pipelines.studio.files import LakeError
from pipelines.studio.lake import Lake
from schemas.catalog import TABLES


class StoredTable:
    """An upstream asset on disk; see :class:`assets.stamps.Stored`."""

    def __init__(self, lake: Lake, asset: str, keys: Sequence[str]) -> None:
        self._lake, self._asset, self._keys = lake, asset, list(keys)

    @property
    def keys(self) -> Sequence[str]:
        """Partition keys that are part of this run, in order."""
        return self._keys

    def read(self, key: str = "", *, clip_ids: Iterable[str] | None = None) -> pa.Table:
        """Read one partition, or only some clips of it.

        Parameters
        ----------
        key : of the partition; empty for a table stored whole
        clip_ids : of the clips wanted; None for all
        """
        return self._lake.table(self._asset, key, clip_ids=clip_ids)

    def stamp(self, key: str = "") -> Stamp:
        """Read the stamp of a stored partition.

        Parameters
        ----------
        key : of the partition

        Raises
        ------
        LakeError
            If it is not stored.
        """
        stamp = self._lake.stamp(self._asset, key)
        if stamp is None:
            raise LakeError(f"{self._asset}: the partition {key!r} is not built; run 'odori build'")
        return stamp


def partitions_for(lake: Lake, asset: str, song: str) -> list[str]:
    """Name the stored partitions of a table that a dance of a song is chosen from.

    Parameters
    ----------
    lake : Lake
    asset : name of the table
    song : key

    Returns
    -------
    list of str
        Of tables of songs the song's own, of others all; empty where none is stored.
    """
    is_of_songs = TABLES[asset].key[0] == "song_id"
    return [key for key in lake.keys(asset) if key == song or not is_of_songs]


REMEMBERED_BYTES = 2**29
"""Chosen so that tables of a few thousand clips fit beside everything else; what was read longest ago goes."""


class TableMemory:
    """Tables that were read, by place, with the version of their file; those read longest ago are given up."""

    def __init__(self) -> None:
        self._held: dict[Any, tuple[Any, pa.Table]] = {}

    def recall(self, place: Any, version: Any, read: Callable[[], pa.Table]) -> pa.Table:  # noqa: ANN401 - compared only
        """Give what was read of a file, read anew where the file is another now.

        Parameters
        ----------
        place : what was read
        version : of its file
        read : reads it
        """
        known = self._held.pop(place, None)
        table = known[1] if known and known[0] == version else read()
        self._held[place] = version, table
        while len(self._held) > 1 and sum(t.nbytes for _, t in self._held.values()) > REMEMBERED_BYTES:
            del self._held[next(iter(self._held))]
        return table


class RememberedTable(StoredTable):
    """An upstream asset on disk that is read once, and again where its file changed; for one who asks many times.

    Parameters
    ----------
    lake : Lake
    asset : str
    keys : partitions
    memory : shared between tables
    """

    def __init__(self, lake: Lake, asset: str, keys: Sequence[str], memory: TableMemory) -> None:
        super().__init__(lake, asset, keys)
        self._memory = memory

    def read(self, key: str = "", *, clip_ids: Iterable[str] | None = None) -> pa.Table:
        """Read one partition, or only some clips of it, where its file is another than it was.

        Parameters
        ----------
        key : of the partition
        clip_ids : as :meth:`StoredTable.read`
        """
        wanted = None if clip_ids is None else tuple(sorted(clip_ids))
        version = self._lake.version(self._asset, key)
        return self._memory.recall(
            (self._asset, key, wanted), version, lambda: super(RememberedTable, self).read(key, clip_ids=wanted)
        )
