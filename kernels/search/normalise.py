"""Motions made comparable: where they start, where they face and how tall the performer is taken away.

After Sedmidubsky, Elias and Zezula [Sedmidubsky2018]. Their published normaliser turns the hip line by ``atan`` and
leaves a body that faces sideways or backwards as it is; here it is ``atan2``.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from kernels.skeleton.canonical import JOINTS, LEG_LENGTH_M
from kernels.types import Float

RATE_HZ = 15.0
"""Frames a second that motions are compared at. Chosen by hand."""

_LEFT, _RIGHT = JOINTS.index("leftUpperLeg"), JOINTS.index("rightUpperLeg")
_LEGS = [[JOINTS.index(f"{side}{part}") for part in ("UpperLeg", "LowerLeg", "Foot")] for side in ("left", "right")]
_N = len(JOINTS)
_LEAST_HIP_M = 0.02
"""Length on the floor of the line from hip to hip below which it does not tell the facing. Chosen by hand."""

N_CHANNELS = 6 * _N + 8
"""Values a frame of :func:`channels`, by definition: joints, their velocities, and what the root does."""

VELOCITY = slice(3 * _N, 6 * _N)
TRAVEL = slice(6 * _N, N_CHANNELS)
"""Where these lie among them, by definition."""

# Divisor that brings positions to about one, as velocities in metres and radians a second are. Chosen by hand.
_POSITION_M = 0.3


def heading_rad(position_xyz_m: Float) -> Float:
    """Direction the hips face about the vertical, by ``atan2`` of the line from the right hip to the left.

    Parameters
    ----------
    position_xyz_m : (F, 22, 3) float, metres, canonical joints, Y up

    Returns
    -------
    (F,) float64, radians, without jumps by whole turns
        0 along +Z, pi/2 along +X. Where the hips stand one above the other, as in the frame before; 0 when they always
        do.
    """
    line = position_xyz_m[:, _LEFT] - position_xyz_m[:, _RIGHT]
    is_seen = np.hypot(line[:, 0], line[:, 2]) > _LEAST_HIP_M
    angle = np.arctan2(-line[:, 2], line[:, 0])
    if not is_seen.any():
        return np.zeros(len(position_xyz_m))
    seen = np.flatnonzero(is_seen)
    last = seen[np.maximum(np.searchsorted(seen, np.arange(len(angle)), side="right") - 1, 0)]
    return np.unwrap(angle[last])


def leg_length_m(position_xyz_m: Float) -> float:
    """Length of a leg from hip to knee to ankle, metres: the median over frames of both sides' mean.

    Parameters
    ----------
    position_xyz_m : (F, 22, 3) float, metres, F >= 1
    """
    bones = [
        np.linalg.norm(position_xyz_m[:, b] - position_xyz_m[:, a], axis=-1)
        for leg in _LEGS
        for a, b in itertools.pairwise(leg)
    ]
    return float(np.median(np.sum(bones, axis=0) / 2))


def turn(vector: Float, angle_rad: Float) -> Float:
    """Turn vectors back by a heading: what faced along it faces +Z.

    Parameters
    ----------
    vector : (F, ..., 3) float
    angle_rad : (F,) float, radians

    Returns
    -------
    (F, ..., 3) float64
    """
    shape = (len(angle_rad),) + (1,) * (vector.ndim - 2)
    cos, sin = np.cos(angle_rad).reshape(shape), np.sin(angle_rad).reshape(shape)
    x, y, z = np.moveaxis(vector, -1, 0)
    return np.stack([x * cos - z * sin, y, x * sin + z * cos], axis=-1)


def normalise(position_xyz_m: Float, *, per_frame: bool = False, is_sized: bool = True) -> Float:
    """Bring a motion to the origin, facing +Z, on legs of the canonical length.

    Parameters
    ----------
    position_xyz_m : (F, 22, 3) float, metres, canonical joints, Y up, F >= 1
    per_frame : bool
        False: the first frame's root goes over the origin and its hips face +Z, so that the path stays. True: every
        frame's do, for searches that ignore travel.
    is_sized : bool
        Scale to legs of :data:`~kernels.skeleton.canonical.LEG_LENGTH_M`; False leaves sizes alone, as [Ganbat2020].

    Returns
    -------
    (F, 22, 3) float64, metres

    Raises
    ------
    ValueError
        If the shape is another, there is no frame, or a value is not finite.
    """
    if position_xyz_m.ndim != 3 or position_xyz_m.shape[1:] != (_N, 3) or not len(position_xyz_m):
        raise ValueError(f"position_xyz_m: want (F, {_N}, 3) with F >= 1, got {position_xyz_m.shape}")
    if not np.isfinite(position_xyz_m).all():
        raise ValueError("position_xyz_m: want finite metres, got gaps; fill them before searching")
    position = np.asarray(position_xyz_m, np.float64)
    leg_m = leg_length_m(position)
    if is_sized and leg_m > 0:
        position = position * (LEG_LENGTH_M / leg_m)
    root, angle = position[:, :1] * np.array([1.0, 0.0, 1.0]), heading_rad(position)
    if not per_frame:
        root, angle = root[:1], np.full(len(position), angle[0])
    return turn(position - root, angle)


def resample(
    position_xyz_m: Float, frame_rate_hz: float, start_s: float, end_s: float, *, rate_hz: float = RATE_HZ
) -> Float:
    """Take a stretch of a motion at another rate, straight between frames.

    Parameters
    ----------
    position_xyz_m : (F, 22, 3) float, F >= 1
    frame_rate_hz : float, > 0
    start_s, end_s : float, seconds of the clip, ``0 <= start_s <= end_s``
        Beyond the clip's end there is nothing: the stretch ends there.
    rate_hz : float, > 0

    Returns
    -------
    (T, 22, 3) float64, T >= 1
    """
    last = len(position_xyz_m) - 1
    end_s = min(end_s, last / frame_rate_hz)
    n = int(np.floor((end_s - start_s) * rate_hz + 1e-6)) + 1
    at = np.clip((start_s + np.arange(max(n, 1)) / rate_hz) * frame_rate_hz, 0, last)
    frame = np.minimum(at.astype(np.int64), max(last - 1, 0))
    share = (at - frame)[:, None, None]
    following = np.minimum(frame + 1, last)
    return np.asarray(position_xyz_m[frame] * (1 - share) + position_xyz_m[following] * share, np.float64)


def channels(position_xyz_m: Float, *, has_travel: bool = True) -> NDArray[np.float32]:
    """Say what a body does frame by frame, free of where it is and where it faces.

    Parameters
    ----------
    position_xyz_m : (T, 22, 3) float, metres, at :data:`RATE_HZ`, T >= 1
    has_travel : bool
        False leaves out where the root goes and turns: a walk on the spot is a walk.

    Returns
    -------
    (T, N_CHANNELS) float32
        Joint positions seen from the root's place on the floor and its heading, joint velocities relative to the root's
        in the same frame, and of the root: velocity (3), turning speed, way travelled sideways and forwards from the
        first frame, sine of the angle turned, and one minus its cosine. Scaled to about one.

    Raises
    ------
    ValueError
        As :func:`normalise`.
    """
    path = normalise(position_xyz_m)
    n = len(path)
    angle = heading_rad(path)
    floor = path[:, :1] * np.array([1.0, 0.0, 1.0])
    body = turn(path - floor, angle)
    speed = np.gradient(path, axis=0) * RATE_HZ if n > 1 else np.zeros_like(path)
    own = turn(speed - speed[:, :1] * np.array([1.0, 0.0, 1.0]), angle)
    turning = np.gradient(angle) * RATE_HZ if n > 1 else np.zeros(1)
    root = turn(speed[:, 0], angle)
    travel = [root, turning[:, None], path[:, 0, [0, 2]], np.sin(angle)[:, None], 1 - np.cos(angle)[:, None]]
    if not has_travel:
        root = root * np.array([0.0, 1.0, 0.0])
        travel = [root, *(np.zeros_like(part) for part in travel[1:])]
    parts = [body.reshape(n, -1) / _POSITION_M, own.reshape(n, -1), *travel]
    return np.concatenate(parts, axis=1).astype(np.float32)
