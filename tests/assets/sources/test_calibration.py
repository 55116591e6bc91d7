"""From a file to a calibrated body, and what stops it."""

from dataclasses import replace

import numpy as np
import pytest

from assets.formats import suit
from assets.sources.calibration import CalibrationError, calibrate_file, calibrate_recording, in_order, up_axis
from kernels.calibration.records import SENSORS, Recording
from kernels.synthetic.suit_performer import made_up
from schemas.settings import CalibrationSettings

USUAL = CalibrationSettings()


@pytest.fixture(scope="module")
def made():
    return made_up(3, n_frames=1200)


@pytest.fixture(scope="module")
def found(made):
    return calibrate_recording(made.recording, settings=USUAL)


def test_joints_lie_where_they_are(made, found):
    away = np.linalg.norm(found.poses.position_xyz_m[:, 1:] - made.joint_xyz_m[:, 1:], axis=-1)
    assert np.sqrt(np.mean(away**2)) < 0.004
    assert found.poses.gap_after_m.max() < 1e-9
    assert set(found.seconds) == {"clean", "calibrate", "poses", "clip"}
    assert up_axis(found.gauge) == "Z"


def test_order_and_names_of_sensors_in_the_file_mean_nothing(made, found, tmp_path):
    back = made.recording
    order = list(range(16, -1, -1))
    turned = Recording(
        back.frame_rate_hz,
        tuple(SENSORS[k] for k in order),
        back.position_xyz_m[:, order],
        back.rotation_wxyz[:, order],
        back.is_valid[:, order],
    )
    place = tmp_path / "take.parquet"
    place.write_bytes(suit.format_parquet(turned))
    again = calibrate_file(place, settings=USUAL)
    np.testing.assert_allclose(again.poses.position_xyz_m, found.poses.position_xyz_m, atol=1e-12)
    assert again.seconds["read"] > 0


def test_settings_reach_the_kernels(made, found):
    rough = calibrate_recording(made.recording, settings=replace(USUAL, low_pass_hz=40.0))
    assert not np.allclose(rough.poses.position_xyz_m, found.poses.position_xyz_m, atol=1e-5)
    once = calibrate_recording(made.recording, settings=replace(USUAL, iterations=1))
    assert 1e-7 < np.abs(once.poses.position_xyz_m - found.poses.position_xyz_m).max() < 0.05
    springs = calibrate_recording(made.recording, settings=replace(USUAL, method="springs"))
    assert springs.poses.gap_after_m.max() > 1e-5  # springs leave gaps, the tree none


def test_the_solver_that_is_asked_for_is_used(made, tmp_path):
    place = tmp_path / "take.parquet"
    place.write_bytes(suit.format_parquet(made.recording))
    asked = []
    calibrate_file(place, settings=USUAL, solvers=lambda method: asked.append(method))
    assert asked == ["gauss_newton"]


def test_two_sensors_are_no_suit(made):
    two = replace(
        made.recording,
        sensors=("1", "2"),
        position_xyz_m=made.recording.position_xyz_m[:, :2],
        rotation_wxyz=made.recording.rotation_wxyz[:, :2],
        is_valid=made.recording.is_valid[:, :2],
    )
    with pytest.raises(CalibrationError, match=r"want the 17 of a suit, got 2 \(1, 2\)"):
        in_order(two)


def test_a_stranger_and_a_missing_sensor_are_named(made):
    names = tuple("l_thig" if name == "l_thigh" else name for name in SENSORS)
    with pytest.raises(CalibrationError) as refused:
        in_order(replace(made.recording, sensors=names))
    assert [f.sensor for f in refused.value.findings] == ["l_thig", "l_thigh"]
    assert "did you mean 'l_thigh'?" in str(refused.value)


def test_a_joint_that_did_not_move_stops_it_but_the_others_are_told():
    with pytest.raises(CalibrationError, match="head") as refused:
        calibrate_recording(made_up(3, n_frames=1200, frozen=("head",)).recording, settings=USUAL)
    joints = {joint.joint: joint for joint in refused.value.calibration.joints}
    assert joints["head"].rank < 2
    assert joints["l_forearm"].rank == 3


def test_a_fault_of_values_stops_it_before_anything_is_computed(made):
    broken = made.recording.position_xyz_m.copy()
    broken[700, SENSORS.index("l_foot")] = np.nan
    valid = made.recording.is_valid.copy()
    valid[700, SENSORS.index("l_foot")] = True
    with pytest.raises(CalibrationError, match="l_foot") as refused:
        calibrate_recording(replace(made.recording, position_xyz_m=broken, is_valid=valid), settings=USUAL)
    assert refused.value.calibration is None
    assert refused.value.findings[0].frame_index == 700
