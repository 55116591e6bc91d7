"""What was built from what: versions of content, and rows carried over instead of computed again.

Conventions
-----------
Every stored partition carries a *stamp*: the code version, the settings and the input versions it was made from, the
version of its own content, and for tables of several clips the same two per clip. Versions are hashes of content, so
an upstream rebuild with equal bytes leaves everything after it fresh. Stamps hold no date, run or path.
"""

import hashlib
import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import pyarrow as pa
import pyarrow.compute as pc
from threadpoolctl import threadpool_limits

from assets.tables import pack
from schemas.table import Table


@dataclass(frozen=True)
class ClipStamp:
    """Versions of one clip's rows: what they were made from, and what they are."""

    made_from: str
    content: str


@dataclass(frozen=True)
class Stamp:
    """What one stored partition was made from, and what it is."""

    code_version: str
    settings: str
    inputs: Mapping[str, str]
    content: str
    clips: Mapping[str, ClipStamp] = field(default_factory=dict)

    def to_json(self) -> str:
        """Write as JSON, keys in order."""
        clips = {clip: [s.made_from, s.content] for clip, s in self.clips.items()}
        return json.dumps(
            {
                "code_version": self.code_version,
                "settings": self.settings,
                "inputs": dict(self.inputs),
                "content": self.content,
                "clips": clips,
            },
            sort_keys=True,
        )

    @classmethod
    def from_json(cls, text: str) -> "Stamp":
        """Read what :meth:`to_json` wrote."""
        data = json.loads(text)
        clips = {clip: ClipStamp(*versions) for clip, versions in data["clips"].items()}
        return cls(data["code_version"], data["settings"], data["inputs"], data["content"], clips)


@dataclass(frozen=True, eq=False)
class Part:
    """One partition of an asset, ready to be stored.

    Parameters
    ----------
    key : partition key; empty for an asset without partitions
    table : its rows
    sources : version of the source files, for assets made from them; else empty
    clips : stamps by clip, where rows are carried over by clip
    metadata : what a person wants to see
    """

    key: str
    table: pa.Table
    sources: str = ""
    clips: Mapping[str, ClipStamp] = field(default_factory=dict)
    metadata: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Parts:
    """Partitions of an asset, made one after the other while they are stored, so that one at a time is in memory."""

    each: Iterable[Part]


@runtime_checkable
class Stored(Protocol):
    """An upstream asset on disk: partitions read one at a time, or rows of a few clips."""

    @property
    def keys(self) -> Sequence[str]:
        """Partition keys that are part of this run, in order."""
        ...

    def read(self, key: str = "", *, clip_ids: Iterable[str] | None = None) -> pa.Table:
        """Read one partition, or only some clips of it.

        Parameters
        ----------
        key : one of :attr:`keys`; "" for an asset without partitions
        clip_ids : of the rows to read; None for all. Clips that are not there have no rows.

        Returns
        -------
        pyarrow.Table
            As declared, in the stored order.
        """
        ...

    def stamp(self, key: str = "") -> Stamp:
        """Read what the partition was made from and is.

        Parameters
        ----------
        key : as for :meth:`read`
        """
        ...


class Earlier(Protocol):
    """What the lake held before this run."""

    def table(self, asset: str, key: str) -> pa.Table | None:
        """Read the rows stored earlier.

        Parameters
        ----------
        asset : name of a table
        key : partition; "" for an asset without partitions

        Returns
        -------
        pyarrow.Table or None
            None where there are none or they have another shape.
        """
        ...

    def stamp(self, asset: str, key: str) -> Stamp | None:
        """Read the stamp stored earlier.

        Parameters
        ----------
        asset, key : as for :meth:`table`

        Returns
        -------
        Stamp or None
            None where there is none.
        """
        ...


class Progress(Protocol):
    """Told how far a long step is."""

    def begin(self, what: str, total: int) -> None:
        """Start counting.

        Parameters
        ----------
        what : what is done, as a person reads it
        total : int, >= 0
            How many steps it takes.
        """
        ...

    def step(self) -> None:
        """One more is done."""
        ...


