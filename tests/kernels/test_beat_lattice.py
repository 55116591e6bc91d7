"""The lattice of tempo and beat: known rows, the same answer as trying every row, and the refusals."""

import itertools

import numpy as np
import pytest

from kernels.beat_lattice import STEADINESS, TempoPrior, best_path, intervals_between

FLAT = TempoPrior(60.0, 150.0, 100.0, 1.0, 0.0)


def spikes(frames, n, *, at=2.0, off=-3.0):
    """A curve that welcomes beats on some frames only."""
    gain = np.full(n, off)
    gain[list(frames)] = at
    return gain


def test_beats_lie_on_the_spikes():
    frames = np.arange(7, 400, 30)
    found = best_path(spikes(frames, 400), 50.0, FLAT)
    assert found.frame.tolist() == frames.tolist()
    assert found.score == pytest.approx(2.0 * len(frames))


def test_a_tempo_between_two_intervals_costs_nothing():
    frames = np.round(5 + 30.5 * np.arange(20)).astype(int)
    assert best_path(spikes(frames, frames[-1] + 9), 50.0, FLAT).score == pytest.approx(40.0)


def test_a_tempo_that_breathes_is_followed():
    step = np.round(30 + 2.4 * np.sin(np.arange(40) / 4)).astype(int)
    frames = 10 + np.append(0, np.cumsum(step))
    found = best_path(spikes(frames, frames[-1] + 12), 50.0, FLAT)
    assert found.frame.tolist() == frames.tolist()


def test_a_missing_spike_is_bridged():
    frames = np.arange(10, 400, 30)
    found = best_path(spikes(np.delete(frames, 5), 400), 50.0, FLAT)
    assert found.frame.tolist() == frames.tolist()


def every_row(gain, rate_hz, prior):
    """Score of the best row by trying them all."""
    interval = intervals_between(rate_hz, prior.slowest_bpm, prior.fastest_bpm)
    worth = dict(zip(interval, prior.bonus(60 * rate_hz / interval) * interval / rate_hz, strict=True))
    n, best = len(gain), -np.inf
    for count in range(1, n // interval[0] + 1):
        for steps in itertools.product(interval, repeat=count):
            for first in range(min(steps[0], n - sum(steps))):
                beats = first + np.append(0, np.cumsum(steps)).astype(int)
                if n - beats[-1] > steps[-1]:
                    continue
                score = gain[beats].sum() + sum(worth[s] for s in steps)
                score += worth[steps[0]] * first / steps[0] + worth[steps[-1]] * (n - beats[-1]) / steps[-1]
                score -= sum(STEADINESS * max(abs(a - b) - 1, 0) / b for a, b in itertools.pairwise(steps))
                best = max(best, score)
    return best


@pytest.mark.parametrize("seed", range(6))
def test_no_row_is_better(seed):
    gain = np.random.default_rng(seed).normal(size=26)
    prior = TempoPrior(60.0, 120.0, 80.0, 0.5, 1.0)
    assert best_path(gain, 8.0, prior).score == pytest.approx(every_row(gain, 8.0, prior))


def test_the_welcome_tempo_wins_where_two_are_equal():
    gain = np.zeros(600)
    for usual in (70.0, 140.0):
        found = best_path(gain, 50.0, TempoPrior(60.0, 150.0, usual, 0.5, 3.0))
        assert 3000 / np.median(np.diff(found.frame)) == pytest.approx(usual, rel=0.05)


def test_too_short_for_two_beats_is_empty():
    assert len(best_path(np.zeros(20), 50.0, FLAT).frame) == 0
    assert len(best_path(np.zeros(0), 50.0, FLAT).frame) == 0


def test_refusals():
    with pytest.raises(ValueError, match="gain"):
        best_path(np.full(9, np.nan), 50.0, FLAT)
    with pytest.raises(ValueError, match="frame_rate_hz"):
        best_path(np.zeros(9), 0.0, FLAT)
    with pytest.raises(ValueError, match="no whole number"):
        best_path(np.zeros(9), 1.0, TempoPrior(61.0, 62.0, 61.5, 1.0, 0.0))
    with pytest.raises(ValueError, match="slowest_bpm"):
        TempoPrior(100.0, 60.0, 80.0, 1.0, 1.0)
    with pytest.raises(ValueError, match="spread_octaves"):
        TempoPrior(60.0, 100.0, 80.0, 0.0, 1.0)
