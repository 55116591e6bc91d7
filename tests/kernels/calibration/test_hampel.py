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


def spiked(size_m, *, rate_hz, frame=100, n=200):
    """Frames found where one sensor stands still but for one frame."""
    place = np.zeros((n, 1, 3))
    place[frame, 0, 1] = size_m
    still = np.tile(rotation.IDENTITY, (n, 1, 1))
    return np.flatnonzero(find_outliers(place, still, np.ones((n, 1), bool), frame_rate_hz=rate_hz)).tolist()


def twisted(chord, *, rate_hz):
    """The same with a rotation that differs by so much in the quaternion."""
    turned = np.tile(rotation.IDENTITY, (200, 1, 1))
    turned[100, 0] = rotation.from_axis_angle(np.array([0.0, 1.0, 0.0]), 4 * np.arcsin(chord / 2))
    still = np.zeros((200, 1, 3))
    return np.flatnonzero(find_outliers(still, turned, np.ones((200, 1), bool), frame_rate_hz=rate_hz)).tolist()


def test_nothing_within_15_mm_or_a_twentieth_of_a_quaternion_is_an_outlier():
    assert spiked(0.014, rate_hz=240.0) == []
    assert spiked(0.016, rate_hz=240.0) == [100]
    assert twisted(0.048, rate_hz=240.0) == []
    assert twisted(0.052, rate_hz=240.0) == [100]


def test_nor_is_what_a_body_can_do_in_two_frames():
    # 30 m/s2 over 67 ms is 67 mm, and 100 rad/s2 222 mrad, half of it in the quaternion
    assert spiked(0.065, rate_hz=30.0) == []
    assert spiked(0.069, rate_hz=30.0) == [100]
    assert twisted(0.109, rate_hz=30.0) == []
    assert twisted(0.113, rate_hz=30.0) == [100]


@pytest.mark.parametrize("frame", [0, 3, 196, 199])
def test_the_first_and_last_four_frames_are_judged_four_times_as_loosely(frame):
    assert spiked(0.055, rate_hz=240.0, frame=frame) == []
    assert spiked(0.065, rate_hz=240.0, frame=frame) == [frame]


@pytest.mark.parametrize("frame", [4, 195])
def test_and_the_ones_next_to_them_are_not(frame):
    assert spiked(0.03, rate_hz=240.0, frame=frame) == [frame]


def shaken(loudness_m, times, *, frame):
    """Whether a frame is found that lies so many times a given deviation above its median, in noise."""
    place = np.zeros((len(loudness_m), 1, 3))
    place[:, 0, 1] = loudness_m * np.random.default_rng(5).uniform(-1, 1, len(loudness_m))
    place[frame, 0, 1] = 1.0
    middle = running_median(place)[:, 0, 1]
    away = np.abs(place[:, 0, 1] - middle)
    usual, near = float(np.median(away)), float(np.median(away[frame - 20 : frame + 21 : 5]))
    place[frame, 0, 1] = middle[frame] + times(usual, near)
    still = np.tile(rotation.IDENTITY, (len(place), 1, 1))
    return bool(find_outliers(place, still, np.ones((len(place), 1), bool), frame_rate_hz=240.0, rounds=1)[frame, 0])


def test_an_outlier_is_six_times_as_far_off_as_the_sensor_usually_is():
    # quiet for 20 frames around: what it usually does decides
    loudness_m = np.where(np.abs(np.arange(600) - 300) < 40, 0.001, 0.02)
    assert not shaken(loudness_m, lambda usual, _: 5.5 * usual, frame=300)
    assert shaken(loudness_m, lambda usual, _: 6.5 * usual, frame=300)


def test_and_five_times_as_far_as_it_is_nearby():
    # loud for 20 frames around, quiet elsewhere
    loudness_m = np.where(np.abs(np.arange(600) - 300) < 40, 0.04, 0.001)
    assert not shaken(loudness_m, lambda _, near: 4.5 * near, frame=300)
    assert shaken(loudness_m, lambda _, near: 6.0 * near, frame=300)


@pytest.mark.parametrize(
    ("lost", "found"),
    [([102, 103, 104, 105, 107], [106]), ([102, 103, 109, 110, 105], [106]), ([103, 104, 105, 107], [])],
)
def test_a_good_reading_alone_among_bad_ones_is_not_believed_however_well_it_fits(lost, found):
    place, still = np.zeros((200, 1, 3)), np.tile(rotation.IDENTITY, (200, 1, 1))
    is_usable = np.ones((200, 1), bool)
    is_usable[lost] = False
    got = find_outliers(place, still, is_usable, frame_rate_hz=120.0, rounds=1)
    np.testing.assert_array_equal(np.flatnonzero(got), found)


def test_outliers_count_as_bad_for_those_between_them():
    place, still = np.zeros((200, 1, 3)), np.tile(rotation.IDENTITY, (200, 1, 1))
    place[[103, 105, 107], 0, 1] = [0.3, -0.3, 0.3]
    is_usable = np.ones((200, 1), bool)
    is_usable[[102, 104]] = False
    got = find_outliers(place, still, is_usable, frame_rate_hz=120.0)
    assert got[106, 0]


def test_what_is_unusable_is_no_outlier():
    place, still = np.zeros((200, 1, 3)), np.tile(rotation.IDENTITY, (200, 1, 1))
    place[100, 0, 1] = 1.0
    is_usable = np.ones((200, 1), bool)
    is_usable[100] = False
    assert not find_outliers(place, still, is_usable, frame_rate_hz=120.0).any()


def test_signs_of_quaternions_are_no_outliers():
    turned = np.tile(rotation.IDENTITY, (200, 1, 1))
    turned[::7] *= -1
    assert not find_outliers(np.zeros((200, 1, 3)), turned, np.ones((200, 1), bool), frame_rate_hz=120.0).any()


def test_bursts_fall_from_their_ends():
    place, still = np.zeros((300, 1, 3)), np.tile(rotation.IDENTITY, (300, 1, 1))
    place[100:107, 0, 0] = np.linspace(0.2, 1.0, 7)
    usable = np.ones((300, 1), bool)
    found = [
        np.flatnonzero(find_outliers(place, still, usable, frame_rate_hz=120.0, rounds=n)).tolist() for n in (1, 2, 3)
    ]
    assert found == [list(range(first, 107)) for first in (103, 101, 100)]
    assert np.flatnonzero(find_outliers(place, still, usable, frame_rate_hz=120.0)).tolist() == found[2]


def test_fast_motion_at_the_very_ends_is_held_against_a_line():
    place = np.zeros((200, 1, 3))
    place[:, 0, 0] = np.arange(200) / 240 * 6.0  # 6 m/s
    still = np.tile(rotation.IDENTITY, (200, 1, 1))
    assert not find_outliers(place, still, np.ones((200, 1), bool), frame_rate_hz=240.0).any()


def test_no_frames_and_few():
    for n in (0, 1, 5, 12):
        still = np.tile(rotation.IDENTITY, (n, 1, 1))
        got = find_outliers(np.zeros((n, 1, 3)), still, np.ones((n, 1), bool), frame_rate_hz=120.0)
        assert got.shape == (n, 1)
        assert not got.any()


def test_median_of_the_good_ones():
    values = np.array([[1.0, 5.0], [9.0, 5.0], [2.0, 5.0], [3.0, 5.0]])
    is_good = np.array([[1, 0], [0, 0], [1, 0], [1, 0]], bool)
    np.testing.assert_array_equal(median_where(values, is_good), [2.0, 0.0])
