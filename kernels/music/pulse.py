"""What the pulse network looks at: rises of sound in eight bands and changes of colour, fifty times a second."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from kernels.music.onsets import FRAME_RATE_HZ, flux

Float = NDArray[np.float64]

PULSE_RATE_HZ = FRAME_RATE_HZ / 2
GROUP_EDGES_HZ = (0.0, 100.0, 200.0, 400.0, 800.0, 1600.0, 3000.0, 6000.0, 1e9)
N_CHANNELS = 12


def _around(curve: Float, before: int, after: int) -> Float:
    """Average of rows i + before to i + after - 1, cut at the ends."""
    n = len(curve)
    total = np.concatenate([np.zeros((1, *curve.shape[1:])), np.cumsum(curve, axis=0)])
    low = np.clip(np.arange(n) + before, 0, n)
    high = np.clip(np.arange(n) + after, 0, n)
    width = np.maximum(high - low, 1).reshape(-1, *([1] * (curve.ndim - 1)))
    return np.asarray((total[high] - total[low]) / width, np.float64)


def pulse_features(level: Float, centre_hz: Float) -> Float:
    """Describe a song for the pulse network.

    Parameters
    ----------
    level : (F, D) float, log levels of :func:`kernels.music.onsets.band_levels`
    centre_hz : (D,) float

    Returns
    -------
    (ceil(F / 2), 12) float32 at :data:`PULSE_RATE_HZ`, about 0 to 2
        Eight bands of spectral flux, all of them together, change of colour below and above 200 Hz over 0.15 s, and
        level against the song's mean.
    """
    n = len(level)
    out = np.zeros((n, N_CHANNELS))
    if n == 0:
        return out
    rise = flux(level)
    for i, (low, high) in enumerate(pairwise(GROUP_EDGES_HZ)):
        inside = (centre_hz >= low) & (centre_hz < high)
        if inside.any():
            out[:, i] = rise[:, inside].mean(axis=1)
    out[:, 8] = rise.mean(axis=1)
    change = _around(level, 0, 15) - _around(level, -15, 0)
    out[:, 9] = np.abs(change[:, centre_hz < 200.0]).mean(axis=1)
    out[:, 10] = np.abs(change[:, centre_hz >= 200.0]).mean(axis=1)
    strong = np.percentile(out[:, :11], 97, axis=0)
    floor = np.concatenate([np.full(9, 0.1 * strong[:9].max()), np.full(2, 0.1 * strong[9:].max())])
    out[:, :11] = np.log1p(2.0 * np.minimum(out[:, :11] / np.maximum(strong + floor, 1e-6), 2.0))
    loud = level.mean(axis=1)
    out[:, 11] = np.clip(_around(loud, -5, 6) - loud.mean(), -2.0, 2.0)
    beside = np.pad(out, ((1, 1), (0, 0)), mode="edge")
    pooled = np.maximum(np.maximum(beside[:-2], beside[1:-1]), beside[2:])
    pooled[:, 11] = out[:, 11]
    return pooled[::2]
