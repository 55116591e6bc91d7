"""A dance in a suit that shows every joint, on beats that are known."""

import numpy as np
import pytest

from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.synthetic.dancer import take
from kernels.synthetic.medley import medley, sway, wear
from kernels.synthetic.suit_performer import CLEAN, SENSORS, make_body, record

MOVES = ("step", "spin", "wave", "kick")


@pytest.fixture(scope="module")
def made():
    return medley(MOVES, seed=3)


def test_begins_in_a_t_pose(made):
    place, _ = kinematics.place(made.clip)
    left, right = (place[0, JOINTS.index(f"{side}Hand")] for side in ("left", "right"))
    shoulder = place[0, JOINTS.index("leftUpperArm"), 1]
    np.testing.assert_allclose([left[1], right[1]], shoulder, atol=0.02)
    assert left[0] > 0.5 > -0.5 > right[0]


def test_beats_are_told_and_idling_has_none(made):
    np.testing.assert_allclose(np.diff(made.beat_s), 0.52)
    assert len(made.beat_s) == 8 * len(MOVES)
    assert made.beat_s[0] == pytest.approx(2.5)
    assert len(medley(("step", "idle"), n_beats=4).beat_s) == 4


def test_moves_flow_into_each_other(made):
    place, world = kinematics.place(made.clip)
    assert np.linalg.norm(np.diff(place, axis=0), axis=-1).max() * 60 < 6.0  # a kick is the fastest
    assert rotation.angle_between(world[1:], world[:-1]).max() * 60 < 12.0
    assert np.isfinite(place).all()


def test_same_seed_same_dance_and_sways_leave_ankles(made):
    np.testing.assert_array_equal(medley(MOVES, seed=3).clip.rotation_wxyz, made.clip.rotation_wxyz)
    assert not np.array_equal(medley(MOVES, seed=4).clip.rotation_wxyz, made.clip.rotation_wxyz)
    plain = take("rock").clip
    before, _ = kinematics.place(plain)
    after, _ = kinematics.place(sway(plain, seed=1))
    nothing, _ = kinematics.place(sway(plain, seed=1, share=0.0))
    np.testing.assert_allclose(nothing, before, atol=1e-12)
    ankles = [JOINTS.index(f"{side}Foot") for side in ("left", "right")]
    np.testing.assert_allclose(after[:, ankles], before[:, ankles], atol=1e-9)
    assert np.abs(after - before).max() > 0.01


def test_worn_by_a_body_the_bones_point_as_the_dancers_do(made):
    body = make_body(5)
    motion = wear(made.clip, body)
    found = record(body, motion, seed=5, disturbance=CLEAN)
    place, _ = kinematics.place(made.clip)
    for sensor, start, end in (("l_forearm", "leftUpperArm", "leftLowerArm"), ("r_foot", "rightLowerLeg", "rightFoot")):
        k = SENSORS.index(sensor)
        above = {"l_forearm": "l_upper_arm", "r_foot": "r_shank"}[sensor]
        bone = found.joint_xyz_m[:, k] - found.joint_xyz_m[:, SENSORS.index(above)]
        way = place[:, JOINTS.index(end)] - place[:, JOINTS.index(start)]
        cosine = np.sum(bone * way[:, [2, 0, 1]], -1) / np.linalg.norm(bone, axis=-1) / np.linalg.norm(way, axis=-1)
        assert cosine.min() > 0.995  # a made-up body is a little crooked


def test_each_error():
    with pytest.raises(ValueError, match="got none"):
        medley(())
    with pytest.raises(ValueError, match="got moonwalk"):
        medley(("moonwalk",))
    with pytest.raises(ValueError, match="multiple of 4, got 6"):
        medley(("step",), n_beats=6)
    assert medley(("step",)).clip.skeleton is CANONICAL
