"""Where a listener would tap: the beats of a song."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.music.onsets import FRAME_RATE_HZ, find_onsets
from kernels.types import BeatGrid

Float = NDArray[np.float64]
Int = NDArray[np.int64]
Samples = NDArray[np.float32] | NDArray[np.float64]

SLOWEST_BPM, FASTEST_BPM, N_INTERVALS = 55.0, 215.0, 60
STEADINESS = 100.0
BEAT_SHARE = 1 / 16


def intervals() -> Int:
    """Beat intervals the tracker knows, (K,) int64, frames, increasing."""
    frames = 60.0 * FRAME_RATE_HZ / np.geomspace(FASTEST_BPM, SLOWEST_BPM, N_INTERVALS)
    return np.unique(np.rint(frames).astype(np.int64))


def beat_frames(activation: Float, *, steadiness: float = STEADINESS) -> Int:
    """Most likely beats of an onset activation.

    The bar-pointer model of Krebs, Böck and Widmer, "An efficient state-space model for joint tempo and meter
    tracking" (ISMIR 2015), for one beat. Between two beats the pointer moves without choice, so the same best path is
    found by a dynamic program over beats alone: whole intervals are scored by differences of running sums.

    Parameters
    ----------
    activation : (F,) float, 0 to 1
    steadiness : float, > 0
        The interval changes at a beat with probability proportional to exp(-steadiness * |ratio - 1|).

    Returns
    -------
    (B,) int64, increasing frames
        Empty for fewer frames than the longest interval or an activation that is zero throughout.
    """
    length = intervals()
    n, k = len(activation), len(length)
    if n < length[-1] or not (activation > 0).any():
        return np.zeros(0, np.int64)
    a = np.clip(activation, 0.005, 0.995)
    on = np.concatenate([[0.0], np.cumsum(np.log(a))])
    off = np.concatenate([[0.0], np.cumsum(np.log((1.0 - a) * (BEAT_SHARE / (1.0 - BEAT_SHARE))))])
    wide = np.maximum(np.rint(length * BEAT_SHARE).astype(np.int64), 1)
    change = -steadiness * np.abs(length[None, :] / length[:, None] - 1.0)
    change -= np.log(np.exp(change).sum(axis=1, keepdims=True))
    column = np.arange(k)
    ended = np.full((n + length[-1] + 1, k), -np.inf)
    started = np.full((n, k), -np.inf)
    choice = np.zeros((n, k), np.int64)
    for t in range(n):
        here = ended[t]
        if t < length[-1]:
            first = np.where(t <= length, off[t] - np.log(k), -np.inf)
            here = np.maximum(here, first)
        score = here[:, None] + change
        choice[t] = score.argmax(axis=0)
        started[t] = score[choice[t], column]
        beat_end, end = np.minimum(t + wide, n), np.minimum(t + length, n)
        gained = on[beat_end] - on[t] + off[end] - off[beat_end]
        ended[t + length, column] = started[t] + gained
    # the last interval may run past the end of the song: its missing part scores nothing
    tail = ended[n:]
    last = np.unravel_index(int(tail.argmax()), tail.shape)
    j = int(last[1])
    t = n + int(last[0]) - int(length[j])
    found = []
    while t >= 0:
        found.append(t + (int(wide[j]) - 1) // 2)
        before = int(choice[t, j])
        came = t - int(length[before])
        if came < 0 or ended[t, before] == -np.inf or (t < length[-1] and ended[t, before] < off[t] - np.log(k)):
            break
        t, j = came, before
    return np.array(found[::-1], np.int64)


@dataclass(frozen=True, eq=False)
class TempoCandidate:
    """One metrical level a listener might tap.

    Parameters
    ----------
    level_ratio : float
        Tempo over the chosen tempo.
    tempo_bpm : float, beats a minute
    score : float
        Comparable within a song; higher is better.
    is_chosen : bool
    """

    level_ratio: float
    tempo_bpm: float
    score: float
    is_chosen: bool


@dataclass(frozen=True, eq=False)
class BeatAnalysis:
    """Beats of a song and the tempo candidates they were chosen from.

    Parameters
    ----------
    grid : BeatGrid
    tempo_candidates : from slow to fast; empty without beats
    """

    grid: BeatGrid
    tempo_candidates: tuple[TempoCandidate, ...]


def track_beats(samples: Samples, sample_rate_hz: float) -> BeatAnalysis:
    """Find the beats of a song.

    Parameters
    ----------
    samples : (n,) or (n, C) float, -1 to 1
    sample_rate_hz : float, > 0

    Returns
    -------
    BeatAnalysis
        Without beats for silence and for songs shorter than two beats.

    Raises
    ------
    ValueError
        If a shape, a sample or the rate does not fit.
    """
    onsets = find_onsets(samples, sample_rate_hz)
    activation = onsets.mix()
    frame = beat_frames(activation)
    time_s = np.maximum(frame / FRAME_RATE_HZ, 0.0)
    zeros = np.zeros(len(time_s), np.int64)
    grid = BeatGrid(time_s=time_s, bar_number=zeros, beat_in_bar_number=zeros, confidence=np.full(len(time_s), 0.5))
    if len(time_s) < 2:
        return BeatAnalysis(grid, ())
    tempo_bpm = 60.0 / float(np.median(np.diff(time_s)))
    return BeatAnalysis(grid, (TempoCandidate(1.0, tempo_bpm, 0.0, True),))
