"""A clip on any human rig becomes the same motion on the canonical skeleton.

Conventions
-----------
Limbs take the directions that the source's limbs have; twists are carried from the source's joints; the root's way is
scaled by the length of the legs about the world's origin, so heading and place stay. The floor becomes y = 0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from kernels import rotation
from kernels.skeleton import alignment, grounding, kinematics, topology
from kernels.skeleton.alignment import SIDES, PlacedRig, X, Y, bone_direction, unit
from kernels.skeleton.canonical import CANONICAL, JOINTS, LEG_LENGTH_M
from kernels.skeleton.contacts import FootContacts, find_contacts
from kernels.skeleton.naming import JointMapping
from kernels.types import Clip, Float

_STRAIGHTENED = tuple(
    side + part for side in SIDES for part in ("Shoulder", "UpperArm", "LowerArm", "UpperLeg", "LowerLeg")
)


@dataclass(frozen=True, eq=False)
class CanonicalMotion:
    """A motion on the canonical skeleton.

    Parameters
    ----------
    root_xyz_m : (F, 3) float64, metres, world
    rotation_wxyz : (F, 22, 4) float64, local; the root's in the world
        In one hemisphere from frame to frame, first frame with w >= 0.
    position_xyz_m : (F, 22, 3) float64, metres, world
    scale_ratio : float
        Canonical leg length over the source's.
    contacts : FootContacts
        Of the source, at the canonical scale.
    """

    root_xyz_m: Float
    rotation_wxyz: Float
    position_xyz_m: Float
    scale_ratio: float
    contacts: FootContacts


def retarget(clip: Clip, mapping: JointMapping, *, give: grounding.GroundingGive | None = None) -> CanonicalMotion:
    """Bring a clip to the canonical skeleton.

    Parameters
    ----------
    clip : Clip
        In metres, Y up, on its own rig.
    mapping : JointMapping
        From :func:`kernels.skeleton.naming.map_joints`.
    give : grounding.GroundingGive, or None for the defaults
        How far root and legs give way to keep planted feet planted.

    Returns
    -------
    CanonicalMotion
        Empty arrays where F is 0.

    Raises
    ------
    ValueError
        If the mapping names a joint the rig does not have, or the body has no sides, no up or no legs
        (:func:`kernels.skeleton.alignment.check_body`).

    Notes
    -----
    Each mapped joint turns its canonical joint by G N⁻¹, G its world orientation and N its neutral one
    (:mod:`kernels.skeleton.alignment`); then the shortest arc brings upper and lower arms and legs and the shoulders
    exactly to the source's directions, which also takes in joints between the mapped ones and rigs that move their
    joints. The spine is taken as a curve from hips to neck: each canonical spine bone has the direction of its stretch
    of the curve and the turn of the joints along it. Feet keep what lies flat flat. Last, the root and, within a few
    degrees, the legs give way so that feet planted in the source are planted here (:mod:`kernels.skeleton.grounding`).
    """
    rig = _place(clip, mapping)
    if clip.n_frames == 0:
        none = np.zeros((0, 2, 3))
        contacts = find_contacts(none, none, frame_rate_hz=clip.frame_rate_hz)
        return CanonicalMotion(np.zeros((0, 3)), np.zeros((0, 22, 4)), np.zeros((0, 22, 3)), 1.0, contacts)
    alignment.check_body(rig.at, rig.position)
    scale = LEG_LENGTH_M / _leg_length_m(rig)
    ankle = scale * rig.position[:, [rig.at[side + "Foot"] for side in SIDES]]
    toes = scale * rig.position[:, [rig.at.get(side + "Toes", rig.at[side + "Foot"]) for side in SIDES]]
    contacts = find_contacts(ankle, toes, frame_rate_hz=clip.frame_rate_hz)
    rig = replace(rig, planted_pitch_rad=_planted_pitch_rad(ankle, toes, contacts))
    orientation = _orientations(rig)
    legs = [JOINTS.index(side + "UpperLeg") for side in SIDES]
    position = kinematics.hang(CANONICAL, np.zeros((clip.n_frames, 3)), orientation)
    hips = scale * rig.position[:, [rig.at[side + "UpperLeg"] for side in SIDES]].mean(axis=1)
    root = hips - position[:, legs].mean(axis=1)
    root = root + grounding.plant_root(
        position + root[:, None],
        source_ankle_xyz_m=ankle,
        source_toes_xyz_m=toes,
        contacts=contacts,
        frame_rate_hz=clip.frame_rate_hz,
        give=give,
    )
    orientation = grounding.plant_legs(
        position + root[:, None],
        orientation,
        source_ankle_xyz_m=ankle,
        source_toes_xyz_m=toes,
        contacts=contacts,
        frame_rate_hz=clip.frame_rate_hz,
        give=give,
    )
    orientation = grounding.lift_toes(kinematics.hang(CANONICAL, root, orientation), orientation)
    return CanonicalMotion(
        root_xyz_m=root,
        rotation_wxyz=kinematics.to_local(CANONICAL, orientation),
        position_xyz_m=kinematics.hang(CANONICAL, root, orientation),
        scale_ratio=scale,
        contacts=contacts,
    )


def _place(clip: Clip, mapping: JointMapping) -> PlacedRig:
    """Place the joints that matter: the mapped ones and all above them."""
    skeleton = clip.skeleton
    missing = [source for source in mapping.joint.values() if source not in skeleton.joints]
    if missing:
        raise ValueError(f"mapping: want joints of the clip's rig, got {', '.join(missing)}")
    at = {name: skeleton.joints.index(source) for name, source in mapping.joint.items()}
    position, orientation = kinematics.forward_some(
        skeleton, clip.root_xyz_m, clip.rotation_wxyz, at.values(), translation_xyz_m=clip.translation_xyz_m
    )
    spine, neck = topology.trunk(skeleton, mapping.joint)
    return PlacedRig(
        clip=clip,
        at=at,
        spine=spine,
        neck=neck,
        rest=alignment.rest_position(clip),
        position=position,
        orientation=orientation,
    )


def _leg_length_m(rig: PlacedRig) -> float:
    """Thigh and shin, mean of both sides, by their usual length in the motion."""
    length = 0.0
    for side in SIDES:
        for a, b in (("UpperLeg", "LowerLeg"), ("LowerLeg", "Foot")):
            bone = rig.position[:, rig.at[side + b]] - rig.position[:, rig.at[side + a]]
            length += float(np.median(np.linalg.norm(bone, axis=-1))) / 2
    return length


def _planted_pitch_rad(ankle: Float, toes: Float, contacts: FootContacts) -> float | None:
    """Usual elevation of the direction from ankle to toes while both are planted; None where they never are."""
    direction = unit(toes - ankle)[contacts.ankle & contacts.toes]
    if len(direction) == 0 or not np.linalg.norm(direction, axis=-1).min() > 0.5:
        return None
    return float(np.median(np.arcsin(direction[:, 1].clip(-1, 1))))


def _orientations(rig: PlacedRig) -> Float:
    """World orientations (F, 22, 4) of the canonical joints."""
    neutral = alignment.neutral_orientations(rig)
    P = rig.position
    driving = list(neutral)
    back = rotation.inv(np.stack([neutral[k] for k in driving]))
    turned = dict(zip(driving, np.moveaxis(rotation.mul(rig.orientation[:, driving], back), 1, 0), strict=True))
    out = np.tile(rotation.IDENTITY, (len(P), len(JOINTS), 1))
    named = {JOINTS.index(name): k for name, k in rig.at.items()}
    for k, source in named.items():
        out[:, k] = turned[source]
    legs = [rig.at[side + "UpperLeg"] for side in SIDES]
    out[:, 0] = _straighten(out[:, :1], X[None], P[:, legs[:1]] - P[:, legs[1:]])[:, 0]
    _bend_spine(rig, out, turned)
    bones = [(JOINTS.index(name), name) for name in _STRAIGHTENED if {name, alignment.BONE[name]} <= rig.at.keys()]
    limbs = [k for k, _ in bones]
    ends = [rig.at[alignment.BONE[name]] for _, name in bones]
    starts = [rig.at[name] for _, name in bones]
    axes = np.stack([bone_direction(name) for _, name in bones])
    out[:, limbs] = _straighten(out[:, limbs], axes, P[:, ends] - P[:, starts])
    for k in range(1, len(JOINTS)):
        if k not in named and JOINTS[k] not in (*topology.SPINE, "neck"):
            out[:, k] = out[:, CANONICAL.parent[k]]
    return rotation.normalize(out)


def _straighten(q: Float, axis: Float, direction: Float) -> Float:
    """Swing orientations (F, K, 4) so that axes (K, 3) take directions (F, K, 3); zero directions are left alone."""
    here = rotation.apply(q, axis)
    is_bone = np.sum(direction * direction, axis=-1, keepdims=True) > 1e-18
    return rotation.mul(rotation.between(here, np.where(is_bone, direction, here)), q)


def _bend_spine(rig: PlacedRig, out: Float, turned: dict[int, Float]) -> None:
    """Fill in spine, chest, upperChest and neck: turns and directions of the source's spine, taken as a curve."""
    joints = [rig.at["hips"], *rig.spine, rig.neck[0]]
    step = np.linalg.norm(np.diff(rig.rest[joints], axis=0), axis=-1)
    if not step.sum() > 1e-9:
        step = np.ones(len(step))
    place = np.concatenate([[0.0], np.cumsum(step) / step.sum()])
    curve = rig.position[:, joints]

    def at(share: float) -> Float:
        i = int(np.clip(np.searchsorted(place, share, side="right") - 1, 0, len(step) - 1))
        t = (share - place[i]) / max(place[i + 1] - place[i], 1e-12)
        return np.asarray((1 - t) * curve[:, i] + t * curve[:, i + 1], np.float64)

    along = [out[:, 0], *(turned[k] for k in rig.spine)]
    edges = [*topology.SPINE.values(), 1.0]
    direction = []
    for name, (a, b) in zip(topology.SPINE, pairwise(edges), strict=True):
        overlap = np.minimum(place[1:], b) - np.maximum(place[:-1], a)
        out[:, JOINTS.index(name)] = _blend(along, np.maximum(overlap, 0.0))
        direction.append(at(b) - at(a))
    *chain, head = rig.neck
    neck = JOINTS.index("neck")
    if chain:
        length = np.linalg.norm(np.diff(rig.rest[rig.neck], axis=0), axis=-1)
        out[:, neck] = _blend([turned[k] for k in chain], np.maximum(length, 1e-9))
        direction.append(rig.position[:, head] - rig.position[:, chain[0]])
    bent = [JOINTS.index(name) for name in topology.SPINE] + [neck] * bool(chain)
    out[:, bent] = _straighten(out[:, bent], np.tile(Y, (len(bent), 1)), np.stack(direction, axis=1))
    if not chain:
        out[:, neck] = out[:, CANONICAL.parent[neck]]


def _blend(q: list[Float], weight: Float) -> Float:
    """Weighted mean of rotations (F, 4) that are not far apart."""
    main = q[int(np.argmax(weight))]
    total = np.zeros_like(main)
    for rotation_wxyz, share in zip(q, weight, strict=True):
        if share > 0:
            near = np.where(np.sum(rotation_wxyz * main, axis=-1, keepdims=True) < 0, -1.0, 1.0)
            total += share * near * rotation_wxyz
    return rotation.normalize(total)
