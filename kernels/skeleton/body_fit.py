"""A dance on another body: fitted to its bones with its feet where they stand, then put on its rig.

Conventions
-----------
The dance comes on the canonical skeleton, feet planted. Travel is scaled by the length of the legs; toes go exactly
where the scaled dance has them, and legs bend to reach: a foot that stands still there stands still here, whatever the
bones measure, and nothing fades in or out.
"""

from __future__ import annotations

import numpy as np
import scipy

from kernels import rotation
from kernels.skeleton import kinematics, topology
from kernels.skeleton.alignment import SIDES
from kernels.skeleton.body_measure import Character, leg_length_m
from kernels.skeleton.canonical import CANONICAL, JOINTS, LEG_LENGTH_M
from kernels.types import Clip, Float, Skeleton

X, Y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
"""Left and up, by convention."""

_SETTLE_S = 0.15
"""Time over which the hips sink to where both feet can be reached. Chosen by hand."""


def fit(dance: Clip, figure: Skeleton) -> Clip:
    """Fit a dance to other bones.

    Parameters
    ----------
    dance : Clip on the canonical skeleton, F >= 1 frames
    figure : Skeleton of the canonical joints, soles at y = 0 (:attr:`Character.figure`)

    Returns
    -------
    Clip
        On the figure. Limbs, trunk and head turn as in the dance, but the legs, which bend so that the toes stand at
        the scaled places of the dance's, as high above the floor as theirs in proportion; the hips sink, slowly, where
        a leg would not reach.

    Raises
    ------
    ValueError
        If the dance is not on the canonical skeleton or the figure has other joints.
    """
    if dance.skeleton.joints != JOINTS or figure.joints != JOINTS:
        raise ValueError("dance, figure: want the 22 canonical joints, got others; retarget first")
    scale = leg_length_m(figure) / LEG_LENGTH_M
    source, orientation = kinematics.place(dance)
    rest = kinematics.rest_position(figure)
    legs = [JOINTS.index(side + "UpperLeg") for side in SIDES]
    position = kinematics.hang(figure, np.zeros((dance.n_frames, 3)), orientation)
    hips = scale * source[:, legs].mean(axis=1)
    hips[:, 1] += rest[legs, 1].mean() - scale * _REST[legs, 1].mean()
    position += (hips - position[:, legs].mean(axis=1))[:, None]
    ankle = np.stack([_ankle_target(side, source, orientation, figure, scale) for side in SIDES], axis=1)
    sink = _sink_m(position[:, legs], ankle, _leg_bones_m(figure), dance.frame_rate_hz)
    position[..., 1] -= sink[:, None]
    for i, side in enumerate(SIDES):
        _bend_leg(side, position, orientation, ankle[:, i], _leg_bones_m(figure)[i])
    return Clip(figure, dance.frame_rate_hz, position[:, 0], kinematics.to_local(figure, orientation))


def put_on(fitted: Clip, character: Character) -> Clip:
    """Put a dance that fits a character's figure on its rig.

    Parameters
    ----------
    fitted : Clip on ``character.figure``
    character : Character

    Returns
    -------
    Clip
        On the rig's own skeleton, joint frames parallel to the world at rest. The hips move; joints above them stay
        where they stand at rest, and joints that no part of the body names go with the joint they hang from.
    """
    skeleton, at = character.skeleton, character.at
    position, turned = kinematics.place(fitted)
    out = np.zeros((fitted.n_frames, len(skeleton.joints), 4))
    driven = {k: rotation.mul(turned[:, JOINTS.index(name)], character.neutral_wxyz[k]) for name, k in at.items()}
    driven |= _trunk(character, position, turned)
    for k, parent in enumerate(skeleton.parent.tolist()):
        out[:, k] = driven[k] if k in driven else out[:, parent] if parent >= 0 else rotation.IDENTITY
    placed = kinematics.hang(skeleton, np.tile(skeleton.offset_xyz_m[0], (fitted.n_frames, 1)), out)
    names = [side + "UpperLeg" for side in SIDES]
    shift = position[:, [JOINTS.index(n) for n in names]].mean(axis=1) - placed[:, [at[n] for n in names]].mean(axis=1)
    hips, local = at["hips"], kinematics.to_local(skeleton, out)
    if hips == 0:
        return Clip(skeleton, fitted.frame_rate_hz, placed[:, 0] + shift, local)
    parent = int(skeleton.parent[hips])
    translation = np.tile(skeleton.offset_xyz_m, (fitted.n_frames, 1, 1))
    translation[:, hips] += rotation.apply(rotation.inv(out[:, parent]), shift)
    return Clip(skeleton, fitted.frame_rate_hz, placed[:, 0], local, translation)


_REST = kinematics.rest_position(CANONICAL)


def _soles(skeleton: Skeleton, side: str) -> Float:
    """Points (2, 3) of a sole in the frame of its foot: below the ankle and below the toes, at rest on the floor."""
    ankle = kinematics.rest_position(skeleton)[JOINTS.index(side + "Foot")]
    toes = skeleton.offset_xyz_m[JOINTS.index(side + "Toes")]
    return np.array([[0.0, -ankle[1], 0.0], [toes[0], -ankle[1], toes[2]]])


