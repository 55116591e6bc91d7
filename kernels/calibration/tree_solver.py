"""Poses of a body closed at its joints, by Gauss-Newton steps on its tree: the answer in one or two of them.

Conventions
-----------
Axes: ``F`` frames, ``S`` the 17 segments, parents first. A bone's frame is its sensor's, its origin its proximal joint;
the pelvis's origin is its sensor. Unknown are the root's position and the 17 world rotations, so joints are closed by
construction. Left increments: ``R <- exp(dt) R``. Everything is computed by :mod:`kernels.calibration.components`, all
frames of a portion side by side, so the answer has the same bits on every processor and on a device.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from kernels.calibration.components import (
    Matrix,
    Quaternion,
    Symmetric,
    Vector,
    add,
    carry,
    cross,
    dot,
    factor,
    join,
    quaternions,
    rotation_between,
    scale,
    solve,
    subtract,
    turn,
    vectors,
)
from kernels.calibration.records import PARENT, SENSORS
from kernels.types import Float

FILLED_WEIGHT = 0.04
"""Weight of an interpolated entry: never 0, which would leave a limb of unknown sensors undetermined. Measured on
made-up recordings: with 0 float32 is off by 5 to 50 mm where two neighbours are missing, with this by 3 micrometres."""

DAMPING = 1e-3
"""Share of a rotation's weight added to each bone's equations. Chosen by hand, small beside 1."""

POSITION_SIGMA_M = 0.005
ROTATION_SIGMA_RAD = float(np.radians(1.5))
"""How far sensors stray from their bones: the same for all. Estimates for each sensor, tried on made-up recordings,
shrink without end, because poses fit the sensor that is trusted most. Chosen by hand about a magnetic suit's noise."""

KINDNESS = 16.0
"""Squared residual, in variances, at which a measurement's weight falls to a quarter from the second step on, as
[Geman1987] weigh them. Chosen by hand: four deviations."""

_UNIT_M = 0.005  # variances are given in this, chosen so that float32 works near 1
_PORTION = 4096  # frames at a time, chosen so that what a step needs stays in the cache; changes no bit


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


def body_rows(model: BodyModel) -> Float:
    """Write a body as the solver and its twin read it.

    Parameters
    ----------
    model : BodyModel

    Returns
    -------
    (S, 11) float64
        Sensor in its bone's frame (3), proximal joint in the parent's (3), both in metres; one over the variance of
        positions and of rotations, in units of 5 mm; what damps a turn; what squared residuals, of positions in metres
        and of rotations in radians, are multiplied with for the weight of Geman and McClure [Geman1987].
    """
    apart, turned = _UNIT_M / model.position_sigma_m, _UNIT_M / model.rotation_sigma_rad
    per_variance = np.stack([apart * apart, turned * turned], axis=1)
    kindness = per_variance / (3.0 * KINDNESS * (_UNIT_M * _UNIT_M))
    return np.concatenate(
        [model.sensor_m, model.offset_m, per_variance, DAMPING * per_variance[:, 1:], kindness], axis=1
    )


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
    Each step eliminates the bones from the leaves to the root, 3 x 3 by 3 x 3, and goes back. Positions are taken from
    each frame's pelvis sensor first, so that accuracy does not depend on where in the world the body is.
    """
    check_stream(model, stream, iterations)
    body = body_rows(model).tolist()
    return in_portions(stream, lambda sensors: _fit(model.parent, body, sensors, iterations))


class Sensor(NamedTuple):
    """What one sensor said in all frames: place from the origin, rotation, and how far it is believed."""

    at: Vector
    said: Quaternion
    belief: Float


def in_portions(stream: Stream, solve_some: Callable[[list[Sensor]], tuple[list[Vector], list[Quaternion]]]) -> Solved:
    """Hand a stream to a solver by components, some thousand frames at a time.

    Parameters
    ----------
    stream : Stream of F frames
    solve_some : callable
        From the S sensors, their places taken from the first one's, to places and rotations of the bones.

    Returns
    -------
    Solved
        Empty where F is 0.
    """
    origin = stream.position_xyz_m[:, :1]
    position, turned = np.zeros_like(stream.position_xyz_m), np.zeros_like(stream.rotation_wxyz)
    for first in range(0, len(origin), _PORTION):
        some = slice(first, first + _PORTION)
        at, said = vectors(stream.position_xyz_m[some] - origin[some]), quaternions(stream.rotation_wxyz[some])
        belief = np.ascontiguousarray(stream.weight[some].T)
        place, q = solve_some([Sensor(*one) for one in zip(at, said, belief, strict=True)])
        position[some], turned[some] = join(place), join(q)
    return Solved(position + origin, turned)


class _Equations(NamedTuple):
    """What a bone and all below it want of its joint's movement dp and turn dt: A dp + B dt = g, B^T dp + C dt = h."""

    A: Symmetric
    B: Matrix
    C: Symmetric
    g: Vector
    h: Vector


