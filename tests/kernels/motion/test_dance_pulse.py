"""A dancer's pulse: known tempo, phase and octave; none in motion that has none."""

import numpy as np
import pytest

from kernels.motion.dance_pulse import beat_welcome, dance_pulse, even_out, gain_of, other_levels
from kernels.skeleton import kinematics
from kernels.synthetic.dancer import MOVES, place, take
from kernels.synthetic.social_dancer import aimless, breathing_beats, danced, uneven_beats

DANCES = sorted(set(MOVES) - {"idle"})


def off_s(found, beat_s):
    """Median distance of the beats found from the nearest known ones."""
    return float(np.median(np.abs(found.time_s[:, None] - beat_s).min(axis=1)))


@pytest.mark.parametrize("rate_hz", [24.0, 120.0])
@pytest.mark.parametrize("interval_s", [0.45, 0.6])
@pytest.mark.parametrize("label", DANCES)
def test_made_up_dancer_has_his_tempo_and_beats(label, interval_s, rate_hz):
    made = take(label, interval_s=interval_s, frame_rate_hz=rate_hz)
    found = dance_pulse(place(made), rate_hz)
    assert found.has_pulse
    assert found.tempo_bpm == pytest.approx(60 / interval_s, rel=0.02)
    assert off_s(found, made.beat_s) <= 1 / 24


@pytest.mark.parametrize("label", ["step", "sway", "hit", "twist"])
def test_a_tempo_that_breathes_is_followed(label):
    beat_s = breathing_beats(20.0, interval_s=0.6, depth_ratio=0.05)
    clip = danced([label], beat_s, frame_rate_hz=30.0, duration_s=20.0)
    found = dance_pulse(kinematics.place(clip)[0], 30.0)
    assert off_s(found, beat_s) <= 1 / 30
    assert 0.01 < found.spread_ratio < 0.06


def test_standing_still_has_no_pulse():
    made = place(take("idle", n_beats=24))
    assert dance_pulse(np.zeros((240, 22, 3)), 30.0).confidence_probability == 0
    for noise_m in (0.0, 0.002):
        found = dance_pulse(made + noise_m * np.random.default_rng(1).normal(size=made.shape), 30.0)
        assert not found.has_pulse
        assert found.confidence_probability < 0.5


def test_most_aimless_motion_has_no_pulse():
    found = [dance_pulse(kinematics.place(aimless(12.0, frame_rate_hz=30.0, seed=seed))[0], 30.0) for seed in range(30)]
    assert sum(one.has_pulse for one in found) <= 10
    assert np.median([one.confidence_probability for one in found]) < 0.3


def test_moves_at_no_tempo_are_mostly_without_a_pulse():
    found = []
    for seed in range(12):
        beat_s = uneven_beats(12.0, interval_s=0.6, spread_ratio=0.4, seed=seed)
        clip = danced(["step", "wave", "rock"], beat_s, frame_rate_hz=30.0, duration_s=12.0, seed=seed)
        found.append(dance_pulse(kinematics.place(clip)[0], 30.0))
    assert sum(one.has_pulse for one in found) <= 3


def test_beats_stay_in_the_clip_and_rise():
    made = take("kick", n_beats=9, first_beat_s=0.0)
    found = dance_pulse(place(made), 30.0)
    assert found.time_s[0] >= 0
    assert found.time_s[-1] <= (len(place(made)) - 1) / 30.0
    assert (np.diff(found.time_s) > 0.3).all()


@pytest.mark.parametrize("frames", [0, 1, 3, 12])
def test_a_clip_too_short_has_none(frames):
    assert not dance_pulse(np.zeros((frames, 22, 3)), 30.0).has_pulse


def test_another_rig_is_looked_at_joint_by_joint():
    time_s = np.arange(360) / 30
    position = np.zeros((360, 3, 3))
    position[:, 1, 0] = 0.4 * np.cos(np.pi * time_s / 0.6)
    position[:, 2, 2] = 0.4 * np.cos(np.pi * time_s / 0.6)
    assert dance_pulse(position, 30.0).tempo_bpm == pytest.approx(100.0, rel=0.02)


def test_other_levels_are_named_where_they_are_levels():
    assert other_levels(90.0) == (0.0, 180.0)
    assert other_levels(130.0) == (65.0, 0.0)


def test_even_out_keeps_an_even_row_and_fills_in_what_has_no_weight():
    even = 0.3 + 0.5 * np.arange(12)
    assert np.allclose(even_out(even, np.ones(12)), even)
    bent, weight = even.copy(), np.ones(12)
    bent[5] += 0.2
    weight[5] = 0.0
    assert np.abs(even_out(bent, weight) - even).max() < 0.01


def test_welcome_and_gain_are_bounded():
    welcome = beat_welcome(place(take("step")), 30.0)
    assert welcome.min() >= 0
    assert welcome.max() == 1
    assert np.isfinite(gain_of(welcome)).all()


def test_refusals():
    with pytest.raises(ValueError, match="position_m"):
        dance_pulse(np.zeros((9, 3)), 30.0)
    with pytest.raises(ValueError, match="frame_rate_hz"):
        dance_pulse(np.zeros((9, 22, 3)), 0.0)
