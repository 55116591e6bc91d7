import numpy as np
import pytest

from kernels.calibration.records import JOINTS, PARENT, PARENT_SENSOR, SENSORS, Recording


def test_seventeen_sensors_parents_first():
    assert len(SENSORS) == 17
    assert SENSORS[0] == "pelvis"
    assert all(PARENT[k] < k for k in range(17))
    assert SENSORS[1:] == JOINTS
    assert PARENT_SENSOR["l_shoulder"] == "thorax"
    assert PARENT_SENSOR["r_upper_arm"] == "r_shoulder"
    assert PARENT_SENSOR["l_thigh"] == "pelvis"
    assert PARENT_SENSOR["r_foot"] == "r_shank"


def recording(**changes):
    fields = {
        "frame_rate_hz": 60.0,
        "sensors": ("a", "b"),
        "position_xyz_m": np.zeros((5, 2, 3)),
        "rotation_wxyz": np.zeros((5, 2, 4)),
        "is_valid": np.ones((5, 2), bool),
    }
    return Recording(**(fields | changes))


def test_a_recording_counts_its_frames():
    assert recording().n_frames == 5
    with pytest.raises(ValueError, match="position_xyz_m: want"):
        recording(position_xyz_m=np.zeros((5, 3, 3)))
    with pytest.raises(ValueError, match="is_valid: want"):
        recording(is_valid=np.ones(5, bool))
    with pytest.raises(ValueError, match="no name twice"):
        recording(sensors=("a", "a"))
    with pytest.raises(ValueError, match="frame_rate_hz"):
        recording(frame_rate_hz=0.0)
