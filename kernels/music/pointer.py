"""The bar-pointer model: the most likely row of beats, given how much each instant looks like a beat."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Int = NDArray[np.int64]

SLOWEST_BPM, FASTEST_BPM, N_INTERVALS = 55.0, 215.0, 60
STEADINESS = 100.0
BEAT_SHARE = 1 / 16
"""Tempi, price of a changed interval (nats for each time its length), and the share of an interval that is the beat:
after [Krebs2015], by convention of trackers that follow it."""

LEAST_PROBABILITY = 0.005
"""Probabilities nearer to 0 or 1 are not believed. Chosen by hand."""

USUAL_BPM, USUAL_SPREAD_OCTAVES, USUAL_WEIGHT_PER_S = 130.0, 0.5, 3.0
"""Chosen by hand: without it half as fast is found too often."""


def beat_intervals(frame_rate_hz: float, *, slowest_bpm: float = SLOWEST_BPM, fastest_bpm: float = FASTEST_BPM) -> Int:
    """List the beat intervals to consider.

    Parameters
    ----------
    frame_rate_hz : float, > 0
    slowest_bpm, fastest_bpm : float, beats a minute, 0 < slowest <= fastest

    Returns
    -------
    (K,) int64, frames, increasing, >= 2
        At most 60 over two octaves, evenly spaced in log tempo, fewer where frames are too coarse to tell them apart.

    Raises
    ------
    ValueError
        If a tempo is out of order.
    """
    if not 0 < slowest_bpm <= fastest_bpm:
        raise ValueError(f"slowest_bpm: want 0 < slowest <= fastest, got {slowest_bpm} and {fastest_bpm}")
    n = max(round(N_INTERVALS * np.log2(fastest_bpm / slowest_bpm) / np.log2(FASTEST_BPM / SLOWEST_BPM)), 1)
    frames = np.rint(60.0 * frame_rate_hz / np.geomspace(fastest_bpm, slowest_bpm, n)).astype(np.int64)
    return np.unique(np.maximum(frames, 2))


def tempo_bonus(tempo_bpm: Float) -> Float:
    """How welcome a tempo is, whatever is heard: log-normal about 130 a minute.

    Parameters
    ----------
    tempo_bpm : (...) float, beats a minute, > 0

    Returns
    -------
    (...) float64, <= 0, nats a second
    """
    off = np.log2(np.asarray(tempo_bpm, np.float64) / USUAL_BPM) / USUAL_SPREAD_OCTAVES
    return np.asarray(-0.5 * USUAL_WEIGHT_PER_S * off**2, np.float64)


def best_beats(probability: Float, interval: Int, *, frame_rate_hz: float) -> tuple[Float, float]:
    """Find the most likely beats.

    Parameters
    ----------
    probability : (F,) float, 0 to 1
        How much each frame looks like a beat.
    interval : (K,) int64, frames, increasing, >= 2
        Beat intervals allowed.
    frame_rate_hz : float, > 0

    Returns
    -------
    frame : (B,) float64, increasing, 0 <= frame < F
        Most likely frame of each beat's stretch of frames, its middle where all are equal. Empty when F is shorter than
        the shortest interval.
    score : float
        Log-likelihood and tempo bonus of the whole, comparable between calls with equal probabilities; 0 when empty.

    Raises
    ------
    ValueError
        If the shapes, a probability or an interval does not fit.

    Notes
    -----
    The model of Krebs, Böck and Widmer [Krebs2015], for bars of one beat: a pointer runs through each beat interval,
    the first sixteenth of it is the beat, and the interval may change only at a beat, with probability proportional to
    exp(-100 |ratio - 1|). Between beats the pointer has no choice, so the same best path is found by a dynamic program
    over whole intervals, each scored by differences of running sums: K² steps a frame instead of one a state. Two
    differences: a bonus for usual tempi, and the stretch before the first beat may be any part of an interval.
    """
    if probability.ndim != 1 or not ((probability >= 0) & (probability <= 1)).all():
        raise ValueError(f"probability: want (F,) from 0 to 1, got {probability.shape}")
    if interval.ndim != 1 or not len(interval) or interval[0] < 2 or (np.diff(interval) <= 0).any():
        raise ValueError(f"interval: want increasing frames >= 2, got {interval}")
    n, k = len(probability), len(interval)
    if n < interval[0]:
        return np.zeros(0), 0.0
    p = np.clip(probability, LEAST_PROBABILITY, 1.0 - LEAST_PROBABILITY)
    on = np.concatenate([[0.0], np.cumsum(np.log(p))])
    off = np.concatenate([[0.0], np.cumsum(np.log((1.0 - p) * (BEAT_SHARE / (1.0 - BEAT_SHARE))))])
    wide = np.maximum(np.rint(interval * BEAT_SHARE).astype(np.int64), 1)
    change = -STEADINESS * np.abs(interval[None, :] / interval[:, None] - 1.0)
    change -= np.log(np.exp(change).sum(axis=1, keepdims=True))
    bonus = tempo_bonus(60.0 * frame_rate_hz / interval) * interval / frame_rate_hz
    column = np.arange(k)
    longest = int(interval[-1])
    entry = np.where(
        np.arange(longest)[:, None] <= interval, off[np.minimum(np.arange(longest), n)][:, None] - np.log(k), -np.inf
    )
    ended = np.full((n + longest + 1, k), -np.inf)
    came = np.zeros((n, k), np.int64)
    for t in range(n):
        here = np.maximum(ended[t], entry[t]) if t < longest else ended[t]
        score = here[:, None] + change
        came[t] = score.argmax(axis=0)
        beat_end, end = np.minimum(t + wide, n), np.minimum(t + interval, n)
        gained = on[beat_end] - on[t] + off[end] - off[beat_end] + bonus
        ended[t + interval, column] = score[came[t], column] + gained
    # the last interval may run past the end: what is missing there scores nothing
    last = np.unravel_index(int(ended[n:].argmax()), ended[n:].shape)
    best, j = float(ended[n:][last]), int(last[1])
    t = n + int(last[0]) - int(interval[j])
    frames = []
    while True:
        frames.append(t + _peak(probability[t : t + int(wide[j])]))
        before = int(came[t, j])
        if t < longest and entry[t, before] >= ended[t, before]:
            break
        t, j = t - int(interval[before]), before
    return np.minimum(np.array(frames[::-1], np.float64), n - 1), best


def _peak(stretch: Float) -> float:
    """Find the index of the largest value; the middle when all are equal."""
    return float(stretch.argmax()) if stretch.max() > stretch.min() else (len(stretch) - 1) / 2
