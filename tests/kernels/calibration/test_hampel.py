import numpy as np
import pytest

from kernels import rotation
from kernels.calibration.hampel import find_outliers, median_where, running_median


@pytest.mark.parametrize("stride", [1, 3])
def test_running_median_is_the_median_of_nine(stride):
    series = np.random.default_rng(0).normal(size=(60, 2, 3))
    got = running_median(series, stride=stride)
    reach = 4 * stride
    for k in (reach, 30, 59 - reach):
        np.testing.assert_array_equal(got[k], np.median(series[k - reach : k + reach + 1 : stride], axis=0))
    assert len(running_median(np.zeros((0, 2)))) == 0


def test_fast_turns_are_not_outliers():
    time_s = np.arange(600) / 120
    place = np.zeros((600, 1, 3))
    place[:, 0, 0] = 0.3 * np.sin(2 * np.pi * 2.5 * time_s)  # 74 m/s² at the ends
    still = np.tile(rotation.IDENTITY, (600, 1, 1))
    assert not find_outliers(place, still, np.ones((600, 1), bool), frame_rate_hz=120.0)[4:-4].any()
    gentle = 0.4 * place  # at the very ends half as much is known
    assert not find_outliers(gentle, still, np.ones((600, 1), bool), frame_rate_hz=120.0).any()


def test_an_outlier_at_an_end_does_not_vouch_for_itself():
    place = np.zeros((200, 1, 3))
    place[:, 0, 0] = np.arange(200) / 60  # 2 m/s
    place[[0, 1, -1], 0, 1] = 0.2
    still = np.tile(rotation.IDENTITY, (200, 1, 1))
    found = find_outliers(place, still, np.ones((200, 1), bool), frame_rate_hz=120.0)
    np.testing.assert_array_equal(np.flatnonzero(found), [0, 1, 199])


def test_a_lone_entry_among_outliers_is_not_believed():
    rng = np.random.default_rng(0)
    place = np.zeros((300, 1, 3))
    place[100:112, 0] = 0.3 + 0.15 * rng.normal(size=(12, 3))
    still = np.tile(rotation.IDENTITY, (300, 1, 1))
    is_usable = np.ones((300, 1), bool)
    is_usable[[102, 103, 104, 105, 107, 108, 109]] = False
    found = find_outliers(place, still, is_usable, frame_rate_hz=120.0)
    assert (found | ~is_usable)[100:112].all()
    assert found[:90].sum() == found[120:].sum() == 0


def test_median_of_the_good_ones():
    values = np.array([[1.0, 5.0], [9.0, 5.0], [2.0, 5.0], [3.0, 5.0]])
    is_good = np.array([[1, 0], [0, 0], [1, 0], [1, 0]], bool)
    np.testing.assert_array_equal(median_where(values, is_good), [2.0, 0.0])
