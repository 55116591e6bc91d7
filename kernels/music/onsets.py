"""What starts in each instant of a song: levels in mel bands and how they rise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Samples = NDArray[np.float32] | NDArray[np.float64]

FRAME_RATE_HZ = 100.0
"""Frames a second of every curve of this module, by convention of beat trackers [Davies2019]."""

WINDOW_S = 0.0464
"""2048 samples at 44.1 kHz [Bock2013]."""

LOWEST_HZ, HIGHEST_HZ, N_BANDS = 30.0, 11000.0, 80
"""Of the mel bands. Chosen by hand. The weights of the pulse network hold for these alone."""

FRAMES_AT_ONCE = 1024
"""Chosen for memory, by hand; changes no value."""


def to_mono(samples: Samples) -> NDArray[np.float32]:
    """Average the channels.

    Parameters
    ----------
    samples : (n,) or (n, C) float, C >= 1

    Returns
    -------
    (n,) float32

    Raises
    ------
    ValueError
        If the shape is another or a sample is not finite.
    """
    if samples.ndim not in (1, 2) or (samples.ndim == 2 and samples.shape[1] < 1):
        raise ValueError(f"samples: want (n,) or (n, C), got {samples.shape}")
    mono = samples if samples.ndim == 1 else samples.mean(axis=1)
    if not np.isfinite(mono).all():
        raise ValueError("samples: not finite; refuse or mend the song where it is read")
    return np.asarray(mono, np.float32)


def band_edges_hz(n_bands: int, lowest_hz: float, highest_hz: float) -> Float:
    """Corner frequencies of triangular bands, equally wide on the mel scale [OShaughnessy1987].

    Parameters
    ----------
    n_bands : int, >= 1
    lowest_hz, highest_hz : float, Hz, 0 <= lowest < highest

    Returns
    -------
    (n_bands + 2,) float64, Hz, increasing: band i rises from edge i to edge i + 1 and falls to edge i + 2
    """
    low, high = 2595.0 * np.log10(1.0 + np.array([lowest_hz, highest_hz]) / 700.0)
    return np.asarray(700.0 * (10.0 ** (np.linspace(low, high, n_bands + 2) / 2595.0) - 1.0), np.float64)


def band_levels(samples: Samples, sample_rate_hz: float) -> tuple[Float, Float]:
    """Log levels in mel bands.

    Parameters
    ----------
    samples : (n,) or (n, C) float, -1 to 1
    sample_rate_hz : float, > 0

    Returns
    -------
    level : (F, D) float64, 0 to 6.9, F = floor(n / rate * FRAME_RATE_HZ) + 1, or 0 for no samples
        log(1 + 1000 r), r the level against the loudest of the song; 0 throughout when that is below -100 dB.
    centre_hz : (D,) float64
        Bands that fit under the Nyquist frequency.

    Raises
    ------
    ValueError
        If a shape, a sample or the rate does not fit.
    """
    if not (np.isfinite(sample_rate_hz) and sample_rate_hz > 0):
        raise ValueError(f"sample_rate_hz: want > 0, got {sample_rate_hz}")
    mono = to_mono(samples)
    window = max(round(WINDOW_S * sample_rate_hz), 8)
    n_fft = 1 << (window - 1).bit_length()
    edges = band_edges_hz(N_BANDS, LOWEST_HZ, HIGHEST_HZ)
    edges = edges[: max(int(np.searchsorted(edges, sample_rate_hz / 2, side="right")), 3)]
    bin_hz = np.arange(n_fft // 2 + 1) * (sample_rate_hz / n_fft)
    rise = (bin_hz - edges[:-2, None]) / np.diff(edges)[:-1, None]
    fall = (edges[2:, None] - bin_hz) / np.diff(edges)[1:, None]
    weight = np.maximum(np.minimum(rise, fall), 0.0).T
    nearest = np.rint(edges[1:-1] / bin_hz[1]).astype(np.int64).clip(0, len(bin_hz) - 1)
    weight[nearest, np.arange(len(nearest))] = np.maximum(weight[nearest, np.arange(len(nearest))], 0.5)
    weight = weight.astype(np.float32)
    if len(mono) == 0:
        return np.zeros((0, weight.shape[1])), edges[1:-1]
    n_frames = int(len(mono) / sample_rate_hz * FRAME_RATE_HZ) + 1
    start = np.rint(np.arange(n_frames) * (sample_rate_hz / FRAME_RATE_HZ)).astype(np.int64)
    padded = np.pad(mono, (window // 2, window))
    hann = (np.hanning(window + 1)[:-1] / (window / 2)).astype(np.float32)
    level = np.zeros((n_frames, weight.shape[1]))
    for i in range(0, n_frames, FRAMES_AT_ONCE):
        frames = padded[start[i : i + FRAMES_AT_ONCE, None] + np.arange(window)] * hann
        level[i : i + FRAMES_AT_ONCE] = np.abs(np.fft.rfft(frames, n_fft, axis=1)).astype(np.float32) @ weight
    loudest = level.max()
    return np.log1p(level * (1000.0 / loudest)) if loudest > 1e-5 else np.zeros_like(level), edges[1:-1]


def flux(level: Float) -> Float:
    """Rise of each band over two frames against the largest of three neighbouring bands.

    After the SuperFlux of Böck and Widmer [Bock2013].

    Parameters
    ----------
    level : (F, D) float

    Returns
    -------
    (F, D) float64, >= 0; the first two frames are zero
    """
    beside = np.pad(level, ((0, 0), (1, 1)), mode="edge")
    largest = np.maximum(np.maximum(beside[:, :-2], beside[:, 2:]), level)
    rise = np.zeros_like(level, np.float64)
    rise[2:] = np.maximum(level[2:] - largest[:-2], 0.0)
    return rise
