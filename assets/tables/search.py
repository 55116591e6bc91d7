"""Arrays of motion search to Arrow tables and back."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from assets.tables.pack import read_rows
from kernels.search.aligned import N_TRACK
from kernels.search.discriminant import unit
from kernels.search.nearest import Proposal
from kernels.types import Float
from schemas.search import LABEL_PROPOSAL, MOTION_EMBEDDING, MOTION_ENCODER, MOTION_INDEX, N_EMBEDDING


def from_encoder(arrays: Mapping[str, NDArray[np.float32]], provenance: str) -> pa.Table:
    """Pack the arrays of an encoder, in order of name; ``provenance`` goes into the schema's metadata."""
    names = sorted(arrays)
    columns = [
        pa.array(names, pa.string()),
        pa.array([arrays[name].shape for name in names], pa.list_(pa.int32())),
        pa.array([arrays[name].reshape(-1) for name in names], pa.list_(pa.float32())),
    ]
    table = MOTION_ENCODER.check(pa.table(columns, schema=MOTION_ENCODER.arrow))
    return MOTION_ENCODER.with_metadata(table, {"provenance": provenance})


def to_encoder(table: pa.Table) -> dict[str, NDArray[np.float32]]:
    """Unpack the arrays of an encoder."""
    return {
        name: np.asarray(value.values, np.float32).reshape(shape)
        for name, shape, value in zip(
            table["parameter_name"].to_pylist(), table["shape"].to_pylist(), table["elements"], strict=True
        )
    }


def from_motion_embedding(
    clip_id: str, window_s: Float, vector: NDArray[np.float32], track: NDArray[np.float32]
) -> pa.Table:
    """Pack the windows of a clip, (W, 2) seconds and (W, 512), and its track, (T, N_TRACK)."""
    w = len(window_s)
    columns = [
        pa.array([clip_id] * w, pa.string()),
        pa.array(np.arange(w), pa.int32()),
        pa.array(window_s[:, 0]),
        pa.array(window_s[:, 1]),
        pa.FixedSizeListArray.from_arrays(pa.array(vector.reshape(-1), pa.float32()), N_EMBEDDING),
        pa.array([track.reshape(-1), *[track[:0].reshape(-1)] * (w - 1)], pa.list_(pa.float32())),
    ]
    return MOTION_EMBEDDING.check(pa.table(columns, schema=MOTION_EMBEDDING.arrow))


def to_vectors(table: pa.Table) -> NDArray[np.float32]:
    """Unpack the vectors of a table of embeddings, (W, 512)."""
    column = table["embedding"].combine_chunks()
    return np.asarray(column.flatten(), np.float32).reshape(len(column), N_EMBEDDING)


def starts(clip_id: Sequence[str]) -> NDArray[np.int64]:
    """Find the first row of every clip, of rows in which a clip's stand together."""
    name = np.asarray(clip_id)
    return np.flatnonzero(np.append(True, name[1:] != name[:-1])) if len(name) else np.zeros(0, np.int64)


def to_tracks(table: pa.Table) -> dict[str, NDArray[np.float32]]:
    """Unpack the tracks of a table of embeddings by clip, (T, N_TRACK) each."""
    first = table.filter(pc.equal(table["window_index"], 0))
    return {
        clip_id: np.asarray(track.values, np.float32).reshape(-1, N_TRACK)
        for clip_id, track in zip(first["clip_id"].to_pylist(), first["track_m"], strict=True)
    }


