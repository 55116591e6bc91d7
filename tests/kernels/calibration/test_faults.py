from dataclasses import replace

import numpy as np
import pytest

from kernels.calibration.calibrate import calibrate
from kernels.calibration.cleaning import clean
from kernels.calibration.faults import check_recording, check_sensors
from kernels.calibration.records import SENSORS
from kernels.synthetic import suit_performer
from kernels.synthetic.suit_faults import FAULTS


def judge(recording):
    return check_recording(recording) if recording.sensors != SENSORS else calibrate(clean(recording)).findings


@pytest.mark.parametrize("name", FAULTS)
def test_every_fault_is_found_with_sensor_and_remedy(made, name):
    fault = FAULTS[name]
    found = judge(fault.spoil(made.recording))
    named = [one for one in found if (one.severity, one.sensor) == (fault.severity, fault.sensor)]
    assert any(fault.words in one.sentence for one in named), [one.sentence for one in found]
    assert all("want" in one.sentence and "got" in one.sentence and ";" in one.sentence for one in found)


@pytest.mark.parametrize("wobble_m", [0.0, 0.012])
def test_no_alarm_on_good_recordings(wobble_m):
    for seed in (31, 32):
        made = suit_performer.made_up(seed, n_frames=4000, disturbance=suit_performer.Disturbance(wobble_m=wobble_m))
        assert judge(made.recording) == ()


def test_a_fault_of_units_comes_alone(made):
    assert len(judge(FAULTS["millimetres"].spoil(made.recording))) == 1


def test_frames_are_named_where_values_are_wrong(made):
    found = check_recording(FAULTS["not a number"].spoil(made.recording))
    assert [(one.sensor, one.frame_index) for one in found] == [("head", 50)]
    dropped = check_recording(FAULTS["dropped"].spoil(made.recording))[0]
    assert not made.recording.is_valid[dropped.frame_index, 7] or dropped.frame_index == 1000


def test_a_misspelt_sensor_is_offered_for_the_missing_one():
    found = check_sensors(tuple(name.replace("head", "skull") for name in SENSORS))
    assert "skull may be meant" in found[0].sentence
    assert [one.sensor for one in found] == ["head", "skull"]


def test_nothing_but_missing_entries(made):
    nothing = replace(made.recording, is_valid=np.zeros_like(made.recording.is_valid))
    assert {one.severity for one in check_recording(nothing)} == {"error"}


@pytest.mark.parametrize(("length", "severity"), [(1.0005, None), (1.005, "warning"), (1.05, "error")])
def test_a_quaternion_a_little_off_is_made_unit_and_one_far_off_is_an_error(made, length, severity):
    rotation = made.recording.rotation_wxyz.copy()
    rotation[100, 3] *= length
    found = [one for one in check_recording(replace(made.recording, rotation_wxyz=rotation)) if "unit" in one.sentence]
    assert [one.severity for one in found] == ([] if severity is None else [severity])
    assert all(f"got one of length {length:.4f} at frame 100" in one.sentence for one in found)
