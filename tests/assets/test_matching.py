"""Segments of a song with their rhythms, clips that can be compared, and segments that nothing fits."""

from dataclasses import replace

import numpy as np
import pytest

from assets.matching import catalogue, segmented, without_match
from assets.tables import matching as mt
from assets.tables.matching import StoredMatches
from kernels.motion.motion_features import MotionFeatures
from kernels.music.music_features import MusicFeatures
from kernels.music.segments import Segments


def best(*score):
    """Matches of a segment with these scores."""
    n = len(score)
    zero = np.zeros(n, np.int64)
    return StoredMatches(("a",) * n, zero, zero, np.array(score), np.zeros(n), np.zeros(n))


@pytest.mark.parametrize(
    ("rhythm", "score", "is_lacking"),
    [([0.0, 1.0], [0.5, 0.2], False), ([0.0, 1.0], [0.0], True), ([0.0, 1.0], [], True), ([0.0, 0.0], [0.0], False)],
    ids=["fits", "sounds, and nothing fits", "no clip", "silent"],
)
def test_a_segment_lacks_a_match_where_it_sounds_and_no_clip_fits(rhythm, score, is_lacking):
    parts = [np.ones(2, np.float32), np.array(rhythm, np.float32)]
    assert without_match(parts, [best(1.0), best(*score)]) == ([1] if is_lacking else [])


def test_a_song_is_cut_into_the_rhythms_of_its_segments():
    values = np.arange(6.0)
    frames = np.array([0, 4]), np.array([4, 2])
    segments = Segments(np.array([0.0, 2.0]), np.array([2.0, 3.0]), *frames, np.zeros(2))
    song = mt.from_music_feature("waltz", MusicFeatures(values, values))
    again, parts = segmented(mt.from_music_segment("waltz", segments), song)
    assert again.end_s.tolist() == [2.0, 3.0]
    assert [part.tolist() for part in parts] == [[0, 1, 2, 3], [4, 5]]
    assert parts[0].dtype == np.float32


class InMemory:
    """Features of clips of one session."""

    keys = ("day",)

    def __init__(self, table):
        self.table = table

    def read(self, key="", *, clip_ids=None):
        return self.table


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0])
def test_a_clip_whose_rhythm_is_none_is_left_out(value):
    values, contact = np.ones(3), np.zeros((3, 2), bool)
    one = MotionFeatures(values, values, values, values)
    rows = mt.from_motion_feature("day-a", replace(one, rhythm=np.array([1.0, value, 1.0])), contact, contact[:, 0])
    rhythms, left_out = catalogue(InMemory(rows))
    assert (rhythms, left_out) == ({}, ["day-a: its rhythm is not finite"])
    good = mt.from_motion_feature("day-b", one, contact, contact[:, 0])
    assert catalogue(InMemory(good))[0]["day-b"].tolist() == [1, 1, 1]
