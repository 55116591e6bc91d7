"""A stretch of motion told by statistics of its channels: no training, and the ground the trained encoders stand on."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from kernels.search.normalise import N_CHANNELS, VELOCITY
from kernels.types import Float

_N_FFT = 128
_BANDS = (0, 3, 6, 11, 20, 33, 65)
_N_JOINTS = (VELOCITY.stop - VELOCITY.start) // 3
N_STATISTICS = 4 * N_CHANNELS + _N_JOINTS * len(_BANDS)


def describe(channel: NDArray[np.float32]) -> Float:
    """Sum up a stretch of motion, whatever its length.

    Parameters
    ----------
    channel : (T, N_CHANNELS) float32
        From :func:`kernels.search.normalise.channels`, T >= 1.

    Returns
    -------
    (N_STATISTICS,) float64
        Of every channel its mean, deviation, 5th and 95th percentile; of every joint its mean speed, and the logarithm
        of the energy of its velocity in six bands up to half the rate.
    """
    value = channel.astype(np.float64)
    low, high = np.percentile(value, (5, 95), axis=0)
    speed = value[:, VELOCITY].reshape(len(value), _N_JOINTS, 3)
    # A stretch longer than the transform is cut into several, so that all of it counts.
    n = -(-len(value) // _N_FFT) * _N_FFT
    padded = np.concatenate([speed, np.zeros((n - len(value), _N_JOINTS, 3))]).reshape(-1, _N_FFT, _N_JOINTS, 3)
    energy = (np.abs(np.fft.rfft(padded, axis=1)) ** 2).sum(axis=(0, 3)) / len(value)
    bands = [np.log(1e-3 + energy[a:b].sum(axis=0)) for a, b in itertools.pairwise(_BANDS)]
    return np.concatenate(
        [value.mean(axis=0), value.std(axis=0), low, high, np.linalg.norm(speed, axis=-1).mean(axis=0), *bands]
    )
