from dataclasses import replace

import numpy as np
import pytest

from kernels.calibration.cleaning import clean
from kernels.calibration.joint_outliers import judge_by_joints
from kernels.calibration.records import SENSORS
from kernels.synthetic import suit_performer

HAND, FOREARM = SENSORS.index("l_hand"), SENSORS.index("l_forearm")


@pytest.fixture(scope="module")
def quiet():
    """With noise, but without outliers or drop-outs."""
    noise = suit_performer.Disturbance(outlier_ratio=0.0, dropped_ratio=0.0)
    recording = suit_performer.made_up(9, n_frames=1500, disturbance=noise).recording
    return recording.position_xyz_m, recording.rotation_wxyz, recording.is_valid


def test_what_moves_with_its_neighbours_is_no_outlier(quiet):
    position, turned, is_valid = quiet
    suspected = np.zeros_like(is_valid)
    suspected[400:420, HAND] = True
    assert not judge_by_joints(position, turned, is_valid, suspected).any()


@pytest.mark.parametrize("sensor", [0, FOREARM, HAND])
def test_the_sensor_that_tears_its_joints_is_blamed_alone(quiet, sensor):
    position, turned, is_valid = quiet
    position = position.copy()
    position[700:703, sensor] += [0.1, -0.05, 0.08]
    found = judge_by_joints(position, turned, is_valid, np.zeros_like(is_valid))
    want = np.zeros_like(is_valid)
    want[700:703, sensor] = True
    np.testing.assert_array_equal(found, want)


def test_an_outlier_at_an_end_does_not_vouch_for_itself(quiet):
    position, turned, is_valid = quiet
    position = position.copy()
    suspected = np.zeros_like(is_valid)
    for frame in (0, 1, -1):
        position[frame, HAND] += 0.1
        suspected[frame, HAND] = True
    np.testing.assert_array_equal(judge_by_joints(position, turned, is_valid, suspected), suspected)


def test_what_cannot_be_judged_stays_as_it_was(quiet):
    position, turned, is_valid = quiet
    suspected, is_usable = np.zeros_like(is_valid), is_valid.copy()
    suspected[800, HAND] = True
    is_usable[795:805, FOREARM] = False  # nothing to hold the hand against
    found = judge_by_joints(position, turned, is_usable, suspected)
    np.testing.assert_array_equal(found, suspected)
    short = judge_by_joints(position[:100], turned[:100], is_valid[:100], suspected[:100])
    np.testing.assert_array_equal(short, suspected[:100])
    nothing = np.zeros((0, 17), bool)
    assert judge_by_joints(position[:0], turned[:0], nothing, nothing).shape == (0, 17)


@pytest.mark.parametrize("frame_rate_hz", [30.0, 60.0])
def test_at_few_frames_a_second_outliers_are_found_and_little_else(frame_rate_hz):
    motion = suit_performer.range_of_motion(5, n_frames=1800, frame_rate_hz=frame_rate_hz)
    made = suit_performer.record(
        suit_performer.make_body(5), motion, seed=5, disturbance=suit_performer.Disturbance(wobble_m=0.005)
    )
    cleaned = clean(made.recording)
    marked = cleaned.is_filled & made.recording.is_valid
    assert marked[made.is_outlier].mean() > 0.97
    assert marked[~made.is_outlier].mean() < 0.001
    assert cleaned.findings == ()


def test_other_sensors_than_a_suit_s_are_cleaned_alone(made):
    recording = made.recording
    few = replace(
        recording,
        sensors=recording.sensors[:2],
        position_xyz_m=recording.position_xyz_m[:, :2],
        rotation_wxyz=recording.rotation_wxyz[:, :2],
        is_valid=recording.is_valid[:, :2],
    )
    assert clean(few).is_filled.shape == (recording.n_frames, 2)


def test_a_long_burst_does_not_vouch_for_itself(quiet):
    position, turned, is_valid = quiet
    position = position.copy()
    suspected = np.zeros_like(is_valid)
    position[700:712, HAND] += [0.15, -0.1, 0.05]
    suspected[700:712, HAND] = True
    np.testing.assert_array_equal(judge_by_joints(position, turned, is_valid, suspected), suspected)
