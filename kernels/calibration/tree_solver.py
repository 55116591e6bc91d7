"""Poses of a body closed at its joints, by Gauss-Newton steps on its tree: the answer in one or two of them.

Conventions
-----------
Axes: ``F`` frames, ``S`` the 17 segments, parents first. A bone's frame is its sensor's, its origin its proximal joint;
the pelvis's origin is its sensor. Unknown are the root's position and the 17 world rotations, so joints are closed by
construction. Left increments: ``R <- exp(dt) R``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from kernels import rotation
from kernels.calibration.records import PARENT, SENSORS
from kernels.types import Float

FILLED_WEIGHT = 0.04
"""Weight of an interpolated entry: never 0, which would leave a limb of unknown sensors undetermined."""

DAMPING = 1e-3
"""Share of a rotation's weight added to each bone's equations."""

POSITION_SIGMA_M = 0.005
ROTATION_SIGMA_RAD = float(np.radians(1.5))
"""How far sensors stray from their bones. Flat on purpose: estimates run away, for the poses soak up the residuals."""

KINDNESS = 16.0
"""Squared residual, in variances, at which a measurement's weight falls to a quarter from the second step on."""


@dataclass(frozen=True, eq=False)
class BodyModel:
    """A calibrated body as the solvers see it.

    Parameters
    ----------
    parent : 17 indices, the root's -1
    sensor_m : (S, 3) float64, metres
        Sensor in its bone's frame; 0 for the root.
    offset_m : (S, 3) float64, metres
        Proximal joint in the parent bone's frame; 0 for the root.
    position_sigma_m, rotation_sigma_rad : (S,) float64, > 0
        How far each sensor is believed to stray from its bone.
    """

    parent: tuple[int, ...]
    sensor_m: Float
    offset_m: Float
    position_sigma_m: Float
    rotation_sigma_rad: Float


@dataclass(frozen=True, eq=False)
class Stream:
    """What the sensors said, for a solver.

    Parameters
    ----------
    position_xyz_m : (F, S, 3) float64, metres
    rotation_wxyz : (F, S, 4) float64, unit
    weight : (F, S) float64, > 0
    """

    position_xyz_m: Float
    rotation_wxyz: Float
    weight: Float


@dataclass(frozen=True, eq=False)
class Solved:
    """World rotations (F, S, 4) of the bones and world positions (F, S, 3) metres of their origins."""

    position_xyz_m: Float
    rotation_wxyz: Float


class PoseSolver(Protocol):
    """Anything that brings bones to their sensors: the references here, or a twin on a device."""

    def __call__(self, model: BodyModel, stream: Stream, *, iterations: int) -> Solved:
        """Solve every frame by itself."""


def make_model(
    in_parent_sensor_m: Float,
    in_child_sensor_m: Float,
    *,
    position_sigma_m: Float | float = POSITION_SIGMA_M,
    rotation_sigma_rad: Float | float = ROTATION_SIGMA_RAD,
) -> BodyModel:
    """Build the body from its joints as the sensors see them.

    Parameters
    ----------
    in_parent_sensor_m, in_child_sensor_m : (16, 3) float, metres
    position_sigma_m, rotation_sigma_rad : (17,) float or one for all, > 0

    Returns
    -------
    BodyModel
    """
    sensor, offset = np.zeros((len(SENSORS), 3)), np.zeros((len(SENSORS), 3))
    sensor[1:] = -in_child_sensor_m
    # a joint in the parent bone's frame: its place from the parent's sensor, and that from the parent's own joint
    offset[1:] = in_parent_sensor_m + sensor[list(PARENT[1:])]
    full = np.ones(len(SENSORS))
    return BodyModel(PARENT, sensor, offset, full * position_sigma_m, full * rotation_sigma_rad)


def check_stream(model: BodyModel, stream: Stream, iterations: int) -> None:
    """Refuse what no solver can take.

    Parameters
    ----------
    model : BodyModel of S bones
    stream : Stream of the S sensors
    iterations : int

    Raises
    ------
    ValueError
        If a shape does not fit, a value is not finite, a weight is not > 0, or there is less than one iteration.
    """
    f, s = len(stream.position_xyz_m), len(model.parent)
    for name, shape in (("position_xyz_m", (f, s, 3)), ("rotation_wxyz", (f, s, 4)), ("weight", (f, s))):
        array = getattr(stream, name)
        if array.shape != shape:
            raise ValueError(f"{name}: want {shape}, got {array.shape}")
        if not np.isfinite(array).all():
            raise ValueError(f"{name}: not finite; clean the recording first")
    if not (stream.weight > 0).all():
        raise ValueError("weight: want > 0 everywhere; give interpolated entries a small one")
    if iterations < 1:
        raise ValueError(f"iterations: want at least 1, got {iterations}")


