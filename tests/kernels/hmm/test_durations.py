"""Lengths of motions on a song's beats: what fits, how well, and what does not."""

import numpy as np
import pytest

from kernels.hmm.durations import HARD_LOG, LONGEST_SPAN, WIDTH, log_durations, motion_grid, parts_per_beat, subdivide


def test_a_motion_of_two_beats_takes_two():
    grid = 0.5 * np.arange(9)
    found = np.exp(log_durations(grid, [np.array([1.0]), np.array([0.5, 0.5, 1.0])], longest=4))
    assert found.shape == (5, 4, 2)
    np.testing.assert_allclose(found[:, :, 0], [[0, 1, 0, 0]] * 5, atol=5e-3)
    np.testing.assert_allclose(found[0, :, 1], [2 / 3, 1 / 3, 0, 0], atol=5e-3)


def test_a_state_no_length_suits_is_passed_over_not_made_up_for():
    grid = 0.6 * np.arange(4)
    found = log_durations(grid, [np.array([0.6]), np.array([0.52]), np.array([0.3])], longest=1)
    assert found[0, 0, 0] == pytest.approx(0.0, abs=1e-3)
    assert found[0, 0, 1] < HARD_LOG
    assert np.isneginf(found[0, 0, 2])


def test_a_state_without_motions_is_never_danced():
    assert np.isneginf(log_durations(np.arange(4.0), [np.zeros(0)], longest=2)).all()


def test_tempo_may_change():
    grid = np.cumsum([0, 0.5, 0.5, 1.0, 1.0, 1.0])
    found = log_durations(grid, [np.array([1.0])], longest=2)
    assert found[:, :, 0].argmax(axis=1).tolist() == [1, 0, 0, 0]


@pytest.mark.parametrize(("beat_s", "parts"), [(0.5, 1), (0.3, 1), (1.0, 2), (1.6, 3), (9.0, 4)])
def test_slow_beats_are_cut(beat_s, parts):
    assert parts_per_beat(beat_s, np.array([0.4, 0.5, 0.9])) == parts
    assert parts_per_beat(beat_s, np.zeros(0)) == 1


def test_cut_evenly():
    np.testing.assert_allclose(subdivide(np.array([0.0, 1.0, 3.0]), 2), [0, 0.5, 1, 2, 3])


def test_a_length_beyond_the_easy_bounds_counts_so_much_less_and_beyond_the_hard_ones_not_at_all():
    span = np.array([0.79, 0.81, 0.89, 0.91, 1.09, 1.11, 1.24, 1.26])
    found = np.array([log_durations(np.array([0.0, s]), [np.ones(1)], longest=1)[0, 0, 0] for s in span])
    bump = -0.5 * (np.log(span) / WIDTH) ** 2
    np.testing.assert_allclose(found[[3, 4]], bump[[3, 4]], atol=0.02)
    np.testing.assert_allclose(found[[1, 2, 5, 6]], bump[[1, 2, 5, 6]] + HARD_LOG, atol=0.1)
    assert np.isneginf(found[[0, 7]]).all()


def test_over_all_lengths_probabilities_sum_to_no_more_than_one():
    grid = np.cumsum(np.random.default_rng(0).uniform(0.3, 0.6, 20))
    lengths = [np.array([0.4, 0.9, 1.4]), np.array([0.45])]
    total = np.exp(log_durations(grid, lengths, longest=5)).sum(axis=1)
    assert (total <= 1 + 1e-9).all()
    assert total.max() > 0.9


def test_a_beat_is_cut_by_the_median_length():
    assert parts_per_beat(1.0, np.array([0.5, 0.5, 9.0])) == 2
    assert parts_per_beat(1.0, np.array([0.4, 0.6])) == 2


def test_a_grid_is_cut_by_usual_motions_and_goes_on_for_the_longest():
    """Beats of 1 s, motions of half a second: two parts; one of 0.9 s takes two at its slowest, 1.125 s."""
    grid = motion_grid(np.arange(4.0), np.array([0.5, 0.5, 0.9]))
    assert (grid.parts, grid.longest) == (2, 2)
    np.testing.assert_allclose(grid.point_s, 0.5 * np.arange(8))
    np.testing.assert_allclose(grid.inner_s, 0.5 * np.arange(7))
    assert grid.is_beat.tolist() == [True, False] * 4
    assert grid.beat_interval_s == pytest.approx(1.0)


@pytest.mark.parametrize(("longest_s", "longest"), [(0.3, 1), (0.79, 1), (0.81, 2), (1.59, 3), (1.61, 4), (99.0, 8)])
def test_the_longest_motion_says_how_far_a_span_goes(longest_s, longest):
    assert LONGEST_SPAN == 8
    lengths = np.array([0.5, 0.5, 0.5, longest_s])
    grid = motion_grid(0.5 * np.arange(4), lengths)
    assert (grid.parts, grid.longest, len(grid.point_s)) == (1, longest, 3 + longest)


def test_beyond_the_song_a_grid_goes_on_at_its_usual_pace():
    grid = motion_grid(np.array([0.0, 1.0, 2.0, 2.5]), np.array([1.0, 2.5]))
    assert grid.longest == 3
    np.testing.assert_allclose(grid.point_s, [0, 1, 2, 2.5, 3.5, 4.5])
    np.testing.assert_allclose(grid.inner_s, [0, 1, 2, 2.5])
