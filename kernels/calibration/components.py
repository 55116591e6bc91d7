"""Vectors, rotations and symmetric 3 x 3 equations by their components, each sum and product in the order written.

Conventions
-----------
A vector is its three components, a unit quaternion its four, ``wxyz``, a symmetric matrix its upper triangle, row by
row; each component is an array (F,) of all frames. There are additions, subtractions, multiplications, divisions and
square roots, and nothing else: IEEE 754 rounds each of these in one way, and NumPy never makes one of two. So a result
has the same bits on every processor, for any number of frames at once, and in the twin
``kernels/opencl/components.cl``, which does the same in the same order.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.types import Float

Vector = tuple[Float, Float, Float]
Quaternion = tuple[Float, Float, Float, Float]
Matrix = tuple[Vector, Vector, Vector]
Symmetric = tuple[Float, Float, Float, Float, Float, Float]
Constant = tuple[float, float, float] | list[float]


class Factor(NamedTuple):
    """A symmetric positive matrix as L D L^T: one over the diagonal of D, and L below its ones; each (F,) float64."""

    d0: Float
    d1: Float
    d2: Float
    l10: Float
    l20: Float
    l21: Float


def vectors(series: Float) -> list[Vector]:
    """Take vectors apart.

    Parameters
    ----------
    series : (F, S, 3) float64

    Returns
    -------
    list of S Vector
    """
    return [(x, y, z) for x, y, z in np.ascontiguousarray(np.moveaxis(series, 0, -1))]


def quaternions(series: Float) -> list[Quaternion]:
    """Take quaternions apart.

    Parameters
    ----------
    series : (F, S, 4) float64, wxyz

    Returns
    -------
    list of S Quaternion
    """
    return [(w, x, y, z) for w, x, y, z in np.ascontiguousarray(np.moveaxis(series, 0, -1))]


def join(parts: Sequence[Vector] | Sequence[Quaternion]) -> Float:
    """Put vectors or quaternions together again.

    Parameters
    ----------
    parts : S of them, of F frames each

    Returns
    -------
    (F, S, 3) or (F, S, 4) float64
    """
    return np.moveaxis(np.array(parts), -1, 0)


def add(a: Vector, b: Vector) -> Vector:
    """Add two vectors.

    Parameters
    ----------
    a, b : Vector

    Returns
    -------
    Vector
    """
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def subtract(a: Vector, b: Vector) -> Vector:
    """Take one vector from another.

    Parameters
    ----------
    a, b : Vector

    Returns
    -------
    Vector
        a - b.
    """
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scale(k: Float | float, v: Vector) -> Vector:
    """Multiply a vector.

    Parameters
    ----------
    k : (F,) float64, or one float for all
    v : Vector

    Returns
    -------
    Vector
    """
    return k * v[0], k * v[1], k * v[2]


def dot(a: Vector, b: Vector) -> Float:
    """Take the scalar product of two vectors.

    Parameters
    ----------
    a, b : Vector

    Returns
    -------
    (F,) float64
    """
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Take the vector product of two vectors.

    Parameters
    ----------
    a, b : Vector

    Returns
    -------
    Vector
    """
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def carry(q: Quaternion, v: Constant) -> Vector:
    """Turn a constant vector: v + w t + u x t with t = 2 u x v, where q is (w, u).

    Parameters
    ----------
    q : Quaternion
    v : three floats

    Returns
    -------
    Vector
    """
    w, x, y, z = q
    a, b, c = v
    tx, ty, tz = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * tx + (y * tz - z * ty), b + w * ty + (z * tx - x * tz), c + w * tz + (x * ty - y * tx)


def turn(q: Quaternion, t: Vector) -> Quaternion:
    """Turn further by a small rotation vector: the left product with (1, t / 2), brought to length one.

    Parameters
    ----------
    q : Quaternion
    t : Vector, radians

    Returns
    -------
    Quaternion
    """
    w, x, y, z = q
    a, b, c = scale(0.5, t)
    e, f = w - a * x - b * y - c * z, x + a * w + b * z - c * y
    g, h = y - a * z + b * w + c * x, z + a * y - b * x + c * w
    length = np.sqrt(e * e + f * f + g * g + h * h)
    return e / length, f / length, g / length, h / length


def rotation_between(q: Quaternion, other: Quaternion) -> Vector:
    """Rotation vector in the world that brings one rotation to another near it.

    Parameters
    ----------
    q, other : Quaternion

    Returns
    -------
    Vector, radians
        Twice the vector part of other q^-1, lengthened by the series of the arcsine: to 1e-3 up to 60 degrees.
    """
    w, x, y, z = q
    a, b, c, d = other
    two = np.where(a * w + b * x + c * y + d * z < 0.0, -2.0, 2.0)
    v = (
        two * (b * w - a * x + d * y - c * z),
        two * (c * w - a * y + b * z - d * x),
        two * (d * w - a * z + c * x - b * y),
    )
    square = 0.25 * dot(v, v)
    return scale(1.0 + square * (1.0 / 6.0 + square * (3.0 / 40.0 + square * (15.0 / 336.0))), v)


def factor(c: Symmetric) -> Factor:
    """Prepare equations for :func:`solve`.

    Parameters
    ----------
    c : Symmetric, positive

    Returns
    -------
    Factor
    """
    c00, c01, c02, c11, c12, c22 = c
    d0 = 1.0 / c00
    l10, l20 = c01 * d0, c02 * d0
    d1 = 1.0 / (c11 - l10 * c01)
    rest = c12 - l20 * c01
    l21 = rest * d1
    return Factor(d0, d1, 1.0 / (c22 - l20 * c02 - l21 * rest), l10, l20, l21)


def solve(f: Factor, b: Vector) -> Vector:
    """Solve three equations.

    Parameters
    ----------
    f : Factor of their matrix
    b : Vector, their right sides

    Returns
    -------
    Vector
    """
    y1 = b[1] - f.l10 * b[0]
    y2 = b[2] - f.l20 * b[0] - f.l21 * y1
    z = y2 * f.d2
    y = y1 * f.d1 - f.l21 * z
    return b[0] * f.d0 - f.l10 * y - f.l20 * z, y, z
