"""How loud a song is in each instant."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels.music.onsets import FRAMES_AT_ONCE, Samples, to_mono

Float = NDArray[np.float64]

FLOOR_DB = -100.0
"""The least level there is, below the 96 dB of 16 bits. Chosen so that silence has a number."""


def a_weighting_db(frequency_hz: Float) -> Float:
    """Weight of a frequency for the ear, IEC 61672-1, curve A [IEC2013].

    Parameters
    ----------
    frequency_hz : (...) float, Hz, >= 0

    Returns
    -------
    (...) float64, decibels, about 0 at 1 kHz; -inf at 0 Hz
    """
    f2 = np.asarray(frequency_hz, np.float64) ** 2
    with np.errstate(divide="ignore"):
        ratio = (12194.0**2 * f2**2) / ((f2 + 20.6**2) * np.sqrt((f2 + 107.7**2) * (f2 + 737.9**2)) * (f2 + 12194.0**2))
        return np.asarray(20.0 * np.log10(ratio) + 2.0, np.float64)


def loudness_db(
    samples: Samples, sample_rate_hz: float, *, frame_rate_hz: float = 120.0, window_s: float = 0.05
) -> tuple[Float, Float]:
    """Measure the short-time A-weighted level.

    Parameters
    ----------
    samples : (n,) or (n, C) float, full scale -1 to 1
        Channels are averaged.
    sample_rate_hz : float, > 0
    frame_rate_hz : float, > 0
        Values a second.
    window_s : float, seconds, > 0
        Length of the Hann window, centred on each instant.

    Returns
    -------
    time_s : (F,) float64, seconds, multiples of 1 / frame_rate_hz from 0 to the end of the song
    level_db : (F,) float64, decibels, -100 to about 0
        A sine of full scale at 1 kHz is at -3.0 dB. Empty without samples; -100 for silence.

    Raises
    ------
    ValueError
        If a shape, a sample or a rate does not fit.
    """
    for name, value in (
        ("sample_rate_hz", sample_rate_hz),
        ("frame_rate_hz", frame_rate_hz),
        ("window_s", window_s),
    ):
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name}: want > 0, got {value}")
    mono = to_mono(samples)
    if len(mono) == 0:
        return np.zeros(0), np.zeros(0)
    window = max(round(window_s * sample_rate_hz), 8)
    n_fft = 1 << (window - 1).bit_length()
    hann = np.hanning(window + 1)[:-1]
    # by Parseval, the weighted mean square of a windowed frame is a weighted sum over its spectrum
    bin_hz = np.arange(n_fft // 2 + 1, dtype=np.float64) * (sample_rate_hz / n_fft)
    weight = 10.0 ** (a_weighting_db(bin_hz) / 10.0)
    weight[1:-1] *= 2.0
    weight /= n_fft * (hann**2).sum()
    n_frames = int(np.floor(len(mono) / sample_rate_hz * frame_rate_hz)) + 1
    start = np.rint(np.arange(n_frames) * (sample_rate_hz / frame_rate_hz)).astype(np.int64)
    padded = np.pad(mono, (window // 2, window))
    power = np.zeros(n_frames)
    for i in range(0, n_frames, FRAMES_AT_ONCE):
        frames = padded[start[i : i + FRAMES_AT_ONCE, None] + np.arange(window)] * hann.astype(np.float32)
        spectrum = np.fft.rfft(frames, n_fft, axis=1)
        power[i : i + FRAMES_AT_ONCE] = (spectrum.real**2 + spectrum.imag**2) @ weight
    level_db = 10.0 * np.log10(np.maximum(power, 10.0 ** (FLOOR_DB / 10.0)))
    return np.arange(n_frames) / frame_rate_hz, level_db
