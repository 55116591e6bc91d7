"""What a fault looks like: how fast its joint turns, frame by frame, around it."""

from __future__ import annotations

import numpy as np

from kernels import rotation
from kernels.health.verdicts import ClipFault
from kernels.types import Clip, Float

REACH_S = 0.4
"""Seconds shown before and after a fault. Chosen by hand, for looking at."""

LONGEST_S = 2.0
"""Seconds shown of a longer fault: its beginning. Chosen by hand, for looking at."""


def turn_rad_per_s(clip: Clip, joint: str) -> Float:
    """Measure how fast a joint turns against its parent; the root in the world.

    Parameters
    ----------
    clip : Clip of F frames
    joint : name; "" for the fastest of all joints, frame by frame

    Returns
    -------
    (F,) float64, radians per second
        From the frame before to each frame; the first has the value of the second, 0 where there is only one.

    Raises
    ------
    ValueError
        If the clip has no such joint.
    """
    turned = clip.rotation_wxyz if not joint else clip.rotation_wxyz[:, [clip.skeleton.index(joint)]]
    if clip.n_frames < 2:
        return np.zeros(clip.n_frames)
    step = rotation.angle_between(turned[:-1], turned[1:]).max(axis=1) * clip.frame_rate_hz
    return np.append(step[0], step)


def around(fault: ClipFault, clip: Clip) -> tuple[int, Float]:
    """Take how fast a fault's joint turns around it.

    Parameters
    ----------
    fault : of the clip
    clip : as it was recorded, F frames

    Returns
    -------
    first : int, frame of the first value
    (N,) float64, radians per second, a value a frame
    """
    reach = round(REACH_S * clip.frame_rate_hz)
    first = max(fault.first - reach, 0)
    last = min(fault.last, fault.first + round(LONGEST_S * clip.frame_rate_hz)) + reach
    return first, turn_rad_per_s(clip, fault.joint)[first : last + 1]
