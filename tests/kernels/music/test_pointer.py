"""The bar pointer on probabilities whose best path is plain."""

import itertools

import numpy as np
import pytest

from kernels.music import pointer
from kernels.music.pointer import beat_intervals, best_beats, tempo_bonus

RATE = 100.0
ALL = beat_intervals(RATE)


def pulses(frames, n, high=0.9, low=0.02):
    probability = np.full(n, low)
    probability[np.asarray(frames)] = high
    return probability


def test_steady_pulses_are_the_beats():
    true = np.arange(17, 3000, 50)
    found, _ = best_beats(pulses(true, 3000), ALL, frame_rate_hz=RATE)
    assert len(found) == len(true)
    np.testing.assert_allclose(found, true, atol=2)


def test_shift_in_time_shifts_the_beats():
    true = np.arange(17, 2000, 53)
    one, _ = best_beats(pulses(true, 2000), ALL, frame_rate_hz=RATE)
    other, _ = best_beats(pulses(true + 11, 2011), ALL, frame_rate_hz=RATE)
    np.testing.assert_array_equal(other[-30:], one[-30:] + 11)


def test_beats_go_on_through_a_break():
    true = np.arange(20, 3000, 60)
    sounded = true[(true < 1200) | (true > 1800)]
    found, _ = best_beats(pulses(sounded, 3000), ALL, frame_rate_hz=RATE)
    assert len(found) == len(true)
    np.testing.assert_allclose(found, true, atol=3)


def test_tempo_ramp_is_followed():
    true = np.rint(np.cumsum(np.linspace(70, 45, 50))).astype(int)
    found, _ = best_beats(pulses(true, int(true[-1]) + 30), ALL, frame_rate_hz=RATE)
    near = np.abs(found[:, None] - true).min(axis=0)
    assert np.mean(near <= 4) > 0.9


def test_same_as_trying_every_path(monkeypatch):
    """Twelve frames, intervals 2 to 4: the dynamic program finds the score of exhaustive search."""
    monkeypatch.setattr(pointer, "STEADINESS", 3.0)
    probability = np.random.default_rng(3).uniform(0.05, 0.95, 12)
    interval = np.array([2, 3, 4])
    n = len(probability)
    log_on = np.log(probability)
    log_off = np.log((1 - probability) / 15)
    change = np.exp(-3.0 * np.abs(interval[None] / interval[:, None] - 1))
    log_change = np.log(change / change.sum(axis=1, keepdims=True))
    bonus = tempo_bonus(60 * RATE / interval) * interval / RATE
    best = -np.inf
    for first in range(5):
        for count in range(1, 7):
            for path in itertools.product(range(3), repeat=count):
                ends = first + np.cumsum(interval[list(path)])
                if ends[-1] < n or (count > 1 and ends[-2] >= n):
                    continue
                starts = np.concatenate([[first], ends[:-1]])
                body = log_off[:first].sum() + sum(
                    log_on[s] + log_off[s + 1 : e].sum() + bonus[j] for s, e, j in zip(starts, ends, path, strict=True)
                )
                entries = [-np.log(3) + log_change[before, path[0]] for before in range(3) if first <= interval[before]]
                steps = sum(log_change[a, b] for a, b in itertools.pairwise(path))
                best = max(best, body + steps + max(entries, default=-np.inf))
    _, score = best_beats(probability, interval, frame_rate_hz=RATE)
    assert score == pytest.approx(best)


def test_usual_tempo_is_welcome_most():
    assert tempo_bonus(np.array(130.0)) == 0
    assert tempo_bonus(np.array(65.0)) == pytest.approx(tempo_bonus(np.array(260.0)))
    assert (np.diff(tempo_bonus(np.array([60.0, 90.0, 130.0]))) > 0).all()


def test_intervals():
    assert ALL[0] == 28
    assert ALL[-1] == 109
    assert (np.diff(ALL) > 0).all()
    assert beat_intervals(RATE, slowest_bpm=120, fastest_bpm=120).tolist() == [50]


def test_too_short_for_a_beat():
    found, score = best_beats(np.full(20, 0.5), ALL, frame_rate_hz=RATE)
    assert len(found) == 0
    assert score == 0


@pytest.mark.parametrize(
    ("probability", "interval"),
    [
        (np.full((5, 2), 0.5), ALL),
        (np.full(5, 1.5), ALL),
        (np.full(5, np.nan), ALL),
        (np.full(5, 0.5), np.array([], np.int64)),
        (np.full(5, 0.5), np.array([1, 2])),
        (np.full(5, 0.5), np.array([5, 4])),
    ],
)
def test_refusals(probability, interval):
    with pytest.raises(ValueError, match=r"probability|interval"):
        best_beats(probability, interval, frame_rate_hz=RATE)
    with pytest.raises(ValueError, match="slowest_bpm"):
        beat_intervals(RATE, slowest_bpm=100, fastest_bpm=50)
