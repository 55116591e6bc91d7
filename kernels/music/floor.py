"""librosa's beat tracker: the floor that ours is measured against."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels.music.onsets import Samples, to_mono

Float = NDArray[np.float64]

ANALYSIS_RATE_HZ = 22050
"""The rate librosa analyses at, by convention of its own."""


def librosa_beats(samples: Samples, sample_rate_hz: float) -> Float:
    """Find beats as librosa does: the dynamic program of Ellis [Ellis2007].

    Parameters
    ----------
    samples : (n,) or (n, C) float, -1 to 1
    sample_rate_hz : float, > 0

    Returns
    -------
    (B,) float64, seconds, increasing
        Empty for silence and for less than a second.

    Raises
    ------
    ValueError
        If a shape, a sample or the rate does not fit.

    Notes
    -----
    The first call in a process compiles for some seconds: for comparison, not for the default path.
    """
    if not (np.isfinite(sample_rate_hz) and sample_rate_hz > 0):
        raise ValueError(f"sample_rate_hz: want > 0, got {sample_rate_hz}")
    mono = to_mono(samples)
    if len(mono) < sample_rate_hz or not mono.any():
        return np.zeros(0)
    import librosa

    heard = librosa.resample(mono, orig_sr=sample_rate_hz, target_sr=ANALYSIS_RATE_HZ)
    _, beat_s = librosa.beat.beat_track(y=heard, sr=ANALYSIS_RATE_HZ, units="time")
    return np.asarray(beat_s, np.float64)
