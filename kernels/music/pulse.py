"""The pulse network: how much each instant of a song looks like a beat and like a downbeat.

Conventions
-----------
A temporal convolutional network after Davies and Böck [Davies2019], made small: 16 hand-made curves in, dilated
convolutions of 5 taps over up to 20 seconds either way, two probabilities out. Its weights come from songs made up by
:mod:`kernels.synthetic.arrangement`; no recording and no one else's music went into them. ``benchmarks/train_pulse.py``
makes them anew.
"""

from __future__ import annotations

import base64
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from kernels.music.onsets import FRAME_RATE_HZ, flux
from kernels.music.pulse_weights import N_HIDDEN, WEIGHTS

Float = NDArray[np.float64]
Weights = NDArray[np.float32]

PULSE_RATE_HZ = FRAME_RATE_HZ / 2
"""Chosen for speed, by hand: half of what [Davies2019] use."""

GROUP_EDGES_HZ = (0.0, 100.0, 200.0, 400.0, 800.0, 1600.0, 3000.0, 6000.0, 1e9)
N_CHANNELS = 16
LEAST_RISE = 0.03
"""Bands whose rises the network is shown, its curves in all, and the rise that a quiet song is scaled to at most.
Chosen by hand, about octaves; the weights of the network hold for these alone."""

DILATIONS = (1, 2, 4, 8, 16, 32, 64, 128, 256)
N_TAPS = 5
"""Of the convolutions, after [Davies2019], who have eleven layers at 100 frames a second: 20 s either way are seen."""

SPEEDS = (0.94, 1.0, 1.06)
"""Speeds at which the network hears a song. Measured on songs kept apart: a point of F more than at one speed."""


def pulse_features(level: Float, centre_hz: Float, change: Float) -> Float:
    """Describe a song for the pulse network.

    Parameters
    ----------
    level : (F, D) float, log levels of :func:`kernels.music.onsets.band_levels`
    centre_hz : (D,) float
    change : (ceil(F / 2), 4) float, of :func:`kernels.music.harmony.harmony_changes` at :data:`PULSE_RATE_HZ`

    Returns
    -------
    (ceil(F / 2), 16) float64 at :data:`PULSE_RATE_HZ`, about 0 to 2
        Eight bands of spectral flux, all of them together, change of colour below and above 200 Hz over 0.15 s,
        level against the song's mean, and four changes of harmony.
    """
    n = len(level)
    if n == 0:
        return np.zeros((0, N_CHANNELS))
    out = np.zeros((n, N_CHANNELS - 4))
    rise = flux(level)
    for i, (low, high) in enumerate(pairwise(GROUP_EDGES_HZ)):
        inside = (centre_hz >= low) & (centre_hz < high)
        if inside.any():
            out[:, i] = rise[:, inside].mean(axis=1)
    out[:, 8] = rise.mean(axis=1)
    colour = np.abs(_around(level, 0, 15) - _around(level, -15, 0))
    out[:, 9] = colour[:, centre_hz < 200.0].mean(axis=1)
    out[:, 10] = colour[:, centre_hz >= 200.0].mean(axis=1)
    strong = np.percentile(out[:, :11], 97, axis=0)
    floor = np.concatenate([np.full(9, 0.1 * strong[:9].max()), np.full(2, 0.1 * strong[9:].max())])
    out[:, :11] = np.log1p(2.0 * np.minimum(out[:, :11] / np.maximum(strong + floor, LEAST_RISE), 2.0))
    loud = level.mean(axis=1)
    out[:, 11] = np.clip(_around(loud, -5, 6) - loud.mean(), -2.0, 2.0)
    beside = np.pad(out, ((1, 1), (0, 0)), mode="edge")
    pooled = np.maximum(np.maximum(beside[:-2], beside[1:-1]), beside[2:])
    pooled[:, 11] = out[:, 11]
    pooled = pooled[::2]
    largest = np.maximum(np.percentile(change, 97, axis=0), 0.05)
    return np.concatenate([pooled, np.log1p(2.0 * np.minimum(change[: len(pooled)] / largest, 2.0))], axis=1)


