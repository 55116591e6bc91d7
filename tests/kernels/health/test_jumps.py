"""Sharp steps, bursts, and whether they come back."""

import numpy as np
import pytest

from kernels.health.jumps import Burst, bound, find_bursts, merged


def bursts(value, least=20.0, rate_hz=30.0):
    value = np.asarray(value, float)[:, None, None] * np.array([1.0, 0.0, 0.0])
    return find_bursts(
        np.diff(value, axis=0),
        lambda s, a, b: float(np.linalg.norm(value[a, s] - value[b, s])),
        least=least,
        frame_rate_hz=rate_hz,
    )


@pytest.fixture
def calm():
    return 10 * np.sin(np.arange(120) / 15.0)


def test_what_is_smooth_has_no_burst(calm):
    assert bursts(calm) == []
    assert bursts(20 * calm) == []
    assert bursts(calm[:2]) == []


def test_one_frame_that_is_off_is_a_burst_that_comes_back(calm):
    calm[50] += 60
    (found,) = bursts(calm)
    assert (found.signal, found.first, found.last, found.n_sharp, found.is_back) == (0, 50, 50, 2, True)
    assert found.size == pytest.approx(60, abs=1)


def test_a_step_that_stays_is_lone(calm):
    calm[50:] += 60
    (found,) = bursts(calm)
    assert (found.first, found.last, found.n_sharp, found.is_back) == (49, 50, 1, False)


def test_two_lone_steps_within_a_second_that_cancel_are_one_excursion(calm):
    calm[50:70] += 60
    (found,) = bursts(calm)
    assert (found.first, found.last, found.is_back) == (50, 69, True)
    far = 10 * np.sin(np.arange(120) / 15.0)
    far[50:90] += 60
    assert [b.is_back for b in bursts(far)] == [False, False]


def test_a_step_is_sharp_only_against_what_is_usual():
    rng = np.random.default_rng(5)
    shaky = rng.normal(0, 6, 120)
    assert bursts(shaky, least=15.0) == []
    calm = rng.normal(0, 0.3, 120)
    calm[60] += 16
    assert [b.first for b in bursts(calm, least=15.0)] == [60]


def test_inside_a_long_burst_steps_are_sharp_whatever_is_usual():
    storm = np.zeros(120)
    storm[30:90] = np.tile([0.0, 90.0], 30)
    (found,) = bursts(storm)
    assert found.first <= 31
    assert found.last >= 88


def test_bounds_fall_with_the_rate_down_to_the_least():
    assert bound(25.0, 5.0, 30.0) == 25.0
    assert 8.0 < bound(25.0, 5.0, 60.0) < 9.0
    assert bound(25.0, 5.0, 240.0) == 5.0
    assert bound(25.0, 5.0, 24.0) > 25.0


def test_bursts_of_one_signal_that_touch_are_joined():
    a, b, c = Burst(0, 3, 5, 2, 40.0, True), Burst(0, 6, 8, 2, 50.0, False), Burst(1, 7, 7, 2, 30.0, True)
    assert merged([a, b, c]) == [Burst(0, 3, 8, 4, 50.0, False), c]
    assert merged([]) == []
