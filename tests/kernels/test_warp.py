import numpy as np
import pytest

from kernels.graph.costs import PathCosts
from kernels.hmm import durations
from kernels.warp import EASY_WARP, HARD_WARP, WarpWeights, is_easy, warp_cost


def test_the_price_is_none_at_the_clips_own_pace_and_one_at_a_tenth():
    np.testing.assert_allclose(warp_cost(np.array([1.0, 1.1, 1 / 1.1]), WarpWeights()), [0, 1, 1], atol=1e-12)


@pytest.mark.parametrize("ratio", [0.8, 0.9, 1.3])
def test_slower_and_faster_by_the_same_cost_the_same(ratio):
    assert warp_cost(ratio, WarpWeights()) == pytest.approx(warp_cost(1 / ratio, WarpWeights()))


def test_every_method_keeps_to_the_same_bounds():
    assert PathCosts().soft_ratio == durations.EASY_WARP == EASY_WARP
    assert PathCosts().hard_ratio == (durations.LEAST_WARP, durations.MOST_WARP) == HARD_WARP
    assert HARD_WARP[0] < EASY_WARP[0] < 1 < EASY_WARP[1] < HARD_WARP[1]


def test_what_is_added_beyond_the_easy_bounds_grows_to_the_hard_ones():
    weights = WarpWeights(pace=0.0, leaving=2.0, further=4.0)
    between = np.exp((np.log(1.1) + np.log(1.25)) / 2)
    np.testing.assert_allclose(warp_cost(np.array([0.9, 1.1, between, 1.25, 0.8]), weights), [0, 0, 4, 6, 6])


def test_easy_is_what_is_within_the_bounds_or_rounded_past_them():
    ratio = np.array([0.9 - 1e-7, 0.9 - 1e-5, 1.0, 1.1 + 1e-7, 1.1 + 1e-5])
    assert is_easy(ratio).tolist() == [True, False, True, True, False]
    assert not is_easy(1.1 + 1e-7, slack=0.0)
