"""What to put where a sensor said nothing, or nothing to be believed.

Conventions
-----------
Series are (F, S, C): frames, sensors, components; every function works on all sensors at once.
"""

from __future__ import annotations

import numpy as np

from kernels.calibration.records import Bools
from kernels.types import Float

_N_SLOPE = 9
"""Frames a slope is taken from. Chosen by hand: it carries 3 mm of noise across 20 lost frames at 2 mm of noise."""

_AT = np.arange(_N_SLOPE) - 4.0
"""Frames from the middle one, by definition."""

# Weights of nine samples whose sum is the slope of their parabola at the last one, from their sums of squares and of
# fourth powers, 60 and 708, by definition of least squares: what a linear algebra library would find has last bits of
# the processor's own.
_END_SLOPE = (_AT / 60.0 + 2.0 * (3.0 * _AT * _AT - 20.0) / 231.0)[:, None]

_TRUSTED_S = 0.25
"""Length of a gap from which slopes count less. Chosen by hand: what a body does in that time no slope tells."""


def fill(series: Float, is_good: Bools) -> Float:
    """Interpolate linearly over entries that are not good; the ends repeat the nearest good one.

    Parameters
    ----------
    series : (F, S, C) float
    is_good : (F, S) bool

    Returns
    -------
    (F, S, C) float64
        Unchanged for a sensor that is never good.
    """
    filled = np.array(series, np.float64)
    for s in np.flatnonzero(~is_good.all(axis=0) & is_good.any(axis=0)):
        good, bad = np.flatnonzero(is_good[:, s]), np.flatnonzero(~is_good[:, s])
        after = np.searchsorted(good, bad)
        left, right = good[np.maximum(after - 1, 0)], good[np.minimum(after, len(good) - 1)]
        share = ((bad - left) / np.maximum(right - left, 1))[:, None]
        share = np.where((right > left)[:, None], np.clip(share, 0, 1), 0.0)
        filled[bad, s] = (1 - share) * series[left, s] + share * series[right, s]
    return filled


def bridge(series: Float, is_good: Bools, *, frame_rate_hz: float) -> Float:
    """Fill gaps with curves that leave and arrive as the series does; as :func:`fill` at the ends.

    Parameters
    ----------
    series : (F, S, C) float
    is_good : (F, S) bool
    frame_rate_hz : float, > 0

    Returns
    -------
    (F, S, C) float64

    Notes
    -----
    Cubics after Hermite. The slope at either side is that of a parabola through nine good frames, or of the straight
    line across the gap where nine good ones do not follow each other. Gaps longer than a quarter of a second count it
    the less the longer they are: what a body does in that time no slope tells.
    """
    filled = fill(series, is_good)
    for s in range(is_good.shape[1]):
        good = np.flatnonzero(is_good[:, s])
        for g in np.flatnonzero(np.diff(good) > 1):
            left, right = int(good[g]), int(good[g + 1])
            width = right - left
            chord = (series[right, s] - series[left, s]) / width
            trust = min(1.0, _TRUSTED_S * frame_rate_hz / width)
            before, after = slice(left - _N_SLOPE + 1, left + 1), slice(right, right + _N_SLOPE)
            leaving, arriving = np.zeros_like(chord), np.zeros_like(chord)
            if before.start >= 0 and is_good[before, s].all():
                leaving = trust * (np.sum(_END_SLOPE * series[before, s], axis=0) - chord)
            if after.stop <= len(series) and is_good[after, s].all():
                arriving = trust * (-np.sum(_END_SLOPE * series[after, s][::-1], axis=0) - chord)
            u = (np.arange(1, width) / width)[:, None]
            filled[left + 1 : right, s] += width * (u * (1 - u) ** 2 * leaving - u**2 * (1 - u) * arriving)
    return filled


def aligned(rotation_wxyz: Float, is_good: Bools) -> Float:
    """Turn the signs of quaternions so that each good one is in the hemisphere of the good one before.

    Parameters
    ----------
    rotation_wxyz : (F, S, 4) float
    is_good : (F, S) bool

    Returns
    -------
    (F, S, 4) float64
        What is not good follows the good one before it.
    """
    frame = np.arange(len(is_good))[:, None]
    last = np.maximum.accumulate(np.where(is_good, frame, 0), axis=0)
    held = np.take_along_axis(rotation_wxyz, last[..., None], axis=0)
    flip = np.ones(is_good.shape)
    flip[1:] = np.where(np.sum(held[1:] * held[:-1], axis=-1) < 0, -1.0, 1.0)
    sign = np.cumprod(flip, axis=0)
    same = np.sum(rotation_wxyz * held, axis=-1) < 0  # what is not good follows the good one before it too
    return rotation_wxyz * np.where(same & ~is_good, -sign, sign)[..., None]
