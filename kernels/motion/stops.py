"""Where a body comes to a stop, part by part: the accents that a dancer's beats are heard by.

A turn of an arm, a landed foot, a knee bent as far as it goes: what moved is still for an instant. The logarithm of the
speed falls and rises there whatever the size of the movement, so a small shift of weight counts like a large step.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from kernels.motion.motion_beats import check_position
from kernels.skeleton.canonical import JOINTS
from kernels.types import Float

STOP_RATE_HZ = 60.0
"""Instants a second at which stops are looked for, whatever the clip's rate. Chosen so that an instant is short beside
the 70 ms within which beats count as the same."""

SMOOTHING_S = 0.055
"""Standard deviation of the Gaussian, over positions and again over speeds. Tuned on made-up dancers with noise up to
2 cm, and on the agreement of CMU subjects 60 and 61: anything from 0.05 to 0.06 does."""

STILL_M_PER_S = 0.05
"""Speed below which a part hardly moves, so that tremor is no stop. Chosen by hand."""

_SIDED = {"leg": ("UpperLeg", "LowerLeg", "Foot", "Toes"), "arm": ("UpperArm", "LowerArm", "Hand")}
_TRUNK = ("hips", "spine", "chest", "upperChest", "neck", "head")

BODY_PARTS: tuple[tuple[int, ...], ...] = (
    tuple(JOINTS.index(name) for name in _TRUNK),
    *(tuple(JOINTS.index(side + p) for p in parts) for parts in _SIDED.values() for side in ("left", "right")),
)
"""Joints of the canonical skeleton by part: trunk, legs, arms."""


def at_stop_rate(position_m: Float, frame_rate_hz: float) -> Float:
    """Bring positions to the rate of stops, smoothed.

    Parameters
    ----------
    position_m : (F, J, 3) float, metres, world, F >= 4
    frame_rate_hz : float, > 0

    Returns
    -------
    (N, J, 3) float64, metres
        One each 1/60 s from the first frame to the last, by cubic splines.

    Raises
    ------
    ValueError
        As :func:`kernels.motion.motion_beats.check_position`, and for fewer than four frames.
    """
    check_position(position_m, frame_rate_hz)
    f = len(position_m)
    if f < 4:
        raise ValueError(f"position_m: want at least 4 frames, got {f}")
    time_s = np.arange(int(np.floor((f - 1) / frame_rate_hz * STOP_RATE_HZ + 1e-9)) + 1) / STOP_RATE_HZ
    flat = position_m.reshape(f, -1)
    between = scipy.interpolate.make_interp_spline(np.arange(f) / frame_rate_hz, flat, k=3)(time_s)
    return _smooth(between).reshape(len(time_s), *position_m.shape[1:])


def stop_strength(position_m: Float, parts: Sequence[Sequence[int]] = BODY_PARTS) -> Float:
    """Measure how plainly the parts of a body stop at each instant.

    Parameters
    ----------
    position_m : (N, J, 3) float, metres, world, of :func:`at_stop_rate`
    parts : joints of each part, at least one

    Returns
    -------
    (N,) float64, 1/s², >= 0
        Sum over parts of the second derivative of the logarithm of the part's mean joint speed, where it is positive.
    """
    velocity = np.gradient(position_m, axis=0) * STOP_RATE_HZ
    speed = np.sqrt(np.einsum("njk,njk->nj", velocity, velocity))
    of_part = np.stack([speed[:, list(joints)].mean(axis=1) for joints in parts], axis=1)
    level = np.log(_smooth(of_part) + STILL_M_PER_S)
    return np.asarray(np.maximum(_second_difference(level), 0.0).sum(axis=1), np.float64)


def landing_strength(height_m: Float) -> Float:
    """Measure how strongly a body is caught from below at each instant: at the bottom of a bounce, after a step.

    Parameters
    ----------
    height_m : (N,) float, metres, of the hips, at the rate of stops, smoothed as :func:`at_stop_rate` does

    Returns
    -------
    (N,) float64, m/s², >= 0
        Upward acceleration.
    """
    return np.maximum(_second_difference(height_m[:, None])[:, 0], 0.0)


def _smooth(values: Float) -> Float:
    smoothed = scipy.ndimage.gaussian_filter1d(values, SMOOTHING_S * STOP_RATE_HZ, axis=0, mode="nearest")
    return np.asarray(smoothed, np.float64)


def _second_difference(values: Float) -> Float:
    """Second derivative along the first axis, (N, M); 0 at the ends."""
    found = np.zeros(values.shape)
    if len(values) > 2:
        found[1:-1] = (values[2:] - 2 * values[1:-1] + values[:-2]) * STOP_RATE_HZ**2
    return found
