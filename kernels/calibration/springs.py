"""Springs between bones that close the gaps, relaxed step by step: the method of [Kitsunai2007], after Kondo et al.

Springs join the ends of adjacent bones and hold each bone to its sensor; forces give accelerations, accelerations
positions; all accelerations of an iteration are computed before any bone moves. Kept as a reference and as an option:
it oscillates at few iterations and never quite closes; :mod:`kernels.calibration.tree_solver` does both better.

Conventions
-----------
As :mod:`kernels.calibration.tree_solver`, and like it computed by :mod:`kernels.calibration.components`. Bones are
rigid bodies of mass 1 about the mean of their joints. Turns are applied as the unit quaternion along (1, w / 2), so
that no step needs more than square roots and divisions, and the serial and the parallel run agree bit for bit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kernels.calibration.components import Quaternion, Vector, add, carry, cross, scale, subtract, turn
from kernels.calibration.tree_solver import BodyModel, Sensor, Solved, Stream, check_stream, in_portions
from kernels.types import Float

JOINT_STIFFNESS = 0.25
END_STIFFNESS = 0.02
HOLD_STIFFNESS = 0.002
"""Of springs at joints, and to the sensors of the last bones and of the others, a unit of mass and iteration.
[Kitsunai2007] gives no values. Chosen by hand."""

KEPT_SPEED = 0.85
"""Share of its speed a bone keeps from one iteration to the next. Chosen from three measured on made-up recordings: 0.5
settles sooner, 1 never does."""

_LEAST_INERTIA = 0.002
"""Square metres by mass: of the shortest bones, so that they do not spin. Chosen by hand."""


@dataclass(frozen=True, eq=False)
class SpringBody:
    """Bones as the springs see them, about their centres.

    Parameters
    ----------
    proximal_m, sensor_m : (S, 3) float64, metres
        A bone's own joint (the root's sensor) and its sensor, from its centre.
    attachment_m : (S, 3) float64, metres
        A bone's own joint as the parent carries it, from the parent's centre; 0 for the root.
    turnability : (S,) float64
        1 / moment of inertia.
    hold : (S,) float64
        Stiffness of the spring to the sensor: :data:`END_STIFFNESS` on the last bones of limbs.
    """

    proximal_m: Float
    sensor_m: Float
    attachment_m: Float
    turnability: Float
    hold: Float


def spring_body(model: BodyModel) -> SpringBody:
    """Weigh the bones of a body.

    Parameters
    ----------
    model : BodyModel

    Returns
    -------
    SpringBody
        Inertia is half the square of the bone's length, at least 0.002.
    """
    n = len(model.parent)
    centre, turnability, hold = np.zeros((n, 3)), np.zeros(n), np.full(n, HOLD_STIFFNESS)
    for s in range(n):
        below = [model.offset_m[c] for c in range(n) if model.parent[c] == s]
        points = below + ([np.zeros(3)] if s > 0 else [])
        if not below:
            hold[s] = END_STIFFNESS
            points = [np.zeros(3), model.sensor_m[s]]
        centre[s] = np.mean(points, axis=0)
        length = 2 * max(float(np.sqrt(np.sum((point - centre[s]) ** 2))) for point in points)
        turnability[s] = 1.0 / max(0.5 * (length * length), _LEAST_INERTIA)
    attachment = np.zeros((n, 3))
    attachment[1:] = model.offset_m[1:] - centre[list(model.parent[1:])]
    return SpringBody(-centre, model.sensor_m - centre, attachment, turnability, hold)


def relax_springs(model: BodyModel, stream: Stream, *, iterations: int = 30) -> Solved:
    """Let the springs pull, all frames side by side.

    Parameters
    ----------
    model : BodyModel
    stream : Stream of F frames
        Weights are not used: a spring knows none.
    iterations : int, >= 1

    Returns
    -------
    Solved
        Each bone where the springs left it; gaps remain. Empty where F is 0.

    Raises
    ------
    ValueError
        From :func:`kernels.calibration.tree_solver.check_stream`.
    """
    check_stream(model, stream, iterations)
    body = spring_body(model)
    return in_portions(stream, lambda sensors: _relax(body, model.parent, sensors, iterations))


def _relax(
    body: SpringBody, parent: tuple[int, ...], sensors: list[Sensor], iterations: int
) -> tuple[list[Vector], list[Quaternion]]:
    """Places and rotations of the bones; forces are summed in the order of :func:`relax_frame`."""
    bones = range(len(parent))
    proximal, sensor, attachment = body.proximal_m.tolist(), body.sensor_m.tolist(), body.attachment_m.tolist()
    turnability, hold = body.turnability.tolist(), body.hold.tolist()
    q = [one.said for one in sensors]
    x = [subtract(sensors[s].at, carry(q[s], sensor[s])) for s in bones]
    still = np.zeros_like(x[0][0])
    v: list[Vector] = [(still, still, still) for s in bones]
    w = v.copy()
    for _ in range(iterations):
        force, torque = [], []
        for s in bones:
            lever = carry(q[s], sensor[s])
            held = scale(hold[s], subtract(sensors[s].at, add(x[s], lever)))
            force.append(held)
            torque.append(cross(lever, held))
        for c in bones[1:]:
            p = parent[c]
            own, on_parent = carry(q[c], proximal[c]), carry(q[p], attachment[c])
            pull = scale(JOINT_STIFFNESS, subtract(add(x[p], on_parent), add(x[c], own)))
            force[c], torque[c] = add(force[c], pull), add(torque[c], cross(own, pull))
            force[p], torque[p] = subtract(force[p], pull), subtract(torque[p], cross(on_parent, pull))
        for s in bones:
            v[s] = scale(KEPT_SPEED, add(v[s], force[s]))
            w[s] = scale(KEPT_SPEED, add(w[s], scale(turnability[s], torque[s])))
            x[s], q[s] = add(x[s], v[s]), turn(q[s], w[s])
    return [add(x[s], carry(q[s], proximal[s])) for s in bones], q


def relax_frame(
    body: SpringBody,
    parent: tuple[int, ...],
    position_xyz_m: list[list[float]],
    rotation_wxyz: list[list[float]],
    *,
    iterations: int = 30,
) -> tuple[list[list[float]], list[list[float]]]:
    """Let the springs pull on one frame, bone by bone, in plain Python: the loop of [Kitsunai2007].

    Parameters
    ----------
    body : SpringBody
    parent : S indices
    position_xyz_m : S lists of 3
    rotation_wxyz : S lists of 4, unit
    iterations : int, >= 1

    Returns
    -------
    position_xyz_m : S lists of 3, metres
        Origins of the bones.
    rotation_wxyz : S lists of 4
    """
    n = len(parent)
    proximal, sensor = body.proximal_m.tolist(), body.sensor_m.tolist()
    attachment, turnability, hold = body.attachment_m.tolist(), body.turnability.tolist(), body.hold.tolist()
    at = [[one[i] - position_xyz_m[0][i] for i in range(3)] for one in position_xyz_m]
    q = [list(one) for one in rotation_wxyz]
    x = []
    for s in range(n):
        a = _carry(q[s], sensor[s])
        x.append([at[s][i] - a[i] for i in range(3)])
    v, w = [[0.0] * 3 for _ in range(n)], [[0.0] * 3 for _ in range(n)]
    for _ in range(iterations):
        force, torque = [[0.0] * 3 for _ in range(n)], [[0.0] * 3 for _ in range(n)]
        for s in range(n):
            a = _carry(q[s], sensor[s])
            f = [hold[s] * (at[s][i] - (x[s][i] + a[i])) for i in range(3)]
            t = _cross(a, f)
            for i in range(3):
                force[s][i] += f[i]
                torque[s][i] += t[i]
        for c in range(1, n):
            p = parent[c]
            a, b = _carry(q[c], proximal[c]), _carry(q[p], attachment[c])
            f = [JOINT_STIFFNESS * ((x[p][i] + b[i]) - (x[c][i] + a[i])) for i in range(3)]
            t, u = _cross(a, f), _cross(b, f)
            for i in range(3):
                force[c][i] += f[i]
                torque[c][i] += t[i]
                force[p][i] -= f[i]
                torque[p][i] -= u[i]
        for s in range(n):
            for i in range(3):
                v[s][i] = KEPT_SPEED * (v[s][i] + force[s][i])
                w[s][i] = KEPT_SPEED * (w[s][i] + torque[s][i] * turnability[s])
                x[s][i] += v[s][i]
            q[s] = _turned(q[s], w[s])
    place = []
    for s in range(n):
        a = _carry(q[s], proximal[s])
        place.append([x[s][i] + a[i] + position_xyz_m[0][i] for i in range(3)])
    return place, q


def _carry(q: list[float], v: list[float]) -> list[float]:
    w, x, y, z = q
    a, b, c = v
    tx, ty, tz = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return [a + w * tx + (y * tz - z * ty), b + w * ty + (z * tx - x * tz), c + w * tz + (x * ty - y * tx)]


def _cross(a: list[float], b: list[float]) -> list[float]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _turned(q: list[float], w: list[float]) -> list[float]:
    x, y, z = 0.5 * w[0], 0.5 * w[1], 0.5 * w[2]
    a, b, c, d = q
    e, f = a - x * b - y * c - z * d, b + x * a + y * d - z * c
    g, h = c - x * d + y * a + z * b, d + x * c - y * b + z * a
    length = math.sqrt(e * e + f * f + g * g + h * h)
    return [e / length, f / length, g / length, h / length]
