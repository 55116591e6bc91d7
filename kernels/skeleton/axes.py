"""From a file's units, axes and root to our world: metres, Y up.

Conventions
-----------
What a file means is inferred from the body in it and returned as a record, so that it can be kept and shown.
Turning Z up into Y up is the quarter turn about X that takes (x, y, z) to (x, z, -y); heading and place stay.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kernels.skeleton import canonical, kinematics, topology
from kernels.types import Float, Skeleton

# Metres one unit stands for, by definition, and the statures believed in it, chosen by hand: narrow where units are
# near to each other. The CMU subjects' files have inches over 0.45, by convention of their makers.
_UNITS: tuple[tuple[float, float, float], ...] = (
    (1.0, 0.9, 2.5),
    (0.01, 0.9, 2.5),
    (0.001, 0.9, 2.5),
    (0.0254, 1.3, 2.2),
    (0.0254 / 0.45, 1.5, 1.95),
)
LANDMARKS = ("head", "leftFoot", "rightFoot", "leftToes", "rightToes", "leftHand", "rightHand")
_UNITLESS_STATURE_M = 1.70
"""Of a body in no unit. Chosen by hand, about the canonical one."""
_STATURE_IN_LEGS = canonical.BODY_HEIGHT_M / canonical.LEG_LENGTH_M


@dataclass(frozen=True)
class World:
    """What a file's numbers mean.

    Parameters
    ----------
    metres_per_unit : float, > 0
    up_axis : ``"Y"`` or ``"Z"``
    root_offset_rule : ``"replace"`` or ``"add"``
        Whether the root's position channels stand in place of its offset or are added to it.
    """

    metres_per_unit: float
    up_axis: str
    root_offset_rule: str


def infer_world(skeleton: Skeleton, joint: Mapping[str, str] | None, position: Float) -> World:
    """Infer unit, up axis and root rule from a body and some of its poses.

    Parameters
    ----------
    skeleton : Skeleton
        In file units and axes, whatever its field's name says.
    joint : canonical name to the rig's name, or None where the rig is no body
    position : (F, J, 3) float, file units and axes, F >= 1
        Poses with the root's channels in place of its offset. Of a body, only the :data:`LANDMARKS` count.

    Returns
    -------
    World
        The up axis is the one along which the head is over the feet; where that speaks against the rest pose, the one
        along which the lowest joint keeps its height. Without a body: Y up, and the unit by the extent of the poses.
    """
    if joint is None:
        extent = float(np.ptp(position, axis=1).max())
        return World(metres_per_unit(extent), "Y", "replace")
    at = {name: skeleton.joints.index(source) for name, source in joint.items()}
    height = stature(skeleton, joint)
    up_axis = _up_axis(skeleton, at, position, height)
    k = "XYZ".index(up_axis)
    feet = [at[name] for name in at if name.endswith(("Foot", "Toes"))]
    floor = float(np.quantile(position[:, feet, k].min(axis=1), 0.05))
    raised = floor + float(skeleton.offset_xyz_m[0, k])
    rule = "add" if abs(raised) + 0.1 * height < abs(floor) else "replace"
    return World(metres_per_unit(height), up_axis, rule)


def stature(skeleton: Skeleton, joint: Mapping[str, str]) -> float:
    """Body height by the length of the legs.

    Parameters
    ----------
    skeleton : Skeleton
    joint : canonical joint to the skeleton's, the feet among them

    Returns
    -------
    float, >= 0, in the skeleton's units
        0 where the legs have no length.
    """
    at = {name: skeleton.joints.index(source) for name, source in joint.items()}
    length = np.linalg.norm(skeleton.offset_xyz_m, axis=-1)
    leg = 0.0
    for side in ("left", "right"):
        path = topology.path_up(skeleton, at[side + "Foot"])
        leg += float(length[path[: path.index(at[side + "UpperLeg"])]].sum()) / 2
    return leg * _STATURE_IN_LEGS


def metres_per_unit(height: float) -> float:
    """Metres a unit stands for, from a body height in it: metre, centimetre, millimetre, inch, CMU's, else 1.70 m tall.

    Parameters
    ----------
    height : float, file units

    Returns
    -------
    float, > 0
        1 where the height is 0.
    """
    for unit_m, lowest_m, highest_m in _UNITS:
        if lowest_m <= height * unit_m <= highest_m:
            return unit_m
    return _UNITLESS_STATURE_M / height if height > 0 else 1.0


def vectors_to_y_up(vector: Float, up_axis: str) -> Float:
    """Turn vectors (..., 3) of a file with the given up axis to Y up.

    Parameters
    ----------
    vector : (..., 3) float, of any unit
    up_axis : "Y" or "Z", of the file

    Returns
    -------
    (..., 3) float64, of the same unit
    """
    if up_axis == "Y":
        return np.asarray(vector, np.float64)
    return np.stack([vector[..., 0], vector[..., 2], -vector[..., 1]], axis=-1)


def rotations_to_y_up(rotation_wxyz: Float, up_axis: str) -> Float:
    """Turn local rotations (..., 4) of a file with the given up axis to Y up: their axes turn as vectors do.

    Parameters
    ----------
    rotation_wxyz : (..., 4) float, unit, local
    up_axis : "Y" or "Z", of the file

    Returns
    -------
    (..., 4) float64, unit, local
    """
    return np.concatenate([rotation_wxyz[..., :1], vectors_to_y_up(rotation_wxyz[..., 1:], up_axis)], axis=-1)


def vectors_from_y_up(vector: Float, up_axis: str) -> Float:
    """Invert :func:`vectors_to_y_up`.

    Parameters
    ----------
    vector : (..., 3) float, of any unit, Y up
    up_axis : "Y" or "Z", of the file

    Returns
    -------
    (..., 3) float64, of the same unit
    """
    if up_axis == "Y":
        return np.asarray(vector, np.float64)
    return np.stack([vector[..., 0], -vector[..., 2], vector[..., 1]], axis=-1)


def rotations_from_y_up(rotation_wxyz: Float, up_axis: str) -> Float:
    """Invert :func:`rotations_to_y_up`.

    Parameters
    ----------
    rotation_wxyz : (..., 4) float, unit, local, Y up
    up_axis : "Y" or "Z", of the file

    Returns
    -------
    (..., 4) float64, unit, local
    """
    return np.concatenate([rotation_wxyz[..., :1], vectors_from_y_up(rotation_wxyz[..., 1:], up_axis)], axis=-1)


def _up_axis(skeleton: Skeleton, at: Mapping[str, int], position: Float, height: float) -> str:
    feet = [at["leftFoot"], at["rightFoot"]]
    standing = np.mean(position[:, at["head"]] - position[:, feet].mean(axis=1), axis=0)
    by_motion = "Y" if abs(standing[1]) >= abs(standing[2]) else "Z"
    rest = kinematics.rest_position(skeleton)
    at_rest = rest[at["head"]] - rest[feet].mean(axis=0)
    by_rest = "YZ"[int(np.argmax(np.abs(at_rest[1:])))]
    is_clear = max(abs(standing[1]), abs(standing[2])) > 0.4 * height
    if by_motion == by_rest or not np.linalg.norm(at_rest) > 0.6 * height:
        return by_motion if is_clear else "Y"
    if not is_clear:
        return by_rest
    unsteady = {}
    for axis in "YZ":
        k = "XYZ".index(axis)
        lowest = position[:, [at[name] for name in LANDMARKS if name in at], k].min(axis=1)
        offset = skeleton.offset_xyz_m[0, k]
        off_zero = min(abs(np.median(lowest)), abs(np.median(lowest) + offset))
        unsteady[axis] = float(np.std(lowest) + 0.2 * off_zero)
    return min(unsteady, key=lambda axis: (unsteady[axis], axis != by_motion))
