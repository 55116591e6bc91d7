import numpy as np
import pytest

from kernels.synthetic import suit_performer
from kernels.synthetic.suit_faults import FAULTS


@pytest.fixture(scope="module")
def recording():
    return suit_performer.made_up(1, n_frames=1500).recording


@pytest.mark.parametrize("name", FAULTS)
def test_each_changes_a_copy(recording, name):
    before = [np.array(a) for a in (recording.position_xyz_m, recording.rotation_wxyz, recording.is_valid)]
    spoilt = FAULTS[name].spoil(recording)
    after = (recording.position_xyz_m, recording.rotation_wxyz, recording.is_valid)
    for one, other in zip(before, after, strict=True):
        np.testing.assert_array_equal(one, other)
    same = spoilt.sensors == recording.sensors and all(
        np.array_equal(one, other, equal_nan=one.dtype != bool)
        for one, other in zip(before, (spoilt.position_xyz_m, spoilt.rotation_wxyz, spoilt.is_valid), strict=True)
    )
    assert not same
