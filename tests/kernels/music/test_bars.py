"""Bars counted from how much beats look like downbeats."""

import numpy as np
import pytest

from kernels.music.bars import count_bars


def looks(places, meter, high=0.7, low=0.1):
    return np.where(np.arange(places) % meter == 0, high, low)


@pytest.mark.parametrize("meter", [2, 3, 4, 5, 7])
def test_clear_downbeats_give_their_meter(meter):
    bar, place = count_bars(looks(12 * meter, meter))
    np.testing.assert_array_equal(place, np.arange(12 * meter) % meter + 1)
    np.testing.assert_array_equal(bar, np.arange(12 * meter) // meter + 1)


def test_pick_up_counts_as_bar_one():
    bar, place = count_bars(looks(42, 4)[2:])
    assert place[:4].tolist() == [3, 4, 1, 2]
    assert bar[:4].tolist() == [1, 1, 1, 1]
    assert bar[6] == 2


def test_a_missing_beat_is_bridged():
    bar, place = count_bars(np.delete(looks(48, 4), 21))
    assert place[:20].tolist() == [1, 2, 3, 4] * 5
    assert place[23:].tolist() == [1, 2, 3, 4] * 6
    assert (np.diff(bar) >= 0).all()


def test_weak_evidence_is_weighed_over_the_song():
    rng = np.random.default_rng(0)
    probability = np.clip(looks(64, 4, 0.35, 0.25) + 0.1 * rng.standard_normal(64), 0, 1)
    assert np.mean(count_bars(probability)[1] == np.arange(64) % 4 + 1) > 0.9


@pytest.mark.parametrize("probability", [np.zeros(0), np.full(3, 0.5), np.full(40, 0.3), np.zeros(40), np.ones(40)])
def test_no_evidence_no_bars(probability):
    bar, place = count_bars(probability)
    assert bar.tolist() == place.tolist() == [0] * len(probability)


def test_refuses_what_is_no_probability():
    with pytest.raises(ValueError, match="0 to 1"):
        count_bars(np.array([0.5, 1.5]))


@pytest.mark.parametrize("meter", [2, 3, 4, 5, 7])
def test_two_bars_are_enough_to_count(meter):
    bar, place = count_bars(looks(2 * meter, meter, 0.9, 0.05))
    np.testing.assert_array_equal(place, np.tile(np.arange(meter) + 1, 2))
    np.testing.assert_array_equal(bar, np.repeat([1, 2], meter))
    assert count_bars(looks(3, 2, 0.9, 0.05))[1].tolist() == [0, 0, 0]


def test_a_bar_of_odd_length_starts_the_count_anew():
    """Two beats more in the middle of a song in four."""
    probability = np.concatenate([looks(24, 4), looks(2, 4), looks(24, 4)])
    _, place = count_bars(probability)
    assert place[:24].tolist() == [1, 2, 3, 4] * 6
    assert place[26:].tolist() == [1, 2, 3, 4] * 6


def test_where_two_meters_explain_a_song_alike_the_commoner_is_counted():
    """Downbeats every twelve beats say as much for three as for four."""
    assert count_bars(looks(48, 12, 0.6, 0.3))[1].max() == 4


def test_a_count_hardly_better_than_the_next_is_none():
    assert count_bars(looks(64, 4, 0.31, 0.3))[1].tolist() == [0] * 64
    assert count_bars(looks(64, 4, 0.5, 0.3))[1].max() == 4


def test_probabilities_of_nothing_and_of_certainty_are_taken_as_nearly_so():
    certain = looks(32, 4, 1.0, 0.0)
    certain[8] = 0.0  # one downbeat that was not heard at all
    np.testing.assert_array_equal(count_bars(certain)[1], np.arange(32) % 4 + 1)
