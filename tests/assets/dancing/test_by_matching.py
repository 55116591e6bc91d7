"""What a segment of a song may be danced with, and what each choice costs."""

import numpy as np

from assets.dancing.match_pieces import ClipFeatures, match_cost, places_of
from assets.tables.matching import StoredMatches
from kernels.motion.features import bumps

PART = bumps(240, np.array([0.0, 60, 120, 180]), np.ones(4), width_s=0.05).astype(np.float32)
STEPS = bumps(600, 60.0 * np.arange(10), np.ones(10), width_s=0.05).astype(np.float32)
CLIPS = {name: ClipFeatures(STEPS, np.ones(600), np.zeros(0)) for name in ("a", "b")}


def matches(score, mutual):
    n = len(score)
    return StoredMatches(
        ("a", "b")[:n], np.full(n, 50), np.zeros(n, np.int64), np.array(score), np.ones(n), np.array(mutual)
    )


def test_cost_of_a_match_is_its_rank_and_what_lacks_to_equality():
    np.testing.assert_allclose(
        match_cost(np.array([9.0, 3.0, 6.0]), np.array([1.0, 0.2, 0.6])), [0, 0.5 + 0.4, 0.25 + 0.2]
    )


def test_equal_scores_cost_the_same():
    np.testing.assert_allclose(match_cost(np.zeros(3), np.zeros(3)), 0.5)
    np.testing.assert_allclose(match_cost(np.array([2.0]), np.array([1.0])), 0)


def test_other_starts_stand_beside_their_match():
    score = float(PART.sum()) / 2
    places = places_of(matches([score, score], [1.0, 1.0]), PART, CLIPS, most=3)
    assert [(p.clip_id, p.rank_number) for p in places] == [("a", 1), ("b", 2), *[("a", 1)] * 3, *[("b", 2)] * 3]
    assert all(p.start_frame_index % 60 in (0, 1, 58, 59) and p.numerator == 50 for p in places)
    assert len({(p.clip_id, p.start_frame_index) for p in places}) == len(places)
    assert all(0 <= p.cost <= 1 for p in places)
    assert [p.start_frame_index for p in places_of(matches([score], [1.0]), PART, CLIPS, most=0)] == [0]


def test_nothing_stands_beside_a_match_with_silence():
    assert len(places_of(matches([0.0, 0.0], [0.0, 0.0]), np.zeros_like(PART), CLIPS, most=4)) == 2
