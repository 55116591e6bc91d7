"""What it costs to go from one recorded motion into another: unlike poses, rough moments, no room for a blend.

How rough a seam is seen to be is told by how rough the recordings are around it, more than by how far the poses are
apart: a blend spreads the difference of two poses over its width, but a stamp or a kick, or a fault of the recording,
beside the calm of the other clip stays what it is.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from kernels.types import Float, Int

SEAM = 1.0
"""Price of any seam, however alike the poses."""

POOR_M2 = 0.05
"""Squared distance of poses, square metres, that doubles the price: of two clips taken at random one pair in four is
nearer."""

STANCE_M = 0.1
"""How far apart the feet stand, metres, where that costs 1: they slide so far in the blend."""

ROUGH, ROOM = 2.0, 2.0
"""Prices of each doubling of the usual jerk, squared, and of a blend half of which has no recording to show."""

BLEND_JERK = 2000.0
"""Jerk of a blend of 0.4 s, metres per second cubed, to each metre between the poses: the median of 40 seams of real
clips whose blend is rougher than the recordings on either side (1230 and 5080 at the tenth and ninetieth percentile)."""

REACH_S = 0.33
"""How far around a seam the recording's own jerk counts, seconds: half a blend and what is looked at beside."""


@dataclass(frozen=True, eq=False)
class Ends:
    """How recorded motions start and end, (I,) motions.

    Parameters
    ----------
    start, end : (I, D) float64, poses as rows whose squared distance is that of the motion graph, velocities included
    start_feet, end_feet : (I, E) float64, the feet alone likewise, their places
    end_accent : (I,) float64, 0 to 1, how visibly the body stops at the end
    start_jerk, end_jerk : (I,) float64, >= 0, metres per second cubed, the largest of the recording around there
    usual_jerk : (I,) float64, >= 0, of the motion's clip
    start_lack, end_lack : (I,) float64, 0 to 1, share of half a blend that lies outside the clip
    """

    start: Float
    end: Float
    start_feet: Float
    end_feet: Float
    end_accent: Float
    start_jerk: Float
    end_jerk: Float
    usual_jerk: Float
    start_lack: Float
    end_lack: Float


def concatenate_ends(parts: list[Ends]) -> Ends:
    """Stack the motions of several clips, at least one."""
    return Ends(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Ends)))


def rough_cost(peak: Float, usual: Float) -> Float:
    """Price of the jerk around a seam: squared doublings of what is usual, times :data:`ROUGH`; 0 below it.

    Parameters
    ----------
    peak, usual : float arrays that fit each other, >= 0

    Returns
    -------
    float64 array, >= 0; 0 where nothing is usual
    """
    is_rough = (peak > usual) & (usual > 0)
    return np.asarray(ROUGH * np.log2(np.where(is_rough, peak, 1.0) / np.where(is_rough, usual, 1.0)) ** 2, np.float64)


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
        ``SEAM + d / POOR_M2 + feet / STANCE_M^2 + rough + room``: d the squared distance of the poses; the largest jerk around the two ends
        and of the blend over what is usual in the calmer of the two clips, or in the median clip where both are wilder.
    """
    apart = _squared(ends.end[before], ends.start[after])
    steps_m2 = _squared(ends.end_feet[before], ends.start_feet[after])
    peak = np.maximum(np.maximum.outer(ends.end_jerk[before], ends.start_jerk[after]), BLEND_JERK * np.sqrt(apart))
    usual = np.minimum.outer(ends.usual_jerk[before], ends.usual_jerk[after])
    usual = np.minimum(usual, np.median(ends.usual_jerk)) if usual.size else usual
    lack = np.add.outer(ends.end_lack[before], ends.start_lack[after])
    unlike = apart / POOR_M2 + steps_m2 / STANCE_M**2
    return np.asarray(SEAM + unlike + rough_cost(peak, usual) + ROOM * lack, np.float64)


def _squared(a: Float, b: Float) -> Float:
    """Squared distances of (N, D) rows from (M, D) rows, (N, M), >= 0."""
    both = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1)[None] - 2 * (a @ b.T)
    return np.asarray(np.maximum(both, 0.0), np.float64)
