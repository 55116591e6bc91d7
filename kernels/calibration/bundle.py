"""All joints and all poses at once: bundle adjustment of the anchors.

Conventions
-----------
Unknown are, for each chosen frame, the pelvis sensor's place y_0 and the 17 world rotations R_s, and for all frames
together the 96 coordinates of the anchors, each joint in its two sensors' frames (cp in the parent's, cc in its own):
``y_s = y_par + R_par cp_s - R_s cc_s``. A frame's 54 unknowns are eliminated (Schur), which leaves 96 equations.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import linalg

from kernels import rotation
from kernels.calibration.joints import UNSEEN, PairSolution
from kernels.calibration.records import PARENT, Cleaned
from kernels.calibration.tree_solver import (
    FILLED_WEIGHT,
    KINDNESS,
    POSITION_SIGMA_M,
    ROTATION_SIGMA_RAD,
    BodyModel,
    Stream,
    make_model,
    solve_tree,
)
from kernels.types import Float

_N_FRAMES = 700
"""Chosen as every tenth frame of a minute at 120 Hz: as many as the low-pass leaves independent."""

_STEPS = 3
"""Chosen by hand; on made-up recordings 3 to 4 steps of Gauss and Newton converge."""

_SOFT_M = 0.0015
"""Residual beyond noise at which the prior counts half. Chosen by hand, about the noise of a good recording."""

_PRIOR_M = 0.020
_PRIOR_SHARE = 0.02
"""Deviation of the prior, and its weight a frame. Tuned on made-up recordings with soft tissue: none leaves the worst
joint 90 mm off instead of 65, eight times the weight is worse everywhere."""

_FIXED_M = 1e-5
"""Deviation of what is to stay where it is. Chosen below any error, and far enough above rounding."""

_LOOSE = 1e-4
"""Share of the prior that noise alone leaves. Chosen to keep the equations from being singular."""

_CHILDREN = range(1, len(PARENT))


def adjust(cleaned: Cleaned, pairs: list[PairSolution], *, steps: int = _STEPS) -> tuple[Float, Float]:
    """Adjust the joints of a body so that whole poses fit the sensors best.

    Parameters
    ----------
    cleaned : Cleaned of the 17 sensors in their order
    pairs : the 16 joints as solved one by one
    steps : int, >= 0

    Returns
    -------
    in_parent_sensor_m, in_child_sensor_m : (16, 3) float64, metres
        As solved one by one where there is no frame.

    Notes
    -----
    Every tenth frame of a minute at 120 Hz, that is as many as the low-pass leaves independent. Measurements far off
    count less (Geman and McClure). Directions a joint's motion does not show stay where they are. Where residuals are
    larger than noise explains, soft tissue moves, and moves with the body: anchors are held near where they were, or
    they would follow it.
    """
    anchors = np.concatenate(
        [np.stack([pair.in_parent_m for pair in pairs]), np.stack([pair.in_child_m for pair in pairs])], axis=1
    ).reshape(-1)
    f = cleaned.recording.n_frames
    if f == 0 or steps == 0:
        return _split(anchors)
    chosen = np.arange(0, f, max(f // _N_FRAMES, 1))
    stream = Stream(
        cleaned.recording.position_xyz_m[chosen],
        cleaned.recording.rotation_wxyz[chosen],
        np.where(cleaned.is_filled[chosen], FILLED_WEIGHT, 1.0),
    )
    hold = _prior(pairs, len(chosen))
    start = anchors.copy()
    solved = solve_tree(_model(anchors), stream, iterations=1)
    q, root = solved.rotation_wxyz, solved.position_xyz_m[:, 0]
    for _ in range(steps):
        H, b, back = _normal_equations(anchors, q, root, stream)
        change = linalg.solve(H + hold, b + hold @ (start - anchors), assume_a="pos")
        moved = back(change)
        anchors = anchors + change
        root = root + moved[:, :3]
        turn = moved[:, 3:].reshape(len(chosen), len(PARENT), 3)
        q = rotation.normalize(rotation.mul(rotation.exp(turn), q))
    return _split(anchors)


def _split(anchors: Float) -> tuple[Float, Float]:
    pair = anchors.reshape(-1, 2, 3)
    return pair[:, 0].copy(), pair[:, 1].copy()


def _model(anchors: Float) -> BodyModel:
    return make_model(*_split(anchors))


def _prior(pairs: list[PairSolution], n_frames: int) -> Float:
    """Hold the anchors where they were, (96, 96)."""
    hold = np.zeros((96, 96))
    for k, pair in enumerate(pairs):
        at = slice(6 * k, 6 * k + 6)
        usual = _PRIOR_SHARE * n_frames / _PRIOR_M**2
        soft = pair.soft_m**2 / (pair.soft_m**2 + _SOFT_M**2)
        hold[at, at] += np.eye(6) * usual * max(soft, _LOOSE)
        for d in range(3):
            if pair.spread[d] < UNSEEN:
                way = np.concatenate([pair.direction_parent[:, d], pair.direction_child[:, d]]) / np.sqrt(2)
                hold[at, at] += np.outer(way, way) / _FIXED_M**2
    return hold


def _normal_equations(
    anchors: Float, q: Float, root: Float, stream: Stream
) -> tuple[Float, Float, Callable[[Float], Float]]:
    """Set up the equations of the anchors with the frames eliminated, and the way back to the frames."""
    n, s = len(root), len(PARENT)
    cp, cc = _split(anchors)
    R = rotation.to_matrix(np.moveaxis(q, 1, 0))  # (17, N, 3, 3)
    J_f, J_a = np.zeros((n, s, 3, 3 + 3 * s)), np.zeros((n, s, 3, 96))
    y = np.zeros((n, s, 3))
    y[:, 0] = root
    J_f[:, :, :, :3] = np.eye(3)
    for c in _CHILDREN:
        up = PARENT[c]
        ahead, behind = R[up] @ cp[c - 1], R[c] @ cc[c - 1]
        y[:, c] = y[:, up] + ahead - behind
        J_f[:, c] = J_f[:, up]
        J_a[:, c] = J_a[:, up]
        J_f[:, c, :, 3 + 3 * up : 6 + 3 * up] -= _cross_matrix(ahead)
        J_f[:, c, :, 3 + 3 * c : 6 + 3 * c] += _cross_matrix(behind)
        J_a[:, c, :, 6 * c - 6 : 6 * c - 3] = R[up]
        J_a[:, c, :, 6 * c - 3 : 6 * c] = -R[c]
    r = stream.position_xyz_m - y
    phi = rotation.log(rotation.mul(stream.rotation_wxyz, rotation.inv(q)))
    wp = np.sqrt(stream.weight * _kind(r, POSITION_SIGMA_M)) / POSITION_SIGMA_M
    wr = stream.weight * _kind(phi, ROTATION_SIGMA_RAD) / ROTATION_SIGMA_RAD**2
    J_frame: Float = (J_f * wp[:, :, None, None]).reshape(n, 3 * s, -1)
    J_anchor: Float = (J_a * wp[:, :, None, None]).reshape(n, 3 * s, -1)
    e = (r * wp[:, :, None]).reshape(n, 3 * s, 1)
    J = np.concatenate([J_anchor, e], axis=-1)  # anchors and right side together
    H_ff = J_frame.mT @ J_frame
    turn = np.arange(3, 3 + 3 * s)
    H_ff[:, turn, turn] += np.repeat(wr, 3, axis=1)
    H_fa = J_frame.mT @ J
    H_fa[:, 3:, -1] += np.repeat(wr, 3, axis=1) * phi.reshape(n, -1)
    flat = J.reshape(-1, 97)
    H_aa = flat.T @ flat
    X = np.linalg.solve(H_ff, H_fa)
    H = H_aa - np.tensordot(H_fa, X, axes=([0, 1], [0, 1]))
    H = (H + H.T) / 2

    def back(change: Float) -> Float:
        moved: Float = X[..., -1] - X[..., :-1] @ change
        return moved

    return H[:-1, :-1], H[:-1, -1], back


def _kind(residual: Float, sigma: float) -> Float:
    """Geman and McClure's weight."""
    weight: Float = 1.0 / (1.0 + np.sum(residual * residual, axis=-1) / (3.0 * sigma**2 * KINDNESS)) ** 2
    return weight


def _cross_matrix(v: Float) -> Float:
    """[v]x, (..., 3, 3)."""
    zero = np.zeros(v.shape[:-1])
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*v.shape[:-1], 3, 3)
