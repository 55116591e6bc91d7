"""The springs of [Kitsunai2007] compiled, one frame after another on one thread: the baseline of speed."""

from __future__ import annotations

import numba
import numpy as np

from kernels.calibration.springs import JOINT_STIFFNESS, KEPT_SPEED, SpringBody
from kernels.calibration.tree_solver import Solved, Stream
from kernels.types import Float


def relax_serial(body: SpringBody, parent: tuple[int, ...], stream: Stream, iterations: int) -> Solved:
    """Relax every frame by the loop of :func:`kernels.calibration.springs.relax_frame`, compiled."""
    place, turned = _relax(
        np.array(parent),
        body.proximal_m,
        body.sensor_m,
        body.attachment_m,
        body.turnability,
        body.hold,
        stream.position_xyz_m,
        stream.rotation_wxyz,
        iterations,
    )
    return Solved(place, turned)


@numba.njit(cache=False, inline="always")
def _carry(q: Float, v: Float, out: Float) -> None:
    w, x, y, z = q[0], q[1], q[2], q[3]
    a, b, c = v[0], v[1], v[2]
    tx, ty, tz = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    out[0] = a + w * tx + (y * tz - z * ty)
    out[1] = b + w * ty + (z * tx - x * tz)
    out[2] = c + w * tz + (x * ty - y * tx)


@numba.njit(cache=False)
def _relax(  # noqa: ANN202
    parent: Float,
    proximal: Float,
    sensor: Float,
    attachment: Float,
    turnability: Float,
    hold: Float,
    position: Float,
    turned: Float,
    iterations: int,
):
    f_count, n = position.shape[0], position.shape[1]
    place, answer = np.zeros((f_count, n, 3)), np.zeros((f_count, n, 4))
    x, v, w, force, torque = (
        np.zeros((n, 3)),
        np.zeros((n, 3)),
        np.zeros((n, 3)),
        np.zeros((n, 3)),
        np.zeros((n, 3)),
    )
    q = np.zeros((n, 4))
    a, b, f = np.zeros(3), np.zeros(3), np.zeros(3)
    for frame in range(f_count):
        for s in range(n):
            for i in range(4):
                q[s, i] = turned[frame, s, i]
            _carry(q[s], sensor[s], a)
            for i in range(3):
                x[s, i] = position[frame, s, i] - a[i]
                v[s, i] = 0.0
                w[s, i] = 0.0
        for _ in range(iterations):
            for s in range(n):
                _carry(q[s], sensor[s], a)
                for i in range(3):
                    f[i] = hold[s] * (position[frame, s, i] - (x[s, i] + a[i]))
                    force[s, i] = f[i]
                torque[s, 0] = a[1] * f[2] - a[2] * f[1]
                torque[s, 1] = a[2] * f[0] - a[0] * f[2]
                torque[s, 2] = a[0] * f[1] - a[1] * f[0]
            for c in range(1, n):
                p = parent[c]
                _carry(q[c], proximal[c], a)
                _carry(q[p], attachment[c], b)
                for i in range(3):
                    f[i] = JOINT_STIFFNESS * ((x[p, i] + b[i]) - (x[c, i] + a[i]))
                    force[c, i] += f[i]
                    force[p, i] -= f[i]
                torque[c, 0] += a[1] * f[2] - a[2] * f[1]
                torque[c, 1] += a[2] * f[0] - a[0] * f[2]
                torque[c, 2] += a[0] * f[1] - a[1] * f[0]
                torque[p, 0] -= b[1] * f[2] - b[2] * f[1]
                torque[p, 1] -= b[2] * f[0] - b[0] * f[2]
                torque[p, 2] -= b[0] * f[1] - b[1] * f[0]
            for s in range(n):
                for i in range(3):
                    v[s, i] = KEPT_SPEED * (v[s, i] + force[s, i])
                    w[s, i] = KEPT_SPEED * (w[s, i] + torque[s, i] * turnability[s])
                    x[s, i] += v[s, i]
                hx, hy, hz = 0.5 * w[s, 0], 0.5 * w[s, 1], 0.5 * w[s, 2]
                e = q[s, 0] - hx * q[s, 1] - hy * q[s, 2] - hz * q[s, 3]
                g = q[s, 1] + hx * q[s, 0] + hy * q[s, 3] - hz * q[s, 2]
                h = q[s, 2] - hx * q[s, 3] + hy * q[s, 0] + hz * q[s, 1]
                k = q[s, 3] + hx * q[s, 2] - hy * q[s, 1] + hz * q[s, 0]
                length = np.sqrt(e * e + g * g + h * h + k * k)
                q[s, 0] = e / length
                q[s, 1] = g / length
                q[s, 2] = h / length
                q[s, 3] = k / length
        for s in range(n):
            _carry(q[s], proximal[s], a)
            for i in range(3):
                place[frame, s, i] = x[s, i] + a[i]
            for i in range(4):
                answer[frame, s, i] = q[s, i]
    return place, answer
