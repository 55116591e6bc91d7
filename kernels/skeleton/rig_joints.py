"""The rest pose of a rig in its own units and axes, and a dance put on its joints.

Conventions
-----------
*Skeleton space* is the rig's own: its units and axes. Rest poses are local, may scale evenly, and there may be several
roots. The *world* is the dance's: metres, Y up. A point p of skeleton space is ``scale * turn(p) + shift`` there.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.body_fit import put_on
from kernels.skeleton.body_measure import Character
from kernels.types import Clip, Float, Int, Skeleton

UNEVEN = 0.01
"""How unlike a matrix's three scales may be. Chosen by hand."""


@dataclass(frozen=True, eq=False)
class RestPose:
    """How the J joints of a rig stand at rest, each in its parent's frame.

    Parameters
    ----------
    parent : (J,) int64, below the joint's own index; -1 for roots, of which there may be several
    translation : (J, 3) float, in units of skeleton space
    rotation_wxyz : (J, 4) float, unit
    scale : (J,) float, > 0
    """

    parent: Int
    translation: Float
    rotation_wxyz: Float
    scale: Float

    @property
    def total_scale(self) -> Float:
        """Scale of each joint in skeleton space: its own times that of all above it, (J,) float64."""
        total = self.scale.copy()
        for k, p in enumerate(self.parent.tolist()):
            total[k] *= total[p] if p >= 0 else 1.0
        return total

    @property
    def turned_wxyz(self) -> Float:
        """Orientation of each joint in skeleton space, (J, 4) float64."""
        world = self.rotation_wxyz.copy()
        for k, p in enumerate(self.parent.tolist()):
            if p >= 0:
                world[k] = rotation.mul(world[p], self.rotation_wxyz[k])
        return world

    @property
    def position(self) -> Float:
        """Place of each joint in skeleton space, (J, 3) float64."""
        place, world, total = self.translation.copy(), self.turned_wxyz, self.total_scale
        for k, p in enumerate(self.parent.tolist()):
            if p >= 0:
                place[k] = place[p] + total[p] * rotation.apply(world[p], self.translation[k])
        return place


@dataclass(frozen=True, eq=False)
class Moves:
    """Samples of a rig's joints: (F, J, 4) rotations, (F, J, 3) translations, (J,) scales, local, in skeleton space.

    ``position_xyz_m`` (F, J, 3) are the joints' places in the world.
    """

    rotation_wxyz: Float
    translation: Float
    scale: Float
    position_xyz_m: Float


def similarity(matrix: Float, what: str) -> tuple[float, Float]:
    """Take the scale and the rotation of a matrix that does nothing else.

    Parameters
    ----------
    matrix : (3, 3) float, rows times matrix
    what : name of the matrix, for the message

    Returns
    -------
    scale : float, > 0
    rotation_wxyz : (4,) float64, unit

    Raises
    ------
    ValueError
        If the matrix shears, mirrors, flattens, or scales its axes by more than :data:`UNEVEN` unlike each other.
    """
    length = np.linalg.norm(matrix, axis=-1)
    scale = float(length.mean())
    uneven = np.abs(matrix @ matrix.T / max(scale, 1e-12) ** 2 - np.eye(3)).max()
    if not (scale > 1e-12 and uneven < UNEVEN and np.linalg.det(matrix) > 0):
        raise ValueError(f"want {what} to turn, move and scale evenly, got a shear, a mirror or uneven scales")
    return scale, rotation.from_matrix((matrix / length[:, None]).T)


def rest_pose(local: Float, parent: Int) -> RestPose:
    """Take the rest pose of a rig from its matrices.

    Parameters
    ----------
    local : (J, 4, 4) float, in the parent's frame, rows times matrix
    parent : (J,) int64, -1 for roots

    Returns
    -------
    RestPose

    Raises
    ------
    ValueError
        If a value is not finite, or a matrix does more than turn, move and scale evenly.
    """
    if not np.isfinite(local).all():
        raise ValueError("want a finite rest pose, got a NaN or infinity")
    parts = [similarity(m[:3, :3], f"the rest transform of joint {k}") for k, m in enumerate(local)]
    return RestPose(parent, local[:, 3, :3], np.array([q for _, q in parts]), np.array([s for s, _ in parts]))


