"""How one clip goes over into the next at a seam: shapes of blends, compared in ``docs/seams.md``.

Conventions
-----------
``x`` is the time from the seam over half the width of the blend, -1 to 1. *Before* and *after* are the two clips at the
same frames, the second already turned and moved to where the first stands.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kernels import rotation
from kernels.types import Float

PROBE_S = 1.0 / 60.0
"""Song time either side of a seam over which the clips' speeds there are taken. Chosen as a frame at 60 Hz, by hand."""

_DECAY = 8 * np.log(2.0)
"""Of the springs, an inverse half width of the blend: twice the natural logarithm of two over the half-life, as
[Holden2021] has it. The half-life, a quarter of the half width, is chosen by hand: a fortieth is left at the ends of
the blend."""


@dataclass(frozen=True, eq=False)
class Side:
    """One of the two clips of a seam.

    Parameters
    ----------
    root_xyz_m, rotation_wxyz : (n, 3), (n, J, 4) float, metres and unit, at the blended frames
    seam_root_xyz_m, seam_rotation_wxyz : (3, 3), (3, J, 4) float
        :data:`PROBE_S` before the seam, on it, and after it.
    """

    root_xyz_m: Float
    rotation_wxyz: Float
    seam_root_xyz_m: Float
    seam_rotation_wxyz: Float


Join = Callable[[Float, float, Side, Side], tuple[Float, Float]]
"""From x (n,), half the width in seconds, and the sides before and after, to root (n, 3) and rotations (n, J, 4)."""


def ease(x: Float) -> Float:
    """Rise from 0 to 1 with no slope at either end: 3x^2 - 2x^3 on [0, 1] [Kovar2002].

    Parameters
    ----------
    x : (...) float

    Returns
    -------
    (...) float64, 0 to 1; held beyond [0, 1]
    """
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3 - 2 * x)


def slerp(x: Float, half_s: float, before: Side, after: Side) -> tuple[Float, Float]:
    """Mix both clips, half and half on the seam, with an eased share.

    Parameters
    ----------
    x, half_s, before, after : as :data:`Join` has them

    Returns
    -------
    root_xyz_m, rotation_wxyz : (n, 3), (n, J, 4) float64
    """
    return _mix(ease((x + 1) / 2), before, after)


def linear_slerp(x: Float, half_s: float, before: Side, after: Side) -> tuple[Float, Float]:
    """Mix both clips with a share that rises evenly: [Xu2015], equations 21 and 22.

    Parameters
    ----------
    x, half_s, before, after : as :data:`Join` has them

    Returns
    -------
    root_xyz_m, rotation_wxyz : (n, 3), (n, J, 4) float64
    """
    return _mix(np.clip((x + 1) / 2, 0.0, 1.0), before, after)


def _mix(share: Float, before: Side, after: Side) -> tuple[Float, Float]:
    root = before.root_xyz_m + share[:, None] * (after.root_xyz_m - before.root_xyz_m)
    return root, one_way_slerp(before.rotation_wxyz, after.rotation_wxyz, share)


def one_way_slerp(before_wxyz: Float, after_wxyz: Float, share: Float) -> Float:
    """Mix two moving poses, each joint going the same way round through the whole of the mix.

    Two hands that differ by half a turn and a little have their shorter arc now on one side, now on the other: a joint
    that took it frame by frame would jump. The way is chosen once for a joint: the one that is shorter where both clips
    have a say.

    Parameters
    ----------
    before_wxyz, after_wxyz : (n, J, 4) float, unit, of frames that follow each other
    share : (n,) float, 0 to 1, of the second

    Returns
    -------
    (n, J, 4) float64, unit; empty in, empty out
    """
    if len(share) == 0:
        return np.zeros((0, *before_wxyz.shape[1:]))
    turn = rotation.continuous(rotation.mul(rotation.inv(before_wxyz), after_wxyz))
    say = share * (1 - share) + 1e-9
    turn = np.where((say[:, None] * turn[..., 0]).sum(axis=0)[:, None] < 0, -turn, turn)
    sine = np.linalg.norm(turn[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, turn[..., :1])  # 0 to a whole turn: beyond half of one the joint goes on as it went
    vector = np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0) * turn[..., 1:]
    return rotation.mul(before_wxyz, rotation.exp(share[:, None, None] * vector))


def inertial(x: Float, half_s: float, before: Side, after: Side) -> tuple[Float, Float]:
    """Play one clip up to the seam and the other after it, each with half their offset there, which springs decay.

    Inertialisation ([Bollo2018]; springs after [Holden2021]) both ways from the seam, so that the pose of the beat
    stays on the beat: pose and speed are continuous, neither clip is seen beyond the seam.

    Parameters
    ----------
    x, half_s, before, after : as :data:`Join` has them

    Returns
    -------
    root_xyz_m, rotation_wxyz : (n, 3), (n, J, 4) float64
        The springs would leave a fortieth of the offset at the ends of the blend: they are faded out there.
    """
    late = x >= 0
    turn = rotation.mul(before.seam_rotation_wxyz, rotation.inv(after.seam_rotation_wxyz))
    turn = np.where(turn[..., :1] < 0, -turn, turn)
    root = np.where(late[:, None], after.root_xyz_m, before.root_xyz_m)
    rot = np.where(late[:, None, None], after.rotation_wxyz, before.rotation_wxyz)
    root = root + _decayed(x, half_s, before.seam_root_xyz_m - after.seam_root_xyz_m)
    return root, rotation.mul(rotation.exp(_decayed(x, half_s, rotation.log(turn))), rot)


def _decayed(x: Float, half_s: float, apart: Float) -> Float:
    """Half an offset and half its speed, (3, ...) around the seam, decayed outwards by critically damped springs."""
    x = x.reshape(-1, *[1] * (apart.ndim - 1))
    offset = apart[1] / 2
    speed = (apart[2] - apart[0]) / (2 * PROBE_S) * half_s / 2
    far, side = np.abs(x), np.where(x >= 0, 1.0, -1.0)
    spring = np.exp(-_DECAY * far) * (side * offset + (speed + side * _DECAY * offset) * far)
    return np.asarray(spring * (1 - far**4) ** 2, np.float64)


SHAPES: dict[str, Join] = {"slerp": slerp, "linear_slerp": linear_slerp, "inertial": inertial}
"""Shapes by the name a setting has for them."""
