"""How far a joint can be trusted, in one word, and what the performer can do about it."""

from __future__ import annotations

import numpy as np

from kernels.calibration.body_faults import move_to_repeat
from kernels.calibration.records import Confidence

_LOW_DEG = 4.0
_MEDIUM_DEG = 6.0
"""Movement about the weakest axis. Chosen by hand, with the residuals below: measured on six made-up recordings with 5
mm of soft tissue, nine in ten of the joints rated low are within 32 mm, of medium ones within 12 mm, of high ones
within 8.4 mm."""

_LOW_M = 0.008
_MEDIUM_M = 0.004
"""Robust residual, an axis. Chosen by hand, with the angles above."""


def rate(*, rank: int, least_motion_rad: float, residual_sigma_m: float) -> Confidence:
    """Rate a joint.

    Parameters
    ----------
    rank : int, 0 to 3
    least_motion_rad : float, radians
        Range of motion about the weakest direction.
    residual_sigma_m : float, metres
        Robust standard deviation an axis of the distance between its two ends.

    Returns
    -------
    "none", "axis-unobserved", "low", "medium" or "high"
    """
    if rank < 2:
        return "none"
    if rank == 2:
        return "axis-unobserved"
    degrees = float(np.degrees(least_motion_rad))
    if degrees < _LOW_DEG or not residual_sigma_m <= _LOW_M:
        return "low"
    if degrees < _MEDIUM_DEG or residual_sigma_m > _MEDIUM_M:
        return "medium"
    return "high"


def advise(joint: str, *, rank: int, least_motion_rad: float, residual_sigma_m: float) -> str:
    """Say what would make a joint better known; empty where it is rated high.

    Parameters
    ----------
    joint : str, the child segment
    rank, least_motion_rad, residual_sigma_m : as :func:`rate`
    """
    degrees = float(np.degrees(least_motion_rad))
    words = []
    if rank < 2:
        words.append(f"{joint} did not turn ({degrees:.1f} degrees): {move_to_repeat(joint)}")
    elif rank == 2 or degrees < _MEDIUM_DEG:
        words.append(f"{joint} turned only {degrees:.1f} degrees about its weakest axis: {move_to_repeat(joint)}")
    if residual_sigma_m > _MEDIUM_M:
        words.append(f"its sensors slide ({1000 * residual_sigma_m:.0f} mm): strap them tighter, nearer to the bone")
    return "; ".join(words)
