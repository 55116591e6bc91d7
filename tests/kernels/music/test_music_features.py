"""Rhythm and intensity of songs made up with known beats and levels."""

import numpy as np
import pytest

from kernels.motion.motion_features import FEATURE_RATE_HZ
from kernels.music.music_features import gather, music_features, onset_strength
from kernels.synthetic.drum_machine import drum_machine_song

RATE_HZ = 22050


@pytest.fixture(scope="module")
def song():
    made = drum_machine_song(tempo_bpm=120, n_bars=3)
    return made.render(sample_rate_hz=RATE_HZ), made.beats.time_s


def test_rhythm_peaks_at_beats(song):
    samples, beat_s = song
    found = music_features(samples, RATE_HZ, beat_s=beat_s, duration_s=len(samples) / RATE_HZ)
    at = np.rint(beat_s * FEATURE_RATE_HZ).astype(int)
    assert (found.rhythm[at] > 0.1).all()
    between = ((at[:-1] + at[1:]) / 2).astype(int)
    assert not found.rhythm[between].any()
    assert np.percentile(found.rhythm, 99) == pytest.approx(1)
    assert np.percentile(found.intensity, 99) == pytest.approx(1)
    assert min(found.rhythm.min(), found.intensity.min()) >= 0
    assert len(found.rhythm) == len(found.intensity) == int(len(samples) / RATE_HZ * 120 + 1e-6) + 1


def test_impulses_are_one_value_a_beat(song):
    samples, beat_s = song
    found = music_features(samples, RATE_HZ, beat_s=beat_s, duration_s=len(samples) / RATE_HZ, width_s=0.0)
    assert np.count_nonzero(found.rhythm) == len(beat_s)


def test_a_quieter_half_has_less_intensity():
    tone = np.sin(2 * np.pi * 1000 * np.arange(4 * RATE_HZ) / RATE_HZ)
    tone[2 * RATE_HZ :] *= 0.1
    found = music_features(tone, RATE_HZ, beat_s=np.zeros(0), duration_s=4.0)
    np.testing.assert_allclose(found.intensity[200] - found.intensity[400], 20 / 40, atol=0.01)


def test_how_loud_a_song_is_recorded_does_not_matter(song):
    samples, beat_s = song
    how = {"beat_s": beat_s, "duration_s": len(samples) / RATE_HZ}
    a, b = (music_features(samples * gain, RATE_HZ, **how) for gain in (1.0, 0.25))
    np.testing.assert_allclose(a.rhythm, b.rhythm, atol=0.02)
    np.testing.assert_allclose(a.intensity, b.intensity, atol=1e-4)


def test_beats_in_silence_have_no_rhythm(song):
    samples, beat_s = song
    quiet = samples.copy()
    quiet[int(2.9 * RATE_HZ) :] = 0
    found = music_features(quiet, RATE_HZ, beat_s=beat_s, duration_s=len(quiet) / RATE_HZ)
    assert not found.rhythm[int(3.3 * 120) :].any()
    assert found.rhythm[: (2 * 120)].any()


def test_silence_and_nothing():
    found = music_features(np.zeros(RATE_HZ), RATE_HZ, beat_s=np.array([0.1, 0.6]), duration_s=1.0)
    assert not found.rhythm.any()
    assert not found.intensity.any()
    none = music_features(np.zeros(0), RATE_HZ, beat_s=np.zeros(0), duration_s=0.0)
    assert len(none.rhythm) == len(none.time_s) == 0


def test_onsets_are_gathered_near_beats_only():
    onset = np.zeros(300)
    onset[[100, 155]] = 5.0, 3.0
    np.testing.assert_array_equal(gather(onset, np.array([1.03, 1.5, 2.5, 9.0])), [5, 3, 0, 0])
    np.testing.assert_array_equal(gather(np.zeros(0), np.array([1.0])), [0])


def test_a_sample_that_is_no_number_is_refused():
    with pytest.raises(ValueError, match="not finite"):
        onset_strength(np.array([0.0, np.nan] * 4000), RATE_HZ)


def test_a_song_that_starts_with_a_sound_has_an_onset_there():
    tone = np.sin(2 * np.pi * 440 * np.arange(RATE_HZ) / RATE_HZ)
    onset = onset_strength(tone, RATE_HZ)
    assert onset[0] > 0
    assert onset[:3].max() == onset.max()
    assert not onset_strength(np.zeros(RATE_HZ), RATE_HZ).any()
    assert len(onset_strength(np.zeros(0), RATE_HZ)) == 0


def test_onsets_within_seven_hundredths_of_a_beat_are_its_own():
    onset = np.zeros(300)
    onset[[93, 107]] = 5.0, 6.0
    assert gather(onset, np.array([1.0])).tolist() == [6.0]
    onset[107] = 0.0
    assert gather(onset, np.array([1.0])).tolist() == [5.0]
    onset[92], onset[93] = 5.0, 0.0
    assert gather(onset, np.array([1.0])).tolist() == [0.0]


def test_a_beat_weaker_than_a_fiftieth_of_the_strongest_onset_is_silence():
    onset = np.zeros(400)
    onset[[100, 200, 300]] = 100.0, 2.0, 1.9
    assert gather(onset, np.array([1.0, 2.0, 3.0])).tolist() == [100.0, 2.0, 0.0]


def test_beats_before_the_first_frame_and_after_the_last_gather_what_is_there():
    onset = np.zeros(100)
    onset[[0, 99]] = 3.0, 4.0
    assert gather(onset, np.array([-0.05, -0.2, 1.05, 1.2])).tolist() == [3.0, 0.0, 4.0, 0.0]


def test_levels_forty_decibels_below_the_loudest_are_no_intensity():
    tone = np.sin(2 * np.pi * 1000 * np.arange(6 * RATE_HZ) / RATE_HZ)
    tone[2 * RATE_HZ : 4 * RATE_HZ] *= 10 ** (-30 / 20)
    tone[4 * RATE_HZ :] *= 10 ** (-45 / 20)
    found = music_features(tone, RATE_HZ, beat_s=np.zeros(0), duration_s=6.0)
    assert found.intensity[120] == pytest.approx(1.0, abs=0.01)
    assert found.intensity[360] == pytest.approx(0.25, abs=0.01)
    assert found.intensity[600] == 0


def test_a_song_below_sixty_decibels_is_silent():
    tone = np.sin(2 * np.pi * 1000 * np.arange(2 * RATE_HZ) / RATE_HZ)
    how = {"beat_s": np.zeros(0), "duration_s": 2.0}
    assert not music_features(10 ** (-58 / 20) * tone, RATE_HZ, **how).intensity.any()
    assert music_features(10 ** (-56 / 20) * tone, RATE_HZ, **how).intensity.any()


def test_a_song_told_longer_than_its_sound_goes_on_at_its_last_level():
    tone = np.sin(2 * np.pi * 1000 * np.arange(RATE_HZ) / RATE_HZ)
    found = music_features(tone, RATE_HZ, beat_s=np.zeros(0), duration_s=1.5)
    assert len(found.intensity) == len(found.rhythm) == 181
    assert (found.intensity[125:] == found.intensity[124]).all()
    assert found.intensity[-1] > 0
    assert found.time_s[-1] == 1.5


def test_the_frame_after_the_last_is_no_part_of_the_song():
    onset = np.array([0.0, 1.0, 0.0, 4.0])
    found = gather(onset, np.array([0.1, 0.3, 0.4, -0.1]), rate_hz=10.0, reach_s=0.0)
    np.testing.assert_array_equal(found, [1, 4, 0, 0])
