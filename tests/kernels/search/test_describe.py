"""Statistics of a stretch."""

import numpy as np
import pytest

from kernels.search.describe import N_STATISTICS, describe
from kernels.search.normalise import N_CHANNELS, RATE_HZ, VELOCITY
from kernels.skeleton.canonical import JOINTS


@pytest.mark.parametrize("n", [1, 2, 7, 90, 300])
def test_any_length_gives_as_many_numbers(n, rng):
    assert describe(rng.normal(size=(n, N_CHANNELS)).astype(np.float32)).shape == (N_STATISTICS,)


def test_mean_and_deviation_come_first():
    value = np.zeros((40, N_CHANNELS), np.float32)
    value[:, 5] = np.tile([1.0, 3.0], 20)
    found = describe(value)
    assert found[5] == 2
    assert found[N_CHANNELS + 28 + 5] == 1


@pytest.mark.parametrize(("hertz", "band"), [(0.2, 0), (1.0, 2), (3.0, 4), (6.0, 5)])
def test_a_swing_falls_into_its_band(hertz, band):
    value = np.zeros((90, N_CHANNELS), np.float32)
    value[:, VELOCITY.start] = np.sin(2 * np.pi * hertz * np.arange(90) / RATE_HZ)
    energy = describe(value)[-25 * 22 : -19 * 22].reshape(6, 22)
    assert energy[:, 0].argmax() == band
    np.testing.assert_allclose(energy[:, 1], np.log(1e-3))


def test_order_in_time_counts_by_thirds_alone(rng):
    value = rng.normal(size=(63, N_CHANNELS)).astype(np.float32)
    there, back = describe(value), describe(value[::-1])
    parts = slice(4 * (N_CHANNELS + 28), 4 * (N_CHANNELS + 28) + 3 * N_CHANNELS)
    np.testing.assert_allclose(back[parts].reshape(3, -1), there[parts].reshape(3, -1)[::-1], atol=1e-6)
    np.testing.assert_allclose(np.delete(back, parts), np.delete(there, parts), atol=1e-6)


def test_percentiles_are_those_of_numpy(rng):
    value = rng.normal(size=(37, N_CHANNELS)).astype(np.float32)
    low = describe(value)[2 * (N_CHANNELS + 28) :][:N_CHANNELS]
    np.testing.assert_allclose(low, np.percentile(value.astype(float), 5, axis=0))


def test_a_hand_is_seen_from_the_shoulder(rng):
    value = rng.normal(size=(9, N_CHANNELS)).astype(np.float32)
    moved = value.copy()
    moved[:, : 3 * 22] += np.float32(5)
    reach = slice(N_CHANNELS, N_CHANNELS + 28)
    np.testing.assert_allclose(describe(moved)[reach], describe(value)[reach], atol=1e-5)


def test_a_stretch_longer_than_the_transform_counts_in_all_its_parts():
    value = np.zeros((256, N_CHANNELS), np.float32)
    value[:, VELOCITY.start] = np.sin(2 * np.pi * 8 * np.arange(256) / 128)
    energy = [describe(part)[-25 * 22 : -19 * 22] for part in (value[:128], value)]
    np.testing.assert_allclose(energy[0], energy[1], atol=1e-6)
    half = value.copy()
    half[128:] = 0
    band = energy[0].reshape(6, 22)[:, 0].argmax()
    quiet = describe(half)[-25 * 22 : -19 * 22].reshape(6, 22)[band, 0]
    assert quiet == pytest.approx(energy[0].reshape(6, 22)[band, 0] - np.log(2), abs=1e-3)


def test_a_motion_of_one_frame_has_it_in_every_third(rng):
    value = rng.normal(size=(1, N_CHANNELS)).astype(np.float32)
    parts = describe(value)[4 * (N_CHANNELS + 28) :][: 3 * N_CHANNELS].reshape(3, N_CHANNELS)
    np.testing.assert_allclose(parts, np.repeat(value, 3, axis=0))


@pytest.mark.parametrize("side", ["left", "right"])
def test_either_hand_is_seen_from_its_shoulder_head_hips_and_the_other_hand(side):
    value = np.zeros((5, N_CHANNELS), np.float32)
    value[:, 3 * JOINTS.index(f"{side}Hand")] = 2.0
    way, far = np.split(describe(value)[N_CHANNELS : N_CHANNELS + 28], [21])
    assert (way.reshape(7, 3)[:, 0] != 0).sum() == 4
    np.testing.assert_array_equal(np.sort(far), [0, 0, 0, 2, 2, 2, 2])