def content_version(table: pa.Table) -> str:
    """Hash a table's rows and types, metadata left out.

    Rows made now and the same rows read and sliced are laid out differently in memory: taken row by row they are not.

    Parameters
    ----------
    table : pyarrow.Table
        Its order of rows counts.

    Returns
    -------
    str
        16 hexadecimal characters, also for no rows.
    """
    digest = hashlib.sha256()
    for name, column in zip(table.column_names, table.columns, strict=True):
        # What the values of a list are called is the writer's affair.
        digest.update(f"{name}:{re.sub(r'<[a-z]+: ', '<', str(column.type))}:{len(column)}".encode())
        _hash_values(digest, column.combine_chunks() if column.num_chunks != 1 else column.chunk(0))
    return digest.hexdigest()[:16]


def _hash_values(digest: Any, values: pa.Array) -> None:  # noqa: ANN401 - hashlib has no public type
    """Feed values to a hash: which are null, how long lists are, and the bytes of what is in them."""
    kind = values.type
    if isinstance(values, pa.ChunkedArray):
        values = pa.concat_arrays(values.chunks) if values.num_chunks else pa.array([], kind)
    digest.update(b"nulls" if values.null_count else b"full")
    if values.null_count:
        digest.update(pc.is_null(values).to_numpy(zero_copy_only=False).tobytes())
    if pa.types.is_fixed_size_list(kind) or pa.types.is_list(kind):
        if not pa.types.is_fixed_size_list(kind):
            digest.update(pc.fill_null(pc.list_value_length(values), 0).to_numpy(zero_copy_only=False).tobytes())
        _hash_values(digest, pc.list_flatten(values))
    elif pa.types.is_string(kind):
        digest.update(json.dumps(values.to_pylist()).encode())
    else:
        filled = pc.fill_null(values, False if pa.types.is_boolean(kind) else 0) if values.null_count else values
        digest.update(filled.to_numpy(zero_copy_only=False).tobytes())


def version_of(*parts: str) -> str:
    """Hash versions in order.

    Parameters
    ----------
    parts : str
        Without line breaks.

    Returns
    -------
    str
        16 hexadecimal characters.
    """
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


def repeatable() -> AbstractContextManager[object]:
    """Compute with one thread of linear algebra: more of them change last bits, and get in each other's way.

    Libraries loaded inside the block are not reached; ``odori`` sets the environment for those as well.
    """
    limit: AbstractContextManager[object] = threadpool_limits(limits=1, user_api="blas")
    return limit


def per_clip(
    table: Table,
    key: str,
    made_from: Mapping[str, str],
    compute: Callable[[str], pa.Table],
    *,
    earlier: Earlier,
    progress: Progress | None = None,
) -> Part:
    """Make one session's table clip by clip, carrying over the rows of clips made from the same before.

    Parameters
    ----------
    table : the table's declaration
    key : session
    made_from : by clip_id in the order of rows, the version of all a clip's rows depend on (inputs, code, settings)
    compute : makes one clip's rows; not called for clips carried over
    earlier : what the lake holds
    progress : told of every clip, carried or computed

    Returns
    -------
    Part
        With stamps by clip and the counts ``computed_clips`` and ``carried_clips`` in its metadata.
    """
    stamp = earlier.stamp(table.name, key)
    known = stamp.clips if stamp else {}
    unchanged = {clip for clip, version in made_from.items() if clip in known and known[clip].made_from == version}
    before = earlier.table(table.name, key) if unchanged else None
    rows = pack.by_clip(before) if before is not None else {}
    parts, stamps, n_computed = [], {}, 0
    with repeatable():
        for clip, version in made_from.items():
            # A clip of no rows leaves none to carry, but its stamp says so.
            is_carried = clip in unchanged and before is not None
            part = rows.get(clip, table.empty()) if is_carried else compute(clip)
            content = known[clip].content if is_carried else content_version(part)
            n_computed += not is_carried
            stamps[clip] = ClipStamp(version, content)
            parts.append(part)
            if progress:
                progress.step()
    metadata = {"computed_clips": n_computed, "carried_clips": len(made_from) - n_computed}
    return Part(key, _joined(table, parts), clips=stamps, metadata=metadata)


def _joined(table: Table, parts: Sequence[pa.Table]) -> pa.Table:
    filled = [p for p in parts if p.num_rows] or list(parts[:1])
    return pack.concat(table, filled)


def clip_versions(stored: Stored, key: str, *also: str) -> dict[str, str]:
    """Version what each clip's rows are made from: its content upstream, and ``also``.

    Parameters
    ----------
    stored : the upstream asset
    key : session
    also : versions of code and settings

    Returns
    -------
    dict
        Version by clip, in the stored order; {} for a session of no clips.
    """
    return {clip: version_of(stamp.content, *also) for clip, stamp in stored.stamp(key).clips.items()}
