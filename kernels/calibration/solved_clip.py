"""A solved recording as a clip on a skeleton, so that it goes on like any other motion.

Conventions
-----------
What a bone's frame is, no sensor shows: it is fixed by a rest pose. The rest pose is the most upright, stillest half
second of the recording, turned to face +Z. Recordings come in any world; which way is up is told by the body.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kernels import rotation
from kernels.calibration.records import PARENT, SENSORS, BodyPoses
from kernels.skeleton.kinematics import to_local
from kernels.skeleton.naming import END_SUFFIX
from kernels.types import Clip, Float, Skeleton

_WINDOW_S = 0.5
"""Length of the rest pose. Chosen by hand: a quarter of the two seconds a performer is asked to stand."""

_LEG_M = 0.82
_FOOT_M = np.array([0.0, -0.06, 0.15])
"""Toes from the ankle of a foot that points ahead, for a leg so long. By convention those of the canonical skeleton,
the toes 2 cm further ahead, chosen by hand."""

_STILL_M_PER_S = 0.1
"""Mean speed that costs as much as a tenth of a right angle's cosine. Chosen by hand."""

_Y = np.array([0.0, 1.0, 0.0])
"""Up, by convention."""


@dataclass(frozen=True, eq=False)
class Gauge:
    """How a recording stands in our world.

    Parameters
    ----------
    up_wxyz : (4,) float64
        Turns the recording's world so that Y is up.
    first_frame, end_frame : int
        The half second [first, end) taken for the rest pose.
    rest_wxyz : (17, 4) float64
        World rotations of the segments in the rest pose, Y up and facing +Z.
    """

    up_wxyz: Float
    first_frame: int
    end_frame: int
    rest_wxyz: Float


def find_gauge(poses: BodyPoses, frame_rate_hz: float) -> Gauge:
    """Find which way is up, and the rest pose.

    Parameters
    ----------
    poses : BodyPoses of F >= 1 frames
    frame_rate_hz : float, > 0

    Returns
    -------
    Gauge

    Raises
    ------
    ValueError
        If there is no frame.
    """
    if len(poses.position_xyz_m) == 0:
        raise ValueError("poses: want at least one frame, got none; record longer")
    at = {name: k for k, name in enumerate(poses.joints)}
    p = poses.position_xyz_m
    rise = np.mean(p[:, at["head"]] - (p[:, at["l_foot"]] + p[:, at["r_foot"]]) / 2, axis=0)
    k = int(np.argmax(np.abs(rise)))
    up = np.sign(rise[k]) * np.eye(3)[k]
    turn = rotation.between(up, _Y)
    first, end = _rest_window(poses, up, frame_rate_hz)
    middle = rotation.mul(turn, _mean(rotation.continuous(poses.rotation_wxyz[first:end])))
    left = rotation.apply(turn, np.mean(p[first:end, at["l_thigh"]] - p[first:end, at["r_thigh"]], axis=0))
    return Gauge(turn, first, end, rotation.mul(_ahead(float(left[0]), float(left[2])), middle))


