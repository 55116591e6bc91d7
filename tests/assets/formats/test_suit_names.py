"""What exporters call sensors."""

import pytest

from assets.formats.suit_names import name_sensors, sensor_of, unknown_sensor
from kernels.calibration.records import SENSORS


@pytest.mark.parametrize("name", SENSORS)
def test_our_own_names_stay(name):
    assert sensor_of(name) == name


@pytest.mark.parametrize(
    ("name", "ours"),
    [
        ("LeftUpperArm", "l_upper_arm"),
        ("L.UpperArm", "l_upper_arm"),
        ("upper_arm_l", "l_upper_arm"),
        ("left upper-arm", "l_upper_arm"),
        ("RForearm", "r_forearm"),
        ("rforearm", "r_forearm"),
        ("R_LOWER_LEG", "r_shank"),
        ("right_tibia_sensor", "r_shank"),
        ("Hips", "pelvis"),
        ("Sternum", "thorax"),
        ("l_clavicle", "l_shoulder"),
    ],
)
def test_spellings(name, ours):
    assert sensor_of(name) == ours


@pytest.mark.parametrize("name", ["", "1", "sensor_3", "hand", "l_pelvis", "sword", "left", "lr_hand_knee"])
def test_what_tells_nothing(name):
    assert sensor_of(name) is None


def test_the_users_own_table_wins_and_leaves_out():
    names, said = name_sensors(["a", "hand_l", "prop"], {"a": "head", "hand_l": "r_hand", "prop": ""})
    assert (names, said) == (("head", "r_hand", ""), "")


@pytest.mark.parametrize("first", [0, 1])
def test_seventeen_numbers_are_taken_in_order(first):
    names, said = name_sensors([str(k) for k in range(first, first + 17)])
    assert names == SENSORS
    assert "in the order pelvis, thorax" in said


def test_fewer_numbers_stay_numbers():
    assert name_sensors(["1", "2"]) == (("1", "2"), "")


def test_two_that_come_to_one_are_refused():
    with pytest.raises(ValueError, match="'l_shin' and 'l_shank', both l_shank"):
        name_sensors(["l_shin", "l_shank"])


def test_a_table_that_names_no_sensor_is_refused():
    with pytest.raises(ValueError, match="got 'tail'"):
        name_sensors(["a"], {"a": "tail"})


def test_the_nearest_is_named():
    assert "did you mean 'l_thigh'?" in unknown_sensor("l_thig")
    assert "known are pelvis" in unknown_sensor("xyz")
