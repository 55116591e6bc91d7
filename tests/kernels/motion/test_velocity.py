"""Speed, kinematic beats, accents and jerk, against closed forms."""

import numpy as np
import pytest

from kernels.motion.velocity import (
    accents,
    jerk,
    jerk_around,
    kinematic_beats,
    mean_speed,
    speed_between,
    usable_frames,
)


@pytest.fixture
def swing():
    """One joint on a 1 Hz sine, 4 s at 60 Hz."""
    t = np.arange(240) / 60
    position = np.zeros((240, 1, 3))
    position[:, 0, 0] = np.sin(2 * np.pi * t)
    return position


def test_swing_turns_twice_a_cycle(swing):
    beats_s = kinematic_beats(swing, 60.0, smoothing_s=0.0) / 60
    np.testing.assert_allclose(beats_s, np.arange(0.25, 4, 0.5), atol=1 / 60)


def test_speed_of_a_steady_walk():
    position = np.zeros((20, 4, 3))
    position[:, :, 2] = (1.5 / 30 * np.arange(20))[:, None]
    np.testing.assert_allclose(mean_speed(position, 30.0), 1.5)


def test_speed_does_not_depend_on_the_rate(swing):
    coarse = mean_speed(swing[::2], 30.0)
    np.testing.assert_allclose(mean_speed(swing, 60.0)[::2][5:-5], coarse[5:-5], rtol=0.02, atol=0.02)


@pytest.mark.parametrize("n_frames", [0, 1, 3])
def test_too_short(n_frames):
    position = np.zeros((n_frames, 2, 3))
    assert len(kinematic_beats(position, 30.0)) == 0
    assert mean_speed(position, 30.0).shape == (n_frames,)
    assert not jerk(position, 30.0).any()


def test_constant_has_no_beats():
    assert len(kinematic_beats(np.ones((50, 2, 3)), 30.0)) == 0


def test_accents_are_full_on_a_stop_and_nothing_between(swing):
    on, between, sigma = accents(swing, 60.0, time_s=np.array([1.25, 1.5, 1.30]))
    assert on > 0.95
    assert between < 1e-5
    assert sigma == pytest.approx(np.exp(-0.5), abs=0.1)


def test_a_slight_stop_counts_less(swing):
    plain = accents(swing, 60.0, time_s=np.array([1.25]))[0]
    slight = accents(0.01 * swing, 60.0, time_s=np.array([1.25]))[0]
    assert plain > 0.95
    assert slight == pytest.approx(0.5, abs=0.15)
    assert accents(0.01 * swing, 60.0, time_s=np.array([1.25]), half_drop_m_per_s=0.0)[0] > 0.95


def test_accents_without_stops_are_zero():
    np.testing.assert_array_equal(accents(np.zeros((50, 1, 3)), 30.0, time_s=np.array([0.5, 1.0])), [0, 0])
    assert accents(np.zeros((50, 1, 3)), 30.0, time_s=np.zeros(0)).shape == (0,)


def test_jerk_of_a_cubic_is_its_third_derivative_at_any_rate():
    for rate_hz in (30.0, 120.0):
        t = np.arange(int(rate_hz)) / rate_hz
        position = np.zeros((len(t), 2, 3))
        position[:, 1, 1] = 5 * t**3
        np.testing.assert_allclose(jerk(position, rate_hz)[1:-2], 30.0, rtol=1e-6)


def test_jerk_is_seen_at_a_cut():
    position = np.zeros((40, 1, 3))
    position[20:, 0, 0] = 0.1
    found = jerk(position, 30.0)
    assert set(np.flatnonzero(found > 1)) <= {18, 19, 20, 21}
    assert found.max() > 1000


@pytest.mark.parametrize("function", [mean_speed, kinematic_beats, jerk])
def test_refusals(function):
    with pytest.raises(ValueError, match="F, J, 3"):
        function(np.zeros((4, 3)), 30.0)
    with pytest.raises(ValueError, match="not finite"):
        function(np.full((4, 1, 3), np.nan), 30.0)
    with pytest.raises(ValueError, match="> 0"):
        function(np.zeros((4, 1, 3)), -1.0)


