"""Gaps that an exporter filled: the whole body goes in straight lines from one recorded frame to another.

Conventions
-----------
Exporters fill gaps channel by channel, so that every joint goes on turning, and the root moving, at a constant pace.
Steps are taken over a 30th of a second, whatever the rate, so that noise and smoothness are those of bodies at 30 Hz.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels import rotation
from kernels.health.body_in_motion import BodyInMotion
from kernels.health.verdicts import ClipFault
from kernels.runs import runs_of

_PACE_RATIO = 0.01
"""How much a turn at constant pace changes from step to step. Chosen by hand: the last digits of a file; bodies change
theirs by a tenth and more."""

_EULER_RATIO = 0.7
"""How much a turn changes, over its square in radians, where angles and not rotations go at a constant pace. Chosen by
hand; by the products of two angles' paces it is at most 1."""

_MOST_EULER_DEG = 3.0
"""Turn in a step up to which its square counts; above, smooth motion would pass for filled. Chosen by hand."""

_RESOLUTION_DEG = 0.02
"""Sum over all joints that rounding in a file may come to. Chosen by hand."""

_LIVE_DEG = 0.03
_FEWEST_LIVE = 8
"""Turn of a joint in a 30th of a second from which it is alive, and how many are in a recorded body. Chosen by hand: a
drawn or made-up one may well move an arm alone, evenly."""

_MOVING_DEG = 0.5
"""Sum of all joints' turns in a 30th of a second from which there is motion to be filled; a centimetre of the hips
counts as a degree. Chosen by hand."""

_SHORTEST_S = 0.25
"""Chosen by hand: shorter, a body may well go straight on. In 334 clean takes nothing else is longer than 0.1."""


def straight_fills(body: BodyInMotion) -> list[ClipFault]:
    """Find gaps filled in straight lines.

    Parameters
    ----------
    body : BodyInMotion

    Returns
    -------
    list of ClipFault
        Fenced, by frame.
    """
    clip, rate_hz = body.clip, body.clip.frame_rate_hz
    stride = max(round(rate_hz / 30.0), 1)
    if clip.n_frames < max(_SHORTEST_S * rate_hz, 2 * stride + 1):
        return []
    faults = []
    for first, last in runs_of(_is_straight(body, stride)).tolist():
        end = last + 2 * stride
        if (end - first) / rate_hz >= _SHORTEST_S:
            said = (
                f"every joint goes on at the same pace for {(end - first) / rate_hz:.2f} s from {body.at_s(first)}: "
                "a gap that was filled with straight lines; not shown; fill it where it was recorded"
            )
            faults.append(ClipFault("gap", "", first, end, "fenced", said))
    return faults


def _is_straight(body: BodyInMotion, stride: int) -> NDArray[np.bool_]:
    """Whether the two steps from each frame on are alike in every joint, (F - 2 stride,)."""
    step = body.step_deg
    if stride > 1:
        turn = body.clip.rotation_wxyz[:, body.needed]
        step = np.degrees(rotation.log(rotation.mul(rotation.inv(turn[:-stride]), turn[stride:])))
    way = 100.0 * (body.hips[stride:] - body.hips[:-stride])
    size = np.linalg.norm(step, axis=-1)[:-stride]
    paced = np.linalg.norm(way, axis=-1)[:-stride]
    change = np.linalg.norm(step[stride:] - step[:-stride], axis=-1)
    strayed = np.linalg.norm(way[stride:] - way[:-stride], axis=-1)
    allowed = (_PACE_RATIO + _EULER_RATIO * np.radians(np.minimum(size, _MOST_EULER_DEG))) * size
    # The limbs by themselves too: whoever spins evenly turns in the world by far more than limbs ever do in the spin.
    is_limb = np.array([k > body.at["hips"] for k in body.needed])
    limbs_go_on = change[:, is_limb].sum(axis=1) < allowed[:, is_limb].sum(axis=1) + _RESOLUTION_DEG
    all_go_on = change.sum(axis=1) + strayed < allowed.sum(axis=1) + 2 * _PACE_RATIO * paced + _RESOLUTION_DEG
    is_alive = ((size > _LIVE_DEG).sum(axis=1) >= _FEWEST_LIVE) & (size.sum(axis=1) + paced > _MOVING_DEG)
    return np.asarray(limbs_go_on & all_go_on & is_alive, np.bool_)
