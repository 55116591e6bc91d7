from dataclasses import replace

import numpy as np
import pytest

from kernels.calibration.calibrate import bone_lengths, calibrate
from kernels.calibration.cleaning import clean
from kernels.calibration.records import JOINTS, PARENT, SENSORS
from kernels.synthetic import suit_performer


def test_joints_of_a_made_up_body(made, calibration):
    assert tuple(joint.joint for joint in calibration.joints) == JOINTS
    assert [joint.parent for joint in calibration.joints] == [SENSORS[k] for k in PARENT[1:]]
    truth = bone_lengths(made.body.in_parent_sensor_m, made.body.in_child_sensor_m)
    off_mm = 1000 * np.abs([joint.length_m for joint in calibration.joints] - truth)
    assert np.median(off_mm) < 0.6
    assert off_mm.max() < 3
    assert calibration.findings == ()
    assert calibration.residual_m.shape == (3000, 16)
    assert {joint.rank for joint in calibration.joints} == {3}


def test_lengths_are_those_of_the_bones(made):
    got = bone_lengths(made.body.in_parent_sensor_m, made.body.in_child_sensor_m)
    offset = made.body.offset_m
    for name in ("l_forearm", "r_hand", "l_shank", "head", "l_upper_arm"):
        np.testing.assert_allclose(got[JOINTS.index(name)], np.linalg.norm(offset[SENSORS.index(name)]))
    hips = offset[[SENSORS.index("l_thigh"), SENSORS.index("r_thigh")]]
    np.testing.assert_allclose(got[JOINTS.index("l_thigh")], np.linalg.norm(hips[0] - hips[1]) / 2)


def test_the_world_does_not_matter(made, cleaned, calibration):
    moved = replace(
        cleaned,
        recording=replace(
            cleaned.recording, position_xyz_m=cleaned.recording.position_xyz_m + np.array([3.0, -2.0, 1.0])
        ),
    )
    again = calibrate(moved)
    np.testing.assert_allclose(again.in_parent_sensor_m, calibration.in_parent_sensor_m, atol=1e-8)


def test_the_same_bits_twice(cleaned, calibration):
    again = calibrate(cleaned)
    np.testing.assert_array_equal(again.in_child_sensor_m, calibration.in_child_sensor_m)
    assert again.findings == calibration.findings


def test_joints_are_given_to_ten_nanometres(calibration):
    for joint in calibration.joints:
        for place in (joint.in_parent_sensor_m, joint.in_child_sensor_m):
            np.testing.assert_array_equal(place, np.round(place, 8))  # so that no last bits of a processor's are left


def test_what_is_rated_high_is_near():
    made = suit_performer.made_up(41, n_frames=4000, disturbance=suit_performer.Disturbance(wobble_m=0.01))
    found = calibrate(clean(made.recording))
    off = np.linalg.norm(found.in_child_sensor_m - made.body.in_child_sensor_m, axis=-1)
    assert all(off[k] < 0.03 for k, joint in enumerate(found.joints) if joint.confidence == "high")
    assert any(joint.advice for joint in found.joints if joint.confidence != "high")


def test_other_sensors_are_refused(cleaned):
    fewer = replace(cleaned, recording=replace(cleaned.recording, sensors=(*SENSORS[:-1], "tail")))
    with pytest.raises(ValueError, match="sensors: want pelvis"):
        calibrate(fewer)


def test_every_joint_tells_how_far_it_moved(cleaned):
    """Elbows and knees about one axis at least; the range is none of a joint that never moved alone."""
    for joint in calibrate(cleaned).joints:
        assert np.isfinite(joint.range_of_motion_rad).all(), joint.joint
        assert joint.range_of_motion_rad.max() > 0.1, joint.joint