def solve_tree(model: BodyModel, stream: Stream, *, iterations: int = 2) -> Solved:
    """Fit a jointed body to its sensors, frame by frame.

    Parameters
    ----------
    model : BodyModel
    stream : Stream of F frames
    iterations : int, >= 1
        Gauss-Newton steps; from the second on, measurements far off count less.

    Returns
    -------
    Solved
        Closed at the joints to rounding. Empty where F is 0.

    Raises
    ------
    ValueError
        From :func:`check_stream`.

    Notes
    -----
    Each step eliminates the bones from the leaves to the root, 3 x 3 by 3 x 3, and goes back. The rotation residual is
    twice the vector part of the quaternion, lengthened by the series of the arcsine to third order: the rotation vector
    to 1e-3 up to 60 degrees. The increment is the unit quaternion along (1, dt / 2).
    """
    check_stream(model, stream, iterations)
    n = len(model.parent)
    measured = np.moveaxis(stream.position_xyz_m, 1, 0)
    said = np.moveaxis(stream.rotation_wxyz, 1, 0)
    q = said.copy()
    root = measured[0].copy()
    weight = np.moveaxis(stream.weight, 1, 0)
    for step in range(iterations):
        R = rotation.to_matrix(q)
        arm = [R[s] @ model.sensor_m[s] for s in range(n)]
        bone = [R[s if s == 0 else model.parent[s]] @ model.offset_m[s] for s in range(n)]
        p = _hang(model, root, bone)
        # of what hangs below each bone: its pull on the joint, and what the joint's movement gives the bone's turn
        K, g, X = np.zeros((n, len(root), 3, 3)), np.zeros((n, len(root), 3)), np.zeros((n, len(root), 3, 4))
        for s in reversed(range(n)):
            r = measured[s] - p[s] - arm[s]
            phi = _rotation_residual(q[s], said[s])
            wp = weight[s] / model.position_sigma_m[s] ** 2
            wr = weight[s] / model.rotation_sigma_rad[s] ** 2
            if step > 0:
                wp = wp * _kind(r, model.position_sigma_m[s])
                wr = wr * _kind(phi, model.rotation_sigma_rad[s])
            D = _cross_matrix(arm[s])
            eye = np.eye(3) * wp[:, None, None]
            damped = wr + DAMPING / model.rotation_sigma_rad[s] ** 2
            A_s, B_s = eye, -wp[:, None, None] * D
            C_s = wp[:, None, None] * (D.mT @ D) + damped[:, None, None] * np.eye(3)
            g_s = wp[:, None] * r
            h_s = -np.matvec(D.mT, g_s) + wr[:, None] * phi
            for c in range(s + 1, n):
                if model.parent[c] == s:
                    D = _cross_matrix(bone[c])
                    KD = K[c] @ D
                    A_s, B_s, C_s = A_s + K[c], B_s - KD, C_s + D.mT @ KD
                    g_s, h_s = g_s + g[c], h_s - np.matvec(D.mT, g[c])
            X[s] = np.linalg.solve(C_s, np.concatenate([B_s.mT, h_s[..., None]], axis=-1))
            K[s] = A_s - B_s @ X[s][..., :3]
            g[s] = g_s - np.matvec(B_s, X[s][..., 3])
        dp = np.zeros((n, *root.shape))
        dp[0] = np.linalg.solve(K[0], g[0][..., None])[..., 0]
        turned = np.zeros((n, *root.shape))
        for s in range(n):
            if s > 0:
                above = model.parent[s]
                dp[s] = dp[above] + np.cross(turned[above], bone[s])
            turned[s] = X[s][..., 3] - np.matvec(X[s][..., :3], dp[s])
        q = rotation.normalize(rotation.mul(np.concatenate([np.ones((*turned.shape[:-1], 1)), turned / 2], -1), q))
        root = root + dp[0]
    R = rotation.to_matrix(q)
    bone = [R[s if s == 0 else model.parent[s]] @ model.offset_m[s] for s in range(n)]
    return Solved(np.stack(_hang(model, root, bone), axis=1), np.moveaxis(q, 0, 1))


def _hang(model: BodyModel, root: Float, bone: list[Float]) -> list[Float]:
    p = [root]
    for s in range(1, len(model.parent)):
        p.append(p[model.parent[s]] + bone[s])
    return p


def _rotation_residual(q: Float, said: Float) -> Float:
    """Rotation vector from ``q`` to what was said, in the world."""
    apart = rotation.mul(said, rotation.inv(q))
    v = apart[..., 1:] * np.where(apart[..., :1] < 0, -2.0, 2.0)
    square = 0.25 * np.sum(v * v, axis=-1, keepdims=True)
    phi: Float = v * (1.0 + square * (1.0 / 6.0 + square * (3.0 / 40.0 + square * (15.0 / 336.0))))
    return phi


def _kind(residual: Float, sigma: float) -> Float:
    """Geman and McClure's weight."""
    u = np.sum(residual * residual, axis=-1) / (3.0 * sigma**2)
    weight: Float = 1.0 / (1.0 + u / KINDNESS) ** 2
    return weight


def _cross_matrix(v: Float) -> Float:
    """[v]x, (..., 3, 3)."""
    zero = np.zeros(v.shape[:-1])
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*v.shape[:-1], 3, 3)
