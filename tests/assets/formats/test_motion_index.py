"""The search index on disk."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from assets.formats import motion_index
from kernels.search.aligned import N_TRACK
from kernels.search.discriminant import unit


def table(vector, name="clip"):
    keys = [hash((name, row.tobytes())) for row in vector]
    n = len(vector)
    return pa.table(
        {
            "clip_id": [f"{name}{i}" for i in range(n)],
            "row_key": pa.array(keys, pa.int64()),
            "track_index": pa.array(2 * np.arange(n), pa.int64()),
            "track_count": pa.array([2] * n, pa.int32()),
        }
    )


def tracks(n):
    return np.arange(2 * n * N_TRACK, dtype=np.float32).reshape(2 * n, N_TRACK)


def store(folder, rows, vector, **options):
    said = motion_index.write_vectors(folder, rows, vector, tracks(len(vector)), **options)
    pq.write_table(rows.replace_schema_metadata(said), folder / motion_index.ROWS)
    motion_index.remove_others(folder, said)
    return said


@pytest.fixture
def vector():
    return unit(np.random.default_rng(0).normal(size=(300, 32))).astype(np.float32)


def test_what_is_written_is_mapped(tmp_path, vector):
    store(tmp_path, table(vector), vector)
    found = motion_index.read(tmp_path)
    assert isinstance(found.vector, np.memmap)
    np.testing.assert_array_equal(found.vector, vector)
    np.testing.assert_array_equal(found.track, tracks(300))
    assert found.approximate == ""


def test_an_empty_index_is_one(tmp_path, vector):
    store(tmp_path, table(vector[:0]), vector[:0])
    found = motion_index.read(tmp_path)
    assert (found.vector.shape, found.track.shape) == ((0, 32), (0, N_TRACK))


@pytest.mark.parametrize("part", ["vectors", "tracks"])
def test_nothing_or_half_an_index_is_none(tmp_path, vector, part):
    assert motion_index.read(tmp_path) is None
    said = store(tmp_path, table(vector), vector)
    (tmp_path / said[part]).write_bytes(b"short")
    assert motion_index.read(tmp_path) is None


def test_the_files_before_are_taken_away(tmp_path, vector):
    first = store(tmp_path, table(vector), vector)
    second = store(tmp_path, table(vector[:9]), vector[:9])
    assert first["vectors"] != second["vectors"]
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(
        [motion_index.ROWS, second["vectors"], second["tracks"]]
    )


def test_an_index_of_an_earlier_version_is_none(tmp_path, vector):
    said = store(tmp_path, table(vector), vector)
    old = table(vector).drop_columns(["track_index", "track_count"]).replace_schema_metadata(said)
    pq.write_table(old, tmp_path / motion_index.ROWS)
    assert motion_index.read(tmp_path) is None


def test_a_large_one_has_a_graph_that_finds_the_near(tmp_path, vector):
    said = store(tmp_path, table(vector), vector, exact_up_to=100)
    assert float(said["recall"]) >= 0.95
    found = motion_index.read(tmp_path)
    assert 7 in found.candidates(vector[7:8], 5)
    assert len(found.candidates(vector[7:8], 5)) <= 5


def test_a_graph_is_renewed_by_what_changed(tmp_path, vector):
    store(tmp_path, table(vector), vector, exact_up_to=100)
    changed = vector.copy()
    changed[7] = -changed[7]
    store(tmp_path, table(changed), changed, exact_up_to=100)
    found = motion_index.read(tmp_path)
    assert 7 not in found.candidates(vector[7:8], 5)
    assert 7 in found.candidates(changed[7:8], 5)
    assert len([p for p in tmp_path.iterdir() if p.suffix == ".usearch"]) == 1


def test_a_file_that_another_search_has_mapped_is_left_to_the_next_time(tmp_path, vector, monkeypatch):
    store(tmp_path, table(vector), vector)
    old = {path.name for path in tmp_path.glob("vectors-*")}
    unlink = Path.unlink

    def refuse(self, missing_ok=False):
        if self.name in old:
            error = PermissionError(13, "The process cannot access the file")
            error.winerror = 1224
            raise error
        unlink(self, missing_ok=missing_ok)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", refuse)
        store(tmp_path, table(vector), -vector)
    assert old < {path.name for path in tmp_path.glob("vectors-*")}
    motion_index.remove_others(tmp_path, store(tmp_path, table(vector), -vector))
    assert not old & {path.name for path in tmp_path.glob("vectors-*")}
