"""Flips of a finished dance: joints that turn, from one frame to the next, further than a body can.

A joint that turns against its parent faster than :data:`FASTEST_TURN_RAD_PER_S` flips. In the world it flips where it
turns as fast and neither the frame before nor the frame after carries the turn on: a spin turns a head as fast for
several frames and is none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels import rotation
from kernels.assembly.blend import Dance, sample
from kernels.assembly.quality import Measure
from kernels.assembly.timing import clock
from kernels.skeleton import kinematics
from kernels.types import Choreography, Clip, Float, Int, Skeleton

Bool = NDArray[np.bool_]

FASTEST_TURN_RAD_PER_S = float(np.radians(1350.0))
"""45 degrees from one frame to the next at 30 frames a second: the definition of a flip. Tuned on salsa and on clips of
everyday motion, of which few frames turn as fast."""

CARRIES_ON = 0.5
"""Share of a turn that a neighbouring frame must make about the same axis to carry it on. Chosen by hand: a spin
passes, what jumps there and back does not."""

FURTHEST_RATIO = 1.1
"""Most that a joint of a dance moves in a frame, over the fastest frame of the clips shown. Chosen by hand: a blend
adds a little to what both clips move."""

UNSEEN_STEP_M_PER_S = 0.5
"""Speed of a joint that is none to speak of, however still the clips stand. Chosen by hand: that of a slow hand."""


@dataclass(frozen=True)
class OneFrameFlip:
    """A joint that turns too far between two frames.

    Parameters
    ----------
    frame : int, the second of them, >= 1
    joint : int
    turn_rad : float, radians, how far it turns
    is_of_body : bool
        Whether it turns so in the world alone, not against its parent.
    """

    frame: int
    joint: int
    turn_rad: float
    is_of_body: bool = False


def find_flips(rotation_wxyz: Float, parent: Int, frame_rate_hz: float) -> list[OneFrameFlip]:
    """Find where joints flip.

    Parameters
    ----------
    rotation_wxyz : (F, J, 4) float, unit, local to the parent
        Every joint counts, those at the ends as well.
    parent : (J,) int64, each before its children, -1 for the root
    frame_rate_hz : float, > 0

    Returns
    -------
    list of OneFrameFlip
        By frame, then joint; empty for fewer than two frames. A joint that only follows its parent's flip in the world
        is left out.

    Raises
    ------
    ValueError
        If the shape is not (F, J, 4) for the parents given, or the rate is not > 0.
    """
    if rotation_wxyz.ndim != 3 or rotation_wxyz.shape[1:] != (len(parent), 4):
        raise ValueError(f"rotation_wxyz: want (F, {len(parent)}, 4), got {rotation_wxyz.shape}")
    if not frame_rate_hz > 0:
        raise ValueError(f"frame_rate_hz: want > 0, got {frame_rate_hz}")
    if len(rotation_wxyz) < 2:
        return []
    local = np.asarray(rotation_wxyz, np.float64)
    limit_rad = FASTEST_TURN_RAD_PER_S / frame_rate_hz
    bent = rotation.angle_between(local[:-1], local[1:])
    bent[:, parent < 0] = 0.0
    orientation = np.zeros_like(local)
    for joint, above in enumerate(parent.tolist()):
        own = local[:, joint]
        orientation[:, joint] = own if above < 0 else rotation.mul(orientation[:, above], own)
    turn = rotation.log(rotation.mul(orientation[1:], rotation.inv(orientation[:-1])))
    turned = np.linalg.norm(turn, axis=-1)
    is_alone = (turned > limit_rad) & ~_is_carried_on(turn, turned)
    follows = is_alone[:, np.maximum(parent, 0)] & (parent >= 0)
    is_bent = bent > limit_rad
    is_flip = is_bent | (is_alone & ~follows)
    return [
        OneFrameFlip(f + 1, j, float(bent[f, j] if is_bent[f, j] else turned[f, j]), bool(not is_bent[f, j]))
        for f, j in np.argwhere(is_flip).tolist()
    ]


def _is_carried_on(turn: Float, turned: Float) -> Bool:
    """Whether a neighbouring frame turns a joint on, (F - 1, J), from turns in the world (F - 1, J, 3)."""
    along = (turn[1:] * turn[:-1]).sum(axis=-1)
    out = np.zeros(turned.shape, bool)
    out[1:] |= along > CARRIES_ON * turned[1:] ** 2
    out[:-1] |= along > CARRIES_ON * turned[:-1] ** 2
    return out


def flip_measure(flips: Sequence[OneFrameFlip]) -> Measure:
    """Count the flips of a dance: none is wanted.

    Parameters
    ----------
    flips : from :func:`find_flips`

    Returns
    -------
    Measure ``one_frame_flip_count``
    """
    return Measure("one_frame_flip_count", float(len(flips)), "0", not flips)


@dataclass(frozen=True)
class FurthestMove:
    """The furthest that a joint of a dance moves in a frame.

    Parameters
    ----------
    frame : int, the second of two
    joint : int
    speed_m_per_s : float
    ratio : float, over the fastest of the clips shown
    """

    frame: int
    joint: int
    speed_m_per_s: float
    ratio: float


def furthest_move(
    dance: Dance,
    steps: Choreography,
    clips: Mapping[str, Clip],
    *,
    skeleton: Skeleton,
    fenced: Mapping[str, Bool] | None = None,
) -> FurthestMove | None:
    """Find the fastest joint of a dance, against the fastest of the clips shown, at the dance's pace.

    Parameters
    ----------
    dance, steps, clips, skeleton : as :func:`kernels.assembly.blend.assemble` has them
    fenced : by clip, (F,) bool of its frames that are never shown and therefore do not count; None for none

    Returns
    -------
    FurthestMove or None
        None for a dance of fewer than two frames. Clips that hardly move count as :data:`UNSEEN_STEP_M_PER_S`.
    """
    if len(dance.time_s) < 2:
        return None
    moved = np.linalg.norm(np.diff(dance.position_xyz_m, axis=0), axis=-1)
    frame, joint = np.unravel_index(int(moved.argmax()), moved.shape)
    allowed_m = UNSEEN_STEP_M_PER_S / dance.frame_rate_hz
    for clip_id, step_s in _paces(dance, steps).items():
        mask = None if fenced is None else fenced.get(clip_id)
        allowed_m = max(allowed_m, _longest_step_m(clips[clip_id], step_s, skeleton, mask))
    furthest_m = float(moved.max())
    return FurthestMove(int(frame) + 1, int(joint), furthest_m * dance.frame_rate_hz, furthest_m / allowed_m)


def move_measure(found: FurthestMove | None) -> Measure:
    """Judge the furthest move of a dance.

    Parameters
    ----------
    found : FurthestMove, or None for a dance too short to have one

    Returns
    -------
    Measure ``fastest_joint_ratio``, 0 where there is none
    """
    ratio = 0.0 if found is None else found.ratio
    return Measure("fastest_joint_ratio", ratio, f"at most {FURTHEST_RATIO:.1f}", ratio <= FURTHEST_RATIO)


def _paces(dance: Dance, steps: Choreography) -> dict[str, float]:
    """Most seconds of each clip that a frame of the dance passes."""
    per_frame = np.diff(clock(steps).at(dance.time_s))
    out: dict[str, float] = {}
    for step in (dance.lineage.step_index[1:], dance.lineage.blend_step_index[1:]):
        for index in np.unique(step[step >= 0]).tolist():
            clip_id = steps.clip_id[index]
            out[clip_id] = max(out.get(clip_id, 0.0), float(per_frame[step == index].max()))
    return out


def _longest_step_m(clip: Clip, step_s: float, skeleton: Skeleton, fenced: Bool | None) -> float:
    """Furthest that a joint of a clip moves in a time, metres, over frames that may be shown; 0 for none."""
    time_s = np.arange(0.0, clip.duration_s, step_s / 2)  # half steps: no fast frame falls between two samples
    if len(time_s) < 3:
        return 0.0
    position, _ = kinematics.forward(skeleton, *sample(clip, time_s))
    moved = np.linalg.norm(position[2:] - position[:-2], axis=-1).max(axis=-1)
    if fenced is not None:
        at = np.clip(np.round(time_s * clip.frame_rate_hz).astype(int), 0, clip.n_frames - 1)
        bad = fenced[at]
        moved = moved[~(bad[2:] | bad[1:-1] | bad[:-2])]
    return float(moved.max(initial=0.0))
