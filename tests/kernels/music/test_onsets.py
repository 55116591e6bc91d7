"""Mel levels and their rises, on sounds whose answer is known."""

import numpy as np
import pytest

from kernels.music.onsets import band_edges_hz, band_levels, flux, to_mono

RATE = 22050


def tone(hz, seconds=1.0, rate=RATE, level=0.5):
    return level * np.sin(2 * np.pi * hz * np.arange(int(seconds * rate)) / rate)


def test_edges_are_even_on_the_mel_scale():
    edges = band_edges_hz(80, 30.0, 11000.0)
    assert len(edges) == 82
    assert edges[0] == pytest.approx(30)
    assert edges[-1] == pytest.approx(11000)
    np.testing.assert_allclose(np.diff(np.log1p(edges / 700)), np.log1p(edges[1] / 700) - np.log1p(edges[0] / 700))


@pytest.mark.parametrize("rate", [8000, 22050, 44100, 96000])
@pytest.mark.parametrize("hz", [100, 440, 3000])
def test_a_tone_is_loudest_in_its_band(rate, hz):
    level, centre_hz = band_levels(tone(hz, rate=rate), rate)
    assert level.shape == (101, len(centre_hz))
    assert centre_hz[level[50].argmax()] == pytest.approx(hz, rel=0.25)
    assert level.max() == pytest.approx(np.log(1001))


def test_loudness_of_the_file_does_not_matter():
    samples = tone(300) * np.linspace(0, 1, RATE)
    np.testing.assert_allclose(band_levels(samples, RATE)[0], band_levels(0.01 * samples, RATE)[0], atol=1e-3)


def test_frames_are_centred_on_their_times():
    click = np.zeros(RATE)
    click[RATE // 2] = 1.0
    level = band_levels(click, RATE)[0].sum(axis=1)
    heard = np.flatnonzero(level > 0.01 * level.max())
    assert heard.mean() == pytest.approx(50, abs=0.6)


def test_flux_finds_a_start_and_ignores_an_end_and_vibrato():
    t = np.arange(2 * RATE) / RATE
    vibrato = np.sin(2 * np.pi * 1000 * t + 3.0 * np.sin(2 * np.pi * 6 * t)) * (t > 0.5) * (t < 1.5)
    rise = flux(band_levels(vibrato, RATE)[0]).sum(axis=1)
    start = rise[45:55].max()
    assert int(rise.argmax()) in range(46, 54)
    assert rise[60:140].max() < 0.15 * start


def test_flux_of_constant_levels_is_zero():
    assert flux(np.full((10, 4), 3.0)).max() == 0
    assert flux(np.zeros((0, 4))).shape == (0, 4)
    assert flux(np.ones((1, 4))).tolist() == [[0, 0, 0, 0]]


def test_silence_and_nothing():
    assert band_levels(np.zeros(RATE), RATE)[0].max() == 0
    assert band_levels(np.zeros(0), RATE)[0].shape[0] == 0
    assert band_levels(np.ones(1), RATE)[0].shape[0] == 1


def test_channels_are_averaged():
    both = np.stack([tone(440), -tone(440)], axis=1)
    assert np.abs(to_mono(both)).max() < 1e-7
    assert to_mono(tone(440)).dtype == np.float32


@pytest.mark.parametrize(
    ("samples", "rate", "said"),
    [
        (np.zeros((2, 2, 2)), RATE, "samples"),
        (np.zeros((5, 0)), RATE, "samples"),
        (np.array([0.0, np.inf]), RATE, "finite"),
        (np.zeros(5), 0, "sample_rate_hz"),
        (np.zeros(5), float("nan"), "sample_rate_hz"),
    ],
)
def test_refusals(samples, rate, said):
    with pytest.raises(ValueError, match=said):
        band_levels(samples, rate)


def test_too_quiet_to_hear_is_silence():
    assert not band_levels(1e-7 * tone(440), RATE)[0].any()
    assert band_levels(1e-4 * tone(440), RATE)[0].max() == pytest.approx(np.log(1001))


@pytest.mark.parametrize("rate", [200, 4000, 22050])
def test_bands_fit_under_the_nyquist_frequency(rate):
    level, centre_hz = band_levels(np.ones(rate), rate)
    assert level.shape[1] == len(centre_hz) >= 1
    assert (centre_hz < max(rate / 2, 60.0)).all()


def test_a_rise_is_measured_over_two_frames_against_the_loudest_neighbour():
    level = np.zeros((4, 3))
    level[2:] = [0.0, 2.0, 5.0]
    rise = flux(level)
    assert rise[:2].tolist() == [[0.0] * 3] * 2
    assert rise[2].tolist() == [0.0, 2.0, 5.0]
    level[0] = [0.0, 0.0, 4.0]
    assert flux(level)[2].tolist() == [0.0, 0.0, 1.0]  # the middle band rose less than its neighbour had been
    level[0] = [1.5, 0.0, 0.0]
    assert flux(level)[2].tolist() == [0.0, 0.5, 5.0]


def test_no_channel_is_refused_and_one_is_the_sound():
    np.testing.assert_array_equal(to_mono(tone(440)[:, None]), to_mono(tone(440)))
    with pytest.raises(ValueError, match="samples"):
        to_mono(np.zeros((3, 0)))
