"""Beats moved to attacks known to the sample."""

import numpy as np
import pytest

from kernels.music.attacks import STIFFNESS, _smooth, attack_strength, snap_to_attacks
from kernels.synthetic.drum_machine import CLICKS, beat_times, click_train


@pytest.mark.parametrize("click", CLICKS)
@pytest.mark.parametrize(("bpm", "end_bpm"), [(60, 60), (113, 113), (180, 180), (90, 130)])
@pytest.mark.parametrize("rate", [8000, 44100])
def test_rough_beats_come_to_within_two_milliseconds(click, bpm, end_bpm, rate):
    true = beat_times(tempo_bpm=bpm, end_tempo_bpm=end_bpm, n_beats=30, start_s=0.4)
    train = click_train(true, click=click, sample_rate_hz=rate)
    rough = true + np.random.default_rng(0).normal(-0.008, 0.006, len(true))
    found = snap_to_attacks(rough, train.samples, rate)
    assert np.abs(found - true).max() < 0.002


def test_beats_on_the_ends_of_beeps_go_back_to_their_starts():
    true = beat_times(tempo_bpm=113, n_beats=30, start_s=0.4)
    train = click_train(true, click="beep")
    rough = true + 0.05 + np.random.default_rng(0).normal(0, 0.004, len(true))
    assert np.abs(snap_to_attacks(rough, train.samples, train.sample_rate_hz) - true).max() < 0.002


def test_a_break_is_bridged_in_tempo():
    true = beat_times(tempo_bpm=120, n_beats=40, start_s=0.3)
    dropped = (np.arange(40) > 15) & (np.arange(40) < 22)
    train = click_train(true, is_dropped=dropped)
    rough = true + np.random.default_rng(1).normal(0, 0.006, 40)
    assert np.abs(snap_to_attacks(rough, train.samples, train.sample_rate_hz) - true).max() < 0.006


def test_one_stray_attack_does_not_pull_a_beat_along():
    true = beat_times(tempo_bpm=120, n_beats=30, start_s=0.3)
    played = true.copy()
    played[12] += 0.035
    train = click_train(played)
    assert abs(snap_to_attacks(true, train.samples, train.sample_rate_hz)[12] - true[12]) < 0.012


def test_silence_and_few_beats_stay():
    true = beat_times(tempo_bpm=120, n_beats=8)
    np.testing.assert_allclose(snap_to_attacks(true, np.zeros(5 * 22050), 22050), true, atol=0.01)
    np.testing.assert_array_equal(snap_to_attacks(true[:3], np.ones(22050), 22050), true[:3])
    assert len(snap_to_attacks(np.zeros(0), np.zeros(0), 22050)) == 0


def test_strength_peaks_at_the_attack_and_is_even_at_the_edges():
    train = click_train(np.array([0.5]), sample_rate_hz=22050)
    strength = attack_strength(train.samples, 22050, np.array([0.5, 0.0, 10.0]), reach_s=0.04)
    assert strength.shape == (3, 41)
    assert abs(int(strength[0].argmax()) - 20) <= 3
    assert strength[2].max() == 0


def test_banded_solution_is_the_dense_one():
    rng = np.random.default_rng(2)
    for n in (4, 5, 9):
        value, weight = rng.standard_normal(n), rng.uniform(0.1, 1, n)
        third = np.diff(np.eye(n), 3, axis=0)
        dense = np.linalg.solve(np.diag(weight) + STIFFNESS * third.T @ third, weight * value)
        np.testing.assert_allclose(_smooth(value, weight), dense, atol=1e-9)


@pytest.mark.parametrize("first_s", [0.5, 0.43, 0.57])
def test_beats_so_close_that_one_attack_draws_them_all_stay_as_they_are(first_s):
    """Beside the attack, and so far off it that all of them would be moved by one lag first."""
    train = click_train(np.array([0.5]), sample_rate_hz=22050)
    beats = first_s + 1e-5 * np.arange(6)
    np.testing.assert_array_equal(snap_to_attacks(beats, train.samples, 22050), beats)


def test_a_tone_that_is_cut_off_is_no_attack():
    """The click at the end of a beep is as wide in frequency as its start, but leaves less sound."""
    time_s = np.arange(22050) / 22050
    beep = np.where((time_s >= 0.3) & (time_s < 0.6), np.sin(2 * np.pi * 1000 * time_s), 0.0)
    start, end = attack_strength(beep, 22050, np.array([0.3, 0.6]), reach_s=0.03).max(axis=1)
    assert end < 0.3 * start
    assert end > 0


def test_of_two_attacks_as_strong_the_nearer_draws_a_beat():
    true = beat_times(tempo_bpm=100, n_beats=12, start_s=0.5)
    train = click_train(np.sort(np.concatenate([true, true + 0.036])))
    found = snap_to_attacks(true + 0.006, train.samples, train.sample_rate_hz)
    assert np.abs(found - true).max() < 0.008


def test_attacks_are_looked_for_around_each_beat_alone():
    train = click_train(np.array([0.5, 1.5]), sample_rate_hz=22050)
    strength = attack_strength(train.samples, 22050, np.array([1.0, 1.5]), reach_s=0.04)
    assert strength[0].max() < 1e-3 * strength[1].max()
    assert attack_strength(train.samples, 22050, np.zeros(0), reach_s=0.04).shape == (0, 41)
    assert attack_strength(train.samples, 22050, np.array([0.5]), reach_s=0.0).shape == (1, 1)


@pytest.mark.parametrize(("hertz", "is_heard"), [(1000, True), (9000, True), (15000, False)])
def test_attacks_are_heard_up_to_10_khz(hertz, is_heard):
    """A tone that swells within 5 ms, so that it is heard at its own pitch alone."""
    time_s = np.arange(44100) / 44100
    swell = np.sin(np.pi / 2 * np.clip((time_s - 0.4) / 0.005, 0, 1)) ** 2
    strength = attack_strength(swell * np.sin(2 * np.pi * hertz * time_s), 44100, np.array([0.4]), reach_s=0.03).max()
    usual = attack_strength(swell * np.sin(2 * np.pi * 3000 * time_s), 44100, np.array([0.4]), reach_s=0.03).max()
    assert (strength > 0.4 * usual) == is_heard
