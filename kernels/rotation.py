"""Rotations as unit quaternions, batched over leading axes.

Conventions
-----------
Quaternions are ``wxyz``, right-handed, and act on column vectors: ``apply(mul(a, b), v) = apply(a, apply(b, v))``.
Angles are radians. All functions take any leading axes ``(..., 4)`` and compute in float64.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Floats = NDArray[np.float64] | NDArray[np.float32]

IDENTITY: Float = np.array([1.0, 0.0, 0.0, 0.0])
"""No turn, w first, by definition."""


def _join(*component: Float) -> Float:
    """Put components (...) side by side: np.stack along the last axis, with less ado."""
    out = np.zeros((*component[0].shape, len(component)))
    for k, values in enumerate(component):
        out[..., k] = values
    return out


def normalize(q: Floats) -> Float:
    """Scale to unit length.

    Parameters
    ----------
    q : (..., 4) float, wxyz, not zero

    Returns
    -------
    (..., 4) float64

    Raises
    ------
    ValueError
        If a quaternion is zero or not finite.
    """
    q = np.asarray(q, np.float64)
    length: Float = np.linalg.norm(q, axis=-1, keepdims=True)
    if not (np.isfinite(length).all() and (length > 0).all()):
        raise ValueError("q: want finite quaternions of non-zero length, got a zero or a NaN; check the rotations read")
    unit: Float = q / length
    return unit


def mul(a: Floats, b: Floats) -> Float:
    """Compose: first ``b``, then ``a``.

    Parameters
    ----------
    a, b : (..., 4) float, wxyz, broadcast together

    Returns
    -------
    (..., 4) float64
    """
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    aw, ax, ay, az = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bw, bx, by, bz = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    return _join(
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def inv(q: Floats) -> Float:
    """Invert unit quaternions.

    Parameters
    ----------
    q : (..., 4) float, wxyz, unit

    Returns
    -------
    (..., 4) float64
    """
    conjugate: Float = np.asarray(q, np.float64) * np.array([1.0, -1.0, -1.0, -1.0])
    return conjugate


def apply(q: Floats, v: Floats) -> Float:
    """Rotate vectors.

    Parameters
    ----------
    q : (..., 4) float, wxyz, unit
    v : (..., 3) float, broadcast with ``q``

    Returns
    -------
    (..., 3) float64
    """
    q, v = np.asarray(q, np.float64), np.asarray(v, np.float64)
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    a, b, c = v[..., 0], v[..., 1], v[..., 2]
    # v + w t + u x t with u = (x, y, z) and t = 2 u x v, written out: np.cross is slower than the rest together.
    tx, ty, tz = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return _join(a + w * tx + (y * tz - z * ty), b + w * ty + (z * tx - x * tz), c + w * tz + (x * ty - y * tx))


def from_axis_angle(axis: Floats, angle_rad: Floats | float) -> Float:
    """Turn by an angle about a unit axis.

    Parameters
    ----------
    axis : (..., 3) float, unit
    angle_rad : (...) float, radians

    Returns
    -------
    (..., 4) float64, wxyz
    """
    half = np.asarray(angle_rad, np.float64)[..., None] / 2.0
    xyz = np.sin(half) * np.asarray(axis, np.float64)
    return np.concatenate([np.broadcast_to(np.cos(half), (*xyz.shape[:-1], 1)), xyz], axis=-1)


def from_euler(angle_rad: Floats | float, order: str) -> Float:
    """Compose intrinsic rotations about the axes of ``order``, first letter outermost.

    ``from_euler([a, b, c], "zyx")`` is ``Rz(a) Ry(b) Rx(c)``: the way BVH channels are read from left to right.

    Parameters
    ----------
    angle_rad : (..., n) float, radians, n = len(order)
    order : letters of "xyz", any length >= 0, any repetition

    Returns
    -------
    (..., 4) float64, wxyz
        The identity when ``order`` is empty.

    Raises
    ------
    ValueError
        If the last axis does not fit ``order`` or a letter is not x, y or z.
    """
    angle = np.asarray(angle_rad, np.float64)
    if angle.shape[-1] != len(order) or set(order) - set("xyz"):
        raise ValueError(f"order: want {angle.shape[-1]} letters of xyz, got {order!r}")
    half = angle / 2.0
    cosine, sine = np.cos(half), np.sin(half)
    q: list[Float] = [np.ones(angle.shape[:-1]), *np.zeros((3, *angle.shape[:-1]))]
    for i, letter in enumerate(order):
        # q times (cosine + sine e_k): only two of the four products are not zero.
        k = "xyz".index(letter)
        ck, sk = cosine[..., i], sine[..., i]
        w, u, v, n = q[0], q[1 + k], q[1 + (k + 1) % 3], q[1 + (k + 2) % 3]
        q[0], q[1 + k] = w * ck - u * sk, u * ck + w * sk
        q[1 + (k + 1) % 3], q[1 + (k + 2) % 3] = v * ck + n * sk, n * ck - v * sk
    return np.stack(q, axis=-1)


def to_euler(q: Floats, order: str) -> Float:
    """Decompose into intrinsic rotations about three axes, first letter outermost: the inverse of :func:`from_euler`.

    Parameters
    ----------
    q : (..., 4) float, wxyz, unit
    order : "xyz", "zxy" … three different letters

    Returns
    -------
    (..., 3) float64, radians
        The middle angle within -pi/2 to pi/2. Where it is at an end, the last angle is 0: only the sum is known there.

    Raises
    ------
    ValueError
        If ``order`` is not three different letters of xyz.
    """
    if sorted(order) != ["x", "y", "z"]:
        raise ValueError(f"order: want three different letters of xyz, got {order!r}")
    i, j, k = ("xyz".index(letter) for letter in order)
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    m = to_matrix(q)
    flat = np.hypot(m[..., i, i], m[..., i, j])
    is_locked = flat < 1e-9
    first = np.where(
        is_locked,
        np.arctan2(sign * m[..., k, j], m[..., j, j]),
        np.arctan2(-sign * m[..., j, k], m[..., k, k]),
    )
    last = np.where(is_locked, 0.0, np.arctan2(-sign * m[..., i, j], m[..., i, i]))
    return np.stack([first, np.arctan2(sign * m[..., i, k], flat), last], axis=-1)


def to_matrix(q: Floats) -> Float:
    """Write as rotation matrices for column vectors.

    Parameters
    ----------
    q : (..., 4) float, wxyz, unit

    Returns
    -------
    (..., 3, 3) float64
    """
    q = np.asarray(q, np.float64)
    return np.stack([apply(q, axis) for axis in np.eye(3)], axis=-1)


def from_matrix(m: Floats) -> Float:
    """Read rotation matrices for column vectors (the largest component divides [Shepperd1978]).

    Parameters
    ----------
    m : (..., 3, 3) float, orthonormal, determinant 1

    Returns
    -------
    (..., 4) float64, wxyz, unit, w >= 0

    Raises
    ------
    ValueError
        If a value is not finite.
    """
    m = np.asarray(m, np.float64)
    m00, m11, m22 = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    a, b, c = m[..., 2, 1], m[..., 0, 2], m[..., 1, 0]
    d, e, f = m[..., 1, 2], m[..., 2, 0], m[..., 0, 1]
    candidates = np.stack(
        [
            np.stack([1 + m00 + m11 + m22, a - d, b - e, c - f], -1),
            np.stack([a - d, 1 + m00 - m11 - m22, c + f, b + e], -1),
            np.stack([b - e, c + f, 1 - m00 + m11 - m22, a + d], -1),
            np.stack([c - f, b + e, a + d, 1 - m00 - m11 + m22], -1),
        ],
        axis=-2,
    )
    best = np.argmax(np.stack([m00 + m11 + m22, m00, m11, m22], -1), axis=-1)
    chosen = normalize(np.take_along_axis(candidates, best[..., None, None], axis=-2)[..., 0, :])
    return np.where(chosen[..., :1] < 0, -chosen, chosen)


def log(q: Floats) -> Float:
    """Rotation vectors: axis times angle, angle in [0, pi].

    Parameters
    ----------
    q : (..., 4) float, wxyz, unit

    Returns
    -------
    (..., 3) float64, radians
    """
    unit = np.asarray(q, np.float64)
    near = unit * np.where(unit[..., :1] < 0, -1.0, 1.0)
    sine = np.linalg.norm(near[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, near[..., :1])
    vector: Float = np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0) * near[..., 1:]
    return vector


def exp(rotation_vector: Floats) -> Float:
    """Invert :func:`log`.

    Parameters
    ----------
    rotation_vector : (..., 3) float, radians

    Returns
    -------
    (..., 4) float64, wxyz, unit
    """
    v = np.asarray(rotation_vector, np.float64)
    angle = np.linalg.norm(v, axis=-1, keepdims=True)
    scale = np.where(angle > 1e-12, np.sin(angle / 2) / np.maximum(angle, 1e-12), 0.5)
    return np.concatenate([np.cos(angle / 2), scale * v], axis=-1)


def angle_between(a: Floats, b: Floats) -> Float:
    """Angle of the rotation from ``a`` to ``b``.

    Parameters
    ----------
    a, b : (..., 4) float, wxyz, unit

    Returns
    -------
    (...) float64, radians, 0 to pi
    """
    return np.asarray(np.linalg.norm(log(mul(inv(a), b)), axis=-1), np.float64)


def slerp(a: Floats, b: Floats, weight: Floats | float) -> Float:
    """Walk the shorter great arc from ``a`` to ``b``.

    Parameters
    ----------
    a, b : (..., 4) float, wxyz, unit
    weight : (...) float, 0 gives ``a``, 1 gives ``b``

    Returns
    -------
    (..., 4) float64, wxyz, unit
    """
    return mul(a, exp(np.asarray(weight, np.float64)[..., None] * log(mul(inv(a), b))))


def between(u: Floats, v: Floats) -> Float:
    """Shortest rotation that takes direction ``u`` to direction ``v``.

    Opposite directions turn by pi about an axis chosen by rule: the one perpendicular to ``u`` that lies closest to
    the x axis, or to the z axis when ``u`` is along x.

    Parameters
    ----------
    u, v : (..., 3) float, not zero, any length

    Returns
    -------
    (..., 4) float64, wxyz, unit

    Raises
    ------
    ValueError
        If a vector is zero or not finite.
    """
    one, other = np.asarray(u, np.float64), np.asarray(v, np.float64)
    length_one = np.sqrt(np.sum(one * one, axis=-1, keepdims=True))
    length_other = np.sqrt(np.sum(other * other, axis=-1, keepdims=True))
    both = length_one * length_other
    if not (np.isfinite(both).all() and (both > 0).all()):
        raise ValueError("u, v: want finite directions of non-zero length, got a zero or a NaN")
    one, other = one / length_one, other / length_other
    a, b, c = one[..., 0], one[..., 1], one[..., 2]
    x, y, z = other[..., 0], other[..., 1], other[..., 2]
    w = 1.0 + (a * x + b * y + c * z)
    q = _join(w, b * z - c * y, c * x - a * z, a * y - b * x)
    opposite = w < 1e-9
    if opposite.any():
        u = np.broadcast_to(one, (*w.shape, 3))
        side = np.where(np.abs(u[..., :1]) < 0.9, np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
        perpendicular = side - u * np.sum(u * side, axis=-1, keepdims=True)
        q[opposite] = np.concatenate([np.zeros((*w.shape, 1)), perpendicular], axis=-1)[opposite]
    return normalize(q)


def twist(q: Floats, axis: Floats) -> Float:
    """Part of a rotation about an axis, from the decomposition ``q = swing * twist``.

    Parameters
    ----------
    q : (..., 4) float, wxyz, unit
    axis : (..., 3) float, unit

    Returns
    -------
    (..., 4) float64, wxyz, unit
        The identity where ``q`` turns the axis by exactly pi: the twist is undefined there.
    """
    q = np.asarray(q, np.float64)
    axis = np.asarray(axis, np.float64)
    along = np.sum(q[..., 1:] * axis, axis=-1, keepdims=True)
    t = np.concatenate([q[..., :1], along * axis], axis=-1)
    length = np.linalg.norm(t, axis=-1, keepdims=True)
    return np.where(length > 1e-9, t / np.maximum(length, 1e-9), IDENTITY)


def continuous(q: Floats) -> Float:
    """Choose signs along the first axis so that each quaternion lies in the hemisphere of the one before.

    Parameters
    ----------
    q : (F, ..., 4) float, wxyz, unit

    Returns
    -------
    (F, ..., 4) float64
        First frame with w >= 0. Empty in, empty out.
    """
    q = np.asarray(q, np.float64)
    if len(q) == 0:
        return q.copy()
    flip = np.concatenate(
        [np.where(q[:1, ..., 0] < 0, -1.0, 1.0), np.where(np.sum(q[1:] * q[:-1], axis=-1) < 0, -1.0, 1.0)]
    )
    return q * np.cumprod(flip, axis=0)[..., None]


def heading_rad(q: Floats) -> Float:
    """Direction a body faces about the vertical: 0 along +Z, pi/2 along +X.

    Parameters
    ----------
    q : (..., 4) float, wxyz, unit
        World rotation of the hips; a body at rest faces +Z with Y up.

    Returns
    -------
    (...) float64, radians, -pi to pi

    Notes
    -----
    The forward axis is used where it is not near the vertical. Bent over or lying, where forward points up or down,
    the side axis (left is +X) decides instead, so that the heading does not flip.
    """
    forward = apply(q, np.array([0.0, 0.0, 1.0]))
    left = apply(q, np.array([1.0, 0.0, 0.0]))
    by_forward = np.arctan2(forward[..., 0], forward[..., 2])
    by_left = np.arctan2(-left[..., 2], left[..., 0])
    return np.where(np.hypot(forward[..., 0], forward[..., 2]) >= 0.5, by_forward, by_left)


def from_heading(angle_rad: Floats | float) -> Float:
    """Turn about the vertical: the inverse of :func:`heading_rad` for an upright body.

    Parameters
    ----------
    angle_rad : (...) float, radians

    Returns
    -------
    (..., 4) float64, wxyz
    """
    return from_axis_angle(np.array([0.0, 1.0, 0.0]), angle_rad)
