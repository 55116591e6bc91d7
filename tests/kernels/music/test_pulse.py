"""The pulse network: its inputs, and that it knows a beat when it hears one."""

import numpy as np
import pytest

from kernels.music import pulse
from kernels.music.harmony import harmony_changes, key_levels
from kernels.music.onsets import band_levels
from kernels.music.pulse import PULSE_RATE_HZ, layer_shapes, pulse_features, pulse_probability
from kernels.music.pulse_weights import N_HIDDEN
from kernels.synthetic.drum_machine import drum_machine_song

RATE = 22050


def described(samples, rate=RATE):
    level, centre_hz = band_levels(samples, rate)
    keys = key_levels(samples, rate, frame_rate_hz=PULSE_RATE_HZ)
    return pulse_features(level, centre_hz, harmony_changes(keys, frame_rate_hz=PULSE_RATE_HZ))


@pytest.fixture(scope="module")
def song():
    return drum_machine_song(tempo_bpm=118, n_bars=10)


@pytest.fixture(scope="module")
def features(song):
    return described(song.render(sample_rate_hz=RATE))


def test_beats_are_likelier_than_what_lies_between(song, features):
    probability = pulse_probability(features)
    frame = np.rint(song.beats.time_s[8:-4] * PULSE_RATE_HZ).astype(int)
    half = round(0.5 * 60 / 118 * PULSE_RATE_HZ)
    on = np.maximum.reduce([probability[frame + i] for i in (-1, 0, 1)])
    between = np.maximum.reduce([probability[frame + half + i] for i in (-1, 0, 1)])
    assert on[:, 0].mean() > 0.6
    assert between[:, 0].mean() < 0.2
    is_down = song.beats.beat_in_bar_number[8:-4] == 1
    assert on[is_down, 1].mean() > 3 * on[~is_down, 1].mean()


def test_shift_in_time_shifts_the_probabilities(features):
    """Away from the ends, where the network sees the zeros around a song."""
    one, other = pulse_probability(features), pulse_probability(np.pad(features, ((100, 0), (0, 0))))
    np.testing.assert_allclose(other[100:].mean(axis=0), one.mean(axis=0), atol=0.02)
    assert np.corrcoef(other[100:, 0], one[:, 0])[0, 1] > 0.95


def test_gain_does_not_matter(song):
    sound = song.render(sample_rate_hz=RATE)
    np.testing.assert_allclose(described(0.05 * sound), described(sound), atol=0.02)


def test_sample_rate_hardly_matters(song, features):
    other = described(song.render(sample_rate_hz=44100), 44100)
    assert np.corrcoef(pulse_probability(other)[:1000, 0], pulse_probability(features)[:1000, 0])[0, 1] > 0.9


def test_shapes_of_features(features):
    assert features.shape[1] == 16
    assert np.isfinite(features).all()
    assert features[:, :11].min() >= 0
    assert features[:, :11].max() < 2
    assert described(np.zeros(0)).shape == (0, 16)
    assert described(np.zeros(RATE))[:, :11].max() == 0


def test_nothing_in_nothing_out():
    assert pulse_probability(np.zeros((0, 16))).shape == (0, 2)
    one = pulse_probability(np.zeros((1, 16)))
    assert one.shape == (1, 2)
    assert ((one > 0) & (one < 1)).all()


def test_weights_fill_the_layers_exactly():
    total = sum(layer.size for layer in pulse._layers())
    assert total == sum(int(np.prod(shape)) for shape in layer_shapes(N_HIDDEN))
    assert all(np.isfinite(layer).all() for layer in pulse._layers())


