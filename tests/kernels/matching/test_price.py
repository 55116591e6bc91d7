"""What a stretch of a clip costs under a stretch of a song."""

import numpy as np
import pytest

from kernels.matching import intensity
from kernels.matching.price import ClipFeatures, Place, SongSpan, agreement, lay_piece, match_cost
from kernels.motion.motion_features import bumps

STEPS = bumps(600, 60.0 * np.arange(10), np.ones(10), width_s=0.05).astype(np.float32)
RISING = np.linspace(0.0, 1.0, 600)
EDGES = (intensity.quantile_edges(RISING[:240]), intensity.quantile_edges(RISING))


def clip(peak_effort=RISING):
    return ClipFeatures(STEPS, peak_effort, np.zeros(0))


def span(start_s=0.0, first=0):
    beat_s = np.arange(0.0, 2.01, 0.5)
    return SongSpan(start_s, start_s + 2.0, first, STEPS[:240], RISING[:240], start_s + beat_s)


def laid(numerator=50, start=0, under=None, of=None, **more):
    weights = {"match_weight": 1.0, "intensity_weight": 1.0, "loss_ratio": 0.1} | more
    return lay_piece(Place("a", 3, numerator, start, 0.4), of or clip(), under or span(), edges=EDGES, **weights)


def test_cost_of_a_match_is_its_rank_and_what_lacks_to_equality():
    np.testing.assert_allclose(
        match_cost(np.array([9.0, 3.0, 6.0]), np.array([1.0, 0.2, 0.6])), [0, 0.5 + 0.4, 0.25 + 0.2]
    )


def test_equal_scores_cost_the_same():
    np.testing.assert_allclose(match_cost(np.zeros(3), np.zeros(3)), 0.5)
    np.testing.assert_allclose(match_cost(np.array([2.0]), np.array([1.0])), 0)


@pytest.mark.parametrize("numerator", [46, 50, 54])
def test_a_piece_costs_its_pace_squared_and_is_easy_within_a_tenth(numerator):
    piece = laid(numerator)
    assert piece.end_s - piece.start_s == pytest.approx(2.0 * numerator / 50)
    assert piece.warp_cost == pytest.approx(0.1 * (np.log(50 / numerator) / np.log(1.1)) ** 2)
    assert piece.is_easy


def test_a_pace_beyond_a_tenth_is_not_easy():
    assert not laid(56).is_easy
    assert laid(55).is_easy  # the song lasts 0.91 as long as the clip
    assert not laid(45).is_easy  # and 1.11 times as long


def test_weights_price_the_match_and_what_lacks_to_agreement():
    piece = laid(match_weight=2.0, intensity_weight=3.0)
    assert (piece.clip_id, piece.rank_number) == ("a", 3)
    assert piece.match_cost == pytest.approx(0.8)
    assert piece.intensity_cost == pytest.approx(3.0 * (1.0 - agreement(span(), RISING[:240], EDGES)))
    assert piece.cost == pytest.approx(piece.match_cost + piece.intensity_cost + piece.warp_cost)


def test_motion_that_falls_while_the_music_rises_agrees_less():
    assert laid(of=clip(1.0 - RISING)).intensity_cost > laid().intensity_cost + 0.1


def test_a_segment_that_starts_between_frames_moves_the_clip_along():
    assert laid(under=span(0.004)).start_s == pytest.approx(0.004)