def local_matrices(matrix: Float, parent: Int) -> Float:
    """Bring matrices of joints into their parents' frames.

    Parameters
    ----------
    matrix : (J, 4, 4) float, in one frame for all, each invertible; rows times matrix
    parent : (J,) int64, -1 for roots

    Returns
    -------
    (J, 4, 4) float64; those of roots as they are
    """
    return np.array([matrix[k] @ np.linalg.inv(matrix[p]) if p >= 0 else matrix[k] for k, p in enumerate(parent)])


def upright(names: list[str], parent: Int, position_xyz_m: Float) -> Skeleton:
    """Hang joints in the world, frames parallel to it at rest, under one root, which is added where there are several.

    Parameters
    ----------
    names : J names of joints, no two alike
    parent : (J,) int64, below the joint's own index; -1 for roots, at least one
    position_xyz_m : (J, 3) float, metres, world, at rest

    Returns
    -------
    Skeleton
        Of the J joints; where there are several roots of J + 1, the first ``"(no joint)"`` at the origin above them.
    """
    offset = position_xyz_m - np.where((parent >= 0)[:, None], position_xyz_m[parent], 0.0)
    if (parent < 0).sum() == 1:
        return Skeleton(tuple(names), parent, offset)
    above = np.where(parent < 0, 0, parent + 1)
    return Skeleton(("(no joint)", *names), np.append(-1, above), np.concatenate([np.zeros((1, 3)), offset]))


def resting_clip(skeleton: Skeleton) -> Clip:
    """Make a clip of one frame in which a skeleton stands at rest.

    Parameters
    ----------
    skeleton : Skeleton of J joints

    Returns
    -------
    Clip of one frame at 1 Hz
    """
    still = np.tile(rotation.IDENTITY, (1, len(skeleton.joints), 1))
    return Clip(skeleton, 1.0, skeleton.offset_xyz_m[:1].astype(np.float64), still)


def rig_moves(
    fitted: Clip, character: Character, rest: RestPose, *, scale: float, turn_wxyz: Float, shift_xyz_m: Float
) -> Moves:
    """Put a dance that fits a character's figure on the joints of its rig.

    Parameters
    ----------
    fitted : Clip of F frames on ``character.figure``
    character : Character in the world, its joints those of the rig, below one more where :func:`upright` added it
    rest : RestPose of the rig's J joints
    scale : float, > 0
    turn_wxyz : (4,) float, unit
    shift_xyz_m : (3,) float, metres
        From skeleton space to the world.

    Returns
    -------
    Moves
        Joints keep their rest translations, but the hips, which travel.
    """
    worn = put_on(fitted, character)
    first = len(worn.skeleton.joints) - len(rest.parent)
    position, turned = (values[:, first:] for values in kinematics.place(worn))
    back = rotation.inv(turn_wxyz)
    # A joint's frame in skeleton space: what it turned in the world, seen from there, times its frame at rest.
    here = rotation.mul(rotation.mul(back, rotation.mul(turned, turn_wxyz)), rest.turned_wxyz)
    place = rotation.apply(back, position - shift_xyz_m) / scale
    local = here.copy()
    translation = np.tile(rest.translation, (len(here), 1, 1))
    total = rest.total_scale
    hips = character.at["hips"] - first
    for k, p in enumerate(rest.parent.tolist()):
        if p >= 0:
            local[:, k] = rotation.mul(rotation.inv(here[:, p]), here[:, k])
        if k == hips:
            way = place[:, k] - (place[:, p] if p >= 0 else 0.0)
            translation[:, k] = rotation.apply(rotation.inv(here[:, p]), way) / total[p] if p >= 0 else way
    return Moves(rotation.continuous(rotation.normalize(local)), translation, rest.scale, position)


def box_around(low: Float, high: Float, matrix: Float) -> tuple[Float, Float]:
    """Box round a box in another frame.

    Parameters
    ----------
    low, high : (3,) float, corners of a box
    matrix : (4, 4) float, invertible, from the other frame to that of the box; rows times matrix

    Returns
    -------
    low, high : (3,) float64, corners of the smallest box of the other frame that holds all eight
    """
    corner = np.array([[*c, 1.0] for c in itertools.product(*zip(low, high, strict=True))])
    box = (corner @ np.linalg.inv(matrix))[:, :3]
    return box.min(axis=0), box.max(axis=0)
