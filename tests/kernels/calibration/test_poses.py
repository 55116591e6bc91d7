import numpy as np
import pytest

from kernels.calibration.poses import solve_poses
from kernels.calibration.records import SENSORS


def test_poses_are_near_the_truth_and_closed(made, poses):
    off = 1000 * np.linalg.norm(poses.position_xyz_m[:, 1:] - made.joint_xyz_m[:, 1:], axis=-1)
    assert np.sqrt(np.mean(off**2)) < 2.0
    assert np.quantile(off, 0.99) < 5.0
    assert poses.gap_after_m.max() < 1e-9
    assert np.sqrt(np.mean(poses.gap_before_m**2)) > 1e-3
    assert poses.joints == SENSORS


def test_the_pelvis_is_midway_between_the_hips(poses):
    hips = poses.position_xyz_m[:, [SENSORS.index("l_thigh"), SENSORS.index("r_thigh")]]
    np.testing.assert_allclose(poses.position_xyz_m[:, 0], hips.mean(axis=1), atol=1e-9)


def test_bones_keep_their_lengths(poses, calibration):
    shank = poses.position_xyz_m[:, SENSORS.index("l_foot")] - poses.position_xyz_m[:, SENSORS.index("l_shank")]
    length = next(joint.length_m for joint in calibration.joints if joint.joint == "l_foot")
    np.testing.assert_allclose(np.linalg.norm(shank, axis=-1), length, atol=1e-9)


def test_springs_are_an_option_and_leave_gaps(cleaned, calibration):
    found = solve_poses(cleaned, calibration, method="springs", iterations=10)
    rms = np.sqrt(np.mean(found.gap_after_m**2))
    assert 1e-5 < rms < np.sqrt(np.mean(found.gap_before_m**2))


def test_another_method_is_refused(cleaned, calibration):
    with pytest.raises(ValueError, match="method: want gauss_newton or springs"):
        solve_poses(cleaned, calibration, method="magic")
    with pytest.raises(ValueError, match="iterations"):
        solve_poses(cleaned, calibration, iterations=0)
