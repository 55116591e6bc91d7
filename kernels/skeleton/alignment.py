"""How a rig's joints stand when its body stands in the canonical rest pose.

Conventions
-----------
The *neutral orientation* N of a joint is its world orientation while the body stands upright in a T-pose facing +Z.
A joint turned to G in the world turns its canonical joint to G N⁻¹. Bone directions fix all of N but a twist; the twist
comes from the rest pose where that is a human pose, else from how elbows and knees bend.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kernels import rotation
from kernels.skeleton import canonical, kinematics, topology
from kernels.types import Clip, Float

X, Y, Z = np.eye(3)
"""Left, up and ahead, by convention."""

SIDES = ("left", "right")
# Bone of each canonical joint: the child its direction points to.
BONE: dict[str, str] = {"neck": "head"} | {
    side + a: side + b for side in SIDES for limb in (topology.ARM, topology.LEG) for a, b in pairwise(limb)
}


_NATURAL_RAD = np.radians(35.0)
"""How far a back may curve and a neck lean at rest without tilting arms and head. Chosen by hand."""
_HINGE: dict[tuple[str, ...], tuple[str, str, str]] = {
    topology.ARM: ("UpperArm", "LowerArm", "Hand"),
    topology.LEG: ("UpperLeg", "LowerLeg", "Foot"),
}


@dataclass(frozen=True, eq=False)
class PlacedRig:
    """A clip on its rig, placed in the world, with what is known of its body.

    Parameters
    ----------
    clip : Clip
    at : canonical name to joint index, with the required joints
    spine : joints above the hips up to the one that carries the arms
    neck : joints above that one up to and with the head
    rest : (J, 3) float, metres
        World positions at rest, with the usual local positions where the rig moves its joints.
    position : (F, J, 3) float, metres, world
    orientation : (F, J, 4) float, world
    planted_pitch_rad : float or None
        Elevation of the direction from ankle to toes in planted feet; None where unknown.
    """

    clip: Clip
    at: Mapping[str, int]
    spine: list[int]
    neck: list[int]
    rest: Float
    position: Float
    orientation: Float
    planted_pitch_rad: float | None = None


def bone_direction(joint: str) -> Float:
    """Give the direction of a canonical joint's bone at rest.

    Parameters
    ----------
    joint : canonical name
        The neck, or a joint of an arm or leg but its last.

    Returns
    -------
    (3,) float64, unit

    Raises
    ------
    KeyError
        If the joint has no bone of its own.
    """
    return unit(canonical.CANONICAL.offset_xyz_m[canonical.JOINTS.index(BONE[joint])])


def foot_direction(pitch_rad: float) -> Float:
    """Give the unit direction of a foot that points ahead.

    Parameters
    ----------
    pitch_rad : float, radians
        Elevation from ankle to toes; below 0 where the toes are lower.

    Returns
    -------
    (3,) float64, in the plane of Y and Z
    """
    return np.array([0.0, np.sin(pitch_rad), np.cos(pitch_rad)])


def unit(vector: Float) -> Float:
    """Bring vectors to length one.

    Parameters
    ----------
    vector : (..., 3) float

    Returns
    -------
    (..., 3) float64
        What is shorter than 1e-12 is divided by that: zero stays zero.
    """
    return np.asarray(vector / np.maximum(np.sqrt(np.sum(vector * vector, axis=-1, keepdims=True)), 1e-12), np.float64)


def turn(source: tuple[Float, Float], target: tuple[Float, Float]) -> Float:
    """Rotation (4,) that takes a primary and a secondary direction (3,) to another pair; exact for the primary.

    Parameters
    ----------
    source, target : two directions each, of any length, not parallel

    Returns
    -------
    (4,) float64, wxyz, unit
    """
    return rotation.from_matrix(_square(*target) @ _square(*source).T)


def rest_position(clip: Clip) -> Float:
    """Place a clip's joints at rest, with the median local position where its rig moves them.

    Parameters
    ----------
    clip : Clip

    Returns
    -------
    (J, 3) float64, metres, world
        The skeleton's own rest for a clip of no frames or one that moves no joint but the root.
    """
    position = kinematics.rest_position(clip.skeleton)
    if clip.translation_xyz_m is None or clip.n_frames == 0:
        return position
    local = np.median(clip.translation_xyz_m, axis=0)
    for k in range(1, len(position)):
        position[k] = position[clip.skeleton.parent[k]] + local[k]
    return position


def check_body(at: Mapping[str, int], position: Float) -> None:
    """Refuse a body that has no sides, no up or no legs.

    Parameters
    ----------
    at : canonical name to joint index, with the required joints
    position : (F, J, 3) float, metres, world, F >= 1
        Of those joints at least, in all or some frames.

    Raises
    ------
    ValueError
        If both hips, both shoulders, hips and neck, or the ends of a thigh or shin are usually in one place.
    """
    pairs = [("leftUpperLeg", "rightUpperLeg"), ("leftUpperArm", "rightUpperArm")]
    pairs += [("hips", "neck" if "neck" in at else "head")]
    pairs += [(side + a, side + b) for side in SIDES for a, b in pairwise(topology.LEG[:3])]
    for a, b in pairs:
        apart_m = float(np.median(np.linalg.norm(position[:, at[b]] - position[:, at[a]], axis=-1)))
        if not apart_m > 1e-6:
            raise ValueError(f"joints: want {a} and {b} apart, got them in one place; check the joint mapping")


def neutral_orientations(rig: PlacedRig) -> dict[int, Float]:
    """Find the neutral orientation of each joint that drives the body.

    Parameters
    ----------
    rig : PlacedRig
        Of at least one frame, passed by :func:`check_body`.

    Returns
    -------
    dict
        Joint index to (4,) float64, for the joints in ``rig.at`` and all of the spine and neck.

    Notes
    -----
    From a human rest pose: each bone is swung, by the shortest arc and parents first, to where it is in the canonical
    pose. A rest pose that is no human pose (bones of a rig built along their own axes, so that legs point up and arms
    cross) says nothing about twist: there the axis about which the elbow or knee bends, seen from the joint and
    averaged over the clip, is brought to the canonical one, and joints without such an axis are untwisted on average.
    """
    body = _body_turn(rig)
    return _from_motion(rig) if body is None else _from_rest(rig, body)


def _is_nothing(rig: PlacedRig, a: int, b: int) -> bool:
    """Whether two joints are in one place at some frame: no direction leads from one to the other."""
    way = rig.position[:, b] - rig.position[:, a]
    return bool((np.sum(way * way, axis=-1) < 1e-12).any())


def _square(primary: Float, secondary: Float) -> Float:
    """Right-handed axes (3, 3) in columns: ``primary``, ``secondary`` made square to it, and their cross."""
    a = primary / np.sqrt(primary @ primary)
    b = secondary - a * (a @ secondary)
    b = b / max(float(np.sqrt(b @ b)), 1e-12)
    return np.column_stack([a, b, _cross(a, b)])


def _cross(a: Float, b: Float) -> Float:
    """Cross product (..., 3), with less ado than np.cross."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def _snap(vector: Float, limit: float = 0.9) -> Float:
    """Give the unit vector, or the coordinate axis near it (within 25 degrees): rigs are built along axes."""
    vector = unit(vector)
    k = int(np.argmax(np.abs(vector)))
    return np.sign(vector[k]) * np.eye(3)[k] if abs(vector[k]) > limit else vector


