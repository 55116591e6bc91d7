"""How the following clip stands at a seam: by the feet that are planted on both sides of it, else by its root.

Conventions
-----------
Points and masks of feet are (2, 2, ...): ankles and toes, then left and right.
"""

from __future__ import annotations

import numpy as np

from kernels.skeleton import grounding
from kernels.skeleton.contacts import FootContacts, find_contacts
from kernels.types import Clip, Float

HEADING_WEIGHT = 0.05
"""Of two points `_ARM_M` before and behind the root against one planted point: what keeps a body facing where it faced.
Chosen by hand, faint beside the feet."""

_ARM_M = 0.3
"""Chosen by hand, about the length of a step."""


def clip_contacts(clip: Clip, position_xyz_m: Float) -> FootContacts:
    """Find when the feet of a canonical clip are planted.

    Parameters
    ----------
    clip : Clip on the canonical skeleton
    position_xyz_m : (F, 22, 3) float, metres, its joints in the world

    Returns
    -------
    FootContacts, at the heights that planted feet have on the canonical skeleton
    """
    return find_contacts(
        position_xyz_m[:, grounding.ANKLES],
        position_xyz_m[:, grounding.TOES],
        frame_rate_hz=clip.frame_rate_hz,
        planted_height_m=(grounding.ANKLE_HEIGHT_M, grounding.TOES_HEIGHT_M),
    )


def planted_share(contacts: FootContacts, start_s: float, end_s: float, frame_rate_hz: float) -> Float:
    """Measure for which part of a stretch of a clip each point of its feet is planted.

    Parameters
    ----------
    contacts : FootContacts of F >= 1 frames
    start_s, end_s : float, seconds of the clip, start <= end; held at its ends
    frame_rate_hz : float, > 0

    Returns
    -------
    (2, 2) float64, 0 to 1
    """
    last = len(contacts.ankle) - 1
    first, stop = (int(np.clip(round(t * frame_rate_hz), 0, last)) for t in (start_s, end_s))
    mask = np.stack([contacts.ankle, contacts.toes])[:, first : stop + 1]
    return np.asarray(mask.mean(axis=1), np.float64)


def meet(before_xyz_m: Float, after_xyz_m: Float, planted: Float, *, heading_rad: float) -> tuple[float, Float]:
    """Turn and move a body so that its planted feet stand where another's stand.

    Parameters
    ----------
    before_xyz_m, after_xyz_m : (22, 3) float, metres
        Canonical joints on both sides of a seam, the second with its root where the first has it, facing alike.
    planted : (2, 2) float, 0 to 1, how surely each point is planted on both sides
    heading_rad : float, radians, where both face

    Returns
    -------
    angle_rad : float, about the vertical through the origin
    shift_xyz_m : (3,) float64, metres, horizontal, after the turn

    Notes
    -----
    Closed form of [Kovar2002] over the planted points, each foot by its share of the body's weight, and a faint memory
    of root and heading. Nothing is planted: nothing moves.
    """
    sides = [np.stack([p[grounding.ANKLES], p[grounding.TOES]]) for p in (before_xyz_m, after_xyz_m)]
    bears = np.mean([_bearing(p, feet[0]) for p, feet in zip((before_xyz_m, after_xyz_m), sides, strict=True)], axis=0)
    weight = (planted * bears).ravel()
    if not weight.sum() > 1e-6:
        return 0.0, np.zeros(3)
    ahead = _ARM_M * np.array([np.sin(heading_rad), 0.0, np.cos(heading_rad)])
    root = before_xyz_m[0] + np.array([ahead, -ahead])
    x, y = (np.concatenate([feet.reshape(4, 3), root])[:, [2, 0]] @ [1, 1j] for feet in reversed(sides))
    w = np.append(weight, [HEADING_WEIGHT, HEADING_WEIGHT])
    w = w / w.sum()
    x_mean, y_mean = w @ x, w @ y
    turned = np.vdot(x - x_mean, w * (y - y_mean))
    turned = turned / max(float(np.abs(turned)), 1e-12)
    moved = y_mean - turned * x_mean
    return float(np.angle(turned)), np.array([moved.imag, 0.0, moved.real])


def _bearing(position_xyz_m: Float, ankle_xyz_m: Float) -> Float:
    """Share of the weight on each foot, (2,): how near the hips are to it on the way from one to the other."""
    left, right, hips = ankle_xyz_m[0, [0, 2]], ankle_xyz_m[1, [0, 2]], position_xyz_m[0, [0, 2]]
    apart = left - right
    share = float(np.clip((hips - right) @ apart / max(float(apart @ apart), 1e-6), 0.05, 0.95))
    return np.array([share, 1 - share])
