"""The loudness curve against levels known from theory."""

import numpy as np
import pytest

from kernels.music.loudness import a_weighting_db, loudness_db

RATE = 44100


def sine(frequency_hz, level_db=0.0, seconds=1.0, rate=RATE):
    return 10 ** (level_db / 20) * np.sin(2 * np.pi * frequency_hz * np.arange(int(seconds * rate)) / rate)


@pytest.mark.parametrize(("hz", "db"), [(31.5, -39.4), (100, -19.1), (1000, 0.0), (2000, 1.2), (10000, -2.5)])
def test_weights_of_the_standard(hz, db):
    assert a_weighting_db(np.array(float(hz))) == pytest.approx(db, abs=0.15)
    assert a_weighting_db(np.array(0.0)) == -np.inf


@pytest.mark.parametrize(("hz", "weight_db"), [(1000, 0.0), (200, -10.8), (4000, 1.0)])
def test_a_sine_is_three_decibels_under_its_peak(hz, weight_db):
    _, level = loudness_db(sine(hz, -20.0), RATE)
    np.testing.assert_allclose(level[10:-10], -23.0 + weight_db, atol=0.3)


@pytest.mark.parametrize("rate", [8000, 22050, 96000])
def test_the_rate_does_not_matter(rate):
    assert loudness_db(sine(1000, rate=rate), rate)[1][60] == pytest.approx(-3.0, abs=0.2)


def test_twice_as_loud_is_six_decibels():
    noise = np.random.default_rng(0).standard_normal(RATE) * 0.1
    np.testing.assert_allclose(loudness_db(2 * noise, RATE)[1] - loudness_db(noise, RATE)[1], 6.02, atol=0.01)


def test_time_axis_and_a_burst():
    samples = np.zeros(2 * RATE)
    samples[RATE : RATE + RATE // 10] = sine(1000, seconds=0.1)
    time_s, level = loudness_db(samples, RATE, frame_rate_hz=100)
    assert len(time_s) == len(level) == 201
    np.testing.assert_allclose(time_s, np.arange(201) / 100)
    loud = time_s[level > -6]
    assert loud.min() == pytest.approx(1.0, abs=0.02)
    assert loud.max() == pytest.approx(1.1, abs=0.02)
    assert (level[:90] == -100).all()


def test_channels_are_averaged():
    both = np.stack([sine(1000), sine(1000)], axis=1)
    np.testing.assert_allclose(loudness_db(both, RATE)[1], loudness_db(sine(1000), RATE)[1], atol=1e-4)


def test_no_samples_and_one():
    assert [len(part) for part in loudness_db(np.zeros(0), RATE)] == [0, 0]
    assert len(loudness_db(np.ones(1), RATE)[0]) == 1


@pytest.mark.parametrize(
    ("samples", "how", "said"),
    [
        (np.zeros((2, 2, 2)), {}, "samples"),
        (np.array([np.nan]), {}, "finite"),
        (np.zeros(5), {"frame_rate_hz": 0}, "frame_rate_hz"),
        (np.zeros(5), {"window_s": -1}, "window_s"),
    ],
)
def test_refusals(samples, how, said):
    with pytest.raises(ValueError, match=said):
        loudness_db(samples, RATE, **how)
