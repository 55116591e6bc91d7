"""Feet of a finished dance: which are planted, and keeping those where they stand.

A warp, a blend and the turn at a seam move feet that stood still in the clips. What was planted in the source is
planted here: first the root gives way, then the legs bend (:mod:`kernels.skeleton.grounding`). A foot stays where it
was put until it is lifted.

Contact locks after Holden's published controller [Holden2021]; offline there is no need for its springs: what comes
after a contact is known.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from kernels import rotation
from kernels.assembly.blend import Dance
from kernels.assembly.stance import clip_contacts
from kernels.skeleton import grounding, kinematics
from kernels.skeleton.alignment import unit
from kernels.skeleton.canonical import CANONICAL
from kernels.skeleton.contacts import FootContacts, runs
from kernels.types import Choreography, Clip, Float

Bool = NDArray[np.bool_]
UP = np.array([0.0, 1.0, 0.0])
"""By convention."""

SAY = 0.25
"""Share of a blended pose above which the second clip's foot must be planted as well. Chosen by hand."""


@dataclass(frozen=True)
class FootLockGive:
    """Limits of how far root and legs move to keep planted feet where they stand.

    Parameters
    ----------
    root, foot : grounding.GroundingGive, of which the weight of added speed and the time of its changes are used
    root_pull : float, per square second
        Draws the root's displacement back to nothing.
    foot_pull, free_pull : float, per square second
        The same of a foot: while it is planted, when it creeps home over many seconds, and while it is free.
    rise_pull : float, per square second, keeps the height of planted feet through a blend
    leg_limit_rad : float, radians
        Most that a thigh or shin turns.
    stretch_ratio : float, 0 to 1
        Of what a leg has left to stretch, the part that may be taken: a knee keeps most of its bend.
    """

    root: grounding.GroundingGive = field(default_factory=grounding.GroundingGive)
    foot: grounding.GroundingGive = field(default_factory=lambda: grounding.GroundingGive(root_speed_weight=0.005))
    root_pull: float = 1e-4
    foot_pull: float = 0.02
    free_pull: float = 1.0
    rise_pull: float = 2.0
    leg_limit_rad: float = float(np.radians(20.0))
    stretch_ratio: float = 0.5


def planted_feet(dance: Dance, steps: Choreography, clips: Mapping[str, Clip]) -> FootContacts:
    """Find which foot is planted when, from the clips through the lineage.

    Blending must not get to decide what counts as contact: the dominant clip of a frame does, and its partner as well
    where that has more than :data:`SAY` of the pose. A foot that lands just before a seam and swings after it does not
    stand.

    Parameters
    ----------
    dance, steps, clips : as :func:`kernels.assembly.blend.assemble` has them, on the canonical skeleton

    Returns
    -------
    FootContacts of the dance's frames
    """
    line = dance.lineage
    planted, partner = np.zeros((2, len(dance.time_s), 2), bool), np.ones((2, len(dance.time_s), 2), bool)
    clip_of_step = np.array(steps.clip_id, object)
    has_say = (line.blend_step_index >= 0) & (line.blend_weight > SAY)
    for clip_id in dict.fromkeys(steps.clip_id):
        clip = clips[clip_id]
        position, _ = kinematics.place(clip)
        found = clip_contacts(clip, position)
        here = clip_of_step[line.step_index] == clip_id
        there = has_say & (clip_of_step[line.blend_step_index] == clip_id)
        for out, is_shown, time_s in ((planted, here, line.clip_time_s), (partner, there, line.blend_time_s)):
            at = np.clip(np.round(time_s[is_shown] * clip.frame_rate_hz).astype(int), 0, clip.n_frames - 1)
            out[:, is_shown] = found.ankle[at], found.toes[at]
    planted &= partner
    return FootContacts(planted[0], planted[1], 0.0, grounding.ANKLE_HEIGHT_M, grounding.TOES_HEIGHT_M)


def lock_feet(dance: Dance, planted: FootContacts, *, give: FootLockGive | None = None) -> Dance:
    """Keep planted feet where they stand.

    Parameters
    ----------
    dance : Dance on the canonical skeleton
    planted : FootContacts of its frames, from :func:`planted_feet`
    give : FootLockGive, or None for the defaults

    Returns
    -------
    Dance
        The same lineage; feet keep their height, and their orientation but for turns about the vertical.

    Notes
    -----
    The root's displacement and then each foot's own are the least-squares paths that cancel the steps of planted
    points, weighed against their own speed and bends: there is no moment of locking or letting go, so none is seen. Two
    clips whose stances differ share the difference, each left with its feet a little as the other has them; a
    foot comes home when it is lifted next. The hips rise and sink with the feet so that knees keep their bend.
    """
    give = FootLockGive() if give is None else give
    rate = dance.frame_rate_hz
    is_blend = dance.lineage.blend_weight > 0
    position, orientation = kinematics.forward(CANONICAL, dance.root_xyz_m, dance.rotation_wxyz)
    turned_rad = _turns_rad(position, planted, is_blend, rate, give)
    for side, (ankle, toes) in enumerate(zip(grounding.ANKLES, grounding.TOES, strict=True)):
        turn = rotation.from_heading(turned_rad[:, side])
        orientation[:, [ankle, toes]] = rotation.mul(turn[:, None], orientation[:, [ankle, toes]])
        position[:, toes] = position[:, ankle] + rotation.apply(turn, position[:, toes] - position[:, ankle])
    point = np.stack([position[:, grounding.ANKLES], position[:, grounding.TOES]])
    mask = np.stack([planted.ankle & ~planted.toes, planted.toes])
    both = (mask[:, 1:] & mask[:, :-1]).astype(np.float64)
    step = np.diff(point, axis=1)
    root = np.zeros_like(dance.root_xyz_m)
    for axis in (0, 2):
        root[:, axis] = grounding.cancel_steps(
            both.sum(axis=(0, 2)), -(both * step[..., axis]).sum(axis=(0, 2)), rate, give=give.root, pull=give.root_pull
        )
    foot = np.zeros((len(root), 2, 3))
    left = step + np.diff(root, axis=0)[None, :, None]
    for side in range(2):
        pull = np.where(mask[..., side].any(axis=0), give.foot_pull, give.free_pull)
        for axis in (0, 2):
            foot[:, side, axis] = grounding.cancel_steps(
                both[..., side].sum(axis=0),
                -(both[..., side] * left[..., side, axis]).sum(axis=0),
                rate,
                give=give.foot,
                pull=pull,
            )
    foot[..., 1] = _rises_m(point[..., 1], mask, is_blend, rate, give)
    root[:, 1] = _height_m(position, foot)
    foot = _within_reach(position, foot - root[:, None] * UP, give.stretch_ratio)
    orientation = grounding.bend_legs(position, orientation, foot, limit_rad=give.leg_limit_rad)
    orientation = _above_floor(dance.root_xyz_m + root, orientation, give.leg_limit_rad)
    local = rotation.continuous(kinematics.to_local(CANONICAL, orientation))
    place = dance.root_xyz_m + root
    position, _ = kinematics.forward(CANONICAL, place, local)
    return replace(dance, root_xyz_m=place, rotation_wxyz=local, position_xyz_m=position)


