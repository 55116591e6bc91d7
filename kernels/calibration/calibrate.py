"""A cleaned recording becomes a calibrated body."""

from __future__ import annotations

import numpy as np

from kernels.calibration.body_faults import find_body_faults
from kernels.calibration.bundle import adjust
from kernels.calibration.confidence import advise, rate
from kernels.calibration.joints import PairSolution, solve_joints
from kernels.calibration.records import JOINTS, PARENT, SENSORS, Calibration, Cleaned, JointEstimate
from kernels.types import Float

_DECIMALS = 8
"""Of metres. Chosen between the last bits of linear algebra, measured on three of its kernels as 4e-14 m at most, and
the smallest error on a recording without noise, a thousand times as large."""


def calibrate(cleaned: Cleaned, *, has_adjustment: bool = True) -> Calibration:
    """Find the joints of a body from its sensors.

    Parameters
    ----------
    cleaned : Cleaned of the 17 sensors in their order
    has_adjustment : bool
        Whether whole poses are fitted after the joints were solved one by one (:mod:`kernels.calibration.bundle`).

    Returns
    -------
    Calibration
        Where a finding is an error, the joints are what could be computed all the same, for looking at only.

    Raises
    ------
    ValueError
        If the sensors are not the 17 in their order.
    """
    if cleaned.recording.sensors != SENSORS:
        raise ValueError(
            f"sensors: want {', '.join(SENSORS)} in this order, got {', '.join(cleaned.recording.sensors)}; "
            "see the findings of check_recording"
        )
    pairs = solve_joints(cleaned)
    if has_adjustment:
        in_parent, in_child = adjust(cleaned, pairs)
    else:
        in_parent = np.stack([pair.in_parent_m for pair in pairs])
        in_child = np.stack([pair.in_child_m for pair in pairs])
    # what linear algebra leaves at 1e-15 m is the processor's own, and would show in all poses made from it
    in_parent, in_child = np.round(in_parent, _DECIMALS), np.round(in_child, _DECIMALS)
    length = bone_lengths(in_parent, in_child)
    joints = tuple(
        _estimate(name, pair, in_parent[k], in_child[k], float(length[k]))
        for k, (name, pair) in enumerate(zip(JOINTS, pairs, strict=True))
    )
    findings = (*cleaned.findings, *find_body_faults(cleaned, pairs))
    return Calibration(joints, findings, np.stack([pair.residual_m for pair in pairs], axis=1))


def bone_lengths(in_parent_sensor_m: Float, in_child_sensor_m: Float) -> Float:
    """Measure from the parent's own joint (midway between the hips for the pelvis) to each joint.

    Parameters
    ----------
    in_parent_sensor_m, in_child_sensor_m : (16, 3) float, metres
        Joints in the frames of their two sensors.

    Returns
    -------
    (16,) float64, metres
    """
    hips = [JOINTS.index("l_thigh"), JOINTS.index("r_thigh")]
    start = np.concatenate([in_parent_sensor_m[hips].mean(axis=0)[None], in_child_sensor_m])
    way = in_parent_sensor_m - start[list(PARENT[1:])]
    length: Float = np.sqrt(np.sum(way * way, axis=-1))
    return length


def _estimate(name: str, pair: PairSolution, in_parent: Float, in_child: Float, length_m: float) -> JointEstimate:
    used = pair.weight > 0
    range_of_motion = np.sqrt(2 * np.maximum(pair.spread, 0))
    least = float(range_of_motion[-1])
    return JointEstimate(
        joint=name,
        parent=SENSORS[PARENT[SENSORS.index(name)]],
        length_m=length_m,
        in_parent_sensor_m=in_parent,
        in_child_sensor_m=in_child,
        confidence=rate(rank=pair.rank, least_motion_rad=least, residual_sigma_m=pair.sigma_m),
        rank=pair.rank,
        residual_rms_m=float(np.sqrt(np.mean(pair.residual_m[used] ** 2))) if used.any() else float("nan"),
        residual_sigma_m=pair.sigma_m,
        conditioning=float(np.sqrt((2 - pair.spread[-1]) / max(pair.spread[-1], 1e-12))),
        range_of_motion_rad=range_of_motion,
        n_frames=int(used.sum()),
        advice=advise(name, rank=pair.rank, least_motion_rad=least, residual_sigma_m=pair.sigma_m),
    )
