"""The one skeleton every clip is brought to.

22 joints named as VRM 1.0 humanoid bones, T-pose rest, all rest rotations identity, 1.72 m tall: Y up, facing +Z, left
towards +X, soles on the floor y = 0 (the toes joint at 2 cm, the ankle at 8 cm).
"""

from __future__ import annotations

import numpy as np

from kernels.types import Float, Skeleton

_REST: tuple[tuple[str, str | None, tuple[float, float, float]], ...] = (
    ("hips", None, (0.0, 0.94, 0.0)),
    ("spine", "hips", (0.0, 0.10, 0.0)),
    ("chest", "spine", (0.0, 0.13, 0.0)),
    ("upperChest", "chest", (0.0, 0.13, 0.0)),
    ("neck", "upperChest", (0.0, 0.15, 0.0)),
    ("head", "neck", (0.0, 0.10, 0.0)),
    ("leftShoulder", "upperChest", (0.03, 0.11, 0.0)),
    ("leftUpperArm", "leftShoulder", (0.13, 0.0, 0.0)),
    ("leftLowerArm", "leftUpperArm", (0.27, 0.0, 0.0)),
    ("leftHand", "leftLowerArm", (0.25, 0.0, 0.0)),
    ("rightShoulder", "upperChest", (-0.03, 0.11, 0.0)),
    ("rightUpperArm", "rightShoulder", (-0.13, 0.0, 0.0)),
    ("rightLowerArm", "rightUpperArm", (-0.27, 0.0, 0.0)),
    ("rightHand", "rightLowerArm", (-0.25, 0.0, 0.0)),
    ("leftUpperLeg", "hips", (0.09, -0.04, 0.0)),
    ("leftLowerLeg", "leftUpperLeg", (0.0, -0.41, 0.0)),
    ("leftFoot", "leftLowerLeg", (0.0, -0.41, 0.0)),
    ("leftToes", "leftFoot", (0.0, -0.06, 0.13)),
    ("rightUpperLeg", "hips", (-0.09, -0.04, 0.0)),
    ("rightLowerLeg", "rightUpperLeg", (0.0, -0.41, 0.0)),
    ("rightFoot", "rightLowerLeg", (0.0, -0.41, 0.0)),
    ("rightToes", "rightFoot", (0.0, -0.06, 0.13)),
)
"""Joints of VRM 1.0, their parents, and their places in the parent's, metres. The proportions are chosen by hand."""


JOINTS: tuple[str, ...] = tuple(name for name, _, _ in _REST)
REQUIRED_JOINTS: tuple[str, ...] = tuple(
    ["hips", "head"]
    + [
        side + part
        for side in ("left", "right")
        for part in ("UpperArm", "LowerArm", "Hand", "UpperLeg", "LowerLeg", "Foot")
    ]
)

MIRRORED_JOINT: tuple[int, ...] = tuple(
    JOINTS.index({"left": "right", "righ": "left"}[j[:4]] + j[4 if j.startswith("left") else 5 :])
    if j.startswith(("left", "right"))
    else k
    for k, j in enumerate(JOINTS)
)
"""Index of the joint on the other side; of those in the middle, their own."""

CANONICAL = Skeleton(
    joints=JOINTS,
    parent=np.array([-1 if parent is None else JOINTS.index(parent) for _, parent, _ in _REST]),
    offset_xyz_m=np.array([offset for _, _, offset in _REST]),
)

BODY_HEIGHT_M = 1.72
LEG_LENGTH_M = 0.82
"""Of the canonical body, by definition: with a head above its joint, and from hip to ankle."""


def mirror(root_xyz_m: Float, rotation_wxyz: Float) -> tuple[Float, Float]:
    """Reflect a canonical motion left to right, in the plane x = 0.

    Parameters
    ----------
    root_xyz_m : (F, 3) float, metres
    rotation_wxyz : (F, 22, 4) float, local, in the order of :data:`JOINTS`

    Returns
    -------
    The same two arrays, reflected.
    """
    flip = np.array([1.0, 1.0, -1.0, -1.0])
    return root_xyz_m * np.array([-1.0, 1.0, 1.0]), rotation_wxyz[:, MIRRORED_JOINT] * flip
