"""Made-up rigs: the same motion on other skeletons, as other studios would have recorded it.

Conventions
-----------
A plan says how a rig differs from the canonical skeleton: names, rest pose, joint axes, proportions, joints more or
fewer. :func:`author` puts a motion of the canonical skeleton on it, so that bringing it back has a known answer.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.types import Clip, Float, Skeleton

_X, _Y, _Z = np.eye(3)
"""Left, up and ahead, by convention."""


@dataclass(frozen=True, eq=False)
class RigPlan:
    """How a rig differs from the canonical skeleton.

    Parameters
    ----------
    names : canonical name to the rig's name; the canonical name where none is given
    axes : canonical name to (4,) rotation
        World orientation of the joint's frame in the T-pose; the identity where none is given. Since rest rotations
        are all the identity, this is also the inverse of how the joint is turned in the rig's rest pose.
    stretch : canonical name to float
        Factor on the length of the bone that leads to the joint; 1 where none is given.
    twisted : canonical names
        Bones that get a joint halfway along, which takes on a turn about the bone of its own.
    without : canonical names
        Joints the rig lacks; their children hang from their parents.
    has_root : bool
        Whether a root at the world's origin stands above the hips, which then move by translation.
    """

    names: Mapping[str, str] = field(default_factory=dict)
    axes: Mapping[str, Float] = field(default_factory=dict)
    stretch: Mapping[str, float] = field(default_factory=dict)
    twisted: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    has_root: bool = False


def posed(swings: Mapping[str, Float]) -> dict[str, Float]:
    """Axes of a rig whose rest pose is the T-pose with some joints turned, children carried along.

    Parameters
    ----------
    swings : canonical name to (4,) rotation of the joint in its parent's frame, in the rest pose

    Returns
    -------
    dict
        For :class:`RigPlan`.
    """
    rest: list[Float] = []
    for k, name in enumerate(JOINTS):
        above = rest[CANONICAL.parent[k]] if k else rotation.IDENTITY
        rest.append(rotation.mul(above, swings.get(name, rotation.IDENTITY)))
    return {name: rotation.inv(q) for name, q in zip(JOINTS, rest, strict=True)}


def a_pose(angle_rad: float = np.pi / 4) -> dict[str, Float]:
    """Axes of a rig at rest with its arms lowered.

    Parameters
    ----------
    angle_rad : float, radians
        How far below the horizontal both arms hang.

    Returns
    -------
    dict
        For :class:`RigPlan`.
    """
    return posed({f"{side}UpperArm": rotation.from_axis_angle(_Z, s * angle_rad) for side, s in _sides(-1.0)})


def arms_forward() -> dict[str, Float]:
    """Axes of a rig at rest with its arms stretched forwards."""
    return posed({f"{side}UpperArm": rotation.from_axis_angle(_Y, s * np.pi / 2) for side, s in _sides(-1.0)})


def lying() -> dict[str, Float]:
    """Axes of a rig at rest on its back, head towards -Z."""
    return posed({"hips": rotation.from_axis_angle(_X, -np.pi / 2)})


def splayed(angle_rad: float = 0.35) -> dict[str, Float]:
    """Axes of a rig at rest with its legs apart and its arms lowered.

    Parameters
    ----------
    angle_rad : float, radians
        How far each leg stands out from the vertical, and each arm hangs below the horizontal.

    Returns
    -------
    dict
        For :class:`RigPlan`.
    """
    legs = {f"{side}UpperLeg": rotation.from_axis_angle(_Z, s * angle_rad) for side, s in _sides(1.0)}
    arms = {f"{side}UpperArm": rotation.from_axis_angle(_Z, s * angle_rad) for side, s in _sides(-1.0)}
    return posed(legs | arms)


def along_bones() -> dict[str, Float]:
    """Axes of a rig built along its bones: the rest pose is no human pose.

    Each joint's x axis runs along its bone, on the right side against it, and elbows and knees bend about y.
    """
    axes = {"hips": _axes(_Y, -_X)} | {name: _axes(_Y, _Z) for name in ("spine", "chest", "upperChest", "neck", "head")}
    for side, s in _sides(1.0):
        for part in ("Shoulder", "UpperArm", "LowerArm", "Hand"):
            axes[side + part] = _axes(_X, s * _Y)
        for part in ("UpperLeg", "LowerLeg"):
            axes[side + part] = _axes(-s * _Y, s * _X)
        foot = CANONICAL.offset_xyz_m[JOINTS.index(f"{side}Toes")]
        for part in ("Foot", "Toes"):
            axes[side + part] = _axes(s * foot / np.linalg.norm(foot), s * _X)
    return axes


def author(motion: Clip, plan: RigPlan) -> Clip:
    """Put a motion of the canonical skeleton on a rig.

    Parameters
    ----------
    motion : Clip
        On the canonical skeleton.
    plan : RigPlan

    Returns
    -------
    Clip
        Every joint of the rig has the world orientation of its canonical joint, but for its own axes; bones that are
        not stretched end where the canonical ones do, as long as the joints left out did not turn.
    """
    position, orientation = kinematics.place(motion)
    axes = {name: plan.axes.get(name, rotation.IDENTITY) for name in JOINTS}
    names: list[str] = []
    parent: list[int] = []
    offset: list[Float] = []
    world: list[Float] = []
    at: dict[str, int] = {}

    def add(name: str, above: int, place: Float, turn: Float) -> int:
        names.append(name)
        parent.append(above)
        offset.append(place)
        world.append(turn)
        return len(names) - 1

    f = motion.n_frames
    if plan.has_root:
        add("Root", -1, np.zeros(3), np.tile(rotation.IDENTITY, (f, 1)))
    rest = kinematics.rest_position(CANONICAL)
    for k, name in enumerate(JOINTS):
        if name in plan.without:
            continue
        turn = rotation.mul(orientation[:, k], axes[name])
        above = int(CANONICAL.parent[k])
        while above >= 0 and JOINTS[above] in plan.without:
            above = int(CANONICAL.parent[above])
        if above < 0:
            at[name] = add(plan.names.get(name, name), len(names) - 1, rest[k], turn)
            continue
        bone = plan.stretch.get(name, 1.0) * (rest[k] - rest[above])
        own = rotation.apply(rotation.inv(axes[JOINTS[above]]), bone)
        hung = at[JOINTS[above]]
        if name in plan.twisted:
            roll = rotation.from_axis_angle(own / np.linalg.norm(own), 0.8 * np.sin(np.arange(f) / 7.0))
            hung = add(f"{plan.names.get(name, name)}Twist", hung, own / 2, rotation.mul(world[hung], roll))
            own = own / 2
        at[name] = add(plan.names.get(name, name), hung, own, turn)
    local = list(world)
    for k in range(1, len(names)):
        local[k] = rotation.mul(rotation.inv(world[parent[k]]), world[k])
    skeleton = Skeleton(tuple(names), np.array(parent), np.array(offset))
    rotation_wxyz = rotation.continuous(rotation.normalize(np.stack(local, axis=1)))
    if not plan.has_root:
        return Clip(skeleton, motion.frame_rate_hz, position[:, 0].copy(), rotation_wxyz)
    moved = np.tile(skeleton.offset_xyz_m, (f, 1, 1))
    moved[:, 1] = position[:, 0]
    return Clip(skeleton, motion.frame_rate_hz, np.zeros((f, 3)), rotation_wxyz, moved)


def _sides(left: float) -> tuple[tuple[str, float], tuple[str, float]]:
    return ("left", left), ("right", -left)


def _axes(x: Float, y: Float) -> Float:
    """Orientation (4,) whose x and y axes are given, at right angles."""
    return rotation.from_matrix(np.stack([x, y, np.cross(x, y)], axis=-1))
