"""Where a listener would tap: the beats of a song, its bars, and the tempi to choose from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.music.attacks import snap_to_attacks
from kernels.music.bars import count_bars
from kernels.music.harmony import harmony_changes, key_levels
from kernels.music.onsets import FRAME_RATE_HZ, Samples, band_levels
from kernels.music.pointer import beat_intervals, best_beats
from kernels.music.pulse import PULSE_RATE_HZ, pulse_features, pulse_probability
from kernels.types import BeatGrid

Float = NDArray[np.float64]
Int = NDArray[np.int64]

TRACKERS = ("bar_pointer", "librosa")
LEAST_CONFIDENCE = 0.15
"""Mean probability of the beats below which there are none. Chosen by hand, so that noise, drones and tones have
none."""

LEVELS = (1 / 3, 1 / 2, 1.0, 2.0, 3.0)
"""Tempi of candidates over the one found, by convention: those by which listeners disagree."""

SLOWEST_CANDIDATE_BPM, FASTEST_CANDIDATE_BPM = 25.0, 450.0
"""Chosen by hand, an octave beyond what is found."""

LEVEL_TOLERANCE = 1.08
"""How far the tempo of a candidate may stray from its level. Chosen by hand."""

AUDIBLE_LEVEL = 0.02
"""Log level of a mel band from which something is heard. Chosen by hand."""

NEAR_S = 0.04
"""How near to a beat its probability is looked up. Chosen as the reach of its attack."""


@dataclass(frozen=True)
class TempoCandidate:
    """One metrical level a listener might tap.

    Parameters
    ----------
    level_ratio : float
        Tempo over the chosen tempo.
    tempo_bpm : float, beats a minute
    score : float, nats a second
        How well the best beats at this level explain the song, the usual tempo of songs included, against the best
        candidate, which has 0.
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


def track_beats(samples: Samples, sample_rate_hz: float, *, tracker: str = "bar_pointer") -> BeatAnalysis:
    """Find the beats of a song.

    Parameters
    ----------
    samples : (n,) or (n, C) float, -1 to 1
    sample_rate_hz : float, > 0
    tracker : ``bar_pointer``, or ``librosa`` for its dynamic program, without bars and candidates, to compare with

    Returns
    -------
    BeatAnalysis
        Confidence of a beat is how much the pulse network believes in one there. Bars are 0 where they cannot be
        told. Without beats where there is nothing to tap to: no samples, silence, a constant, noise without pulse
        (mean confidence below 0.15), a song shorter than two beats.

    Raises
    ------
    ValueError
        If a shape, a sample, the rate or the tracker does not fit.
    """
    if tracker not in TRACKERS:
        raise ValueError(f"tracker: want one of {', '.join(TRACKERS)}, got {tracker!r}")
    if tracker == "librosa":
        from kernels.music.floor import librosa_beats

        return BeatAnalysis(_grid(librosa_beats(samples, sample_rate_hz)), ())
    level, centre_hz = band_levels(samples, sample_rate_hz)
    if len(level) < 2 or not (level > AUDIBLE_LEVEL).any():
        return BeatAnalysis(_grid(np.zeros(0)), ())
    keys = key_levels(samples, sample_rate_hz, frame_rate_hz=PULSE_RATE_HZ)
    features = pulse_features(level, centre_hz, harmony_changes(keys, frame_rate_hz=PULSE_RATE_HZ))
    pulse = pulse_probability(features)
    fine = np.stack([_at_frame_rate(column, len(level)) for column in pulse.T], axis=1)
    frame, _ = best_beats(fine[:, 0], beat_intervals(FRAME_RATE_HZ), frame_rate_hz=FRAME_RATE_HZ)
    heard = np.flatnonzero((level > AUDIBLE_LEVEL).any(axis=1))
    frame = frame[(frame >= heard[0] - 2) & (frame <= heard[-1] + 2)]
    confidence = _peak_near(fine[:, 0], frame)
    if len(frame) < 2 or confidence.mean() < LEAST_CONFIDENCE:
        return BeatAnalysis(_grid(np.zeros(0)), ())
    candidates = _candidates(fine[:, 0], 60.0 * FRAME_RATE_HZ / float(np.median(np.diff(frame))))
    bar_number, place = count_bars(_peak_near(fine[:, 1], frame))
    time_s = np.maximum(snap_to_attacks(frame / FRAME_RATE_HZ, samples, sample_rate_hz), 0.0)
    keep = np.concatenate([[True], np.diff(time_s) > 0])
    grid = BeatGrid(
        time_s=time_s[keep], bar_number=bar_number[keep], beat_in_bar_number=place[keep], confidence=confidence[keep]
    )
    return BeatAnalysis(grid, candidates)


def _grid(time_s: Float) -> BeatGrid:
    """Beats without bars, half believed."""
    zeros = np.zeros(len(time_s), np.int64)
    return BeatGrid(time_s=time_s, bar_number=zeros, beat_in_bar_number=zeros, confidence=np.full(len(time_s), 0.5))


def _at_frame_rate(curve: Float, n: int) -> Float:
    """Fill in between values that are two frames apart."""
    return np.asarray(np.interp(np.arange(n) / 2, np.arange(len(curve)), curve), np.float64)


def _peak_near(curve: Float, frame: Float) -> Float:
    """Find the largest value within 40 ms of each frame."""
    reach = round(NEAR_S * FRAME_RATE_HZ)
    rows = np.rint(frame).astype(np.int64)[:, None] + np.arange(-reach, reach + 1)
    return np.asarray(curve[np.clip(rows, 0, len(curve) - 1)].max(axis=1, initial=0.0), np.float64)


def _candidates(probability: Float, tempo_bpm: float) -> tuple[TempoCandidate, ...]:
    """Score the metrical levels around a tempo."""
    found: list[tuple[float, float, float]] = []
    for ratio in LEVELS:
        bpm = tempo_bpm * ratio
        if not SLOWEST_CANDIDATE_BPM <= bpm <= FASTEST_CANDIDATE_BPM:
            continue
        interval = beat_intervals(FRAME_RATE_HZ, slowest_bpm=bpm / LEVEL_TOLERANCE, fastest_bpm=bpm * LEVEL_TOLERANCE)
        frame, score = best_beats(probability, interval, frame_rate_hz=FRAME_RATE_HZ)
        if len(frame) > 1:
            exact = 60.0 * FRAME_RATE_HZ / float(np.median(np.diff(frame)))
            found.append((ratio, exact if ratio != 1.0 else tempo_bpm, score * FRAME_RATE_HZ / len(probability)))
    if not found:
        return ()
    best = max(score for _, _, score in found)
    twofold = [score for ratio, _, score in found if ratio in (0.5, 2.0)]
    return tuple(
        TempoCandidate(ratio, bpm, score - best, ratio == 1.0)
        for ratio, bpm, score in found
        if ratio in (0.5, 1.0, 2.0) or score >= min(twofold, default=-np.inf)
    )
