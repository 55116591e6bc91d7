"""Frames that are put right: a cubic over the gap, through good frames on both sides.

Conventions
-----------
A gap is its first and last bad frame, both bad. Its support are two good frames on each side: the next one, and one
about half a gap further, so that noise of the recording does not tilt the curve. Turns are mended in the logarithm of
rotations about the last good frame.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from kernels import rotation
from kernels.types import Float

LONGEST_GAP_S = 0.1
"""Chosen by hand: in a tenth of a second a limb does not turn twice, so that a cubic has its way."""

FEWEST_FRAMES = 3
"""Of the longest gap at low rates. Chosen by hand."""


def longest_gap(frame_rate_hz: float) -> int:
    """Give the longest gap that is mended.

    Parameters
    ----------
    frame_rate_hz : float, > 0

    Returns
    -------
    int, frames, >= :data:`FEWEST_FRAMES`
    """
    return max(FEWEST_FRAMES, round(LONGEST_GAP_S * frame_rate_hz))


def support(first: int, last: int, is_good: NDArray[np.bool_]) -> tuple[int, int, int, int] | None:
    """Find the good frames that carry the curve over a gap.

    Parameters
    ----------
    first, last : int, bad frames at its ends
    is_good : (F,) bool

    Returns
    -------
    Four frames in order, two before and two after; None where one is missing or bad
    """
    reach = 1 + max(1, round((last - first + 1) / 2))
    frames = first - reach, first - 1, last + 1, last + reach
    if frames[0] < 0 or frames[3] >= len(is_good):
        return None
    is_whole = is_good[frames[0] : first].all() and is_good[last + 1 : frames[3] + 1].all()
    return frames if is_whole else None


def bridge_turns(turn_wxyz: Float, frames: tuple[int, int, int, int]) -> Float:
    """Bridge the turns of a joint over a gap.

    Parameters
    ----------
    turn_wxyz : (F, 4) float, of one joint
    frames : from :func:`support`

    Returns
    -------
    (G, 4) float64, in the hemisphere of the frame before
    """
    origin = turn_wxyz[frames[1]]
    vector = rotation.log(rotation.mul(rotation.inv(origin), turn_wxyz[list(frames)]))
    for i in (0, 2, 3):
        vector[i] = _nearest(vector[i], vector[2] if i == 3 else np.zeros(3))
    return rotation.mul(origin, rotation.exp(_cubic(vector, frames)))


def bridge_places(place: Float, frames: tuple[int, int, int, int]) -> Float:
    """Bridge the places of a joint over a gap.

    Parameters
    ----------
    place : (F, 3) float, of one joint
    frames : from :func:`support`

    Returns
    -------
    (G, 3) float64
    """
    return _cubic(place[list(frames)], frames)


def doubt(
    bridge: Callable[[tuple[int, int, int, int]], Float],
    miss: Callable[[int, Float], float],
    first: int,
    last: int,
    is_good: NDArray[np.bool_],
) -> float:
    """Tell how far a curve would be off: that of gaps as long, where the frames are known, before and after this one.

    Parameters
    ----------
    bridge : four frames to the values between the middle two
    miss : first frame and such values to how far they are off the recorded
    first, last : int, the gap
    is_good : (F,) bool

    Returns
    -------
    float
        The larger of both, in the unit of ``miss``; of one where there is only one; infinite where there is none.
    """
    length = last - first + 1
    reach = 1 + max(1, round(length / 2))
    missed = []
    for a in (first - reach - length, last + reach + 1):
        frames = support(a, a + length - 1, is_good) if a >= 0 else None
        if frames is not None and is_good[a : a + length].all():
            missed.append(miss(a, bridge(frames)))
    return max(missed, default=np.inf)


def _nearest(vector: Float, to: Float) -> Float:
    """Choose, of the vectors that mean the same turn, the nearer to another."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-9:
        return vector
    other = vector * (1 - 2 * np.pi / angle)
    return other if np.linalg.norm(other - to) < np.linalg.norm(vector - to) else vector


def _cubic(value: Float, frames: tuple[int, int, int, int]) -> Float:
    """Run a cubic through four values (4, 3) at four frames, at the frames between the middle two."""
    t = np.arange(frames[1] + 1, frames[2], dtype=np.float64)
    out = np.zeros((len(t), value.shape[-1]))
    for i in range(4):
        weight = np.ones(len(t))
        for k in range(4):
            if k != i:
                weight *= (t - frames[k]) / (frames[i] - frames[k])
        out += weight[:, None] * value[i]
    return out
