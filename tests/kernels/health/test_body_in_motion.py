"""A clip's own body in the world."""

import numpy as np
import pytest

from kernels import rotation
from kernels.health.body_in_motion import BodyInMotion, canonical_parent
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import JOINTS
from kernels.skeleton.naming import map_joints
from kernels.synthetic import dancer, rigs
from kernels.synthetic.rigs import RigPlan


def body(clip):
    return BodyInMotion(clip, map_joints(clip.skeleton))


def test_places_and_measures_are_those_of_the_clip():
    clip = dancer.take("kick", n_beats=4).clip
    b = body(clip)
    position, _ = kinematics.place(clip)
    assert b.position_xyz_m == pytest.approx(position)
    assert b.leg_m == pytest.approx(0.82)
    assert b.scale == pytest.approx(1.0)
    assert b.hips[0] == pytest.approx(position[0, [JOINTS.index(f"{s}UpperLeg") for s in ("left", "right")]].mean(0))
    assert b.feet.shape == (clip.n_frames, 4, 3)
    assert b.forward[:, 2].min() > 0.9
    assert b.at_s(45) == "1.50 s"


def test_turns_are_against_the_next_mapped_joint_above():
    clip = dancer.take("wave", n_beats=4).clip
    lacking = rigs.author(clip, RigPlan(without=("leftShoulder", "chest")))
    b = body(lacking)
    assert "leftShoulder" not in b.at
    world = b.orientation_wxyz
    above = canonical_parent("leftUpperArm", b.at)
    assert above in ("upperChest", "chest", "spine")
    turn = b.canonical_turn_wxyz[:, list(b.at).index("leftUpperArm")]
    back = rotation.mul(world[:, b.at[above]], turn)
    assert rotation.angle_between(back, world[:, b.at["leftUpperArm"]]).max() < 1e-6
    assert canonical_parent("hips", b.at) is None


def test_a_joint_that_moves_nothing_of_the_body_is_not_needed():
    clip = dancer.take("wave", n_beats=2).clip
    twisted = rigs.author(clip, RigPlan(twisted=("leftLowerArm",)))
    b = body(twisted)
    assert twisted.skeleton.index("leftLowerArmTwist") in b.needed
    assert b.needed == sorted(set(b.needed))
    assert not np.isnan(b.position_xyz_m).any()
