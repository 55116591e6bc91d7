"""From local rotations to the world and back."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from kernels import rotation
from kernels.types import Clip, Float, Skeleton


def forward(
    skeleton: Skeleton, root_xyz_m: Float, rotation_wxyz: Float, *, translation_xyz_m: Float | None = None
) -> tuple[Float, Float]:
    """Place every joint in the world (forward kinematics).

    Parameters
    ----------
    skeleton : Skeleton of J joints
    root_xyz_m : (F, 3) float, metres
    rotation_wxyz : (F, J, 4) float, unit, local; the root's in the world
    translation_xyz_m : (F, J, 3) float, metres, or None
        Local positions in place of the skeleton's offsets; row 0 is ignored.

    Returns
    -------
    position_xyz_m : (F, J, 3) float64, metres, world
    orientation_wxyz : (F, J, 4) float64, unit, world
        Both empty when F is 0.

    Raises
    ------
    ValueError
        If a shape does not fit the skeleton.
    """
    f, j = len(root_xyz_m), len(skeleton.joints)
    if root_xyz_m.shape != (f, 3) or rotation_wxyz.shape != (f, j, 4):
        raise ValueError(
            f"root_xyz_m, rotation_wxyz: want (F, 3) and (F, {j}, 4), got {root_xyz_m.shape} and {rotation_wxyz.shape}"
        )
    position = np.zeros((j, f, 3))
    orientation = np.zeros((j, f, 4))
    local = np.moveaxis(np.asarray(rotation_wxyz, np.float64), 1, 0)
    position[0], orientation[0] = root_xyz_m, local[0]
    for k in range(1, j):
        parent = skeleton.parent[k]
        offset = skeleton.offset_xyz_m[k] if translation_xyz_m is None else translation_xyz_m[:, k]
        position[k] = position[parent] + rotation.apply(orientation[parent], offset)
        orientation[k] = rotation.mul(orientation[parent], local[k])
    return np.moveaxis(position, 0, 1).copy(), np.moveaxis(orientation, 0, 1).copy()


def forward_some(
    skeleton: Skeleton,
    root_xyz_m: Float,
    rotation_wxyz: Float,
    joints: Iterable[int],
    *,
    translation_xyz_m: Float | None = None,
) -> tuple[Float, Float]:
    """Place some joints in the world, and all above them: :func:`forward` where the rest does not matter.

    Parameters
    ----------
    skeleton, root_xyz_m, rotation_wxyz, translation_xyz_m : as :func:`forward`
    joints : indices

    Returns
    -------
    position_xyz_m : (F, J, 3) float64, metres, world
    orientation_wxyz : (F, J, 4) float64, unit, world
        Zero for joints that are neither asked for nor above one that is.
    """
    f, j = len(root_xyz_m), len(skeleton.joints)
    needed = {0}
    for joint in joints:
        k = int(joint)
        while k not in needed:
            needed.add(k)
            k = int(skeleton.parent[k])
    position, orientation = np.zeros((j, f, 3)), np.zeros((j, f, 4))
    position[0], orientation[0] = root_xyz_m, rotation_wxyz[:, 0]
    for k in sorted(needed - {0}):
        parent = skeleton.parent[k]
        offset = skeleton.offset_xyz_m[k] if translation_xyz_m is None else translation_xyz_m[:, k]
        position[k] = position[parent] + rotation.apply(orientation[parent], offset)
        orientation[k] = rotation.mul(orientation[parent], rotation_wxyz[:, k])
    return np.moveaxis(position, 0, 1), np.moveaxis(orientation, 0, 1)


def place(clip: Clip) -> tuple[Float, Float]:
    """World positions and orientations of a clip: :func:`forward` on its own skeleton.

    Parameters
    ----------
    clip : Clip of F frames and J joints

    Returns
    -------
    position_xyz_m : (F, J, 3) float64, metres, world
    orientation_wxyz : (F, J, 4) float64, unit, world
    """
    return forward(clip.skeleton, clip.root_xyz_m, clip.rotation_wxyz, translation_xyz_m=clip.translation_xyz_m)


def to_local(skeleton: Skeleton, orientation_wxyz: Float) -> Float:
    """Rotations local to the parent from rotations in the world.

    Parameters
    ----------
    skeleton : Skeleton of J joints
    orientation_wxyz : (F, J, 4) float, unit, world

    Returns
    -------
    (F, J, 4) float64, unit, local; the root's stays in the world
        In one hemisphere from frame to frame, first frame with w >= 0.

    Raises
    ------
    ValueError
        If a quaternion is zero or not finite.
    """
    local = np.array(orientation_wxyz, np.float64)
    child = np.arange(1, len(skeleton.joints))
    parent = skeleton.parent[1:]
    local[:, child] = rotation.mul(rotation.inv(orientation_wxyz[:, parent]), orientation_wxyz[:, child])
    return rotation.continuous(rotation.normalize(local))


def rest_position(skeleton: Skeleton) -> Float:
    """World positions at rest, (J, 3) float64, metres.

    Parameters
    ----------
    skeleton : Skeleton of J joints

    Returns
    -------
    (J, 3) float64, metres
    """
    position = skeleton.offset_xyz_m.astype(np.float64).copy()
    for k in range(1, len(skeleton.joints)):
        position[k] += position[skeleton.parent[k]]
    return position


def hang(skeleton: Skeleton, root_xyz_m: Float, orientation_wxyz: Float) -> Float:
    """Place every joint from world orientations: what :func:`forward` does from local ones.

    Parameters
    ----------
    skeleton : Skeleton of J joints
    root_xyz_m : (F, 3) float, metres
    orientation_wxyz : (F, J, 4) float, unit, world

    Returns
    -------
    (F, J, 3) float64, metres, world
    """
    bone = rotation.apply(orientation_wxyz[:, skeleton.parent[1:]], skeleton.offset_xyz_m[1:])
    position = np.zeros((*orientation_wxyz.shape[:2], 3))
    position[:, 0] = root_xyz_m
    for k in range(1, len(skeleton.joints)):
        position[:, k] = position[:, skeleton.parent[k]] + bone[:, k - 1]
    return position