def catalogue(
    sessions: Iterable[tuple[pa.Table, pa.Table]],
) -> tuple[dict[str, list[Any]], NDArray[np.float32], NDArray[np.float32]]:
    """Join the embeddings of sessions with the facts of their clips.

    Parameters
    ----------
    sessions : pairs of the tables ``clip`` and ``motion_embedding``

    Returns
    -------
    columns by name, N values each, vectors (N, 512) float32, and tracks (M, N_TRACK) float32, a clip behind the other
        In order of clip and window; clips that are not read (any more) are left out.
    """
    rows: list[dict[str, Any]] = []
    vectors = [np.zeros((0, N_EMBEDDING), np.float32)]
    track: dict[str, NDArray[np.float32]] = {}
    for clips, embedded in sessions:
        known = {row["clip_id"]: row for row in read_rows(clips).to_pylist()}
        plain = embedded.select([c for c in embedded.column_names if c not in ("embedding", "track_m")]).to_pylist()
        is_kept = np.array([row["clip_id"] in known for row in plain], bool)
        rows += [{**known[row["clip_id"]], **row} for row in plain if row["clip_id"] in known]
        vectors.append(to_vectors(embedded)[is_kept])
        track |= to_tracks(embedded)
    order = sorted(range(len(rows)), key=lambda i: (rows[i]["clip_id"], rows[i]["window_index"]))
    names = [c.name for c in MOTION_INDEX.columns if c.name not in _MADE_BY_INDEX]
    found = {name: [rows[i][name] for i in order] for name in names}
    clips = list(dict.fromkeys(found["clip_id"]))
    count = np.array([len(track[c]) for c in clips], np.int64)
    of = np.unique(np.asarray(found["clip_id"], str), return_inverse=True)[1]
    found |= {"track_index": (np.cumsum(count) - count)[of].tolist(), "track_count": count[of].tolist()}
    tracks = np.concatenate([np.zeros((0, N_TRACK), np.float32), *(track[c] for c in clips)])
    return found, np.concatenate(vectors)[order], tracks


_MADE_BY_INDEX = ("row_index", "row_key", "track_index", "track_count", "map_x_score", "map_y_score")


def clip_vectors(vector: NDArray[np.float32], start: NDArray[np.int64]) -> NDArray[np.float32]:
    """Sum up every clip by the mean direction of its windows: (N, 512) and (C,) first rows to (C, 512)."""
    if not len(start):
        return vector
    total = np.add.reduceat(vector.astype(np.float64), start, axis=0)
    return np.asarray(unit(total), np.float32)


def likest(centre: Float) -> Float:
    """Cosine of every clip's nearest other, (C,); empty for fewer than two."""
    if len(centre) < 2:
        return np.zeros(0)
    likeness = centre @ centre.T
    np.fill_diagonal(likeness, -np.inf)
    nearest: Float = likeness.max(axis=1)
    return nearest


def from_motion_index(
    rows: Mapping[str, Sequence[Any]], vector: NDArray[np.float32], place: Float, start: NDArray[np.int64]
) -> pa.Table:
    """Pack the index, N rows; ``place`` is (C, 2) by clip, ``start`` its first rows."""
    n = len(rows["clip_id"])
    of = np.repeat(place, np.diff(np.append(start, n)), axis=0)
    made = {
        "row_index": np.arange(n),
        "row_key": _row_keys(rows, vector),
        "map_x_score": of[:, 0],
        "map_y_score": of[:, 1],
    }
    columns = [pa.array(made.get(c.name, rows.get(c.name)), c.type) for c in MOTION_INDEX.columns]
    return MOTION_INDEX.check(pa.table(columns, schema=MOTION_INDEX.arrow))


def _row_keys(rows: Mapping[str, Sequence[Any]], vector: NDArray[np.float32]) -> NDArray[np.int64]:
    named = zip(rows["clip_id"], rows["window_index"], np.ascontiguousarray(vector), strict=True)
    digests = [hashlib.blake2b(f"{c} {w} ".encode() + row.tobytes(), digest_size=8).digest() for c, w, row in named]
    return np.frombuffer(b"".join(digests), np.int64)


def from_proposals(
    proposals: Sequence[Sequence[Proposal]],
    unlabelled: Sequence[str],
    labelled: Sequence[str],
    names: Sequence[str],
    *,
    far: float,
) -> pa.Table:
    """Pack proposals: those of each unlabelled clip, by rank; ``far`` is how near a sure one has to be."""
    rows = [
        {
            "clip_id": clip,
            "rank_number": rank,
            "proposed_label": names[p.label],
            "vote_ratio": p.vote_ratio,
            "nearest_clip_id": labelled[p.nearest],
            "distance_score": p.distance,
            "is_sure": rank == 1 and p.vote_ratio >= _CLEAR_VOTE and p.distance <= far,
        }
        for clip, found in zip(unlabelled, proposals, strict=False)
        for rank, p in enumerate(found, start=1)
    ]
    return LABEL_PROPOSAL.check(pa.Table.from_pylist(rows, schema=LABEL_PROPOSAL.arrow))


_CLEAR_VOTE = 0.6
"""Share of the nearest clips' votes: three of five. Chosen by hand."""
