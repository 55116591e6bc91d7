"""Speed, kinematic beats, accents and jerk, against closed forms."""

import numpy as np
import pytest

from kernels.motion.velocity import accents, jerk, jerk_around, kinematic_beats, mean_speed, speed_between


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
