"""The calibration of a suit, to and from its table.

Curves over a clip are kept in at most :data:`N_SPANS` equal spans, enough to look at.
"""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from assets.sources.calibration import Calibrated
from assets.tables import pack
from kernels import rotation
from kernels.calibration.records import JOINTS, SENSORS
from kernels.types import Float
from schemas.calibration import CALIBRATION, CURVE

N_SPANS = 240
"""Values of a curve over a clip. Chosen by hand, enough to look at."""


def from_calibration(clip_id: str, found: Calibrated) -> pa.Table:
    """Pack the calibration of one recording.

    Parameters
    ----------
    clip_id : key of the recording's clip
    found : Calibrated

    Returns
    -------
    table ``calibration``, 16 rows, a joint each
    """
    joints, n = found.calibration.joints, len(JOINTS)
    rest = found.gauge.rest_wxyz[1:]
    in_child = np.stack([joint.in_child_sensor_m for joint in joints])
    before, after = found.poses.gap_before_m, found.poses.gap_after_m
    floats = {
        "length_m": [joint.length_m for joint in joints],
        "residual_rms_m": [joint.residual_rms_m for joint in joints],
        "residual_sigma_m": [joint.residual_sigma_m for joint in joints],
        "conditioning": [joint.conditioning for joint in joints],
        "noise_position_m": found.cleaned.position_noise_m[1:],
        "noise_rotation_rad": found.cleaned.rotation_noise_rad[1:],
        "filled_ratio": found.cleaned.is_filled.mean(axis=0)[1:],
        "outlier_ratio": found.cleaned.n_outliers[1:] / max(found.cleaned.recording.n_frames, 1),
        "span_s": np.full(n, found.clip.duration_s / max(min(N_SPANS, found.clip.n_frames), 1)),
        "gap_before_m": np.sqrt(np.mean(before**2, axis=0)),
        "gap_after_m": after.max(axis=0, initial=0.0),
    }
    columns = {name: pa.array(np.asarray(values, np.float64), pa.float32()) for name, values in floats.items()}
    columns |= {
        "clip_id": pa.array([clip_id] * n, pa.string()),
        "joint_index": pa.array(np.arange(1, n + 1), pa.int32()),
        "joint_name": pa.array([joint.joint for joint in joints], pa.string()),
        "parent_name": pa.array([joint.parent for joint in joints], pa.string()),
        "offset_xyz_m": pack.vector(found.clip.skeleton.offset_xyz_m[1 : len(SENSORS)]),
        "sensor_xyz_m": pack.vector(rotation.apply(rest, -in_child)),
        "sensor_wxyz": pack.quaternion(rest),
        "in_parent_sensor_xyz_m": pack.vector(found.calibration.in_parent_sensor_m),
        "in_child_sensor_xyz_m": pack.vector(in_child),
        "range_of_motion_rad": pack.vector(np.stack([joint.range_of_motion_rad for joint in joints])),
        "rank": pa.array([joint.rank for joint in joints], pa.int32()),
        "confidence_label": pa.array([joint.confidence for joint in joints], pa.string()),
        "advice": pa.array([joint.advice or None for joint in joints], pa.string()),
        "frame_count": pa.array([joint.n_frames for joint in joints], pa.int32()),
        "gap_before_curve_m": _curves(before),
        "gap_after_curve_m": _curves(after),
        "rest_start_frame_index": pa.array([found.gauge.first_frame] * n, pa.int32()),
        "rest_end_frame_index": pa.array([found.gauge.end_frame] * n, pa.int32()),
    }
    return CALIBRATION.check(pa.table([columns[name] for name in CALIBRATION.arrow.names], schema=CALIBRATION.arrow))


def _curves(values: Float) -> pa.Array:
    """Pack (F, 16) as one list a joint: root mean squares of equal spans of frames."""
    n = min(N_SPANS, len(values))
    start = np.linspace(0, len(values), n, endpoint=False).astype(int)
    width = np.diff(np.append(start, len(values)))
    means = np.add.reduceat(values**2, start, axis=0) / width[:, None] if n else np.zeros((0, values.shape[1]))
    return pa.array(list(np.sqrt(means).T.astype(np.float32)), CURVE)


def to_curves(column: pa.ChunkedArray) -> Float:
    """Unpack the curves of one clip's joints.

    Parameters
    ----------
    column : a curve's column of table ``calibration``, rows of one clip

    Returns
    -------
    (16, spans) float64, metres
        Spans as in the table, at most :data:`N_SPANS`; (0,) of no rows.
    """
    return np.array([np.asarray(row, np.float64) for row in column.to_pylist()])