def test_dilated_convolution_by_hand(monkeypatch):
    """The network written out frame by frame gives the same."""
    monkeypatch.setattr(pulse, "SPEEDS", (1.0,))
    x = np.random.default_rng(0).uniform(0, 1, (40, 16))
    layers = [np.asarray(layer, np.float64) for layer in pulse._layers()]

    def elu(v):
        return np.where(v > 0, v, np.exp(np.minimum(v, 0)) - 1)

    state = elu(x @ layers[0] + layers[1])
    for i, dilation in enumerate(pulse.DILATIONS):
        taps, bias, mix, mix_bias = layers[2 + 4 * i : 6 + 4 * i]
        new = np.zeros_like(state)
        for t in range(len(x)):
            heard = bias.copy()
            for tap in range(5):
                at = t + (tap - 2) * dilation
                if 0 <= at < len(x):
                    heard += state[at] @ taps[tap]
            new[t] = state[t] + elu(heard) @ mix + mix_bias
        state = new
    by_hand = 1 / (1 + np.exp(-(state @ layers[-2] + layers[-1])))
    np.testing.assert_allclose(pulse_probability(x), by_hand, atol=1e-4)


def test_speeds_are_averaged_in_log_odds(monkeypatch):
    x = np.random.default_rng(1).uniform(0, 1, (200, 16))

    def log_odds(*speeds):
        monkeypatch.setattr(pulse, "SPEEDS", speeds)
        p = pulse_probability(x)
        return np.log(p / (1 - p))

    together = log_odds(0.94, 1.0, 1.06)
    np.testing.assert_allclose(together, (log_odds(0.94) + log_odds(1.0) + log_odds(1.06)) / 3, atol=1e-9)
    assert np.abs(together - log_odds(1.0)).max() > 0.01


def test_refuses_other_shapes():
    with pytest.raises(ValueError, match="features"):
        pulse_probability(np.zeros((5, 12)))


def test_levels_that_do_not_change_have_no_onset_and_no_change_of_colour():
    level, centre_hz = np.tile([3.0, 1.0, 2.0], (120, 1)), np.array([60.0, 500.0, 4000.0])
    found = pulse_features(level, centre_hz, np.zeros((60, 4)))
    assert found.shape == (60, 16)
    np.testing.assert_allclose(found[8:-8], 0, atol=1e-9)


def test_a_change_of_colour_is_told_below_and_above_two_hundred_hertz():
    level, centre_hz = np.zeros((80, 2)), np.array([100.0, 800.0])
    level[40:, 0] = 2.0  # a low sound sets in and stays
    found = pulse_features(level, centre_hz, np.zeros((40, 4)))
    assert abs(int(found[8:-8, 9].argmax()) + 8 - 20) <= 1
    assert found[8:-8, 9].max() > 0
    assert not found[8:-8, 10].any()
    other = pulse_features(level[:, ::-1], centre_hz, np.zeros((40, 4)))
    assert not other[8:-8, 9].any()
    assert other[8:-8, 10].max() > 0


def test_loudness_is_told_against_the_mean_of_the_song():
    level = np.concatenate([np.full((60, 2), 1.0), np.full((60, 2), 3.0)])
    found = pulse_features(level, np.array([100.0, 800.0]), np.zeros((60, 4)))[:, 11]
    np.testing.assert_allclose(found[[15, 45]], [-1.0, 1.0])
    loud = pulse_features(np.concatenate([0 * level, 9 + 0 * level]), np.array([100.0, 800.0]), np.zeros((120, 4)))
    assert np.abs(loud[:, 11]).max() == 2.0


def test_a_soft_band_is_not_blown_up_to_a_loud_one():
    """Bands are scaled to their own onsets, but never by more than a tenth of the strongest allows."""
    level = np.zeros((400, 2))
    for at in range(20, 400, 40):
        level[at : at + 4, 0], level[at : at + 4, 1] = 4.0, 0.02
    found = pulse_features(level, np.array([60.0, 3500.0]), np.zeros((200, 4)))
    assert found[:, 0].max() > 5 * found[:, 6].max()


def test_an_odd_number_of_frames_is_halved_upwards():
    assert pulse_features(np.zeros((7, 2)), np.array([100.0, 800.0]), np.zeros((4, 4))).shape == (4, 16)
