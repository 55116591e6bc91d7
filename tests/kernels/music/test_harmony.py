"""Semitone levels and changes of harmony, on chords that are known."""

import numpy as np
import pytest

from kernels.music.harmony import LOWEST_KEY, harmony_changes, key_levels

RATE = 22050


def chord(keys, seconds, rate=RATE):
    t = np.arange(int(seconds * rate)) / rate
    return sum(0.2 * np.sin(2 * np.pi * 440 * 2 ** ((key - 69) / 12) * t) for key in keys)


@pytest.mark.parametrize("rate", [8000, 22050, 44100])
@pytest.mark.parametrize("key", [45, 57, 69, 81])
def test_a_tone_lights_its_own_key(rate, key):
    level = key_levels(chord([key], 1.0, rate), rate, frame_rate_hz=50)
    assert level.shape == (51, 60)
    assert int(level[25].argmax()) + LOWEST_KEY == key


def test_change_is_largest_where_the_chord_changes():
    samples = np.concatenate([chord([48, 60, 64, 67], 2.0), chord([53, 60, 65, 69], 2.0)])
    change = harmony_changes(key_levels(samples, RATE, frame_rate_hz=50), frame_rate_hz=50)
    inside = change[20:-20]
    for column in range(4):
        assert (int(inside[:, column].argmax()) + 20) / 50 == pytest.approx(2.0, abs=0.1)
    assert inside[:, 0].max() > 5 * np.median(inside[:, 0])


def test_loudness_and_repetition_are_no_change():
    held = chord([48, 60, 64, 67], 4.0)
    pulsed = held * (1 + 0.5 * np.sign(np.sin(2 * np.pi * 2 * np.arange(len(held)) / RATE)))
    change = harmony_changes(key_levels(pulsed, RATE, frame_rate_hz=50), frame_rate_hz=50)
    assert change[20:-20].max() < 0.06


def test_silence_and_nothing():
    assert key_levels(np.zeros(0), RATE, frame_rate_hz=50).shape == (0, 60)
    assert harmony_changes(np.zeros((0, 60)), frame_rate_hz=50).shape == (0, 4)
    quiet = key_levels(np.zeros(RATE), RATE, frame_rate_hz=50)
    assert quiet.max() == 0
    assert harmony_changes(quiet, frame_rate_hz=50).max() == 0


def test_refusals():
    with pytest.raises(ValueError, match="sample_rate_hz"):
        key_levels(np.zeros(5), 0, frame_rate_hz=50)
    with pytest.raises(ValueError, match="samples"):
        key_levels(np.zeros((2, 2, 2)), RATE, frame_rate_hz=50)


def test_keys_above_the_nyquist_frequency_are_not_heard():
    level = key_levels(chord([57], 1.0, 2000), 2000, frame_rate_hz=50)
    above = 440.0 * 2.0 ** ((np.arange(LOWEST_KEY, LOWEST_KEY + 60) - 69) / 12.0) > 1100
    assert above.any()
    assert not level[:, above].any()
    assert level[25, 57 - LOWEST_KEY] > 0


def test_a_change_of_bass_alone_is_seen_in_the_bass():
    samples = np.concatenate([chord([40, 64, 67, 71], 2.0), chord([45, 64, 67, 71], 2.0)])
    change = harmony_changes(key_levels(samples, RATE, frame_rate_hz=50), frame_rate_hz=50)[95:106].max(axis=0)
    assert change[2] > 2 * change[0]
    assert change[3] > 2 * change[1]


def test_the_same_chord_an_octave_up_is_no_change_of_pitch_classes():
    samples = np.concatenate([chord([60, 64, 67], 2.0), chord([72, 76, 79], 2.0)])
    change = harmony_changes(key_levels(samples, RATE, frame_rate_hz=50), frame_rate_hz=50)
    assert change[95:106, :2].max() < 0.1


def test_too_quiet_to_hear_is_silence():
    assert not key_levels(1e-7 * chord([57], 1.0), RATE, frame_rate_hz=50).any()
    assert key_levels(1e-3 * chord([57], 1.0), RATE, frame_rate_hz=50).any()


def test_a_rate_of_frames_that_cannot_be_is_refused():
    for bad in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="frame_rate_hz"):
            key_levels(np.zeros(5), RATE, frame_rate_hz=bad)
