"""A body to dance on: what a rig's bones measure, and how its joints stand in the canonical rest pose.

Conventions
-----------
The *figure* of a character is the canonical skeleton with the character's own bones: 22 joints, T-pose rest, identity
rest rotations, soles on the floor y = 0. A dance is first fitted to the figure (:mod:`kernels.skeleton.body_fit`), then
put on the rig, joint by joint: a canonical joint turned to C turns the rig's joint to C N, N its neutral orientation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kernels import rotation
from kernels.skeleton import alignment, kinematics, topology
from kernels.skeleton.alignment import SIDES, PlacedRig
from kernels.skeleton.canonical import CANONICAL, JOINTS, LEG_LENGTH_M
from kernels.skeleton.contacts import find_contacts
from kernels.skeleton.naming import JointMapping
from kernels.types import Clip, Float, Skeleton

SOLE_M = 0.02
"""How far below the lower of ankle and toes a canonical foot's sole lies, by definition; of others in proportion."""

_REST = kinematics.rest_position(CANONICAL)
_NECK_SHARE = 0.51 / 0.61  # where the neck begins on the way from hips to head, by definition of the canonical body


@dataclass(frozen=True, eq=False)
class Character:
    """A rig to be danced on.

    Parameters
    ----------
    skeleton : Skeleton of J joints, the rig's own; joint frames parallel to the world at rest
    at : canonical name to joint index, with the required joints
    spine, neck : joints above the hips up to the one that carries the arms, and above that one up to the head
    neutral_wxyz : joint index to (4,), world orientation while the body stands in the canonical rest pose
    figure : Skeleton of the 22 canonical joints with this body's bones, soles at y = 0
    """

    skeleton: Skeleton
    at: Mapping[str, int]
    spine: tuple[int, ...]
    neck: tuple[int, ...]
    neutral_wxyz: Mapping[int, Float]
    figure: Skeleton

    @property
    def scale_ratio(self) -> float:
        """Leg length over the canonical one."""
        return leg_length_m(self.figure) / LEG_LENGTH_M


def leg_length_m(figure: Skeleton) -> float:
    """Thigh and shin of a figure, mean of both sides, metres.

    Parameters
    ----------
    figure : Skeleton of the canonical joints
    """
    bones = [figure.offset_xyz_m[JOINTS.index(side + part)] for side in SIDES for part in ("LowerLeg", "Foot")]
    return float(np.linalg.norm(bones, axis=-1).sum() / 2)


def measure(clip: Clip, mapping: JointMapping, *, floor_m: float | None = None) -> Character:
    """Take the measure of a rig.

    Parameters
    ----------
    clip : Clip of F >= 1 frames on the rig, metres, Y up
        A rig without motion of its own: one frame in its rest pose.
    mapping : JointMapping from :func:`kernels.skeleton.naming.map_joints`
    floor_m : float or None, metres
        Height of the floor the rig stands on at rest, where it is known; else its soles lie as far below its feet as
        the canonical body's, in proportion.

    Returns
    -------
    Character

    Raises
    ------
    ValueError
        If there is no frame, or the body has no sides, no up or no legs
        (:func:`kernels.skeleton.alignment.check_body`).
    """
    if clip.n_frames < 1:
        raise ValueError("clip: want at least one frame to measure a body by, got none")
    at = {name: clip.skeleton.joints.index(joint) for name, joint in mapping.joint.items()}
    position, orientation = kinematics.forward_some(
        clip.skeleton, clip.root_xyz_m, clip.rotation_wxyz, at.values(), translation_xyz_m=clip.translation_xyz_m
    )
    alignment.check_body(at, position)
    spine, neck = topology.trunk(clip.skeleton, mapping.joint)
    rest = alignment.rest_position(clip)
    rig = PlacedRig(clip, at, spine, neck, rest, position, orientation, _planted_pitch_rad(at, position, clip))
    neutral = alignment.neutral_orientations(rig)
    local_m = rest - np.concatenate([np.zeros((1, 3)), rest[clip.skeleton.parent[1:]]])
    skeleton = Skeleton(clip.skeleton.joints, clip.skeleton.parent, local_m)
    standing = _standing(skeleton, neutral)
    feet = [at[side + part] for side in SIDES for part in ("Foot", "Toes") if side + part in at]
    lowest_m = None if floor_m is None else float(rest[feet, 1].min()) - floor_m
    figure = _figure(standing, at, spine, neck, lowest_m)
    return Character(skeleton, at, tuple(spine), tuple(neck), neutral, figure)


