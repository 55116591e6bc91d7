"""Agreement of intensity: histograms, and the order a histogram cannot see."""

import numpy as np
import pytest

from kernels.matching.intensity import agreement, beat_means, bhattacharyya, histogram, quantile_edges
from kernels.ranks import rank_correlation


def test_equal_histograms_agree_and_disjoint_do_not():
    p, q = np.array([0.5, 0.5, 0]), np.array([0, 0, 1.0])
    assert bhattacharyya(p, p) == pytest.approx(1)
    assert bhattacharyya(p, q) == 0
    assert bhattacharyya(np.array([0.5, 0.5]), np.array([1.0, 0])) == pytest.approx(np.sqrt(0.5))


def test_edges_of_equal_mass():
    values = np.random.default_rng(0).random(10000)
    np.testing.assert_allclose(histogram(values, quantile_edges(values)), 0.1, atol=0.001)
    np.testing.assert_array_equal(quantile_edges(np.zeros(0)), np.zeros(9))
    assert histogram(np.zeros(0), np.zeros(9)).sum() == 0


def test_a_crescendo_is_told_from_a_decrescendo_by_rank_alone():
    up = np.linspace(0, 1, 100)
    edges = quantile_edges(up)
    assert bhattacharyya(histogram(up, edges), histogram(up[::-1], edges)) == pytest.approx(1)
    assert rank_correlation(up, up[::-1]) == pytest.approx(-1)
    assert rank_correlation(up, up**3) == pytest.approx(1)
    assert agreement(1.0, 1.0) == 1
    assert agreement(1.0, -1.0) == 0.5


def test_ranks_of_ties_and_of_little():
    assert rank_correlation(np.array([1.0, 1, 2]), np.array([3.0, 3, 9])) == pytest.approx(1)
    assert rank_correlation(np.ones(5), np.arange(5.0)) == 0
    assert rank_correlation(np.arange(2.0), np.arange(2.0)) == 0


def test_means_of_beats():
    np.testing.assert_allclose(beat_means(np.arange(6.0), np.array([0, 2, 4, 6])), [0.5, 2.5, 4.5])
    np.testing.assert_allclose(beat_means(np.arange(6.0), np.array([0, 6, 6, 9])), [2.5, 5, 5])
    np.testing.assert_array_equal(beat_means(np.zeros(0), np.array([0, 1])), [0])


def test_one_bin_is_refused():
    with pytest.raises(ValueError, match="n_bins"):
        quantile_edges(np.ones(3), n_bins=1)


def test_a_value_on_an_edge_counts_above_it():
    np.testing.assert_array_equal(histogram(np.array([1.0, 0.5]), np.array([1.0])), [0.5, 0.5])
    np.testing.assert_array_equal(histogram(np.array([1.0, 1.0]), np.array([1.0])), [0, 1])


def test_a_stretch_of_no_frame_has_the_value_at_its_start():
    np.testing.assert_array_equal(beat_means(np.arange(6.0) ** 2, np.array([0, 3, 3, 6])), [5 / 3, 9, 50 / 3])


def test_agreement_is_the_mean_of_both_and_rises_with_each():
    assert agreement(0.4, 0.2) == pytest.approx((0.4 + 0.6) / 2)
    assert agreement(0.5, 0.2) > agreement(0.4, 0.2)
    assert agreement(0.4, 0.3) > agreement(0.4, 0.2)


def test_bins_above_every_value_are_there_and_empty():
    np.testing.assert_array_equal(histogram(np.array([0.5]), np.array([1.0, 2.0, 3.0])), [1, 0, 0, 0])
    np.testing.assert_array_equal(histogram(np.zeros(0), np.array([1.0, 2.0])), [0, 0, 0])
