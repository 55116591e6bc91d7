import numpy as np
import pytest

from kernels.calibration.hemispheres import undo_hemispheres
from kernels.calibration.records import SENSORS


def turn_back(made, place):
    return undo_hemispheres(place, made.recording.is_valid, sensors=SENSORS)


@pytest.mark.parametrize(("sensor", "first", "end"), [(6, 500, 900), (0, 1200, 3000), (12, 0, 700), (2, 0, 3000)])
def test_mirrored_stretches_are_turned_back(made, sensor, first, end):
    place = np.where(made.recording.is_valid[..., None], made.recording.position_xyz_m, 0.0)
    spoilt = place.copy()
    spoilt[first:end, sensor] *= -1
    mended, found = turn_back(made, spoilt)
    assert [(one.severity, one.sensor) for one in found] == [("warning", SENSORS[sensor])]
    assert abs(found[0].frame_index - first) <= 1
    good = ~made.is_outlier & made.recording.is_valid
    wrong = np.abs(mended - place).max(axis=-1)[good] > 1e-9
    assert wrong.mean() < 1e-4


def test_good_recordings_stay_as_they_are(made):
    place = np.where(made.recording.is_valid[..., None], made.recording.position_xyz_m, 0.0)
    mended, found = turn_back(made, place)
    np.testing.assert_array_equal(mended, place)
    assert found == []


def test_nothing_to_judge():
    none = np.zeros((0, 17))
    assert undo_hemispheres(np.zeros((0, 17, 3)), none > 0, sensors=SENSORS)[1] == []
    assert undo_hemispheres(np.ones((50, 17, 3)), np.zeros((50, 17), bool), sensors=SENSORS)[1] == []


NAMES = ("a", "b", "c", "d")


def around(place, n=60):
    """Three sensors a metre from the source, and one that is where it is told: (n, 4, 3)."""
    position = np.zeros((n, 4, 3))
    position[:, :3] = [[1.0, 0.1, 0.0], [1.0, -0.1, 0.0], [1.0, 0.0, 0.1]]
    position[:, 3] = place
    return position


def turned_back(position, is_usable=None):
    is_usable = np.ones(position.shape[:2], bool) if is_usable is None else is_usable
    return undo_hemispheres(position, is_usable, sensors=NAMES)


@pytest.mark.parametrize(("place", "mirrored"), [((-0.1, 1.0, 0.0), False), ((-0.9, 0.3, 0.0), True)])
def test_a_sensor_that_never_jumps_is_turned_only_where_it_would_lie_half_as_far(place, mirrored):
    mended, found = turned_back(around(place))
    np.testing.assert_array_equal(mended[:, 3], np.tile(np.array(place) * (-1 if mirrored else 1), (60, 1)))
    assert len(found) == mirrored


def test_one_that_jumps_is_turned_to_the_nearer_side():
    place = np.tile([-0.1, 1.0, 0.0], (60, 1))
    place[30:] *= -1
    mended, found = turned_back(around(place))
    np.testing.assert_array_equal(mended[:, 3], np.tile([0.1, -1.0, 0.0], (60, 1)))
    assert [one.frame_index for one in found] == [0]


def test_where_it_cannot_be_told_which_half_is_mirrored_that_is_an_error():
    place = np.tile([0.01, 0.5, 0.0], (60, 1))
    place[30:] *= -1
    _, (found,) = turned_back(around(place))
    assert (found.severity, found.sensor) == ("error", "d")
    assert "cannot be told" in found.sentence


@pytest.mark.parametrize(("size_m", "n_mirrored"), [(0.09, 0), (0.11, 30)])
def test_a_jump_is_longer_than_20_cm(size_m, n_mirrored):
    place = np.tile([size_m, 0.0, 0.0], (60, 1))
    place[30:] *= -1
    mended, _ = turned_back(around(place))
    assert (mended[:, 3] != place).any(axis=1).sum() == n_mirrored


@pytest.mark.parametrize(("off_m", "n_mirrored"), [(0.15, 30), (0.25, 0)])
def test_and_ends_opposite_within_a_fifth(off_m, n_mirrored):
    place = np.tile([0.5, 0.0, 0.0], (60, 1))
    place[30:] = [-0.5, off_m, 0.0]
    mended, _ = turned_back(around(place))
    assert (mended[:, 3] != place).any(axis=1).sum() == n_mirrored


@pytest.mark.parametrize(("n", "n_mirrored"), [(2, 0), (6, 6)])
def test_a_short_visit_to_the_other_side_is_left_to_the_outliers(n, n_mirrored):
    place = np.tile([0.5, 0.2, 0.0], (60, 1))
    place[30 : 30 + n] *= -1
    mended, _ = turned_back(around(place))
    assert (mended[:, 3] != place).any(axis=1).sum() == n_mirrored


def test_with_fewer_than_three_sensors_nothing_is_compared():
    place = np.tile([-0.9, 0.3, 0.0], (60, 1))
    place[30:] *= -1
    position = around(place)
    is_usable = np.ones((60, 4), bool)
    is_usable[:, :2] = False
    mended, found = turned_back(position, is_usable)
    np.testing.assert_array_equal(mended[:, 3], np.tile([-0.9, 0.3, 0.0], (60, 1)))  # as it was before it jumped
    assert [one.frame_index for one in found] == [30]


def test_a_jump_that_noise_makes_shorter_for_one_step_is_still_one():
    place = np.tile([0.11, 0.0, 0.0], (60, 1))
    place[30:] *= -1
    place[[29, 30], 0] = [0.07, -0.07]
    mended, _ = turned_back(around(place))
    assert (mended[:, 3] != place).any(axis=1).sum() == 30


def test_a_jump_as_soon_as_a_median_can_be_taken_is_one():
    place = np.tile([-0.1, 1.0, 0.0], (60, 1))
    place[7:] *= -1
    mended, found = turned_back(around(place))
    np.testing.assert_array_equal(mended[:, 3], np.tile([0.1, -1.0, 0.0], (60, 1)))
    assert [one.frame_index for one in found] == [0]
