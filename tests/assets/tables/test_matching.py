"""Features, segments and matches come back as they were packed."""

import numpy as np
import pyarrow as pa
import pytest

from assets.tables import matching as mt
from kernels.matching.score import Match
from kernels.motion.motion_features import MotionFeatures
from kernels.music.music_features import MusicFeatures
from kernels.music.repeats import Repeat
from kernels.music.segments import Segments
from schemas.matching import MATCH
from schemas.motion import MOTION_FEATURE
from schemas.music import MUSIC_FEATURE, MUSIC_SEGMENT

SEGMENTS = Segments(
    np.array([0.0, 2.0]), np.array([2.0, 3.5]), np.array([0, 240]), np.array([240, 181]), np.array([0.0, 1.0])
)


def a_match(segment, rank, clip, *, scale=5, score=1.0):
    return Match(segment, rank, clip, scale, 7, score, 0.5, 0.25)


def test_a_clip_comes_back_in_float32_under_its_name():
    values = np.linspace(0, 1, 5)
    contact = np.array([[True, False]] * 5)
    table = mt.from_motion_feature("s-a", MotionFeatures(values, values, values, values), contact, contact[:, 0])
    assert table.schema.equals(MOTION_FEATURE.arrow)
    assert table["is_left_contact"].to_pylist() == [True] * 5
    assert table["is_right_contact"].to_pylist() == [False] * 5
    np.testing.assert_allclose(table["time_s"], np.arange(5) / 120)
    rhythm = mt.to_rhythms(table)["s-a"]
    assert rhythm.dtype == np.float32
    np.testing.assert_array_equal(rhythm, values.astype(np.float32))


def test_a_song_and_its_segments_come_back():
    values = np.arange(421.0)
    song = mt.from_music_feature("waltz", MusicFeatures(values, values))
    assert song.schema.equals(MUSIC_FEATURE.arrow)
    assert mt.to_rhythm(song).dtype == np.float32
    np.testing.assert_array_equal(mt.to_rhythm(song), values)
    table = mt.from_music_segment("waltz", SEGMENTS)
    assert table.schema.equals(MUSIC_SEGMENT.arrow)
    again = mt.to_music_segment(table)
    for name in ("start_s", "end_s", "start_frame_index", "frame_count", "novelty"):
        np.testing.assert_array_equal(getattr(again, name), getattr(SEGMENTS, name))
    parts = mt.segment_rhythms(again, values.astype(np.float32))
    np.testing.assert_array_equal(np.concatenate(parts), values)
    assert [len(p) for p in parts] == [240, 181]


def test_matches_come_back_by_segment_and_rank():
    found = [[a_match(0, 1, 1, score=3.0), a_match(0, 2, 0, scale=0)], []]
    table = mt.from_matches("waltz", found, ["s-a", "s-b"])
    assert table.schema.equals(MATCH.arrow)
    assert table["scale_ratio"].to_pylist() == pytest.approx([1.0, 0.9])
    first, second = mt.to_matches(table, 2)
    assert first.clip_ids == ("s-b", "s-a")
    np.testing.assert_array_equal(first.numerator, [50, 45])
    np.testing.assert_array_equal(first.score, [3.0, 1.0])
    assert second.clip_ids == ()
    assert len(second.score) == 0


def test_nothing_is_packed_as_no_rows():
    assert mt.from_matches("waltz", [], []).num_rows == 0
    assert mt.to_matches(MATCH.empty(), 0) == []
    assert mt.to_rhythms(MOTION_FEATURE.empty()) == {}


def test_repeats_come_back_onto_their_beats():
    grid_s = 0.3 + 0.5 * np.arange(60)
    found = [Repeat(30, 48, 4, 0.8), Repeat(50, 59, 10, 0.7)]
    rows = mt.from_music_repeat("song", found, grid_s)
    back = mt.to_music_repeat(rows, grid_s)
    assert [(r.first, r.last, r.source) for r in back] == [(30, 48, 4), (50, 59, 10)]
    assert [r.first for r in mt.to_music_repeat(rows, grid_s[:10])] == []
    assert mt.to_music_repeat(mt.from_music_repeat("song", [], grid_s), grid_s) == []


def test_strength_is_averaged_between_beats():
    time_s = np.arange(480) / 120
    rows = pa.table({"time_s": time_s, "intensity": np.repeat([1.0, 3.0, 2.0, 5.0], 120).astype(np.float32)})
    np.testing.assert_allclose(mt.strength_between(rows, np.array([0.0, 1.0, 2.0, 4.0])), [1, 3, 3.5])
    np.testing.assert_array_equal(mt.strength_between(rows.slice(0, 0), np.arange(4.0)), 0)
