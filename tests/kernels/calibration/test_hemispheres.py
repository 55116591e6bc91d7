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
