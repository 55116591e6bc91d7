from dataclasses import replace

import numpy as np

from kernels.calibration.cleaning import clean
from kernels.calibration.records import SENSORS, Recording
from kernels.calibration.silence import find_silent

HAND = SENSORS.index("l_hand")


def stuck(made, first, end):
    position, turned = made.recording.position_xyz_m.copy(), made.recording.rotation_wxyz.copy()
    is_valid = made.recording.is_valid.copy()
    position[first:end, HAND], turned[first:end, HAND] = position[first, HAND], turned[first, HAND]
    is_valid[first:end, HAND] = True
    return replace(made.recording, position_xyz_m=position, rotation_wxyz=turned, is_valid=is_valid)


def test_a_reading_repeated_while_the_body_moves_is_none(perfect):
    is_silent, found = find_silent(stuck(perfect, 1000, 1200))
    want = np.zeros_like(is_silent)
    want[1001:1200, HAND] = True
    np.testing.assert_array_equal(is_silent, want)
    assert [(one.severity, one.sensor, one.frame_index) for one in found] == [("warning", "l_hand", 1001)]
    assert "199 frames" in found[0].sentence


def test_a_body_that_stands_still_is_not_silent(perfect):
    assert (perfect.recording.position_xyz_m[:200] == perfect.recording.position_xyz_m[0]).all()  # the T-pose
    is_silent, found = find_silent(perfect.recording)
    assert not is_silent.any()
    assert found == []


def test_short_repeats_are_let_pass(perfect):
    assert not find_silent(stuck(perfect, 1000, 1020))[0].any()


def test_zeros_called_valid_are_told_in_one_sentence(made):
    recording = made.recording
    lost = ~recording.is_valid
    zeros = replace(
        recording,
        position_xyz_m=np.where(lost[..., None], 0.0, recording.position_xyz_m),
        rotation_wxyz=np.where(lost[..., None], [1.0, 0.0, 0.0, 0.0], recording.rotation_wxyz),
        is_valid=np.ones_like(lost),
    )
    got, want = clean(zeros), clean(recording)
    np.testing.assert_array_equal(got.is_filled, want.is_filled)
    assert [one.severity for one in got.findings] == ["warning"]
    assert "exactly zero" in got.findings[0].sentence


def test_a_sensor_stuck_for_long_is_an_error(made):
    frame = int(np.flatnonzero(made.recording.is_valid[500:, HAND])[0]) + 500
    found = clean(stuck(made, frame, 2000)).findings
    assert ("error", "l_hand") in [(one.severity, one.sensor) for one in found]


def test_no_frames():
    empty = Recording(120.0, SENSORS, np.zeros((0, 17, 3)), np.zeros((0, 17, 4)), np.zeros((0, 17), bool))
    assert find_silent(empty)[1] == []