def pulse_probability(features: Float) -> Float:
    """Run the network.

    Parameters
    ----------
    features : (F, 16) float, of :func:`pulse_features`

    Returns
    -------
    (F, 2) float64, 0 to 1
        Probability of a beat and of a downbeat within a frame either way: the mean, in log odds, of hearing the song
        6 % slower, as it is and 6 % faster, which gave 1 to 2 points of F on songs kept apart.

    Raises
    ------
    ValueError
        If the shape is another.
    """
    if features.ndim != 2 or features.shape[1] != N_CHANNELS:
        raise ValueError(f"features: want (F, {N_CHANNELS}), got {features.shape}")
    n = len(features)
    at = np.arange(n, dtype=np.float64)
    logit = np.zeros((n, 2))
    for speed in SPEEDS:
        heard = _sampled(features, np.arange(int(n / speed), dtype=np.float64) * speed) if n else features
        logit += _sampled(_logit(heard), at / speed) if len(heard) else 0.0
    return 1.0 / (1.0 + np.exp(-logit / len(SPEEDS)))


def _logit(features: Float) -> Float:
    """Run the network once, (F, 16) to (F, 2)."""
    layers = iter(_layers())
    n = len(features)
    state = _elu(np.asarray(features, np.float32) @ next(layers) + next(layers))
    for dilation in DILATIONS:
        taps, bias, mix, mix_bias = (next(layers) for _ in range(4))
        reach = dilation * (N_TAPS // 2)
        padded = np.pad(state, ((reach, reach), (0, 0)))
        heard = np.broadcast_to(bias, state.shape)
        for tap in range(N_TAPS):
            heard = heard + padded[tap * dilation : tap * dilation + n] @ taps[tap]
        state = state + _elu(heard) @ mix + mix_bias
    return np.asarray(state @ next(layers) + next(layers), np.float64)


def _sampled(curve: Float, at: Float) -> Float:
    """Read columns between their rows."""
    return np.stack([np.interp(at, np.arange(len(curve)), column) for column in curve.T], axis=1)


def layer_shapes(n_hidden: int) -> list[tuple[int, ...]]:
    """List the shapes of the network's arrays in the order they are stored.

    Parameters
    ----------
    n_hidden : int, >= 1
        Width of the hidden layers.

    Returns
    -------
    list of shapes
        Weights then bias of each layer: from the input curves, two a dilation (over time, then across), to the two
        outputs.
    """
    shapes: list[tuple[int, ...]] = [(N_CHANNELS, n_hidden), (n_hidden,)]
    for _ in DILATIONS:
        shapes += [(N_TAPS, n_hidden, n_hidden), (n_hidden,), (n_hidden, n_hidden), (n_hidden,)]
    return [*shapes, (n_hidden, 2), (2,)]


@cache
def _layers() -> list[Weights]:
    """Unpack the stored weights."""
    flat = np.frombuffer(base64.b85decode(WEIGHTS), "<f2").astype(np.float32)
    arrays = []
    at = 0
    for shape in layer_shapes(N_HIDDEN):
        size = int(np.prod(shape))
        arrays.append(flat[at : at + size].reshape(shape))
        at += size
    return arrays


def _elu(x: Weights) -> Weights:
    return np.where(x > 0, x, np.expm1(np.minimum(x, np.float32(0))))


def _around(curve: Float, before: int, after: int) -> Float:
    """Average rows i + before to i + after - 1, cut at the ends."""
    n = len(curve)
    total = np.concatenate([np.zeros((1, *curve.shape[1:])), np.cumsum(curve, axis=0)])
    low = np.clip(np.arange(n) + before, 0, n)
    high = np.clip(np.arange(n) + after, 0, n)
    width = np.maximum(high - low, 1).reshape(-1, *([1] * (curve.ndim - 1)))
    return np.asarray((total[high] - total[low]) / width, np.float64)