def _planted_pitch_rad(at: Mapping[str, int], position: Float, clip: Clip) -> float | None:
    """Usual elevation from ankle to toes in planted feet; None without toes, or where no foot is ever planted."""
    if any(side + "Toes" not in at for side in SIDES) or clip.n_frames < 2:
        return None
    ankle, toes = (position[:, [at[side + part] for side in SIDES]] for part in ("Foot", "Toes"))
    found = find_contacts(ankle, toes, frame_rate_hz=clip.frame_rate_hz)
    direction = alignment.unit(toes - ankle)[found.ankle & found.toes]
    if len(direction) == 0 or not np.linalg.norm(direction, axis=-1).min() > 0.5:
        return None
    return float(np.median(np.arcsin(direction[:, 1].clip(-1, 1))))


def _standing(skeleton: Skeleton, neutral: Mapping[int, Float]) -> Float:
    """World positions (J, 3) of a rig in the canonical rest pose; joints without a part of their own go with theirs."""
    orientation = np.zeros((1, len(skeleton.joints), 4))
    for k, parent in enumerate(skeleton.parent.tolist()):
        orientation[:, k] = neutral.get(k, orientation[0, parent] if parent >= 0 else rotation.IDENTITY)
    return np.asarray(kinematics.hang(skeleton, np.zeros((1, 3)), orientation)[0], np.float64)


def _figure(
    standing: Float, at: Mapping[str, int], spine: list[int], neck: list[int], lowest_m: float | None
) -> Skeleton:
    """Canonical joints at the places a rig's have in the canonical pose; those it lacks in proportion."""
    place: dict[str, Float] = {name: standing[k] for name, k in at.items() if name not in (*topology.SPINE, "neck")}
    trunk = standing[[at["hips"], *spine, neck[0]]]
    has_neck = len(neck) > 1
    shares = dict(topology.SPINE) if has_neck else {n: s * _NECK_SHARE for n, s in topology.SPINE.items()}
    for name, share in {**shares, "neck": 1.0 if has_neck else _NECK_SHARE}.items():
        place[name] = _along(trunk, share)
    legs = [np.linalg.norm(place[s + b] - place[s + a]) for s in SIDES for a, b in _LEG_BONES]
    scale = float(np.sum(legs)) / 2 / LEG_LENGTH_M
    for side in SIDES:
        if side + "Shoulder" not in place:
            arm = place[side + "UpperArm"]
            share = (
                CANONICAL.offset_xyz_m[JOINTS.index(side + "Shoulder"), 0] / _REST[JOINTS.index(side + "UpperArm"), 0]
            )
            middle = np.array([place["neck"][0], arm[1], arm[2]])
            place[side + "Shoulder"] = middle + share * (arm - middle)
        if side + "Toes" not in place:
            place[side + "Toes"] = place[side + "Foot"] + scale * CANONICAL.offset_xyz_m[JOINTS.index(side + "Toes")]
    position = np.array([place[name] for name in JOINTS])
    feet = [JOINTS.index(side + part) for side in SIDES for part in ("Foot", "Toes")]
    is_known = lowest_m is not None and 0 < lowest_m < 0.15 * scale
    sole_m = lowest_m if is_known and lowest_m is not None else SOLE_M * scale
    position[:, 1] -= position[feet, 1].min() - sole_m
    middle_m = (position[JOINTS.index("leftUpperLeg")] + position[JOINTS.index("rightUpperLeg")]) / 2
    position -= middle_m * np.array([1.0, 0.0, 1.0])
    return Skeleton(
        JOINTS, CANONICAL.parent, position - np.concatenate([np.zeros((1, 3)), position[CANONICAL.parent[1:]]])
    )


_LEG_BONES = (("UpperLeg", "LowerLeg"), ("LowerLeg", "Foot"))


def _along(points: Float, share: float) -> Float:
    """Point (3,) at a share of the way along a row of points (n, 3)."""
    step = np.linalg.norm(np.diff(points, axis=0), axis=-1)
    if not step.sum() > 1e-9:
        return np.asarray(points[0], np.float64)
    place = np.concatenate([[0.0], np.cumsum(step) / step.sum()])
    return np.array([np.interp(share, place, axis) for axis in points.T])
