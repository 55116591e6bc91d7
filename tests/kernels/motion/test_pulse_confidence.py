"""Figures of a pulse: what each says of rows of beats that are right and of rows that are not."""

import numpy as np
import pytest

from kernels.motion.dance_pulse import LEVELS
from kernels.motion.pulse_confidence import level_figures, probability, pulse_figures
from kernels.motion.stops import STOP_RATE_HZ


def bumps(times_s, *, duration_s=12.0, height=1.0):
    """Welcome with a bump at each time."""
    at = np.arange(int(duration_s * STOP_RATE_HZ)) / STOP_RATE_HZ
    heights = np.broadcast_to(height, np.shape(times_s))
    return np.max([h * np.exp(-((at - t) ** 2) / (2 * 0.03**2)) for t, h in zip(times_s, heights, strict=True)], axis=0)


EVEN = 0.3 + 0.6 * np.arange(19)


def figures(welcome, beats=EVEN, stops=None):
    return pulse_figures(welcome, beats if stops is None else stops, beats, score=20.0, levels=LEVELS)


def test_beats_on_bumps_are_welcome_and_repeat():
    found = figures(bumps(EVEN))
    assert found[1] == pytest.approx(1.0, abs=0.05)
    assert found[2] == pytest.approx(1.0, abs=0.05)
    assert found[3:5] == pytest.approx([1.0, 1.0], abs=0.1)
    assert found[5] == 0
    assert found[6] == pytest.approx(np.log(19))
    assert found[7] > 0.5
    assert found[8] == pytest.approx(20.0 / np.sqrt(12.0))


def test_beats_between_bumps_are_not():
    found = figures(bumps(EVEN - 0.3))
    assert found[1] < 0.1
    assert found[2] < -0.2


def test_a_row_of_scattered_bumps_does_not_repeat_and_folds_at_no_tempo():
    drawn = np.sort(np.random.default_rng(3).uniform(0, 12, 19))
    found = figures(bumps(drawn))
    assert abs(found[3]) < 0.5
    assert found[7] < 0.3


def test_stops_off_their_beats_are_told():
    stops = EVEN + np.where(np.arange(19) % 2, 0.06, -0.06)
    assert figures(bumps(stops), stops=stops)[5] == pytest.approx(0.1)


def test_a_long_clip_folds_as_a_short_one():
    beats = 0.3 + 0.61 * np.arange(98)
    long = pulse_figures(bumps(beats, duration_s=60.0), beats, beats, score=20.0, levels=LEVELS)
    assert long[7] > 0.5


def test_level_figures_tell_the_faster_and_the_slower_level():
    plain = level_figures(bumps(EVEN), EVEN)
    assert plain[1] < 0.05
    assert plain[2] < 0.05
    assert plain[3] == pytest.approx(0.0, abs=1e-6)
    both = level_figures(bumps(np.append(EVEN, EVEN + 0.3)), EVEN)
    assert both[1] > 0.9
    every_second = level_figures(bumps(EVEN, height=np.where(np.arange(19) % 2, 0.3, 1.0)), EVEN)
    assert every_second[2] > 0.2


def test_probability_is_logistic():
    assert probability(np.array([1.0, 2.0]), (0.0, 0.0)) == 0.5
    assert probability(np.array([1.0, 2.0]), (1.0, 1.0)) == pytest.approx(1 / (1 + np.exp(-3.0)))
