"""A convolutional network over channels of motion, masked, so that a clip's length is nothing it can learn from.

One definition for NumPy and JAX: training differentiates it, searching runs it without loading JAX.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.search.normalise import N_CHANNELS

WIDTHS = (64, 64, 128, 128)
KERNELS = (5, 5, 3, 3)
POOLED = (True, True, False, False)
"""Channels and frames of the four convolutions, and after which of them every two frames become one. Chosen by hand;
four as in [Ganbat2020]."""

N_OUT = 256
"""Values of the network's part of a vector. Chosen by hand, half of the vector."""

Weights = Mapping[str, Any]


def weight_shapes() -> dict[str, tuple[int, ...]]:
    """Name and shape of every weight."""
    shapes: dict[str, tuple[int, ...]] = {}
    width = N_CHANNELS
    for i, (out, k) in enumerate(zip(WIDTHS, KERNELS, strict=True)):
        shapes |= {f"matrix_{i}": (k * width, out), f"bias_{i}": (out,), f"gain_{i}": (out,), f"shift_{i}": (out,)}
        width = out
    return shapes | {"head": (2 * width, N_OUT)}


def initial_weights(rng: np.random.Generator) -> dict[str, NDArray[np.float32]]:
    """Draw weights to start from ([He2015] for the layers with a rectifier)."""
    weights = {}
    for name, shape in weight_shapes().items():
        if name.startswith("matrix"):
            value = rng.normal(0.0, np.sqrt(2.0 / shape[0]), shape)
        elif name == "head":
            value = rng.normal(0.0, np.sqrt(1.0 / shape[0]), shape)
        else:
            value = np.full(shape, 1.0 if name.startswith("gain") else 0.0)
        weights[name] = value.astype(np.float32)
    return weights


def forward(weights: Weights, channel: Any, mask: Any, xp: Any = np) -> Any:  # noqa: ANN401 - arrays of NumPy or JAX
    """Embed a batch of stretches.

    Four layers of convolution, layer norm and rectifier, the first two halved in time by the mean of what is there;
    mean and maximum over time; a dense layer to unit length.

    Parameters
    ----------
    weights : by name, see :func:`weight_shapes`
    channel : (B, T, N_CHANNELS) float32, T a multiple of 4
    mask : (B, T) float32
        1 where there is motion, 0 beyond its end; at least one 1 a row.
    xp : module
        ``numpy`` or ``jax.numpy``; the arrays' own.

    Returns
    -------
    (B, N_OUT) float32, unit length
    """
    value, there = channel * mask[..., None], mask[..., None]
    for i, (k, is_pooled) in enumerate(zip(KERNELS, POOLED, strict=True)):
        value = _unfold(value, k, xp) @ weights[f"matrix_{i}"] + weights[f"bias_{i}"]
        value = value - value.mean(axis=-1, keepdims=True)
        value = value / xp.sqrt((value * value).mean(axis=-1, keepdims=True) + 1e-5)
        value = xp.maximum(value * weights[f"gain_{i}"] + weights[f"shift_{i}"], 0.0) * there
        if is_pooled:
            count = there[:, ::2] + there[:, 1::2]
            value = (value[:, ::2] + value[:, 1::2]) / xp.maximum(count, 1.0)
            there = xp.minimum(count, 1.0)
    mean = value.sum(axis=1) / there.sum(axis=1)
    # After the rectifier nothing is below zero, and zero is what lies beyond the end.
    out = xp.concatenate([mean, value.max(axis=1)], axis=-1) @ weights["head"]
    return out / xp.sqrt((out * out).sum(axis=-1, keepdims=True) + 1e-12)


def _unfold(value: Any, k: int, xp: Any) -> Any:  # noqa: ANN401 - arrays of NumPy or JAX
    """Lay k neighbouring frames side by side, zeros beyond the ends: (B, T, C) to (B, T, k C)."""
    n, half = value.shape[1], k // 2
    padded = xp.pad(value, ((0, 0), (half, half), (0, 0)))
    return xp.concatenate([padded[:, i : i + n] for i in range(k)], axis=-1)


def batch(
    channels: Sequence[NDArray[np.float32]], n_frames: int = 0
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Put stretches of different lengths into one array.

    Parameters
    ----------
    channels : B arrays (T_i, C)
    n_frames : int
        Frames of the batch, at least those of the longest; 0: just enough, a multiple of 4.

    Returns
    -------
    (B, T, C) float32 and (B, T) float32, its mask
    """
    n = n_frames or -(-max(len(c) for c in channels) // 4) * 4
    value = np.zeros((len(channels), n, channels[0].shape[1]), np.float32)
    mask = np.zeros((len(channels), n), np.float32)
    for row, channel in enumerate(channels):
        value[row, : len(channel)] = channel
        mask[row, : len(channel)] = 1.0
    return value, mask