def to_clip(poses: BodyPoses, frame_rate_hz: float, *, gauge: Gauge | None = None) -> Clip:
    """Put solved poses on a skeleton of 17 joints and 5 ends.

    Parameters
    ----------
    poses : BodyPoses of F >= 1 frames
    frame_rate_hz : float, > 0
    gauge : Gauge, or None to find it

    Returns
    -------
    Clip
        Metres, Y up. Joints are named after the suit's segments; the ends of head, hands and feet, which no sensor
        shows, lie where an average body has them.

    Raises
    ------
    ValueError
        If there is no frame, or the rate is not > 0.
    """
    gauge = find_gauge(poses, frame_rate_hz) if gauge is None else gauge
    world = rotation.mul(gauge.up_wxyz, poses.rotation_wxyz)
    place = rotation.apply(gauge.up_wxyz, poses.position_xyz_m)
    n = len(SENSORS)
    offset = np.zeros((n, 3))
    for c in range(1, n):
        above = PARENT[c]
        # constant in the parent's frame to rounding; the mean keeps a float32 solver's noise out
        in_parent = rotation.apply(rotation.inv(world[:, above]), place[:, c] - place[:, above]).mean(axis=0)
        offset[c] = rotation.apply(gauge.rest_wxyz[above], in_parent)
    turned = rotation.mul(world, rotation.inv(gauge.rest_wxyz))
    ends = _ends(offset)
    names = (*SENSORS, *(name + END_SUFFIX for name in ends))
    parent = np.array([*PARENT, *(SENSORS.index(name) for name in ends)], np.int64)
    offset = np.concatenate([offset, np.stack(list(ends.values()))])
    offset[0] = place[gauge.first_frame : gauge.end_frame, 0].mean(axis=0)
    whole = np.concatenate([turned, turned[:, parent[n:]]], axis=1)
    skeleton = Skeleton(names, parent, offset)
    return Clip(skeleton, frame_rate_hz, place[:, 0], to_local(skeleton, whole))


def _rest_window(poses: BodyPoses, up: Float, frame_rate_hz: float) -> tuple[int, int]:
    """Find the half second in which the body stands straightest and stillest; of equal ones the first."""
    at = {name: k for k, name in enumerate(poses.joints)}
    p = poses.position_xyz_m
    f = len(p)

    def along(a: str, b: str) -> Float:
        way = p[:, at[b]] - p[:, at[a]]
        unit: Float = way / np.maximum(np.sqrt(np.sum(way * way, axis=-1, keepdims=True)), 1e-9)
        return unit

    cost = 1.0 - along("thorax", "head") @ up
    for side in ("l_", "r_"):
        cost = cost + 2.0 + along(side + "thigh", side + "shank") @ up + along(side + "shank", side + "foot") @ up
        upper, lower = along(side + "upper_arm", side + "forearm"), along(side + "forearm", side + "hand")
        cost = cost + 1.0 - np.sum(upper * lower, axis=-1)
    speed = np.zeros(f)
    if f > 1:
        step = np.sqrt(np.sum(np.diff(p, axis=0) ** 2, axis=-1)).mean(axis=-1)
        speed = np.concatenate([step, step[-1:]]) * frame_rate_hz
    cost = cost + speed / _STILL_M_PER_S * 0.1
    width = min(max(round(_WINDOW_S * frame_rate_hz), 1), f)
    total = np.concatenate([[0.0], np.cumsum(cost)])
    first = int(np.argmin(total[width:] - total[:-width]))
    return first, first + width


def _ahead(x: float, z: float) -> Float:
    """Turn about the vertical that brings a hip line along (x, z) to +X, so that the body faces +Z."""
    # by half angles: sines and arc tangents have last bits of the processor's own
    length = math.sqrt(x * x + z * z)
    w, y = (length + x, z) if x >= 0 else (abs(z), math.copysign(length - x, z))
    whole = math.sqrt(w * w + y * y)
    return np.array([w / whole, 0.0, y / whole, 0.0]) if whole > 0 else rotation.IDENTITY


def _mean(rotation_wxyz: Float) -> Float:
    """Mean of rotations near each other, (F, S, 4) to (S, 4)."""
    return rotation.normalize(rotation_wxyz.mean(axis=0))


def _ends(offset: Float) -> dict[str, Float]:
    """Far ends of head, hands and feet from their joints in the rest pose."""
    at = {name: k for k, name in enumerate(SENSORS)}

    def length(name: str) -> float:
        return float(np.sqrt(np.sum(offset[at[name]] ** 2)))

    ends = {"head": np.array([0.0, 0.5 * length("head"), 0.0])}
    for side in ("l_", "r_"):
        forearm = offset[at[side + "hand"]]
        ends[side + "hand"] = 0.7 * forearm
        ends[side + "foot"] = _FOOT_M * (length(side + "shank") + length(side + "foot")) / _LEG_M
    return ends