def _turns_rad(position: Float, planted: FootContacts, is_blend: Bool, rate: float, give: FootLockGive) -> Float:
    """Angles (F, 2) about the vertical that keep flat feet from turning while one clip goes over into the next."""
    foot = position[:, grounding.TOES] - position[:, grounding.ANKLES]
    heading = np.unwrap(np.arctan2(foot[..., 0], foot[..., 2]), axis=0)
    flat = planted.ankle & planted.toes
    hold = flat[1:] & flat[:-1]
    step = np.where((is_blend[1:] & is_blend[:-1])[:, None], np.diff(heading, axis=0), 0.0)
    out = np.zeros_like(heading)
    for side in range(2):
        pull = np.where(planted.foot[:, side], give.foot_pull, give.free_pull)
        weight = hold[:, side].astype(np.float64)
        out[:, side] = grounding.cancel_steps(weight, -weight * step[:, side], rate, give=give.foot, pull=pull)
    return out


def _rises_m(height: Float, mask: Bool, is_blend: Bool, rate: float, give: FootLockGive) -> Float:
    """Heights (F, 2) that planted points (2, F, 2) need added in blends, to pass from what they are before to after."""
    at = np.arange(len(is_blend))
    out = np.zeros((len(at), 2))
    for side in range(2):
        weight, place = np.full(len(at), give.free_pull), np.zeros(len(at))
        for point, stands in zip(height[..., side], mask[..., side], strict=True):
            weight[stands] = give.rise_pull
            for a, b in zip(*runs(stands), strict=True):
                known = at[a:b][~is_blend[a:b]]
                if len(known) and len(known) < b - a:
                    place[a:b] = np.interp(at[a:b], known, point[known]) - point[a:b]
        out[:, side] = grounding.keep_places(weight, place, rate, give=give.foot)
    return out


def _height_m(position: Float, foot: Float) -> Float:
    """Height (F,) the hips give so that legs whose feet moved keep their bend, the straighter the more so."""
    hip, knee, ankle = (position[:, joints] for joints in (grounding.THIGHS, grounding.KNEES, grounding.ANKLES))
    way = ankle + foot - hip
    now = np.linalg.norm(way, axis=-1)
    longer = now - np.linalg.norm(ankle - hip, axis=-1)
    slope = -way[..., 1] / np.maximum(now, 1e-9)
    straight = (unit(knee - hip) * unit(ankle - knee)).sum(axis=-1).clip(0, 1)
    weight = 1 / (1.05 - straight**2)
    return np.asarray(-(weight * slope * longer).sum(axis=1) / (weight * slope**2 + 1e-3).sum(axis=1), np.float64)


def _within_reach(position: Float, foot: Float, stretch_ratio: float) -> Float:
    """Shorten moves (F, 2, 3) of the ankles that would take more than a part of what a leg has left to stretch."""
    hip, ankle = position[:, grounding.THIGHS], position[:, grounding.ANKLES]
    was = np.linalg.norm(ankle - hip, axis=-1)
    way = ankle + foot - hip
    now = np.linalg.norm(way, axis=-1)
    longer = np.maximum(now - was, 0.0)
    most = np.maximum(stretch_ratio * (grounding.LEG_M - was), 1e-9)
    allowed = longer * most / np.hypot(longer, most)
    return np.asarray(way * ((now - longer + allowed) / np.maximum(now, 1e-9))[..., None] + hip - ankle, np.float64)


def _above_floor(root: Float, orientation: Float, limit_rad: float) -> Float:
    """Raise feet (F, 22, 4 oriented) out of the floor: fast ones swing through it between two frames of a slow clip."""
    position = kinematics.hang(CANONICAL, root, orientation)
    lowest = np.minimum(position[:, grounding.ANKLES, 1], position[:, grounding.TOES, 1])
    under = np.flatnonzero((lowest < 0).any(axis=1))
    out = orientation.copy()
    if len(under):
        lift = np.maximum(-lowest[under], 0.0)[..., None] * UP
        out[under] = grounding.bend_legs(position[under], orientation[under], lift, limit_rad=limit_rad)
    return out
