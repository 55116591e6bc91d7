"""Ranks, ties and none."""

import numpy as np
import pytest
import scipy.stats

from kernels.ranks import mean_ranks, rank_correlation


def test_ties_have_their_mean_rank():
    np.testing.assert_array_equal(mean_ranks(np.array([3.0, 1.0, 3.0, 2.0])), [3.5, 1, 3.5, 2])
    assert mean_ranks(np.array([])).shape == (0,)


@pytest.mark.parametrize("seed", range(5))
def test_as_scipy_has_it(seed):
    x, y = np.random.default_rng(seed).integers(0, 9, (2, 40)).astype(float)
    np.testing.assert_array_equal(mean_ranks(x), scipy.stats.rankdata(x))
    assert rank_correlation(x, y) == pytest.approx(scipy.stats.spearmanr(x, y).statistic, abs=1e-12)


def test_order_alone_counts():
    up = np.arange(6.0)
    assert rank_correlation(up, np.exp(up)) == pytest.approx(1)
    assert rank_correlation(up, -up) == pytest.approx(-1)
    assert rank_correlation(up, np.ones(6)) == 0
    assert rank_correlation(up[:2], up[:2]) == 0


def test_three_are_enough():
    assert rank_correlation(np.array([1.0, 2, 3]), np.array([1.0, 3, 2])) == pytest.approx(0.5)
    assert rank_correlation(np.zeros(0), np.zeros(0)) == 0
