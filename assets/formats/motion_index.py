"""The search index on disk: rows as Parquet, vectors and tracks as bare float32 that are mapped and never decoded.

``all.parquet`` names the files beside it in its metadata: ``vectors``, ``tracks`` and, of a large catalogue,
``approximate``, an HNSW graph [Malkov2018] as usearch writes it. Files are named by their content: a
search going on while the index is renewed reads the old one to its end.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from assets.formats import beside
from kernels.search.aligned import N_TRACK

EXACT_UP_TO = 50_000
"""Windows up to which all are compared. Measured on two cores: 12 ms on the clock for as many of 512 values."""

ROWS = "all.parquet"
_SEARCHED = 256
"""Breadth of a search in the graph [Malkov2018]. Chosen by hand; recall was 1.00 on 60,000 made-up windows."""

_RECALL_QUERIES, _RECALL_HITS = 200, 10
"""Windows and hits recall is measured by, when an index is made. Chosen for time, by hand."""

Vectors = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class StoredIndex:
    """An index as it lies on disk.

    Parameters
    ----------
    rows : table ``motion_index``
    vector : (N, D) float32, mapped
    track : (M, N_TRACK) float32, mapped, the clips' tracks one behind the other
    folder : where it lies
    approximate : name of the graph's file; empty where every search is exact
    """

    rows: pa.Table
    vector: Vectors
    track: Vectors
    folder: Path
    approximate: str = ""

    def candidates(self, query: Vectors, n: int) -> NDArray[np.int64]:
        """Find rows that may be near, by the graph.

        Parameters
        ----------
        query : (Q, D) float32, unit, as the rows' vectors
        n : int, >= 1
            Rows asked for a query.

        Returns
        -------
        (M,) int64, rising row numbers, at most Q n
            Those of all queries together.

        Raises
        ------
        ValueError
            If the index has no graph.
        """
        from usearch.index import Index

        graph: Any = Index.restore(str(self.folder / self.approximate), view=True)
        graph.expansion_search = max(_SEARCHED, 2 * n)
        found = graph.search(query, n, threads=1)
        return np.flatnonzero(np.isin(_keys(self.rows), np.asarray(found.keys).reshape(-1)))


def _keys(rows: pa.Table) -> NDArray[np.uint64]:
    return np.asarray(rows["row_key"].to_numpy().view(np.uint64), np.uint64)


def read(folder: Path) -> StoredIndex | None:
    """Open an index; None where there is none that is whole.

    Parameters
    ----------
    folder : of the index
    """
    try:
        rows = pq.read_table(folder / ROWS, memory_map=True)
    except (OSError, pa.ArrowInvalid):
        return None
    said = {k.decode(): v.decode() for k, v in (rows.schema.metadata or {}).items()}
    if not {"track_index", "track_count"} <= set(rows.column_names):
        return None
    n_frames = rows["track_index"][-1].as_py() + rows["track_count"][-1].as_py() if rows.num_rows else 0
    vector = _mapped(folder / said.get("vectors", ""), rows.num_rows, int(said.get("vector_length", "0")))
    track = _mapped(folder / said.get("tracks", ""), n_frames, N_TRACK)
    if vector is None or track is None:
        return None
    approximate = said.get("approximate", "")
    if approximate and not (folder / approximate).is_file():
        return None
    return StoredIndex(rows, vector, track, folder, approximate)


def _mapped(place: Path, n: int, width: int) -> Vectors | None:
    """Map a file of n rows; None where it is not there or of another size."""
    if not place.is_file() or not width or place.stat().st_size != 4 * width * n:
        return None
    return np.memmap(place, np.float32, "r", shape=(n, width)) if n else np.zeros((n, width), np.float32)


def write_vectors(
    folder: Path, rows: pa.Table, vector: Vectors, track: Vectors, *, exact_up_to: int = EXACT_UP_TO
) -> dict[str, str]:
    """Write vectors and tracks of an index, and the graph of a large one; what the rows' metadata has to say of them.

    Parameters
    ----------
    folder : of the index
    rows : table ``motion_index``, N rows
    vector : (N, D) float32
    track : (M, N_TRACK) float32
    exact_up_to : int
        With more rows a graph is written: that of the index before with what changed taken out and put in.

    Returns
    -------
    dict of texts for the metadata of ``all.parquet``, which has to be written next

    Raises
    ------
    OSError
        As the disk says it; the index before stays.
    """
    vector = np.ascontiguousarray(vector, np.float32)
    said = {"vector_length": str(vector.shape[1])}
    for what, array in (("vectors", vector), ("tracks", np.ascontiguousarray(track, np.float32))):
        data = array.tobytes()
        said[what] = f"{what}-{hashlib.sha256(data).hexdigest()[:16]}.f32"
        if not (folder / said[what]).is_file():
            with beside.written_beside(folder / said[what]) as partial:
                partial.write_bytes(data)
    if len(vector) > exact_up_to:
        said |= _write_graph(folder, rows, vector)
    return said


def remove_others(folder: Path, kept: Mapping[str, str]) -> None:
    """Delete vectors and graphs of earlier indices, once the rows name others.

    Parameters
    ----------
    folder : of the index; nothing happens where it is missing
    kept : its values are names of files that stay, as :func:`write_vectors` says them

    Raises
    ------
    OSError
        If a file cannot be removed; one that is gone already is no error, and one that a search has mapped, on Windows,
        is left to the next time.
    """
    for path in folder.glob("*-*.*"):
        if path.suffix in (".f32", ".usearch") and path.name not in kept.values():
            try:
                path.unlink(missing_ok=True)
            except OSError as error:
                if not beside.is_held(error):
                    raise


def _write_graph(folder: Path, rows: pa.Table, vector: Vectors) -> dict[str, str]:
    from usearch.index import Index

    before = read(folder)
    keys = _keys(rows)
    graph: Any = Index(ndim=vector.shape[1], metric="ip", dtype="f16", connectivity=16, expansion_add=128)
    old = np.zeros(0, np.uint64)
    if before is not None and before.approximate:
        graph.load(str(folder / before.approximate))
        old = _keys(before.rows)
    gone, new = np.setdiff1d(old, keys), np.flatnonzero(~np.isin(keys, old))
    if len(gone):
        graph.remove(gone)
    graph.add(keys[new], vector[new], threads=1)
    name = f"graph-{hashlib.sha256(keys.tobytes()).hexdigest()[:16]}.usearch"
    with beside.written_beside(folder / name) as partial:
        graph.save(str(partial))
    recall = _recall(StoredIndex(rows, vector, np.zeros((0, N_TRACK), np.float32), folder, name))
    return {"approximate": name, "recall": f"{recall:.4f}"}


def _recall(index: StoredIndex) -> float:
    """Measure the share of the ten nearest rows that the graph finds, over evenly spread rows as queries."""
    at = np.unique(np.linspace(0, len(index.vector) - 1, _RECALL_QUERIES).round().astype(int))
    found = total = 0
    for row in at.tolist():
        query = np.asarray(index.vector[row])
        nearest = np.argsort(-(index.vector @ query), kind="stable")[:_RECALL_HITS]
        found += len(np.intersect1d(nearest, index.candidates(query[None], _RECALL_HITS * 4)))
        total += len(nearest)
    return found / max(total, 1)
