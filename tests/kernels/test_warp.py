import numpy as np
import pytest

from kernels.graph.costs import PathCosts
from kernels.hmm import durations
from kernels.warp import EASY_WARP, HARD_WARP, stretch_price


def test_the_price_is_none_at_the_clips_own_pace_and_one_at_a_tenth():
    np.testing.assert_allclose(stretch_price(np.array([1.0, 1.1, 1 / 1.1])), [0, 1, 1], atol=1e-12)


@pytest.mark.parametrize("ratio", [0.8, 0.9, 1.3])
def test_slower_and_faster_by_the_same_cost_the_same(ratio):
    assert stretch_price(ratio) == pytest.approx(stretch_price(1 / ratio))


def test_every_method_keeps_to_the_same_bounds():
    assert PathCosts().soft_ratio == durations.EASY_WARP == EASY_WARP
    assert PathCosts().hard_ratio == (durations.LEAST_WARP, durations.MOST_WARP) == HARD_WARP
    assert HARD_WARP[0] < EASY_WARP[0] < 1 < EASY_WARP[1] < HARD_WARP[1]