def _fit(
    parent: tuple[int, ...], body: list[list[float]], sensors: list[Sensor], iterations: int
) -> tuple[list[Vector], list[Quaternion]]:
    """Take the steps: places and rotations of the bones."""
    q = [sensor.said for sensor in sensors]
    root = sensors[0].at
    for step in range(iterations):
        bone, place = _hang(parent, body, root, q)
        equations = [_weigh(sensors[s], q[s], place[s], body[s], is_first=step == 0) for s in range(len(parent))]
        moved, turned = _least_squares(parent, bone, equations)
        q = [turn(q[s], turned[s]) for s in range(len(parent))]
        root = add(root, moved)
    return _hang(parent, body, root, q)[1], q


def _hang(
    parent: tuple[int, ...], body: list[list[float]], root: Vector, q: list[Quaternion]
) -> tuple[list[Vector], list[Vector]]:
    """Ways from the parent's origin to each bone's, the root's of no meaning, and places of the origins."""
    bone, place = [root], [root]
    for s in range(1, len(parent)):
        bone.append(carry(q[parent[s]], body[s][3:6]))
        place.append(add(place[parent[s]], bone[s]))
    return bone, place


def _weigh(sensor: Sensor, q: Quaternion, place: Vector, row: list[float], *, is_first: bool) -> _Equations:
    """Set up what a bone's own sensor wants of it."""
    per_place, per_turn, damping, kind_place, kind_turn = row[6:]
    arm = carry(q, row[:3])
    r = subtract(subtract(sensor.at, place), arm)
    phi = rotation_between(q, sensor.said)
    wp, wr = sensor.belief * per_place, sensor.belief * per_turn
    if not is_first:
        up, ur = 1.0 + dot(r, r) * kind_place, 1.0 + dot(phi, phi) * kind_turn
        wp, wr = wp / (up * up), wr / (ur * ur)
    x, y, z = arm
    wx, wy, wz = scale(wp, arm)
    damped = wr + damping
    zero = np.zeros_like(wp)
    return _Equations(
        (wp, zero, zero, wp, zero, wp),
        ((zero, wz, -wy), (-wz, zero, wx), (wy, -wx, zero)),
        (
            wp * (y * y + z * z) + damped,
            -(wx * y),
            -(wx * z),
            wp * (x * x + z * z) + damped,
            -(wy * z),
            wp * (x * x + y * y) + damped,
        ),
        scale(wp, r),
        add(cross((wx, wy, wz), r), scale(wr, phi)),
    )


def _least_squares(
    parent: tuple[int, ...], bone: list[Vector], equations: list[_Equations]
) -> tuple[Vector, list[Vector]]:
    """Solve for the root's movement and the turns of all: from the leaves to the root, and back."""
    n = len(parent)
    wanted, turns = list(equations), {}
    for s in reversed(range(n)):
        turns[s], K, k = _eliminate(wanted[s])
        if s > 0:
            wanted[parent[s]] = _with_child(wanted[parent[s]], K, k, bone[s])
    moved = [solve(factor(K), k)]
    turned = [_turn_of(turns[0], moved[0])]
    for s in range(1, n):
        moved.append(add(moved[parent[s]], cross(turned[parent[s]], bone[s])))
        turned.append(_turn_of(turns[s], moved[s]))
    return moved[0], turned


class _Turn(NamedTuple):
    """A bone's turn dt = of_pull - X dp, where dp is its joint's movement; X by its columns."""

    X: Matrix
    of_pull: Vector


def _eliminate(e: _Equations) -> tuple[_Turn, Symmetric, Vector]:
    """Solve for the bone's turn, and leave its joint's movement: K dp = k."""
    f = factor(e.C)
    B0, B1, B2 = e.B
    X0, X1, X2 = solve(f, B0), solve(f, B1), solve(f, B2)
    x = solve(f, e.h)
    K = (
        e.A[0] - dot(B0, X0),
        e.A[1] - dot(B0, X1),
        e.A[2] - dot(B0, X2),
        e.A[3] - dot(B1, X1),
        e.A[4] - dot(B1, X2),
        e.A[5] - dot(B2, X2),
    )
    return _Turn((X0, X1, X2), x), K, subtract(e.g, (dot(B0, x), dot(B1, x), dot(B2, x)))


def _with_child(e: _Equations, K: Symmetric, k: Vector, bone: Vector) -> _Equations:
    """Add what a child wants, whose joint moves by dp + dt x bone."""
    k00, k01, k02, k11, k12, k22 = K
    W0, W1, W2 = cross((k00, k01, k02), bone), cross((k01, k11, k12), bone), cross((k02, k12, k22), bone)
    t0, t1, t2 = (cross((W0[i], W1[i], W2[i]), bone) for i in range(3))
    return _Equations(
        _sum(e.A, K),
        (subtract(e.B[0], W0), subtract(e.B[1], W1), subtract(e.B[2], W2)),
        _sum(e.C, (t0[0], t1[0], t2[0], t1[1], t2[1], t2[2])),
        add(e.g, k),
        add(e.h, cross(bone, k)),
    )


def _sum(a: Symmetric, b: Symmetric) -> Symmetric:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


def _turn_of(way: _Turn, moved: Vector) -> Vector:
    x, y, z = moved
    X0, X1, X2 = way.X
    return subtract(way.of_pull, add(add(scale(x, X0), scale(y, X1)), scale(z, X2)))
