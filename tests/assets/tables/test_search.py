"""Arrays of motion search to tables and back."""

import numpy as np
import pyarrow as pa
import pytest

from assets.tables import search as search_tables
from assets.tables.pack import from_rows
from kernels.search.aligned import N_TRACK
from kernels.search.discriminant import unit
from kernels.search.nearest import Proposal
from schemas.motion import CLIP
from schemas.search import MOTION_ENCODER


@pytest.fixture
def vector():
    return unit(np.random.default_rng(0).normal(size=(5, 512))).astype(np.float32)


def clip_rows(**state):
    names = "path source_sha256 label style subject licence up_axis root_offset_rule naming_family performed_to"
    texts = dict.fromkeys(names.split(" "), "x")
    plain = {"frame_rate_hz": 30.0, "frame_count": 31, "duration_s": 1.0, "joint_count": 22, "metres_per_unit": 1.0}
    more = {"session": "s", "is_labelled": True, "reason": None, "source_format": "bvh", "warnings": []}
    more |= {"health": "", "danceability_ratio": 1.0}
    return from_rows(
        CLIP,
        [{**texts, **plain, **more, "performed_offset_s": 0.0, "clip_id": c, "state": s} for c, s in state.items()],
    )


def test_encoder_comes_back_as_it_was():
    arrays = {"b.two": np.arange(6, dtype=np.float32).reshape(2, 3), "a": np.float32([7])}
    table = search_tables.from_encoder(arrays, '{"seed": 0}')
    found = search_tables.to_encoder(table)
    assert list(found) == ["a", "b.two"]
    assert all(np.array_equal(found[name], arrays[name]) and found[name].dtype == np.float32 for name in found)
    assert table.schema.metadata[b"provenance"] == b'{"seed": 0}'
    assert MOTION_ENCODER.check(table).num_rows == 2


def test_sessions_become_one_catalogue_in_order_of_clips(vector):
    cut = np.array([[0.0, 1.0], [0.5, 1.5]])
    track = np.arange(5 * N_TRACK, dtype=np.float32).reshape(5, N_TRACK)
    embedded = [
        search_tables.from_motion_embedding("s-b", cut, vector[:2], track[:3]),
        pa.concat_tables(
            [
                search_tables.from_motion_embedding("s-a", cut[:1], vector[2:3], track[3:]),
                search_tables.from_motion_embedding("s-gone", cut[:1], vector[3:4], track[:1]),
            ]
        ),
    ]
    clips = [clip_rows(**{"s-b": "read"}), clip_rows(**{"s-a": "read", "s-gone": "refused"})]
    rows, found, tracks = search_tables.catalogue(zip(clips, embedded, strict=True))
    assert rows["clip_id"] == ["s-a", "s-b", "s-b"]
    np.testing.assert_array_equal(found, vector[[2, 0, 1]])
    np.testing.assert_array_equal(tracks, track[[3, 4, 0, 1, 2]])
    assert (rows["track_index"], rows["track_count"]) == ([0, 2, 2], [2, 3, 3])
    start = search_tables.starts(rows["clip_id"])
    assert start.tolist() == [0, 1]
    table = search_tables.from_motion_index(rows, found, np.array([[1.0, 2.0], [3.0, 4.0]]), start)
    assert table["map_y_score"].to_pylist() == [2.0, 4.0, 4.0]
    assert len(set(table["row_key"].to_pylist())) == 3


def test_a_window_embedded_anew_has_another_key(vector):
    rows = {name: [v] * 1 for name, v in dict(clip_id="a", session="s", window_index=0, start_s=0.0, end_s=1.0).items()}
    rows |= {name: ["x"] for name in ("label", "style", "licence", "path")} | {
        "is_labelled": [True],
        "duration_s": [1.0],
        "track_index": [0],
        "track_count": [1],
    }
    keys = [
        search_tables.from_motion_index(rows, v[None], np.zeros((1, 2)), np.zeros(1, np.int64))["row_key"][0].as_py()
        for v in (vector[0], vector[0], vector[1])
    ]
    assert keys[0] == keys[1] != keys[2]


def test_a_catalogue_of_nothing_is_empty():
    rows, found, tracks = search_tables.catalogue([])
    assert tracks.shape == (0, N_TRACK)
    assert rows["clip_id"] == []
    assert found.shape == (0, 512)
    start = search_tables.starts(rows["clip_id"])
    assert search_tables.from_motion_index(rows, found, np.zeros((0, 2)), start).num_rows == 0
    assert search_tables.clip_vectors(found, start).shape == (0, 512)


def test_a_proposal_is_sure_where_the_vote_is_clear_and_the_nearest_near():
    found = [
        [Proposal(0, 0.9, 1, 0.2), Proposal(1, 0.1, 0, 0.4)],
        [Proposal(1, 0.9, 0, 0.8)],
        [Proposal(0, 0.5, 1, 0.1)],
    ]
    table = search_tables.from_proposals(found, ["x", "y", "z"], ["a", "b"], ["step", "wave"], far=0.5)
    assert table["proposed_label"].to_pylist() == ["step", "wave", "wave", "step"]
    assert table["nearest_clip_id"].to_pylist() == ["b", "a", "a", "b"]
    assert table["is_sure"].to_pylist() == [True, False, False, False]


def test_likest_is_the_nearest_other():
    np.testing.assert_allclose(search_tables.likest(np.array([[1.0, 0], [0.6, 0.8], [0, 1.0]])), [0.6, 0.8, 0.8])
    assert len(search_tables.likest(np.ones((1, 2)))) == 0
