import numpy as np
import pytest

from kernels import rotation
from kernels.calibration.records import PARENT, SENSORS
from kernels.synthetic import suit_performer


@pytest.fixture(scope="module")
def clean():
    return suit_performer.made_up(3, n_frames=900, disturbance=suit_performer.CLEAN)


def test_sensors_meet_at_the_joints_to_rounding(clean):
    p, q = clean.recording.position_xyz_m, clean.recording.rotation_wxyz
    for c in range(1, 17):
        a = PARENT[c]
        one = p[:, a] + rotation.apply(q[:, a], clean.body.in_parent_sensor_m[c - 1])
        other = p[:, c] + rotation.apply(q[:, c], clean.body.in_child_sensor_m[c - 1])
        np.testing.assert_allclose(one, other, atol=1e-12)
        np.testing.assert_allclose(one, clean.joint_xyz_m[:, c], atol=1e-12)


def test_it_opens_in_a_t_pose(clean):
    still = clean.joint_xyz_m[:240]
    assert np.ptp(still, axis=0).max() < 1e-12
    at = {name: still[0, k] for k, name in enumerate(SENSORS)}
    assert abs(at["l_hand"][2] - at["l_upper_arm"][2]) < 0.05
    assert at["l_hand"][1] > at["l_upper_arm"][1] + 0.4
    assert np.ptp(clean.joint_xyz_m[:, 4:7], axis=0).max() > 0.3


def test_noise_is_as_told():
    how = suit_performer.Disturbance(0.003, np.radians(2.0), 0.0, 0.0, 0.0)
    made = suit_performer.made_up(3, n_frames=2000, disturbance=how)
    assert (made.recording.position_xyz_m - made.sensor_xyz_m).std() == pytest.approx(0.003, rel=0.02)
    turned = rotation.log(rotation.mul(made.recording.rotation_wxyz, rotation.inv(made.sensor_wxyz)))
    assert np.degrees(turned.std()) == pytest.approx(2.0, rel=0.02)


def test_wobble_outliers_and_gaps_are_as_told():
    how = suit_performer.Disturbance(0.0, 0.0, 0.01, 0.02, 0.03)
    made = suit_performer.made_up(3, n_frames=5000, disturbance=how)
    assert made.is_outlier.mean() == pytest.approx(0.02, rel=0.2)
    assert (~made.recording.is_valid).mean() == pytest.approx(0.03, rel=0.2)
    assert np.isnan(made.recording.position_xyz_m[~made.recording.is_valid]).all()
    good = made.recording.is_valid & ~made.is_outlier
    off = np.linalg.norm(made.recording.position_xyz_m - made.sensor_xyz_m, axis=-1)
    for name, factor in (("r_forearm", 1.0), ("l_thigh", 1.5), ("head", 0.2)):
        k = SENSORS.index(name)
        assert np.sqrt(np.mean(off[good[:, k], k] ** 2)) == pytest.approx(0.01 * factor, rel=0.15)


def test_distortion_is_smooth_and_of_its_size():
    made = suit_performer.made_up(
        3, n_frames=900, disturbance=suit_performer.Disturbance(0, 0, 0, 0, 0, distortion_m=0.01)
    )
    off = made.recording.position_xyz_m - made.sensor_xyz_m
    assert 0.003 < np.sqrt(np.mean(np.sum(off**2, -1))) < 0.03
    assert np.linalg.norm(np.diff(off, axis=0), axis=-1).max() < 0.003


def test_same_seed_same_body_and_motion_whatever_the_noise(clean):
    noisy = suit_performer.made_up(3, n_frames=900)
    np.testing.assert_array_equal(noisy.joint_xyz_m, clean.joint_xyz_m)
    again = suit_performer.made_up(3, n_frames=900)
    np.testing.assert_array_equal(noisy.recording.position_xyz_m, again.recording.position_xyz_m)
    assert np.abs(suit_performer.made_up(4, n_frames=900).joint_xyz_m - clean.joint_xyz_m).max() > 0.1


def test_frozen_and_hinged_joints():
    motion = suit_performer.range_of_motion(3, n_frames=900, frozen=("head",), hinged=("l_shank",))
    np.testing.assert_array_equal(motion.local_wxyz[:, SENSORS.index("head"), 1:], 0.0)
    shank = motion.local_wxyz[:, SENSORS.index("l_shank")]
    np.testing.assert_array_equal(shank[:, [1, 3]], 0.0)
    assert np.abs(shank[:, 2]).max() > 0.2


def test_exchanging_twice_changes_nothing(clean):
    once = suit_performer.swap(clean.recording, {"head": "l_foot"})
    np.testing.assert_array_equal(once.position_xyz_m[:, 2], clean.recording.position_xyz_m[:, SENSORS.index("l_foot")])
    np.testing.assert_array_equal(
        suit_performer.swap(once, {"head": "l_foot"}).rotation_wxyz, clean.recording.rotation_wxyz
    )


def test_no_frames():
    assert suit_performer.made_up(1, n_frames=0).recording.n_frames == 0
