import numpy as np
import pytest

from kernels import rotation
from kernels.calibration.gaps import aligned, bridge, fill


def test_fill_draws_straight_lines_and_holds_the_ends():
    series = np.array([9.0, 1.0, 9.0, 9.0, 4.0, 9.0]).reshape(6, 1, 1)
    is_good = np.array([0, 1, 0, 0, 1, 0], bool)[:, None]
    np.testing.assert_allclose(fill(series, is_good).ravel(), [1, 1, 2, 3, 4, 4])
    np.testing.assert_array_equal(fill(series, np.zeros((6, 1), bool)), series)


def test_bridges_follow_a_parabola_and_hold_the_ends():
    time = np.arange(60.0)
    series = np.stack([0.1 * time**2, 3.0 - time], axis=1)[:, None]
    is_good = np.ones((60, 1), bool)
    is_good[20:32] = False
    np.testing.assert_allclose(
        bridge(np.where(is_good[..., None], series, 99.0), is_good, frame_rate_hz=120.0), series, atol=1e-9
    )
    is_good[:4] = False
    np.testing.assert_array_equal(bridge(series, is_good, frame_rate_hz=120.0)[:4, 0], np.repeat(series[4], 4, axis=0))


def test_bridges_beat_lines_in_a_swing_and_trust_slopes_less_in_long_gaps():
    time_s = np.arange(480) / 120
    series = np.sin(2 * np.pi * time_s)[:, None, None]
    is_good = np.ones((480, 1), bool)
    is_good[150:174] = False
    near = np.abs(bridge(series, is_good, frame_rate_hz=120.0) - series).max()
    assert near < 0.2 * np.abs(fill(series, is_good) - series).max()
    is_good[150:390] = False  # two whole swings unseen: no slope may carry the curve out of the room
    assert np.abs(bridge(series, is_good, frame_rate_hz=120.0)).max() < 3.0


def bulge(width):
    """How far a bridge rises between a rise of 1 a frame and a fall of as much, so many frames apart, at 120 Hz."""
    left = np.arange(-60.0, 1.0)
    series = np.concatenate([left, np.full(width - 1, 99.0), left[::-1]])[:, None, None]
    is_good = (np.arange(len(series)) <= 60) | (np.arange(len(series)) >= 60 + width)
    return bridge(series, is_good[:, None], frame_rate_hz=120.0)[60 + width // 2, 0, 0]


def test_slopes_count_whole_up_to_a_quarter_of_a_second_and_the_less_the_longer_the_gap():
    # a whole parabola rises by a quarter of its width; from 30 frames on the slopes count 30 / width of that
    np.testing.assert_allclose([bulge(10), bulge(20), bulge(30)], [2.5, 5.0, 7.5])
    np.testing.assert_allclose([bulge(60), bulge(120), bulge(240)], [7.5, 7.5, 7.5])


@pytest.mark.parametrize("lost", [12, 30])
def test_a_side_without_nine_good_frames_leaves_along_the_line(lost):
    series = np.arange(44.0)[:, None, None] ** 2
    is_good = np.ones((44, 1), bool)
    is_good[18:24] = False
    both = bridge(series, is_good, frame_rate_hz=120.0)[18:24, 0, 0]
    is_good[lost] = False  # among the nine before the gap, or the nine after it
    one = bridge(series, is_good, frame_rate_hz=120.0)[18:24, 0, 0]
    line = fill(series, is_good)[18:24, 0, 0]
    near, far = (0, -1) if lost < 18 else (-1, 0)
    share = (one - line) / (both - line)  # of a parabola's two slopes each carries the whole at its own end
    assert abs(share[near]) < abs(share[far])
    assert 0 < share[near] < 0.5 < share[far] < 1


def test_where_too_little_is_known_a_bridge_is_a_line():
    series = np.arange(12.0).reshape(12, 1, 1) ** 2
    is_good = np.ones((12, 1), bool)
    is_good[5:8] = False
    np.testing.assert_array_equal(bridge(series, is_good, frame_rate_hz=120.0), fill(series, is_good))
    assert bridge(np.zeros((0, 2, 3)), np.zeros((0, 2), bool), frame_rate_hz=120.0).shape == (0, 2, 3)


def test_signs_are_carried_over_what_is_not_good():
    turn = rotation.exp(np.linspace(0, 1, 10)[:, None, None] * np.array([0.0, 0.0, 1.0]))
    flipped = turn * np.where(np.arange(10) % 3 == 0, -1.0, 1.0)[:, None, None]
    is_good = np.ones((10, 1), bool)
    is_good[4:6] = False
    got = aligned(flipped, is_good)
    assert (np.sum(got[1:] * got[:-1], axis=-1) > 0).all()


def test_what_is_not_good_turns_no_sign_of_those_after_it():
    angle = np.radians([0.0, 120.0, 60.0])
    turned = np.stack([np.cos(angle), np.sin(angle), 0 * angle, 0 * angle], axis=1)[:, None]
    got = aligned(turned, np.array([[True], [False], [True]]))
    np.testing.assert_array_equal(got, turned * np.array([1.0, -1.0, 1.0])[:, None, None])
