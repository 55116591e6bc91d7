"""Statistics of a stretch."""

import numpy as np
import pytest

from kernels.search.describe import N_STATISTICS, describe
from kernels.search.normalise import N_CHANNELS, RATE_HZ, VELOCITY


@pytest.mark.parametrize("n", [1, 2, 7, 90, 300])
def test_any_length_gives_as_many_numbers(n, rng):
    assert describe(rng.normal(size=(n, N_CHANNELS)).astype(np.float32)).shape == (N_STATISTICS,)


def test_mean_and_deviation_come_first():
    value = np.zeros((40, N_CHANNELS), np.float32)
    value[:, 5] = np.tile([1.0, 3.0], 20)
    found = describe(value)
    assert found[5] == 2
    assert found[N_CHANNELS + 5] == 1


@pytest.mark.parametrize(("hertz", "band"), [(0.2, 0), (1.0, 2), (3.0, 4), (6.0, 5)])
def test_a_swing_falls_into_its_band(hertz, band):
    value = np.zeros((90, N_CHANNELS), np.float32)
    value[:, VELOCITY.start] = np.sin(2 * np.pi * hertz * np.arange(90) / RATE_HZ)
    energy = describe(value)[-6 * 22 :].reshape(6, 22)
    assert energy[:, 0].argmax() == band
    np.testing.assert_allclose(energy[:, 1], np.log(1e-3))


def test_order_in_time_counts_only_by_speed(rng):
    value = rng.normal(size=(64, N_CHANNELS)).astype(np.float32)
    np.testing.assert_allclose(describe(value[::-1]), describe(value), atol=1e-6)
