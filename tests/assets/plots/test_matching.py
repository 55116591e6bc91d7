"""Pictures of matches are made, also of nothing, and repeat to the byte."""

import numpy as np

from assets.plots import matching as mp
from assets.tables import matching as mt
from kernels.matching.match_sequence import Chosen
from kernels.matching.price import MatchPiece
from kernels.matching.score import Match
from kernels.motion.motion_features import MotionFeatures
from kernels.music.segments import Segments
from schemas.motion import MOTION_FEATURE

SEGMENTS = Segments(
    np.array([0.0, 2.0]), np.array([2.0, 3.5]), np.array([0, 240]), np.array([240, 181]), np.array([0.0, 1.0])
)
NONE = Segments(*(np.zeros(0) for _ in range(5)))


def stored():
    found = [[Match(0, 1, 1, 5, 7, 3.0, 0.9, 0.8), Match(0, 2, 0, 0, 9, 2.0, 0.7, 0.6)], []]
    return mt.to_matches(mt.from_matches("waltz", found, ["s-a", "s-b"]), 2)


def test_features_of_a_session_with_a_row_a_clip():
    values = np.abs(np.sin(np.arange(200) / 9))
    contact = np.ones((200, 2), bool)
    table = mt.from_motion_feature("s-a", MotionFeatures(values, values, values, values), contact, contact[:, 0])
    text = mp.session_features(table)
    assert "| s-a | 1.67 |" in text
    assert "data:image/png" in text
    assert text == mp.session_features(table)
    assert "data:image/png" not in mp.session_features(MOTION_FEATURE.empty())


def test_a_song_with_its_segments():
    time_s = np.arange(421) / 120
    text = mp.song_features(time_s, np.sin(time_s) ** 2, np.cos(time_s) ** 2, SEGMENTS)
    assert "| 1 | 2.00 to 3.50 | 181 | 1 |" in text
    assert text == mp.song_features(time_s, np.sin(time_s) ** 2, np.cos(time_s) ** 2, SEGMENTS)
    assert "data:image/png" in mp.song_features(np.zeros(0), np.zeros(0), np.zeros(0), NONE)


def test_segments_against_their_best_matches():
    text = mp.segment_matches(SEGMENTS, stored())
    assert "| 0 | 0.00 to 2.00 | s-b | 1.00 | 0.06 | 3 | 0.8 |" in text
    assert text == mp.segment_matches(SEGMENTS, stored())
    assert "data:image/png" in mp.segment_matches(NONE, [])


def test_curves_over_each_other():
    values = np.linspace(0, 1, 50)
    assert "data:image/png" in mp.matched_curves("segment 0", values, [("s-a", values[::-1])])
    assert mp.matched_curves("segment 0", values, []) == ""


def test_a_seam_beyond_the_thresholds_is_plain_to_see():
    pieces = [MatchPiece("s-a", 0.0, 2.0, 1, 0.1, 0.2, 0.0), MatchPiece("s-b", 1.0, 2.5, 0, 1.0, 1.0, 0.0)]
    no = np.array([False, True])
    found = Chosen(np.array([0, 0]), no, ~no, np.array([0, 0.5]), np.zeros(2), 2.8)
    text = mp.chosen(np.array([0.0, 2.0, 3.5]), pieces, found)
    assert text.count("**no**") == 1
    assert "none" in text
