"""Planted feet stay planted on another skeleton: the root gives way first, then the legs a little.

Conventions
-----------
Feet are (F, 2, 3), left first, as in :mod:`kernels.skeleton.contacts`. The *source* is the motion retargeted from,
already scaled to the canonical legs; the *floor* of the canonical body is y = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.contacts import FootContacts, runs
from kernels.types import Float

ANKLES = [JOINTS.index("leftFoot"), JOINTS.index("rightFoot")]
TOES = [JOINTS.index("leftToes"), JOINTS.index("rightToes")]
KNEES = [JOINTS.index("leftLowerLeg"), JOINTS.index("rightLowerLeg")]
THIGHS = [JOINTS.index("leftUpperLeg"), JOINTS.index("rightUpperLeg")]

_REST = kinematics.rest_position(CANONICAL)
ANKLE_HEIGHT_M = float(_REST[ANKLES[0], 1])
TOES_HEIGHT_M = float(_REST[TOES[0], 1])
_LOWEST_TOES_M = 0.01  # chosen by hand: half of their height at rest
_THIGH_M = float(np.linalg.norm(CANONICAL.offset_xyz_m[KNEES[0]]))
_SHIN_M = float(np.linalg.norm(CANONICAL.offset_xyz_m[ANKLES[0]]))
LEG_M = _THIGH_M + _SHIN_M


@dataclass(frozen=True)
class GroundingGive:
    """Limits of how far root and legs move to keep planted feet where they stand.

    Parameters
    ----------
    root_speed_weight : float
        Weight of the root's added speed against the feet's added slide; small lets the root follow the feet.
    root_smooth_s : float, seconds
        Time over which the root may change its added speed.
    root_lift_s : float, seconds
        Time over which the root comes to the height that planted feet ask for.
    leg_limit_rad : float, radians
        Most that a thigh or a shin may turn from the source's direction.
    fade_s : float, seconds
        Over which a leg returns to its source before and after a contact.
    """

    root_speed_weight: float = 0.05
    root_smooth_s: float = 0.1
    root_lift_s: float = 0.1
    leg_limit_rad: float = float(np.radians(2.5))
    fade_s: float = 0.15


def plant_root(
    position_xyz_m: Float,
    *,
    source_ankle_xyz_m: Float,
    source_toes_xyz_m: Float,
    contacts: FootContacts,
    frame_rate_hz: float,
    give: GroundingGive | None = None,
) -> Float:
    """Find how the root must move so that feet planted in the source do not slide and stand at their height.

    Parameters
    ----------
    position_xyz_m : (F, 22, 3) float, metres
        Canonical joints, before.
    source_ankle_xyz_m, source_toes_xyz_m : (F, 2, 3) float, metres, at the canonical body's scale
    contacts : FootContacts of the source
    frame_rate_hz : float, > 0
    give : GroundingGive, or None for the defaults

    Returns
    -------
    (F, 3) float64, metres, to be added to the root
        Sideways it has no drift to speak of: without contacts it is zero. Up, it lifts planted toes and ankles to the
        height they have in the canonical rest pose.
    """
    give = give or GroundingGive()
    point, source = _points(position_xyz_m), np.stack([source_ankle_xyz_m, source_toes_xyz_m])
    mask = np.stack([contacts.ankle, contacts.toes])
    mask[0] &= ~mask[1]
    error = point - source
    n = len(position_xyz_m)
    out = np.zeros((n, 3))
    both = (mask[:, 1:] & mask[:, :-1]).astype(np.float64)
    for axis in (0, 2):
        step = np.diff(error[..., axis], axis=1)
        out[:, axis] = _solve(
            n, frame_rate_hz, give, step_weight=both.sum(axis=(0, 2)), step=-(both * step).sum(axis=(0, 2)), pull=1e-4
        )
    height = np.array([ANKLE_HEIGHT_M, TOES_HEIGHT_M]) - [contacts.ankle_height_m, contacts.toes_height_m]
    lift = height[:, None, None] - error[..., 1]
    weight = mask.astype(np.float64)
    weight[1] += 1e-4 * _is_lower(source_toes_xyz_m)
    weight *= give.root_speed_weight / give.root_lift_s**2
    out[:, 1] = _solve(
        n, frame_rate_hz, give, place_weight=weight.sum(axis=(0, 2)), place=(weight * lift).sum(axis=(0, 2))
    )
    return out


def plant_legs(
    position_xyz_m: Float,
    orientation_wxyz: Float,
    *,
    source_ankle_xyz_m: Float,
    source_toes_xyz_m: Float,
    contacts: FootContacts,
    frame_rate_hz: float,
    give: GroundingGive | None = None,
) -> Float:
    """Turn thighs and shins a little where planted feet still slide.

    Parameters
    ----------
    position_xyz_m : (F, 22, 3) float, metres
    orientation_wxyz : (F, 22, 4) float, world
    source_ankle_xyz_m, source_toes_xyz_m : (F, 2, 3) float, metres, at the canonical body's scale
    contacts : FootContacts of the source
    frame_rate_hz : float, > 0
    give : GroundingGive, or None for the defaults

    Returns
    -------
    (F, 22, 4) float64, world orientations
        Feet keep their orientation in the world. No thigh or shin turns by more than ``give.leg_limit_rad``.
    """
    give = give or GroundingGive()
    point, source = _points(position_xyz_m), np.stack([source_ankle_xyz_m, source_toes_xyz_m])
    height = np.array([ANKLE_HEIGHT_M, TOES_HEIGHT_M]) - [contacts.ankle_height_m, contacts.toes_height_m]
    mask = np.stack([contacts.ankle, contacts.toes])
    mask[0] &= ~mask[1]
    shift = np.zeros((len(position_xyz_m), 2, 3))
    n_fade = max(1, round(give.fade_s * frame_rate_hz))
    for side in range(2):
        for k in range(2):
            start, stop = runs(mask[k, :, side])
            for a, b in zip(start, stop, strict=True):
                error = point[k, a:b, side] - source[k, a:b, side]
                wanted = error.mean(axis=0)
                wanted[1] = height[k]
                shift[a:b, side] = wanted - error
        shift[:, side] = _fade(shift[:, side], mask[0, :, side] | mask[1, :, side], n_fade)
    if not np.abs(shift).max(initial=0.0) > 1e-6:
        return orientation_wxyz.copy()
    return bend_legs(position_xyz_m, orientation_wxyz, shift, limit_rad=give.leg_limit_rad)


def cancel_steps(
    weight: Float, step: Float, frame_rate_hz: float, *, give: GroundingGive, pull: Float | float
) -> Float:
    """Find a displacement whose steps come near to wanted ones where they count, and which is slow and smooth besides.

    Parameters
    ----------
    weight : (F - 1,) float, >= 0, of each step
    step : (F - 1,) float, metres, the wanted steps times their weights
    frame_rate_hz : float, > 0
    give : GroundingGive, for the weight of added speed and the time of its changes
    pull : float or (F,) float, per square second, > 0, weight of the displacement itself

    Returns
    -------
    (F,) float64, metres
    """
    return _solve(len(weight) + 1, frame_rate_hz, give, step_weight=weight, step=step, pull=pull)


def keep_places(weight: Float, place: Float, frame_rate_hz: float, *, give: GroundingGive) -> Float:
    """Find a displacement that comes near to wanted places where they count, and which is slow and smooth besides.

    Parameters
    ----------
    weight : (F,) float, per square second, > 0, of each place
    place : (F,) float, metres
    frame_rate_hz : float, > 0
    give : GroundingGive, for the weight of added speed and the time of its changes

    Returns
    -------
    (F,) float64, metres
    """
    return _solve(len(weight), frame_rate_hz, give, place_weight=weight, place=weight * place)


def bend_legs(position_xyz_m: Float, orientation_wxyz: Float, shift_xyz_m: Float, *, limit_rad: float) -> Float:
    """Turn thighs and shins so that the ankles move.

    Parameters
    ----------
    position_xyz_m : (F, 22, 3) float, metres
    orientation_wxyz : (F, 22, 4) float, world
    shift_xyz_m : (F, 2, 3) float, metres, of the left and the right ankle
    limit_rad : float, radians, most that a thigh or shin turns

    Returns
    -------
    (F, 22, 4) float64, world orientations
        Feet keep theirs. An ankle out of reach comes as near as the straight leg goes.
    """
    hip, ankle = position_xyz_m[:, THIGHS], position_xyz_m[:, ANKLES]
    hinge = rotation.apply(orientation_wxyz[:, THIGHS], np.array([1.0, 0.0, 0.0]))
    thigh, shin = _reach(hip, ankle, shift_xyz_m, hinge, limit_rad)
    out = orientation_wxyz.copy()
    out[:, THIGHS] = rotation.mul(thigh, orientation_wxyz[:, THIGHS])
    out[:, KNEES] = rotation.mul(shin, orientation_wxyz[:, KNEES])
    return out


def lift_toes(position_xyz_m: Float, orientation_wxyz: Float) -> Float:
    """Raise the tips of feet that would reach through the floor: feet of other lengths than the source's.

    Parameters
    ----------
    position_xyz_m : (F, 22, 3) float, metres
    orientation_wxyz : (F, 22, 4) float, world

    Returns
    -------
    (F, 22, 4) float64, world orientations
        Feet and toes turned about the ankle so that the toes joint keeps 1 cm above the floor, where the ankle is high
        enough for that.
    """
    out = orientation_wxyz.copy()
    for ankle, toes in zip(ANKLES, TOES, strict=True):
        foot = position_xyz_m[:, toes] - position_xyz_m[:, ankle]
        length = np.linalg.norm(foot, axis=-1)
        low = _LOWEST_TOES_M - position_xyz_m[:, ankle, 1]
        up = np.where((low > foot[:, 1]) & (low < 0.9 * length), low, foot[:, 1])
        flat = np.linalg.norm(foot[:, [0, 2]], axis=-1)
        ahead = rotation.apply(orientation_wxyz[:, ankle], np.array([0.0, 0.0, 1.0]))
        level = np.where((flat > 1e-6)[:, None], foot, ahead) * np.array([1.0, 0.0, 1.0])
        level /= np.maximum(np.linalg.norm(level, axis=-1, keepdims=True), 1e-12)
        raised = level * np.sqrt(np.maximum(length**2 - up**2, 0.0))[:, None] + up[:, None] * np.array([0.0, 1.0, 0.0])
        turn = rotation.between(foot, np.where((up > foot[:, 1])[:, None], raised, foot))
        out[:, ankle] = rotation.mul(turn, orientation_wxyz[:, ankle])
        out[:, toes] = rotation.mul(turn, orientation_wxyz[:, toes])
    return out


def _points(position_xyz_m: Float) -> Float:
    """Ankles and toes, (2, F, 2, 3)."""
    return np.stack([position_xyz_m[:, ANKLES], position_xyz_m[:, TOES]])


def _is_lower(toes_xyz_m: Float) -> NDArray[np.bool_]:
    """Find the lower foot, (F, 2): it stands in where nothing is planted."""
    height = toes_xyz_m[..., 1]
    return np.asarray(height <= height.min(axis=1, keepdims=True), np.bool_)


def _solve(
    n: int,
    frame_rate_hz: float,
    give: GroundingGive,
    *,
    step_weight: Float | None = None,
    step: Float | None = None,
    place_weight: Float | None = None,
    place: Float | None = None,
    pull: Float | float = 0.0,
) -> Float:
    """Find a path of n points by least squares: weighted errors of steps and places, with its speed and its bends.

    Speeds are per second; the matrix has two bands beside the diagonal.
    """
    band = np.zeros((3, n))  # solveh_banded, upper form: band[2] is the diagonal
    right = np.zeros(n)
    per_s2 = frame_rate_hz**2
    if n > 1:
        stiff = np.full(n - 1, give.root_speed_weight) + (0.0 if step_weight is None else step_weight)
        stiff = stiff * per_s2
        band[2, :-1] += stiff
        band[2, 1:] += stiff
        band[1, 1:] -= stiff
        if step is not None:
            right[1:] += step * per_s2
            right[:-1] -= step * per_s2
    if n > 2:
        bend = give.root_smooth_s**2 * frame_rate_hz**4 * give.root_speed_weight
        for k, factor in ((0, 1.0), (1, -2.0), (2, 1.0)):
            band[2, k : n - 2 + k] += bend * factor * factor
        band[1, 1:-1] -= 2 * bend
        band[1, 2:] -= 2 * bend
        band[0, 2:] += bend
    band[2] += pull if place_weight is None else place_weight + pull
    if place is not None:
        right += place
    return np.asarray(solveh_banded(band + np.array([[0.0], [0.0], [1e-9]]), right), np.float64)


def _fade(shift: Float, is_planted: NDArray[np.bool_], n_fade: int) -> Float:
    """Let the shift of planted frames fade in before and out after them."""
    n = len(shift)
    if not is_planted.any():
        return shift
    at = np.arange(n)
    before = np.maximum.accumulate(np.where(is_planted, at, -1))
    after = np.minimum.accumulate(np.where(is_planted, at, n)[::-1])[::-1]
    out = np.zeros_like(shift)
    for nearest in (before, after):
        known = (nearest >= 0) & (nearest < n)
        far = np.where(known, np.abs(at - nearest) / n_fade, 1.0).clip(0, 1)
        weight = 1 - far * far * (3 - 2 * far)
        out += weight[:, None] * shift[np.clip(nearest, 0, n - 1)]
    return np.where(is_planted[:, None], shift, out)


def _reach(hip: Float, ankle: Float, shift: Float, hinge: Float, limit_rad: float) -> tuple[Float, Float]:
    """Find turns (..., 4) of thigh and shin that move the ankle by ``shift``, as far as the limit allows."""
    thigh, shin = _bend(hip, ankle, ankle + shift, hinge)
    for _ in range(2):
        angle = np.maximum(*(rotation.angle_between(rotation.IDENTITY, q) for q in (thigh, shin)))
        far = angle > limit_rad
        if not far.any():
            return thigh, shin
        shift = shift * np.where(far, limit_rad / np.maximum(angle, 1e-9), 1.0)[..., None]
        thigh, shin = _bend(hip, ankle, ankle + shift, hinge)
    # The way from shift to angle is steep near the straight leg: what is still over the limit is cut.
    angle = np.maximum(*(rotation.angle_between(rotation.IDENTITY, q) for q in (thigh, shin)))
    cut = np.minimum(1.0, limit_rad / np.maximum(angle, 1e-9))
    return rotation.slerp(rotation.IDENTITY, thigh, cut), rotation.slerp(rotation.IDENTITY, shin, cut)


def _bend(hip: Float, ankle: Float, target: Float, hinge: Float) -> tuple[Float, Float]:
    """Find turns (..., 4) of thigh and shin that put the ankle on the target, the knee staying in its plane with it."""
    reach = np.linalg.norm(target - hip, axis=-1).clip(abs(_THIGH_M - _SHIN_M) + 1e-6, _THIGH_M + _SHIN_M - 1e-9)
    now = np.linalg.norm(ankle - hip, axis=-1).clip(abs(_THIGH_M - _SHIN_M) + 1e-6, _THIGH_M + _SHIN_M - 1e-9)

    def inner(far: Float, near_m: float, other_m: float) -> Float:
        cosine: Float = (near_m**2 + far**2 - other_m**2) / (2 * near_m * far)
        return np.asarray(np.arccos(cosine.clip(-1, 1)), np.float64)

    # Bending opens or closes the triangle hip, knee, ankle in its plane; then the whole leg swings.
    swing = rotation.between(ankle - hip, target - hip)
    thigh = rotation.from_axis_angle(hinge, inner(now, _THIGH_M, _SHIN_M) - inner(reach, _THIGH_M, _SHIN_M))
    shin = rotation.from_axis_angle(hinge, inner(reach, _SHIN_M, _THIGH_M) - inner(now, _SHIN_M, _THIGH_M))
    return rotation.mul(swing, thigh), rotation.mul(swing, shin)