def _ankle_target(side: str, source: Float, orientation: Float, figure: Skeleton, scale: float) -> Float:
    """Where an ankle (F, 3) has to be for its toes and sole to stand as the dance's do."""
    foot, toes = JOINTS.index(side + "Foot"), JOINTS.index(side + "Toes")
    turned = orientation[:, foot, None]
    low = [rotation.apply(turned, _soles(skeleton, side))[..., 1].min(axis=1) for skeleton in (CANONICAL, figure)]
    target = scale * source[:, toes] - rotation.apply(orientation[:, foot], figure.offset_xyz_m[toes])
    target[:, 1] = scale * (source[:, foot, 1] + low[0]) - low[1]
    return target


def _leg_bones_m(figure: Skeleton) -> list[tuple[float, float]]:
    """Thigh and shin of each side, metres."""
    length = np.linalg.norm(figure.offset_xyz_m, axis=-1)
    return [(float(length[JOINTS.index(s + "LowerLeg")]), float(length[JOINTS.index(s + "Foot")])) for s in SIDES]


def _sink_m(hip: Float, ankle: Float, bones_m: list[tuple[float, float]], frame_rate_hz: float) -> Float:
    """How far the hips (F,) must sink for both legs to reach, changing slowly: never less than is needed."""
    reach = np.array([a + b for a, b in bones_m]) * (1 - 1e-4)
    flat = np.linalg.norm((hip - ankle)[..., [0, 2]], axis=-1)
    upright = np.sqrt(np.maximum(reach**2 - flat**2, 0.0))
    needed = np.maximum(hip[..., 1] - ankle[..., 1] - upright, 0.0).max(axis=1)
    half = max(round(_SETTLE_S * frame_rate_hz), 1)
    widest = scipy.ndimage.maximum_filter1d(needed, 4 * half + 1, mode="nearest")
    # Two means over a half window each stay inside the window of the maximum.
    for _ in range(2):
        widest = scipy.ndimage.uniform_filter1d(widest, 2 * half + 1, mode="nearest")
    return np.asarray(widest, np.float64)


def _bend_leg(side: str, position: Float, orientation: Float, ankle: Float, bones_m: tuple[float, float]) -> None:
    """Turn a thigh and a shin, in place, so that the ankle comes to its target; the knee stays in its plane."""
    thigh, knee, foot = (JOINTS.index(side + part) for part in topology.LEG[:3])
    upper_m, lower_m = bones_m
    hip, now = position[:, thigh], position[:, foot]
    low, high = abs(upper_m - lower_m) + 1e-6, upper_m + lower_m - 1e-9

    def inner(far: Float, near_m: float, other_m: float) -> Float:
        cosine = (near_m**2 + far**2 - other_m**2) / (2 * near_m * far)
        return np.asarray(np.arccos(cosine.clip(-1, 1)), np.float64)

    was = np.linalg.norm(now - hip, axis=-1).clip(low, high)
    shall = np.linalg.norm(ankle - hip, axis=-1).clip(low, high)
    hinge = rotation.apply(orientation[:, thigh], X)
    swing = rotation.between(now - hip, ankle - hip)
    upper = rotation.from_axis_angle(hinge, inner(was, upper_m, lower_m) - inner(shall, upper_m, lower_m))
    lower = rotation.from_axis_angle(hinge, inner(shall, lower_m, upper_m) - inner(was, lower_m, upper_m))
    orientation[:, thigh] = rotation.mul(swing, rotation.mul(upper, orientation[:, thigh]))
    orientation[:, knee] = rotation.mul(swing, rotation.mul(lower, orientation[:, knee]))


def _trunk(character: Character, position: Float, turned: Float) -> dict[int, Float]:
    """World orientations (F, 4) of the joints of spine and neck, however many there are."""
    at, rest = character.at, kinematics.rest_position(character.skeleton)
    joints = [at["hips"], *character.spine, character.neck[0]]
    step = np.linalg.norm(np.diff(rest[joints], axis=0), axis=-1)
    step = step if step.sum() > 1e-9 else np.ones(len(step))
    place = np.concatenate([[0.0], np.cumsum(step) / step.sum()])
    edges = np.array([0.0, *topology.SPINE.values(), 1.0])
    bones = [JOINTS.index(name) for name in ("hips", *topology.SPINE)]
    curve = position[:, [*bones, JOINTS.index("neck")]]

    def along(share: float) -> Float:
        i = int(np.clip(np.searchsorted(edges, share, side="right") - 1, 0, len(bones) - 1))
        t = (share - edges[i]) / (edges[i + 1] - edges[i])
        return np.asarray((1 - t) * curve[:, i] + t * curve[:, i + 1], np.float64)

    found: dict[int, Float] = {}
    for i, k in enumerate(character.spine, 1):
        a, b = float(place[i]), float(place[i + 1])
        overlap = np.maximum(np.minimum(edges[1:], b) - np.maximum(edges[:-1], a), 0.0)
        here = _mean([turned[:, bone] for bone in bones], overlap)
        direction = along(b) - along(a)
        is_bone = np.sum(direction**2, axis=-1, keepdims=True) > 1e-12
        up = rotation.apply(here, Y)
        found[k] = rotation.mul(
            rotation.mul(rotation.between(up, np.where(is_bone, direction, up)), here), character.neutral_wxyz[k]
        )
    for k in character.neck[:-1]:
        found[k] = rotation.mul(turned[:, JOINTS.index("neck")], character.neutral_wxyz[k])
    return found


def _mean(rotations: list[Float], weight: Float) -> Float:
    """Weighted mean rotation (F, 4), one after the other by slerp; the first where there is no weight."""
    total, out = 0.0, rotations[0]
    for q, w in zip(rotations, weight.tolist(), strict=True):
        if w > 0:
            total += w
            out = q if total == w else rotation.slerp(out, q, w / total)
    return out
