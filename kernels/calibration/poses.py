"""From a calibrated body and its recording to poses without gaps."""

from __future__ import annotations

from typing import Literal

import numpy as np

from kernels import rotation
from kernels.calibration.records import PARENT, SENSORS, BodyPoses, Calibration, Cleaned
from kernels.calibration.springs import relax_springs
from kernels.calibration.tree_solver import FILLED_WEIGHT, BodyModel, PoseSolver, Stream, make_model, solve_tree
from kernels.types import Float

Method = Literal["gauss_newton", "springs"]


def solve_poses(
    cleaned: Cleaned,
    calibration: Calibration,
    *,
    method: Method = "gauss_newton",
    iterations: int | None = None,
    device: PoseSolver | None = None,
) -> BodyPoses:
    """Bring the bones of a calibrated body to where their sensors are.

    Parameters
    ----------
    cleaned : Cleaned of F frames
    calibration : Calibration
    method : "gauss_newton" or "springs"
        The first closes every joint by construction; the second is the spring relaxation of [Kitsunai2007].
    iterations : int, >= 1, or None for the method's usual: 2 and 30
    device : PoseSolver or None
        A twin from ``kernels.opencl`` that was made for the same method; None for the NumPy reference.

    Returns
    -------
    BodyPoses
        Empty where F is 0.

    Raises
    ------
    ValueError
        If the method is not known, or from :func:`kernels.calibration.tree_solver.check_stream`.
    """
    if method not in ("gauss_newton", "springs"):
        raise ValueError(f"method: want gauss_newton or springs, got {method!r}")
    model = body_model(calibration)
    reference, usual = (solve_tree, 2) if method == "gauss_newton" else (relax_springs, 30)
    solver = reference if device is None else device
    stream = to_stream(cleaned)
    solved = solver(model, stream, iterations=usual if iterations is None else iterations)
    position = solved.position_xyz_m
    before = gaps(
        model, stream.position_xyz_m - rotation.apply(stream.rotation_wxyz, model.sensor_m), stream.rotation_wxyz
    )
    after = gaps(model, position, solved.rotation_wxyz)
    centre = position.copy()
    centre[:, 0] += rotation.apply(solved.rotation_wxyz[:, 0], hip_centre(model))
    return BodyPoses(SENSORS, centre, solved.rotation_wxyz, before, after)


def body_model(calibration: Calibration) -> BodyModel:
    """Build the body as the solvers see it.

    Parameters
    ----------
    calibration : Calibration

    Returns
    -------
    BodyModel
    """
    return make_model(calibration.in_parent_sensor_m, calibration.in_child_sensor_m)


def to_stream(cleaned: Cleaned) -> Stream:
    """Take what the sensors said, interpolated entries at :data:`FILLED_WEIGHT`.

    Parameters
    ----------
    cleaned : Cleaned of F frames

    Returns
    -------
    Stream
    """
    recording = cleaned.recording
    weight = np.where(cleaned.is_filled, FILLED_WEIGHT, 1.0)
    return Stream(recording.position_xyz_m, recording.rotation_wxyz, weight)


def hip_centre(model: BodyModel) -> Float:
    """Take the point midway between the hips: no sensor shows where the pelvis begins.

    Parameters
    ----------
    model : BodyModel

    Returns
    -------
    (3,) float64, metres, in the pelvis's frame
    """
    hips = [SENSORS.index("l_thigh"), SENSORS.index("r_thigh")]
    centre: Float = model.offset_m[hips].mean(axis=0)
    return centre


def gaps(model: BodyModel, position_xyz_m: Float, rotation_wxyz: Float) -> Float:
    """Distance between the two ends at each joint.

    Parameters
    ----------
    model : BodyModel
    position_xyz_m : (F, 17, 3) float, metres
        Origins of the bones: their proximal joints, and the pelvis's sensor.
    rotation_wxyz : (F, 17, 4) float, unit

    Returns
    -------
    (F, 16) float64, metres
    """
    above = list(PARENT[1:])
    end = position_xyz_m[:, above] + rotation.apply(rotation_wxyz[:, above], model.offset_m[1:])
    gap: Float = np.sqrt(np.sum((end - position_xyz_m[:, 1:]) ** 2, axis=-1))
    return gap
