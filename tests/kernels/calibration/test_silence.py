from dataclasses import replace
from types import SimpleNamespace

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
    assert "other sensors" not in found[0].sentence


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


def test_a_quarter_of_a_second_of_repeats_is_silence_and_a_frame_less_is_not(perfect):
    assert find_silent(stuck(perfect, 1000, 1031))[0].sum() == 30
    assert not find_silent(stuck(perfect, 1000, 1030))[0].any()


def test_at_slow_rates_silence_takes_five_repeats(perfect):
    every = {name: getattr(perfect.recording, name)[::15] for name in ("position_xyz_m", "rotation_wxyz", "is_valid")}
    slow = SimpleNamespace(recording=replace(perfect.recording, frame_rate_hz=8.0, **every))
    assert find_silent(stuck(slow, 80, 86))[0].sum() == 5
    assert not find_silent(stuck(slow, 80, 85))[0].any()


def test_a_sensor_that_turns_on_the_spot_is_heard(perfect):
    held = stuck(perfect, 1000, 1200)
    assert not find_silent(replace(held, rotation_wxyz=perfect.recording.rotation_wxyz))[0].any()


def test_what_is_called_lost_is_not_told_as_silent(perfect):
    held = stuck(perfect, 1000, 1200)
    is_valid = held.is_valid.copy()
    is_valid[1000:1200, HAND] = False
    assert find_silent(replace(held, is_valid=is_valid))[1] == []
    zeros = held.position_xyz_m.copy()
    zeros[1000:1200, HAND] = 0.0
    assert find_silent(replace(held, position_xyz_m=zeros, is_valid=is_valid))[1] == []


def test_repeated_zeros_are_told_once(perfect):
    held = stuck(perfect, 1000, 1200)
    held.position_xyz_m[1000:1200, HAND] = 0.0
    is_silent, found = find_silent(held)
    assert is_silent.sum() == 200
    assert len(found) == 1
    assert "a position of exactly zero in 200 frames from frame 1000 on;" in found[0].sentence


def test_one_sensor_that_moves_does_not_make_the_others_silent(perfect):
    position = perfect.recording.position_xyz_m.copy()
    position[:200, 3, 0] += np.linspace(0, 1, 200)  # during the T-pose
    assert not find_silent(replace(perfect.recording, position_xyz_m=position))[0].any()


def test_others_that_were_silent_too_are_counted(perfect):
    held = stuck(perfect, 1000, 1200)
    for other in (0, 5):
        held.position_xyz_m[1000:1200, other] = held.position_xyz_m[1000, other]
        held.rotation_wxyz[1000:1200, other] = held.rotation_wxyz[1000, other]
    _, found = find_silent(held)
    assert found[0].sensor == SENSORS[0]
    assert "(2 other sensors did so too)" in found[0].sentence