@pytest.mark.parametrize("rate_hz", [30.0, 60.0, 120.0])
def test_jerk_around_a_moment_is_the_same_at_any_rate(rate_hz):
    time_s = np.arange(round(6 * rate_hz)) / rate_hz
    position = np.zeros((len(time_s), 2, 3))
    position[:, 0, 0] = 0.1 * np.sin(2 * np.pi * time_s)
    position[:, 1, 1] = np.where(np.abs(time_s - 3) < 0.5, 0.1 * np.sin(6 * np.pi * (time_s - 3)) ** 3, 0)
    peak, usual = jerk_around(position, rate_hz, time_s=np.array([1.0, 3.0, 5.0]))
    np.testing.assert_allclose(peak[[0, 2]], 0.1 * (2 * np.pi) ** 3, rtol=0.06)
    assert peak[1] > 10 * peak[0]
    assert peak[1] == pytest.approx(usual, rel=0.1)


def test_jerk_around_nothing():
    assert jerk_around(np.zeros((3, 1, 3)), 30.0, time_s=np.array([0.0, 0.05]))[0].tolist() == [0, 0]
    peak, usual = jerk_around(np.zeros((90, 1, 3)), 30.0, time_s=np.zeros(0))
    assert (len(peak), usual) == (0, 0.0)
    with pytest.raises(ValueError, match="frame_rate_hz"):
        jerk_around(np.zeros((90, 1, 3)), 0.0, time_s=np.zeros(0))


def test_speed_between_moments_of_a_body_that_speeds_up():
    position = np.zeros((121, 3, 3))
    position[:, :, 0] = (np.arange(121) / 30)[:, None] ** 2 / 2
    found = speed_between(position, 30.0, time_s=np.array([0.0, 1.0, 2.0, 4.0]))
    np.testing.assert_allclose(found, [0.5, 1.5, 3.0, 3.0], atol=0.03)
    assert len(speed_between(position, 30.0, time_s=np.zeros(0))) == 0
    assert speed_between(position, 30.0, time_s=np.array([1.0]))[0] == pytest.approx(2.0, abs=0.03)


def line(*step_m, n=40, usual_m=0.0):
    """Two joints of which one goes so far each frame, at first as said and then as usual, (n, 2, 3)."""
    position = np.zeros((n, 2, 3))
    step = np.full(n - 1, usual_m)
    step[: len(step_m)] = step_m
    position[1:, 1, 0] = np.cumsum(step)
    return position


def test_a_pose_before_the_take_and_one_after_it_are_left_out():
    assert usable_frames(line(1.0), 30.0) == (1, 39)
    assert usable_frames(line(0.0, 0.0, 1.0), 30.0) == (3, 39)
    assert usable_frames(line(1.0, 0.0, 1.0), 30.0) == (3, 39)
    assert usable_frames(line(1.0)[::-1], 30.0) == (0, 38)
    assert usable_frames(line(0.0, 0.0, 1.0)[::-1], 30.0) == (0, 36)
    assert usable_frames(line(1.0, 0.0, 1.0)[::-1], 30.0) == (0, 36)


def test_a_jump_further_in_is_part_of_the_take():
    assert usable_frames(line(0.0, 0.0, 0.0, 1.0), 30.0) == (0, 39)
    assert usable_frames(line(0.0, 0.0, 0.0, 1.0)[::-1], 30.0) == (0, 39)


def test_a_jump_is_faster_than_8_m_a_second_and_than_four_times_the_usual():
    assert usable_frames(line(7.9 / 30), 30.0) == (0, 39)
    assert usable_frames(line(8.1 / 30), 30.0) == (1, 39)
    assert usable_frames(line(11.9 / 30, usual_m=3 / 30), 30.0) == (0, 39)
    assert usable_frames(line(12.1 / 30, usual_m=3 / 30), 30.0) == (1, 39)


@pytest.mark.parametrize("n", [0, 1, 11, 12])
def test_a_clip_of_fewer_than_twelve_frames_is_used_whole(n):
    assert usable_frames(line(n=12)[:n], 30.0) == (0, max(n - 1, 0))