def _body_turn(rig: PlacedRig) -> Float | None:
    """Turn (4,) that stands the rest pose upright facing +Z; None where the rest pose is no human pose."""
    at, rest = rig.at, rig.rest
    left = _snap(rest[at["leftUpperLeg"]] - rest[at["rightUpperLeg"]])
    up = _snap(rest[rig.neck[0]] - (rest[at["leftUpperLeg"]] + rest[at["rightUpperLeg"]]) / 2)
    if np.linalg.norm(_cross(left, up)) < 0.5:
        return None
    body = turn((left, up), (X, Y))

    def along(a: str, b: str) -> Float:
        return rotation.apply(body, unit(rest[at[b]] - rest[at[a]]))

    is_human = along("rightUpperArm", "leftUpperArm") @ X > 0.3
    for side in SIDES:
        thigh, shin = along(side + "UpperLeg", side + "LowerLeg"), along(side + "LowerLeg", side + "Foot")
        arm, forearm = along(side + "UpperArm", side + "LowerArm"), along(side + "LowerArm", side + "Hand")
        is_human &= thigh @ -Y > -0.2 and thigh @ shin > -0.5 and arm @ forearm > -0.5
        if side + "Toes" in at:
            foot = along(side + "Foot", side + "Toes")
            is_human &= foot @ shin < 0.98 and foot @ Z > -0.5
    return body if is_human else None


