"""What a song does at 120 values a second: onsets gathered at its beats (rhythm) and its level (intensity).

After Shiratori, Nakazawa and Ikeuchi [Shiratori2006], who take onset strength at beats [Goto2001] for rhythm. Onsets by
:mod:`kernels.music.onsets`; A-weighted level in place of the melody range's power is ours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kernels.motion.motion_features import FEATURE_RATE_HZ, bumps, robust_unit
from kernels.music.loudness import loudness_db
from kernels.music.onsets import FRAME_RATE_HZ, Samples, band_levels, flux
from kernels.types import Float

GATHER_S = 0.07
"""Onsets so far from a beat are gathered at it: the tolerance at which beats count as met [Davies2009]."""

LEAST_ONSET_RATIO = 0.02
"""A beat weaker than this share of the song's strongest is silence, not rhythm. Chosen by hand."""

RANGE_DB = 40.0
"""Levels so far below the song's 99th percentile, and lower, count as 0. Chosen by hand."""

SILENCE_DB = -60.0
"""A song whose 99th percentile is lower has no intensity. Chosen by hand."""

LEVEL_WINDOW_S = 0.2
"""Chosen by hand."""


@dataclass(frozen=True, eq=False)
class MusicFeatures:
    """Features of one song, (F,) each, at 120 Hz from its first sample, >= 0, the 99th percentile scaled to 1."""

    rhythm: Float
    intensity: Float

    @property
    def time_s(self) -> Float:
        """Seconds of each value."""
        return np.arange(len(self.rhythm)) / FEATURE_RATE_HZ


def onset_strength(samples: Samples, sample_rate_hz: float) -> Float:
    """Sum the rises of all bands; see :func:`kernels.music.onsets.flux`.

    Before the first sample there was silence: a song that starts with a sound has an onset there.

    Parameters
    ----------
    samples : (n,) or (n, C) float, full scale -1 to 1
    sample_rate_hz : float, > 0

    Returns
    -------
    (F,) float64, >= 0, at 100 Hz
        As many as :func:`kernels.music.onsets.band_levels` has frames, and empty where that is.

    Raises
    ------
    ValueError
        If :func:`kernels.music.onsets.band_levels` refuses the samples or the rate.
    """
    level, _ = band_levels(samples, sample_rate_hz)
    return np.asarray(flux(np.pad(level, ((2, 0), (0, 0))))[2:].sum(axis=1), np.float64)


def gather(onset: Float, beat_s: Float, *, rate_hz: float = FRAME_RATE_HZ, reach_s: float = GATHER_S) -> Float:
    """Gather onset strength at beats: the strongest within reach of each.

    Parameters
    ----------
    onset : (F,) float, >= 0
    beat_s : (B,) float, seconds
    rate_hz : float, > 0, of ``onset``
    reach_s : float, seconds

    Returns
    -------
    (B,) float64, >= 0; 0 for beats beyond the song and for those in silence
    """
    if len(onset) == 0 or len(beat_s) == 0:
        return np.zeros(len(beat_s))
    reach = round(reach_s * rate_hz)
    rows = np.rint(np.asarray(beat_s) * rate_hz).astype(np.int64)[:, None] + np.arange(-reach, reach + 1)
    inside = (rows >= 0) & (rows < len(onset))
    strength = np.where(inside, onset[np.clip(rows, 0, len(onset) - 1)], 0.0).max(axis=1)
    return np.where(strength >= LEAST_ONSET_RATIO * float(onset.max()), strength, 0.0)


def music_features(
    samples: Samples, sample_rate_hz: float, *, beat_s: Float, duration_s: float, width_s: float = 0.05
) -> MusicFeatures:
    """Measure rhythm and intensity of a song.

    *Rhythm*: at each beat a bump as high as the onset strength gathered there. *Intensity*: the A-weighted level over
    200 ms in decibels above 40 dB below its 99th percentile.

    Parameters
    ----------
    samples : (n,) or (n, C) float, full scale -1 to 1
    sample_rate_hz : float, > 0
    beat_s : (B,) float, seconds, increasing
    duration_s : float, seconds, >= 0
    width_s : float, seconds, >= 0
        Of the bumps, :func:`kernels.motion.motion_features.bumps`; the same as the clips'.

    Returns
    -------
    MusicFeatures
        Of floor(duration * 120) + 1 values, none where it is 0; zeros in silence.

    Raises
    ------
    ValueError
        If a shape, a sample or the rate does not fit.
    """
    n = int(np.floor(duration_s * FEATURE_RATE_HZ + 1e-6)) + 1 if duration_s > 0 else 0
    strength = gather(onset_strength(samples, sample_rate_hz), beat_s)
    rhythm = bumps(n, np.asarray(beat_s) * FEATURE_RATE_HZ, strength, width_s=width_s)
    _, level = loudness_db(samples, sample_rate_hz, frame_rate_hz=FEATURE_RATE_HZ, window_s=LEVEL_WINDOW_S)
    level = np.pad(level, (0, max(n - len(level), 0)), mode="edge")[:n] if len(level) else np.full(n, -np.inf)
    loud = float(np.percentile(level, 99)) if n else -np.inf
    intensity = np.maximum(level - (loud - RANGE_DB), 0.0) if loud > SILENCE_DB else np.zeros(n)
    return MusicFeatures(robust_unit(rhythm), robust_unit(intensity))
