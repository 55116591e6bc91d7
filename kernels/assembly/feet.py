"""Feet of a finished dance: which are planted, and keeping those where they stand.

A warp, a blend and the turn at a seam move feet that stood still in the clips. What was planted in the source is
planted here: first the root gives way, then the legs bend (:mod:`kernels.skeleton.grounding`), fading in before a
contact and out after it. Where a foot stood for long and its clip let it creep, it may creep on slowly.

Contact locks after Holden's published inertialising controller; offline there is no need for its springs: what comes
after a contact is known.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from kernels import rotation
from kernels.assembly.blend import Dance
from kernels.motion.contacts import FootContacts, find_contacts
from kernels.skeleton import grounding, kinematics
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Choreography, Clip, Float

Bool = NDArray[np.bool_]


@dataclass(frozen=True)
class Give:
    """How far the body gives way to planted feet.

    Parameters
    ----------
    root, foot : grounding.Give, of which the weight of added speed and the time of its changes are used
    root_pull, foot_pull : float, per square second
        Draw the displacement back to nothing: 1 lets what is held in place creep home within about a second.
    leg_limit_rad : float, radians
        Most that a thigh or shin turns.
    """

    root: grounding.Give = field(default_factory=grounding.Give)
    foot: grounding.Give = field(default_factory=lambda: grounding.Give(root_smooth_s=0.1))
    root_pull: float = 1e-4
    foot_pull: float = 1.0
    leg_limit_rad: float = float(np.radians(20.0))


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


def planted_feet(dance: Dance, steps: Choreography, clips: Mapping[str, Clip]) -> FootContacts:
    """Tell which foot is planted when, by the clips through the lineage.

    Blending must not get to decide what counts as contact: the dominant clip of a frame does.

    Parameters
    ----------
    dance, steps, clips : as :func:`kernels.assembly.blend.assemble` has them, on the canonical skeleton

    Returns
    -------
    FootContacts of the dance's frames
    """
    planted = np.zeros((2, len(dance.time_s), 2), bool)
    clip_of_step = np.array(steps.clip_id, object)
    for clip_id in dict.fromkeys(steps.clip_id):
        clip = clips[clip_id]
        position, _ = kinematics.place(clip)
        found = clip_contacts(clip, position)
        frame = np.flatnonzero(clip_of_step[dance.lineage.step_index] == clip_id)
        at = np.clip(np.round(dance.lineage.clip_time_s[frame] * clip.frame_rate_hz).astype(int), 0, clip.n_frames - 1)
        planted[:, frame] = found.ankle[at], found.toes[at]
    return FootContacts(planted[0], planted[1], 0.0, grounding.ANKLE_HEIGHT_M, grounding.TOES_HEIGHT_M)


def lock_feet(dance: Dance, planted: FootContacts, *, give: Give | None = None) -> Dance:
    """Keep planted feet where they stand.

    Parameters
    ----------
    dance : Dance on the canonical skeleton
    planted : FootContacts of its frames, from :func:`planted_feet`
    give : Give, or None for the defaults

    Returns
    -------
    Dance
        The same lineage; feet keep their orientation in the world and their height.

    Notes
    -----
    Both the root's displacement and then each foot's own are the least-squares paths that cancel the steps of planted
    points, weighed against their own speed and bends: there is no moment of locking or letting go, so none is seen.
    """
    give = Give() if give is None else give
    rate = dance.frame_rate_hz
    point = np.stack([dance.position_xyz_m[:, grounding.ANKLES], dance.position_xyz_m[:, grounding.TOES]])
    mask = np.stack([planted.ankle & ~planted.toes, planted.toes])
    both = (mask[:, 1:] & mask[:, :-1]).astype(np.float64)
    step = np.diff(point, axis=1)
    shift = np.zeros_like(dance.root_xyz_m)
    for axis in (0, 2):
        shift[:, axis] = grounding.cancel_steps(
            both.sum(axis=(0, 2)), -(both * step[..., axis]).sum(axis=(0, 2)), rate, give=give.root, pull=give.root_pull
        )
    foot = np.zeros((len(shift), 2, 3))
    left = step + np.diff(shift, axis=0)[None, :, None]
    for side in range(2):
        for axis in (0, 2):
            foot[:, side, axis] = grounding.cancel_steps(
                both[..., side].sum(axis=0),
                -(both[..., side] * left[..., side, axis]).sum(axis=0),
                rate,
                give=give.foot,
                pull=give.foot_pull,
            )
    root = dance.root_xyz_m + shift
    position, orientation = kinematics.forward(CANONICAL, root, dance.rotation_wxyz)
    orientation = grounding.bend_legs(position, orientation, foot, limit_rad=give.leg_limit_rad)
    local = rotation.continuous(kinematics.to_local(CANONICAL, orientation))
    position, _ = kinematics.forward(CANONICAL, root, local)
    return replace(dance, root_xyz_m=root, rotation_wxyz=local, position_xyz_m=position)
