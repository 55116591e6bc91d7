"""What it costs to go from one recorded motion into another: unlike poses, rough moments, no room for a blend.

How rough a seam is seen to be is told by how rough the recordings are around it, more than by how far the poses are
apart: a blend spreads the difference of two poses over its width, but a stamp or a kick, or a fault of the recording,
beside the calm of the other clip stays what it is.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from kernels import rotation
from kernels.skeleton.canonical import JOINTS
from kernels.types import Float, Int

SEAM = 1.0
"""Price of any seam, however alike the poses: 1 by definition, the unit of all other prices. Dearer seams were tried on
three songs of real clips and left."""

POOR_M2 = 0.05
"""Squared distance of poses, square metres, that doubles the price. Measured on real clips: of two moments taken at
random one pair in four is nearer."""

CALM = 0.6
"""Share of what is usual at most (the 99th percentile) from which jerk costs. Chosen by hand."""

STANCE_M = 0.1
"""How far apart the feet stand, metres, where that costs 1: they slide so far in the blend. Chosen by hand."""

ROUGH, ROOM = 2.0, 2.0
"""Prices of each doubling of the usual jerk, squared, and of a blend half of which has no recording to show. Chosen by
hand; a dearer doubling was tried on three songs of real clips and left."""

LIMBS = ("leftHand", "rightHand", "leftFoot", "rightFoot")
FEET = (2, 3)
"""Their places among the limbs, by definition."""

AROUND_S = (-0.2, -0.1, 0.0, 0.1, 0.2)
"""Moments around a seam at which paths are compared, seconds. Chosen to span a usual blend."""

HERE = AROUND_S.index(0.0)
"""Place of the seam itself, by definition."""

BLEND_JERK = 6.0 / 0.4**2 * 30.0
"""Jerk, metres per second cubed, of a limb whose two paths are a metre apart over the blend, by definition of the usual
one: the eased share of a blend of w seconds sets in with an acceleration of 6 / w^2, which a stage of 30 frames a
second sees at once."""

REACH_S = 0.33
"""How far around a seam the recording's own jerk counts, seconds. Chosen as half a usual blend and 0.1 s beside, danced
a tenth faster."""


@dataclass(frozen=True, eq=False)
class Ends:
    """How recorded motions start and end, (I,) motions.

    Parameters
    ----------
    start, end : (I, D) float64, poses as rows whose squared distance is that of the motion graph, velocities included
    start_limb, end_limb : (I, 4, W, 3) float64, metres, paths of hands and feet around there (:func:`limb_paths`)
    end_accent : (I,) float64, 0 to 1, how visibly the body stops at the end
    start_jerk, end_jerk : (I,) float64, >= 0, metres per second cubed, the largest of the recording around there
    usual_jerk : (I,) float64, >= 0, of the motion's clip
    start_lack, end_lack : (I,) float64, 0 to 1, share of half a blend that lies outside the clip
    """

    start: Float
    end: Float
    start_limb: Float
    end_limb: Float
    end_accent: Float
    start_jerk: Float
    end_jerk: Float
    usual_jerk: Float
    start_lack: Float
    end_lack: Float


def concatenate_ends(parts: list[Ends]) -> Ends:
    """Stack the motions of several clips.

    Parameters
    ----------
    parts : at least one

    Returns
    -------
    Ends of all motions, in order
    """
    return Ends(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Ends)))


def limb_paths(position_xyz_m: Float, root_wxyz: Float, *, frame_rate_hz: float, time_s: Float) -> Float:
    """Follow hands and feet around moments of a clip, seen from where the hips stand and face at the moment.

    Not only where they are but where they go: a hand that comes from the left does not go on into one that comes from
    the right, however near they meet. After the windows of [Kovar2002].

    Parameters
    ----------
    position_xyz_m : (F, J, 3) float, metres, world, canonical joints, F >= 1
    root_wxyz : (F, 4) float, unit, the hips' rotation in the world
    frame_rate_hz : float, > 0
    time_s : (n,) float, seconds of the clip; held at its ends beyond them

    Returns
    -------
    (n, 4, W, 3) float64, metres: :data:`LIMBS` at the moments :data:`AROUND_S`, between frames by lines
    """
    last = len(position_xyz_m) - 1
    joints = [0, *(JOINTS.index(name) for name in LIMBS)]
    at = np.clip((np.asarray(time_s)[:, None] + np.array(AROUND_S)) * frame_rate_hz, 0, last)
    below = np.minimum(at.astype(np.int64), max(last - 1, 0))
    share = (at - below)[..., None, None]
    seen = position_xyz_m[:, joints]
    found = (1 - share) * seen[below] + share * seen[np.minimum(below + 1, last)]
    found = found - found[:, HERE, :1][:, None] * np.array([1.0, 0.0, 1.0])
    facing = rotation.from_heading(-rotation.heading_rad(root_wxyz[np.rint(at[:, HERE]).astype(np.int64)]))
    turned = rotation.apply(facing[:, None, None], found[:, :, 1:])
    return np.asarray(np.swapaxes(turned, 1, 2), np.float64)


def rough_cost(peak: Float, usual: Float) -> Float:
    """Price of the jerk around a seam: squared doublings of what is usual, times :data:`ROUGH`; 0 below it.

    Parameters
    ----------
    peak, usual : float arrays that fit each other, >= 0

    Returns
    -------
    float64 array, >= 0; 0 where nothing is usual
    """
    calm = CALM * usual
    is_rough = (peak > calm) & (calm > 0)
    return np.asarray(ROUGH * np.log2(np.where(is_rough, peak, 1.0) / np.where(is_rough, calm, 1.0)) ** 2, np.float64)


def own_cost(ends: Ends) -> tuple[Float, Float]:
    """Price of a seam at the start and at the end of each motion as far as it lies in the motion's own recording.

    Parameters
    ----------
    ends : Ends of I motions

    Returns
    -------
    start, end : (I,) float64, >= 0
        The rough moment against what is usual in its clip, or in the median clip where it is wilder; lacking room.
    """
    usual = np.minimum(ends.usual_jerk, np.median(ends.usual_jerk)) if len(ends.usual_jerk) else ends.usual_jerk
    start = rough_cost(ends.start_jerk, usual) + ROOM * ends.start_lack
    return start, rough_cost(ends.end_jerk, usual) + ROOM * ends.end_lack


def seam_cost(ends: Ends, before: Int, after: Int) -> Float:
    """Price every seam between motions that end and motions that start.

    Parameters
    ----------
    ends : Ends of I motions
    before : (N,) int64, motions that end
    after : (M,) int64, motions that start

    Returns
    -------
    (N, M) float64, >= 0
        ``SEAM + d / POOR_M2 + feet / STANCE_M^2 + rough + room``: d and feet the squared distances of the poses and of
        the feet; rough by the largest jerk around the two ends and of the blend, over what is usual in the calmer of
        the two clips, or in the median clip where both are wilder.
    """
    apart = _squared(ends.end[before], ends.start[after])
    n_limbs, n_moments = len(LIMBS), len(AROUND_S)
    leaves, enters = ends.end_limb[before], ends.start_limb[after]
    limbs = [_squared(leaves[:, i], enters[:, i]) / n_moments for i in range(n_limbs)]
    stands = [_squared(leaves[:, i, HERE], enters[:, i, HERE]) for i in FEET]
    feet = np.mean(stands, axis=0)
    blend = BLEND_JERK * np.sqrt(np.max(limbs, axis=0))
    peak = np.maximum(np.maximum.outer(ends.end_jerk[before], ends.start_jerk[after]), blend)
    usual = np.minimum.outer(ends.usual_jerk[before], ends.usual_jerk[after])
    usual = np.minimum(usual, np.median(ends.usual_jerk)) if usual.size else usual
    lack = np.add.outer(ends.end_lack[before], ends.start_lack[after])
    unlike = apart / POOR_M2 + feet / STANCE_M**2
    return np.asarray(SEAM + unlike + rough_cost(peak, usual) + ROOM * lack, np.float64)


def _squared(a: Float, b: Float) -> Float:
    """Squared distances of N rows from M rows of as many numbers, (N, M), >= 0."""
    a, b = (rows.reshape(len(rows), int(np.prod(rows.shape[1:]))) for rows in (a, b))
    both = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1)[None] - 2 * (a @ b.T)
    return np.asarray(np.maximum(both, 0.0), np.float64)
