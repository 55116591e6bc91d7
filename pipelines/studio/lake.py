"""The lake on disk: ``<lake>/<table>/<partition>.parquet``, each file with its stamp in the footer.

The only place that writes the lake's Parquet files. A file is written beside and renamed, so a killed run leaves the
old one or the new one. Files of one table and content are byte-equal.
"""

from collections.abc import Iterable, Mapping
from typing import IO, Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from upath import UPath

from assets.formats import beside
from assets.formats.file_names import WINDOWS, file_name, key_of, name_anew
from assets.stamps import Stamp
from assets.tables import pack
from pipelines.studio.files import LakeError, write_beside
from schemas.catalog import TABLES

STAMP_KEY = b"odori"
WHOLE = "all"


class Lake:
    """Tables of a studio.

    Parameters
    ----------
    root : absolute path or URL that fsspec knows
    windows : whether files are named as Windows wants them
    """

    def __init__(self, root: UPath, *, windows: bool = WINDOWS) -> None:
        self.root = root
        self._windows = windows

    def path(self, asset: str, key: str = "") -> UPath:
        """Place of a stored partition; of the whole table when the key is empty."""
        return self.root / asset / f"{file_name(key or WHOLE, windows=self._windows)}.parquet"

    def keys(self, asset: str) -> list[str]:
        """Partitions stored, sorted; empty when there are none."""
        folder = self.root / asset
        if not folder.is_dir():
            return []
        names = (p.name.removesuffix(".parquet") for p in folder.iterdir() if p.name.endswith(".parquet"))
        return sorted(key_of(name, windows=self._windows) for name in names)

    def version(self, asset: str, key: str = "") -> tuple[int, int] | None:
        """Size and time of a stored partition's file, which change when it is written; None when it is not stored."""
        try:
            found = self.path(asset, key).stat()
        except OSError:
            return None
        return int(found.st_size), int(getattr(found, "st_mtime_ns", 1e9 * found.st_mtime))

    def metadata(self, asset: str, key: str = "") -> Mapping[bytes, bytes]:
        """Read what stands in the footer of a stored partition.

        Parameters
        ----------
        asset : str
        key : of the partition; empty for a table stored whole

        Raises
        ------
        OSError
            If it is not stored, or cannot be read.
        """
        with _opened(self.path(asset, key)) as file:
            return pq.read_schema(file).metadata or {}

    def stamp(self, asset: str, key: str = "") -> Stamp | None:
        """Stamp of a stored partition; None when it is not stored or was written by something else."""
        try:
            metadata = self.metadata(asset, key)
            if metadata.get(b"version", b"").decode() != str(TABLES[asset].version):
                return None
            return Stamp.from_json(metadata[STAMP_KEY].decode())
        except (FileNotFoundError, KeyError, ValueError, pa.ArrowInvalid, OSError):
            return None

    def table(self, asset: str, key: str = "", *, clip_ids: Iterable[str] | None = None) -> pa.Table:
        """Read a stored partition, or some clips of it.

        Raises
        ------
        LakeError
            If it is not stored, or is no table of this kind.
        """
        path = self.path(asset, key)
        filters = None if clip_ids is None else pc.field("clip_id").isin(pa.array(sorted(clip_ids), pa.string()))
        try:
            with _opened(path) as file:
                table = pq.read_table(file, filters=filters)
            return TABLES[asset].check(table)
        except FileNotFoundError as error:
            raise LakeError(f"{path.name}: the table {asset} is not built for it; run 'odori build'") from error
        except (ValueError, pa.ArrowInvalid, OSError) as error:  # OSError is also how damaged pages are reported
            what = " ".join(str(error).split())
            raise LakeError(f"{asset}/{path.name}: {what}; delete the file and run 'odori build'") from error

    def write(self, asset: str, key: str, table: pa.Table, stamp: Stamp) -> None:
        """Store a partition, rows of one clip in one row group.

        Raises
        ------
        LakeError
            If the disk is full, read-only or otherwise refuses; nothing stored before is touched.
        """
        table = table.replace_schema_metadata({**(table.schema.metadata or {}), STAMP_KEY: stamp.to_json().encode()})
        write_beside(self.path(asset, key), lambda file: _write_parquet(table, file))

    def remove(self, asset: str, key: str) -> None:
        """Forget a partition; nothing happens when it is not stored."""
        self.path(asset, key).unlink(missing_ok=True)

    def name_anew(self) -> int:
        """Give files that came from Windows the names they have here; how many those were."""
        folders = [p for p in self.root.iterdir() if p.is_dir()] if self.root.is_dir() else []
        return sum(
            name_anew(folder, suffix, windows=self._windows) for folder in folders for suffix in (".parquet", ".json")
        )

    def sweep(self) -> int:
        """Delete what killed runs left beside; how many files that were."""
        return beside.sweep(self.root)


MOST_ROW_GROUPS = 4096
"""Clips of a file up to which each has a row group of its own, so that one can be read alone. Chosen by hand: the
footer grows with them."""


def _opened(path: UPath) -> Any:  # noqa: ANN401 - a file of Arrow's own, or one of Python's
    """Open a file to be read, by Arrow itself where it lies on a disk.

    Arrow's threads let go of a file of Python's late. At the end of the process Python then ends the thread, and with
    it the process: "terminate called without an active exception".
    """
    return pa.OSFile(str(path)) if path.protocol in ("", "file") else path.open("rb")


def _write_parquet(table: pa.Table, file: IO[bytes]) -> None:
    is_framewise = TABLES[table.schema.metadata[b"table"].decode()].key == ("clip_id", "frame_index")
    parts = list(pack.by_clip(table).values()) if is_framewise and table.num_rows else [table]
    if len(parts) > MOST_ROW_GROUPS:
        parts = [table]
    with pq.ParquetWriter(
        file, table.schema, compression="zstd", use_dictionary=["clip_id"] if is_framewise else True
    ) as out:
        for part in parts:
            out.write_table(part, row_group_size=max(part.num_rows, 1))