def _from_rest(rig: PlacedRig, body: Float) -> dict[int, Float]:
    """Neutral orientations from a human rest pose: all orientations there are the identity, so the swing is neutral."""
    at, rest = rig.at, rig.rest
    neutral: dict[int, Float] = {at["hips"]: body}

    def swing(turned: Float, a: int, b: int, target: Float) -> Float:
        bone = rest[b] - rest[a]
        return _swing(rotation.apply(turned, bone), target, turned) if np.linalg.norm(bone) > 1e-9 else turned

    chest = body
    for a, b in zip(rig.spine, [*rig.spine[1:], rig.neck[0]], strict=True):
        chest = neutral[a] = swing(chest, a, b, Y)
    # A back that curves and a neck that leans are anatomy: they tilt bones, but neither arms nor head.
    chest = _natural(chest, body)
    here = chest
    for a, b in pairwise(rig.neck):
        here = neutral[a] = swing(here, a, b, Y)
    neutral[rig.neck[-1]] = _natural(here, chest)
    for side in SIDES:
        for limb, start in ((topology.ARM, chest), (topology.LEG, body)):
            here = start
            chain = [side + part for part in limb if side + part in at]
            for name, child in zip(chain, [*chain[1:], None], strict=True):
                if name.endswith("UpperArm"):
                    here = _natural(here, chest)
                if name.endswith("Foot") and child is not None:
                    here = _flat_foot(rig, here, body, rest[at[child]] - rest[at[name]])
                elif child is not None:
                    here = swing(here, at[name], at[child], bone_direction(name))
                neutral[at[name]] = here
    return neutral


def _natural(turned: Float, level: Float) -> Float:
    """Take the orientation for level where it is no further from that than bodies are built."""
    return level if rotation.angle_between(turned, level) < _NATURAL_RAD else turned


def _swing(direction: Float, target: Float, turned: Float) -> Float:
    return rotation.mul(rotation.between(direction, target), turned)


def _flat_foot(rig: PlacedRig, shin: Float, body: Float, bone: Float) -> Float:
    """Neutral orientation of a foot from its rest pose: pointing ahead, at the elevation that lies flat.

    The elevation at rest is that of another foot's anatomy, to be kept, or of a rest pose with stretched feet, to be
    undone: whichever planted feet show.
    """
    if np.linalg.norm(bone) < 1e-9:
        return shin
    by_shin, by_body = (unit(rotation.apply(turned, bone)) for turned in (shin, body))
    # Feet flat on the floor under spread legs follow the body, feet spread with the legs follow the shin.
    is_by_body = abs(by_body[0]) < abs(by_shin[0]) - 0.02 and rotation.angle_between(shin, body) < 0.6
    turned, direction = (body, by_body) if is_by_body else (shin, by_shin)
    pitch = float(np.arcsin(np.clip(direction[1], -1, 1)))
    if rig.planted_pitch_rad is not None:
        pitch = min(pitch, FLAT_PITCH_RAD, key=lambda flat: abs(flat - float(rig.planted_pitch_rad or 0.0)))
    elif not -0.9 < pitch < 0.1:
        pitch = FLAT_PITCH_RAD
    return _swing(direction, foot_direction(pitch), turned)


