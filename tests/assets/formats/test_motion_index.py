"""The search index on disk."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from assets.formats import motion_index
from kernels.search.discriminant import unit


def table(vector, name="clip"):
    keys = [hash((name, row.tobytes())) for row in vector]
    return pa.table({"clip_id": [f"{name}{i}" for i in range(len(vector))], "row_key": pa.array(keys, pa.int64())})


def store(folder, rows, vector, **options):
    said = motion_index.write_vectors(folder, rows, vector, **options)
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
    assert found.approximate == ""


def test_an_empty_index_is_one(tmp_path, vector):
    store(tmp_path, table(vector[:0]), vector[:0])
    assert motion_index.read(tmp_path).vector.shape == (0, 32)


def test_nothing_or_half_an_index_is_none(tmp_path, vector):
    assert motion_index.read(tmp_path) is None
    said = store(tmp_path, table(vector), vector)
    (tmp_path / said["vectors"]).write_bytes(b"short")
    assert motion_index.read(tmp_path) is None


def test_the_files_before_are_taken_away(tmp_path, vector):
    first = store(tmp_path, table(vector), vector)
    second = store(tmp_path, table(vector[:9]), vector[:9])
    assert first["vectors"] != second["vectors"]
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([motion_index.ROWS, second["vectors"]])


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
