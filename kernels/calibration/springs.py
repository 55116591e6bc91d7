"""The document's way to close the gaps: springs between bones, relaxed step by step.

After Kitsunai, Saito and Nakajima, "Boosting of the spring based automatic body calibration algorithm" (after Kondo et
al.): springs join the ends of adjacent bones and hold each bone to its sensor; forces give accelerations, accelerations
positions; all accelerations of an iteration are computed before any bone moves. Kept as a reference and as an option:
it oscillates at few iterations and never quite closes; :mod:`kernels.calibration.tree_solver` does both better.

Conventions
-----------
As :mod:`kernels.calibration.tree_solver`. Bones are rigid bodies of mass 1 about the mean of their joints. Turns are
applied as the unit quaternion along (1, w / 2), so that no step needs more than square roots and divisions, and the
serial and the parallel run agree bit for bit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kernels import rotation
from kernels.calibration.tree_solver import BodyModel, Solved, Stream, check_stream
from kernels.types import Float

JOINT_STIFFNESS = 0.25
END_STIFFNESS = 0.02
HOLD_STIFFNESS = 0.002
KEPT_SPEED = 0.85
_LEAST_INERTIA = 0.002


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
        turnability[s] = 1.0 / max(0.5 * length**2, _LEAST_INERTIA)
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
    n, child = len(model.parent), np.arange(1, len(model.parent))
    above = np.array(model.parent[1:])
    q = np.array(stream.rotation_wxyz, np.float64)
    x = stream.position_xyz_m - rotation.apply(q, body.sensor_m)
    v, w = np.zeros_like(x), np.zeros_like(x)
    for _ in range(iterations):
        force, torque = np.zeros_like(x), np.zeros_like(x)
        own = rotation.apply(q[:, child], body.proximal_m[1:])
        on_parent = rotation.apply(q[:, above], body.attachment_m[1:])
        pull = JOINT_STIFFNESS * ((x[:, above] + on_parent) - (x[:, child] + own))
        for s in range(n):  # in the order of the literal loop, so that sums have the same bits
            lever = rotation.apply(q[:, s], body.sensor_m[s])
            held = body.hold[s] * (stream.position_xyz_m[:, s] - (x[:, s] + lever))
            force[:, s] += held
            torque[:, s] += _cross(lever, held)
        for k, (c, p) in enumerate(zip(child, above, strict=True)):
            force[:, c] += pull[:, k]
            torque[:, c] += _cross(own[:, k], pull[:, k])
            force[:, p] -= pull[:, k]
            torque[:, p] -= _cross(on_parent[:, k], pull[:, k])
        v = KEPT_SPEED * (v + force)
        w = KEPT_SPEED * (w + torque * body.turnability[:, None])
        x = x + v
        q = _turned(q, w)
    return Solved(x + rotation.apply(q, body.proximal_m), q)


def relax_frame(
    body: SpringBody,
    parent: tuple[int, ...],
    position_xyz_m: list[list[float]],
    rotation_wxyz: list[list[float]],
    *,
    iterations: int = 30,
) -> tuple[list[list[float]], list[list[float]]]:
    """Let the springs pull on one frame, bone by bone, in plain Python: the document's loop, read aloud.

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
    q = [list(one) for one in rotation_wxyz]
    x = []
    for s in range(n):
        a = _carry(q[s], sensor[s])
        x.append([position_xyz_m[s][i] - a[i] for i in range(3)])
    v, w = [[0.0] * 3 for _ in range(n)], [[0.0] * 3 for _ in range(n)]
    for _ in range(iterations):
        force, torque = [[0.0] * 3 for _ in range(n)], [[0.0] * 3 for _ in range(n)]
        for s in range(n):
            a = _carry(q[s], sensor[s])
            f = [hold[s] * (position_xyz_m[s][i] - (x[s][i] + a[i])) for i in range(3)]
            t = _cross_list(a, f)
            for i in range(3):
                force[s][i] += f[i]
                torque[s][i] += t[i]
        for c in range(1, n):
            p = parent[c]
            a, b = _carry(q[c], proximal[c]), _carry(q[p], attachment[c])
            f = [JOINT_STIFFNESS * ((x[p][i] + b[i]) - (x[c][i] + a[i])) for i in range(3)]
            t, u = _cross_list(a, f), _cross_list(b, f)
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
            q[s] = _turned_list(q[s], w[s])
    place = []
    for s in range(n):
        a = _carry(q[s], proximal[s])
        place.append([x[s][i] + a[i] for i in range(3)])
    return place, q


def _cross(a: Float, b: Float) -> Float:
    return np.stack(
        [
            a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
            a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
            a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0],
        ],
        axis=-1,
    )


def _turned(q: Float, w: Float) -> Float:
    """Left product with (1, w / 2), at length one."""
    x, y, z = 0.5 * w[..., 0], 0.5 * w[..., 1], 0.5 * w[..., 2]
    a, b, c, d = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    e, f = a - x * b - y * c - z * d, b + x * a + y * d - z * c
    g, h = c - x * d + y * a + z * b, d + x * c - y * b + z * a
    length = np.sqrt(e * e + f * f + g * g + h * h)
    return np.stack([e / length, f / length, g / length, h / length], axis=-1)


def _carry(q: list[float], v: list[float]) -> list[float]:
    w, x, y, z = q
    a, b, c = v
    tx, ty, tz = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return [a + w * tx + (y * tz - z * ty), b + w * ty + (z * tx - x * tz), c + w * tz + (x * ty - y * tx)]


def _cross_list(a: list[float], b: list[float]) -> list[float]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _turned_list(q: list[float], w: list[float]) -> list[float]:
    x, y, z = 0.5 * w[0], 0.5 * w[1], 0.5 * w[2]
    a, b, c, d = q
    e, f = a - x * b - y * c - z * d, b + x * a + y * d - z * c
    g, h = c - x * d + y * a + z * b, d + x * c - y * b + z * a
    length = (e * e + f * f + g * g + h * h) ** 0.5
    return [e / length, f / length, g / length, h / length]