def _from_motion(rig: PlacedRig) -> dict[int, Float]:
    """Neutral orientations where the rest pose is no human pose."""
    at, P, G = rig.at, rig.position, rig.orientation
    neutral: dict[int, Float] = {}
    turned: dict[int, Float] = {}
    hip_line = unit(P[:, at["leftUpperLeg"]] - P[:, at["rightUpperLeg"]])
    arm_line = unit(P[:, at["leftUpperArm"]] - P[:, at["rightUpperArm"]])
    is_square = _is_square(rig)

    def local(k: int, world: Float) -> Float:
        return np.asarray(np.mean(rotation.apply(rotation.inv(G[:, k]), world), axis=0), np.float64)

    def settle(k: int, bone: Float, secondary: Float, target: tuple[Float, Float]) -> None:
        primary = _snap(local(k, bone), 0.998)
        second = local(k, secondary)
        if is_square and np.abs(primary).max() > 0.998:
            second = _snap(second - primary * (primary @ second), 0.7)
        neutral[k] = turn((primary, second), target)
        turned[k] = rotation.mul(G[:, k], rotation.inv(neutral[k]))

    def follow(k: int, parent: int) -> None:
        relative = _mean(rotation.mul(rotation.inv(G[:, parent]), G[:, k]))
        neutral[k] = rotation.mul(neutral[parent], _square_up(relative) if is_square else relative)
        turned[k] = rotation.mul(G[:, k], rotation.inv(neutral[k]))

    def carry(parent: int, bone: Float, direction: Float, secondary: Float) -> Float:
        here = turned[parent]
        swung = rotation.mul(rotation.between(rotation.apply(here, direction), bone), here)
        return rotation.apply(swung, secondary)

    hips = at["hips"]
    trunk = P[:, rig.neck[0]] - P[:, hips]
    first = next((k for k in rig.spine if not _is_nothing(rig, hips, k)), rig.neck[0])
    settle(hips, hip_line, P[:, first] - P[:, hips], (X, Y))
    last = hips
    for i, (a, b) in enumerate(zip(rig.spine, [*rig.spine[1:], rig.neck[0]], strict=True), 1):
        bone = trunk if _is_nothing(rig, a, b) else P[:, b] - P[:, a]
        share = i / len(rig.spine)
        settle(a, bone, unit((1 - share) * hip_line + share * arm_line), (Y, X))
        last = a
    chest = last
    for a, b in pairwise(rig.neck):
        settle(a, trunk if _is_nothing(rig, a, b) else P[:, b] - P[:, a], arm_line, (Y, X))
        last = a
    follow(rig.neck[-1], last)
    for side in SIDES:
        for limb, start in ((topology.ARM, chest), (topology.LEG, hips)):
            last = start
            chain = [side + part for part in limb if side + part in at]
            for name, child in zip(chain, [*chain[1:], None], strict=True):
                k = at[name]
                if child is None or _is_nothing(rig, k, at[child]):
                    follow(k, last)
                    last = k
                    continue
                bone = P[:, at[child]] - P[:, k]
                direction, axis = bone_direction(name), Y if name.endswith("Shoulder") else X
                if name.endswith("Foot"):
                    direction = foot_direction(
                        FLAT_PITCH_RAD if rig.planted_pitch_rad is None else rig.planted_pitch_rad
                    )
                if name.endswith("Arm"):
                    axis = -Y if side == "left" else Y
                bend = _bend(rig, side, limb) if name.endswith(("Arm", "Leg")) else None
                settle(k, bone, carry(last, bone, direction, axis) if bend is None else bend, (direction, axis))
                last = k
    return neutral


def _bend(rig: PlacedRig, side: str, limb: tuple[str, ...]) -> Float | None:
    """Axes (F, 3) about which elbow or knee bends, as long as the sine of the bend; None where it hardly does."""
    a, b, c = (rig.position[:, rig.at[side + part]] for part in _HINGE[limb])
    axis = _cross(unit(b - a), unit(c - b))
    return axis if np.sqrt(np.mean(np.sum(axis**2, axis=-1))) > np.sin(np.radians(5.0)) else None


def _is_square(rig: PlacedRig) -> bool:
    """Whether elbows and knees bend about coordinate axes of the joints above them."""
    for side in SIDES:
        for limb in (topology.ARM, topology.LEG):
            bend = _bend(rig, side, limb)
            if bend is not None:
                upper = rig.orientation[:, rig.at[side + _HINGE[limb][0]]]
                axis = unit(np.mean(rotation.apply(rotation.inv(upper), bend), axis=0))
                if np.abs(axis).max() < np.cos(np.radians(10.0)):
                    return False
    return True


def _mean(q: Float) -> Float:
    """Mean rotation (4,) of (F, 4): the largest eigenvector of the sum of outer products [Markley2007]."""
    return np.asarray(np.linalg.eigh(q.T @ q)[1][:, -1], np.float64)


def _square_up(q: Float) -> Float:
    """Nearest rotation by quarter turns, where it is within 40 degrees; else ``q`` itself."""
    m = rotation.to_matrix(q)
    square = np.zeros((3, 3))
    for column in np.argsort(-np.abs(m).max(axis=0)):
        free = np.abs(m[:, column]) * (np.abs(square).sum(axis=1) == 0)
        k = int(np.argmax(free))
        square[k, column] = np.sign(m[k, column])
    if np.linalg.det(square) < 0.5:
        return q
    nearest = rotation.from_matrix(square)
    return nearest if rotation.angle_between(nearest, q) < np.radians(40.0) else q


FLAT_PITCH_RAD = float(np.arcsin(bone_direction("leftFoot")[1]))