def moving(*speed_m_per_s):
    """One joint whose central differences are these speeds at one frame a second, but for the ends."""
    position = np.zeros((len(speed_m_per_s) + 1, 1, 3))
    position[1:, 0, 0] = np.cumsum(speed_m_per_s)
    return position


def test_of_equal_lowest_speeds_the_first_is_the_beat():
    found = kinematic_beats(moving(4, 4, 1, 1, 1, 4, 4), 1.0, smoothing_s=0.0)
    np.testing.assert_array_equal(found, [3])


def test_three_frames_are_too_few_for_a_beat():
    there_and_back = moving(1, -1)
    np.testing.assert_array_equal(mean_speed(there_and_back, 1.0, smoothing_s=0.0), [1, 0, 1])
    assert len(kinematic_beats(there_and_back, 1.0, smoothing_s=0.0)) == 0
    assert len(kinematic_beats(moving(1, -1, -1), 1.0, smoothing_s=0.0)) == 1


def test_the_drop_of_a_stop_is_from_the_mean_of_the_peaks_beside_it():
    t = np.arange(360) / 60
    position = np.zeros((360, 1, 3))
    # slow before the stop at 3 s and fast after it
    position[:, 0, 0] = np.where(t < 3, 0.05, 0.3) * np.cos(np.pi * (t - 3))
    position[t < 3, 0, 0] += 0.25
    speed = mean_speed(position, 60.0)
    stop = int(kinematic_beats(position, 60.0)[np.argmin(np.abs(kinematic_beats(position, 60.0) - 180))])
    beside = [k for k in kinematic_beats(position, 60.0) if k != stop]
    before = speed[max([k for k in beside if k < stop], default=0) : stop].max()
    after = speed[stop : min([k for k in beside if k > stop], default=360)].max()
    assert after > 3 * before
    drop = (before + after) / 2 - speed[stop]
    for half in (0.05, 0.5):
        got = accents(position, 60.0, time_s=np.array([stop / 60]), half_drop_m_per_s=half)[0]
        assert got == pytest.approx(drop / (drop + half), rel=1e-6)


def test_jerk_is_that_of_the_joint_that_jerks_most():
    t = np.arange(30) / 30
    position = np.zeros((30, 3, 3))
    position[:, 1, 1] = 5 * t**3
    position[:, 2, 1] = 2 * t**3
    np.testing.assert_allclose(jerk(position, 30.0)[1:-2], 30.0, rtol=1e-6)
    peak, usual = jerk_around(position, 30.0, time_s=np.array([0.5]))
    assert peak[0] == pytest.approx(30.0, rel=1e-6)
    assert usual == pytest.approx(30.0, rel=1e-6)


def test_jerk_around_reaches_as_far_on_either_side_and_usually_is_its_99th_percentile():
    position = np.zeros((1000, 1, 3))
    position[500:, 0, 0] = 0.1  # a jump of the positions between 499 and 500
    at = 499.5 / 30
    for reach_s, apart_s, is_seen in ((0.3, 0.32, True), (0.3, 0.35, False)):
        for moment in (at - apart_s, at + apart_s):
            peak, usual = jerk_around(position, 30.0, time_s=np.array([moment]), reach_s=reach_s)
            assert (peak[0] > 0) == is_seen
            assert usual == 0  # three of a thousand


def test_a_slow_recording_is_looked_at_frame_by_frame():
    t = np.arange(40) / 10
    position = np.zeros((40, 1, 3))
    position[:, 0, 0] = t**3
    peak, usual = jerk_around(position, 10.0, time_s=np.array([2.0]))
    np.testing.assert_allclose([peak[0], usual], 6.0, rtol=1e-6)


def test_moments_in_one_frame_and_beyond_the_clip_have_the_speed_there():
    position = moving(1, 1, 1, 5, 5, 5)
    found = speed_between(position, 1.0, time_s=np.array([1.0, 1.2, 1.4]))
    np.testing.assert_allclose(found, 1.0)
    np.testing.assert_allclose(speed_between(position, 1.0, time_s=np.array([0.0, 99.0])), 16 / 6)
    np.testing.assert_allclose(speed_between(position, 1.0, time_s=np.array([50.0, 99.0])), 5.0)
