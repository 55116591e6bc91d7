"""The preview synthesizer: right pitches at right times, and always the same."""

import numpy as np
import pytest

from kernels.music.notes import sorted_notes
from kernels.music.preview import DRUMS, VOICES, Voice, play, render_preview

RATE = 22050


def spectrum_peak_hz(samples, rate=RATE):
    return float(np.argmax(np.abs(np.fft.rfft(samples * np.hanning(len(samples))))) * rate / len(samples))


@pytest.mark.parametrize("program", range(0, 128, 8))
def test_a_note_has_its_pitch_and_its_place(program):
    sound = render_preview(sorted_notes([(0.5, 1.0, 69, 100, 1, program)]), sample_rate_hz=RATE)[:, 0]
    assert np.abs(sound[: RATE // 2]).max() == 0
    during = sound[int(0.7 * RATE) : int(1.4 * RATE)]
    assert spectrum_peak_hz(during) / 440 == pytest.approx(round(spectrum_peak_hz(during) / 440), abs=0.01)
    assert np.abs(during).max() > 3 * np.abs(sound[int(2.6 * RATE) :]).max()


def test_drums_are_told_apart():
    """Half of a bass drum's energy lies under 150 Hz, half of a hi-hat's above 4 kHz, a snare's in between."""

    def middle_hz(key):
        sound = render_preview(sorted_notes([(0.0, 0.1, key, 100, 10, 0)]), sample_rate_hz=RATE)[:, 0]
        energy = np.cumsum(np.abs(np.fft.rfft(sound)) ** 2)
        return np.searchsorted(energy, energy[-1] / 2) * RATE / len(sound)

    assert middle_hz(36) < 150
    assert 150 < middle_hz(38) < 4000
    assert middle_hz(42) > 4000


def test_every_percussion_key_sounds_at_once():
    for key in range(27, 88):
        sound = np.abs(render_preview(sorted_notes([(0.25, 0.1, key, 100, 10, 0)]), sample_rate_hz=RATE)[:, 0])
        assert sound[: RATE // 4].max() == 0
        assert sound[RATE // 4 : RATE // 4 + RATE // 50].max() > 0.5 * sound.max()
    assert len({key for keys, _ in DRUMS for key in keys}) == sum(len(keys) for keys, _ in DRUMS)


def test_louder_velocity_is_louder():
    peaks = [np.abs(render_preview(sorted_notes([(0.0, 0.5, 60, v, 1, 0)]))).max() for v in (30, 60, 120)]
    assert peaks[0] < peaks[1] < peaks[2]


def test_the_same_bytes_again_and_other_noise_from_another_seed():
    notes = sorted_notes([(0.0, 0.1, 38, 100, 10, 0), (0.2, 0.3, 60, 90, 1, 0)])
    assert render_preview(notes).tobytes() == render_preview(notes).tobytes()
    assert not np.array_equal(render_preview(notes), render_preview(notes, seed=1))


def test_many_notes_at_once_stay_below_full_scale():
    notes = sorted_notes([(0.0, 1.0, key, 127, 1, 80) for key in range(30, 90)])
    sound = render_preview(notes, sample_rate_hz=RATE)
    assert sound.dtype == np.float32
    assert np.abs(sound).max() == pytest.approx(0.8, abs=1e-6)


def test_length_and_shape():
    assert render_preview(sorted_notes([(1.0, 0.5, 60, 90, 1, 0)]), sample_rate_hz=RATE).shape == (int(3 * RATE) + 1, 1)
    assert render_preview(sorted_notes([])).shape == (0, 1)
    assert len(render_preview(sorted_notes([(0.0, 0.0, 60, 90, 1, 0)]))) > 0


def test_keys_outside_the_kit_are_silent():
    notes = sorted_notes([(0.0, 0.1, 38, 100, 10, 0)])
    assert np.abs(play(notes, sample_rate_hz=RATE, voices=VOICES, kit={})).max() == 0


def test_refusals():
    with pytest.raises(ValueError, match="sample_rate_hz"):
        render_preview(sorted_notes([(0.0, 0.1, 60, 90, 1, 0)]), sample_rate_hz=100)
    with pytest.raises(ValueError, match="voices"):
        play(sorted_notes([]), sample_rate_hz=RATE, voices=VOICES[:3], kit={})


def test_even_harmonics_keep_their_share_and_all_fall_with_their_number():
    voice = Voice(1.0, 0.5, 0.001, 1.0, 1.0, 0.01, 1.0)
    notes = sorted_notes([(0.0, 1.2, 69, 127, 1, 0)])
    sound = play(notes, sample_rate_hz=RATE, voices=[voice] * 16, kit={})
    held = np.abs(np.fft.rfft(sound[2205 : 2205 + RATE]))  # a second: each bin is 1 Hz
    np.testing.assert_allclose(held[[880, 1320, 1760]] / held[440], [0.5 / 2, 1 / 3, 0.5 / 4], rtol=0.02)


def test_the_least_rate_is_8000():
    notes = sorted_notes([(0.0, 0.1, 60, 90, 1, 0)])
    assert np.abs(render_preview(notes, sample_rate_hz=8000)).max() > 0.01
    with pytest.raises(ValueError, match="want >= 8000, got 7999"):
        render_preview(notes, sample_rate_hz=7999)
