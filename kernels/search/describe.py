"""A stretch of motion described by statistics of its channels: not trained; the trained encoders build on it."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from kernels.search.normalise import N_CHANNELS, VELOCITY
from kernels.skeleton.canonical import JOINTS
from kernels.types import Float

_N_FFT = 128
_BANDS = (0, 3, 6, 11, 20, 33, 65)
"""Frames of a spectrum, 8.5 s, and edges of its bands. Chosen by hand, about octaves."""

_N_JOINTS = (VELOCITY.stop - VELOCITY.start) // 3
"""By definition of the channels."""

_PERCENTILES = (0.05, 0.95)
"""Chosen by hand: the extent of a movement without its outliers."""

_PARTS = 3
"""Thirds of a motion. Tuned on eight take-disjoint splits of real clips: with the reach of hands, bands by axis and
clips searched whole up to 8 s, they raise first hits from .947 to .961."""

_HANDS = [JOINTS.index(f"{side}Hand") for side in ("left", "right")]
# Where a hand is seen from: what it does about the shoulder tells a wave from a bow that lowers the shoulder.
_REACHES = [
    *(
        (JOINTS.index(f"{side}Hand"), JOINTS.index(of))
        for side in ("left", "right")
        for of in (f"{side}UpperArm", "head", "hips")
    ),
    (_HANDS[0], _HANDS[1]),
]
_N_VALUES = N_CHANNELS + 4 * len(_REACHES)
N_STATISTICS = (2 + len(_PERCENTILES)) * _N_VALUES + _PARTS * N_CHANNELS + _N_JOINTS * (1 + 4 * (len(_BANDS) - 1))
"""Values of a motion, by definition of what is counted below."""


def describe(channel: NDArray[np.float32]) -> Float:
    """Sum up a stretch of motion, whatever its length.

    Parameters
    ----------
    channel : (T, N_CHANNELS) float32
        From :func:`kernels.search.normalise.channels`, T >= 1.

    Returns
    -------
    (N_STATISTICS,) float64
        Of every channel, and of the way and distance from either hand to shoulder, head, hips and the other hand: mean,
        deviation, 5th and 95th percentile. Of every channel its mean in each third of the stretch. Of every joint its
        mean speed, and the logarithm of the energy of its velocity in six bands up to half the rate, whole and by axis.
    """
    n = len(channel)
    channel = channel.astype(np.float64)
    position = channel[:, : VELOCITY.start].reshape(n, _N_JOINTS, 3)
    reach = np.stack([position[:, a] - position[:, b] for a, b in _REACHES], axis=1)
    far = np.linalg.norm(reach, axis=-1)
    value = np.concatenate([channel, reach.reshape(n, -1), far], axis=1)
    edges = np.linspace(0, n, _PARTS + 1).astype(int)
    parts = [channel[min(a, n - 1) : max(b, a + 1)].mean(axis=0) for a, b in itertools.pairwise(edges.tolist())]
    speed = channel[:, VELOCITY].reshape(n, _N_JOINTS, 3)
    # A stretch longer than the transform is cut into several, so that all of it counts.
    padded = np.zeros((-(-n // _N_FFT) * _N_FFT, _N_JOINTS, 3))
    padded[:n] = speed
    spectrum = np.fft.rfft(padded.reshape(-1, _N_FFT, _N_JOINTS, 3), axis=1)
    energy = (spectrum.real**2 + spectrum.imag**2).sum(axis=0) / n
    bands = np.add.reduceat(energy, _BANDS[:-1], axis=0)
    told = [np.log(1e-3 + bands.sum(axis=-1)), np.log(1e-3 + bands), np.linalg.norm(speed, axis=-1).mean(axis=0)]
    return np.concatenate(
        [value.mean(axis=0), value.std(axis=0), *_percentiles(value), *parts, *(each.reshape(-1) for each in told)]
    )


def _percentiles(value: Float) -> list[Float]:
    """Take percentiles of columns, straight between values: as NumPy's, which takes thrice as long."""
    ordered = np.sort(value, axis=0)
    found = []
    for share in _PERCENTILES:
        at = share * (len(value) - 1)
        low = int(at)
        high = min(low + 1, len(value) - 1)
        found.append(ordered[low] * (1 - (at - low)) + ordered[high] * (at - low))
    return found
