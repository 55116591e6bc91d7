"""The table of calibrations: what the kernels found, and curves to look at."""

import numpy as np
import pytest

from assets.sources.calibration import calibrate_recording
from assets.tables import pack
from assets.tables.calibration import N_SPANS, from_calibration, to_curves
from kernels import rotation
from kernels.calibration.records import JOINTS, SENSORS
from kernels.skeleton import kinematics
from kernels.synthetic.suit_performer import made_up
from schemas.settings import CalibrationSettings


@pytest.fixture(scope="module")
def found():
    return calibrate_recording(made_up(6, n_frames=1000).recording, settings=CalibrationSettings())


@pytest.fixture(scope="module")
def table(found):
    return from_calibration("s-take", found)


def test_one_row_a_joint(found, table):
    assert table["joint_name"].to_pylist() == list(JOINTS)
    assert table["joint_index"].to_pylist() == list(range(1, 17))
    np.testing.assert_allclose(
        pack.to_array(table["in_parent_sensor_xyz_m"]), found.calibration.in_parent_sensor_m, atol=1e-6
    )
    np.testing.assert_allclose(
        pack.to_numbers(table["length_m"]), [j.length_m for j in found.calibration.joints], atol=1e-6
    )
    assert (pack.to_numbers(table["gap_after_m"]) < 1e-6).all()
    assert table["confidence_label"].to_pylist() == [joint.confidence for joint in found.calibration.joints]
    assert table["advice"].to_pylist() == [joint.advice or None for joint in found.calibration.joints]


def test_sensors_on_the_stored_bones_are_where_they_were(found, table):
    """A bone of the clip and the sensor's place on it from the table give the sensor's place in the world."""
    place, turned = kinematics.place(found.clip)
    sensor_m, sensor = pack.to_array(table["sensor_xyz_m"]), pack.to_array(table["sensor_wxyz"])
    cleaned, up = found.cleaned.recording, found.gauge.up_wxyz
    for k in (3, 8, 16):
        seen = place[:, k] + rotation.apply(turned[:, k], sensor_m[k - 1])
        said = rotation.apply(up, cleaned.position_xyz_m[:, k])
        assert np.sqrt(np.mean(np.sum((seen - said) ** 2, -1))) < 0.006, SENSORS[k]
        facing = rotation.mul(turned[:, k], sensor[k - 1])
        told = rotation.mul(up, cleaned.rotation_wxyz[:, k])
        assert np.median(rotation.angle_between(facing, told)) < 0.02, SENSORS[k]


def test_offsets_are_the_skeletons(found, table):
    np.testing.assert_allclose(pack.to_array(table["offset_xyz_m"]), found.clip.skeleton.offset_xyz_m[1:17], atol=1e-6)


def test_curves_keep_the_mean_square(found, table):
    before = to_curves(table["gap_before_curve_m"])
    assert before.shape == (16, N_SPANS)
    np.testing.assert_allclose(np.sqrt((before**2).mean(1)), np.sqrt((found.poses.gap_before_m**2).mean(0)), rtol=0.05)
    assert table["span_s"][0].as_py() * N_SPANS == pytest.approx(found.clip.duration_s, rel=1e-5)


def test_same_recording_same_table(found, table):
    assert from_calibration("s-take", found).equals(table)
