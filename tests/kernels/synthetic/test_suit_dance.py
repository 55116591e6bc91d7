import numpy as np
import pytest

from kernels import rotation
from kernels.calibration.records import PARENT, SENSORS
from kernels.synthetic import suit, suit_dance


@pytest.fixture(scope="module")
def motion():
    return suit_dance.danced(2, suit.make_body(2), moves=("step", "wave"), warm_up_s=6.0, frame_rate_hz=60.0)


def test_warm_up_and_dance_are_one_motion_without_jumps(motion):
    assert len(motion.root_xyz_m) == len(motion.local_wxyz) > 6 * 60 + 2 * 7.5 * 60
    assert np.linalg.norm(np.diff(motion.root_xyz_m, axis=0), axis=-1).max() * 60 < 3.0
    turned = rotation.angle_between(motion.local_wxyz[1:], motion.local_wxyz[:-1])
    assert turned.max() * 60 < 25.0


def test_arms_wave_and_feet_are_below(motion):
    body = suit.make_body(2)
    made = suit.record(body, motion, seed=2, disturbance=suit.CLEAN)
    dance = made.joint_xyz_m[-400:]
    height = {name: dance[:, k, 2] for k, name in enumerate(SENSORS)}
    assert (height["l_hand"] > height["head"]).any()
    assert (height["l_hand"] < height["thorax"]).any()
    assert (height["l_foot"] < height["l_shank"]).all()
    assert np.abs(height["r_foot"] - np.median(height["r_foot"])).max() < 0.03  # it stands on it while it waves


def test_every_joint_lives(motion):
    for k in range(1, 17):
        assert rotation.angle_between(motion.local_wxyz[:, k], motion.local_wxyz[:1, k]).max() > 0.02, SENSORS[k]
    assert len(PARENT) == motion.local_wxyz.shape[1]


def test_without_moves_it_is_the_warm_up():
    body = suit.make_body(1)
    only = suit_dance.danced(1, body, moves=(), warm_up_s=4.0)
    np.testing.assert_array_equal(only.local_wxyz, suit.range_of_motion(1, n_frames=480).local_wxyz)


def test_an_unknown_move_is_refused():
    with pytest.raises(ValueError, match="label: want one of"):
        suit_dance.danced(1, suit.make_body(1), moves=("fly",), warm_up_s=4.0)
