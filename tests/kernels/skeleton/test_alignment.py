import dataclasses

import numpy as np
import pytest

from kernels import rotation
from kernels.skeleton import alignment, kinematics, topology
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.synthetic import dancer, rigs

X, Y, Z = np.eye(3)
FULL = {name: name for name in JOINTS}


def swing(a, b):
    return rotation.between(np.array(a), np.array(b))


@pytest.fixture(scope="module")
def step():
    return dancer.take("step", n_beats=6).clip


def placed(motion, **plan):
    clip = rigs.author(motion, rigs.RigPlan(**plan))
    position, orientation = kinematics.place(clip)
    at = {name: clip.skeleton.index(name) for name in JOINTS if name in clip.skeleton.joints}
    spine, neck = topology.trunk(clip.skeleton, {name: name for name in at})
    rest = alignment.rest_position(clip)
    return alignment.PlacedRig(clip, at, spine, neck, rest, position, orientation)


def assert_neutral(rig, axes, limit_rad=1e-6, names=JOINTS):
    neutral = alignment.neutral_orientations(rig)
    for name in names:
        wanted = axes.get(name, rotation.IDENTITY)
        assert rotation.angle_between(neutral[rig.at[name]], wanted) < limit_rad, name


@pytest.mark.parametrize(
    "axes",
    [
        {},
        rigs.a_pose(),
        rigs.arms_forward(),
        rigs.lying(),
        rigs.splayed(),
        rigs.along_bones(),
        rigs.posed({"leftUpperArm": swing(X, [0.3, -0.5, 0.8]), "leftLowerArm": swing(X, [1, 0, 0.7])}),
        rigs.posed({"hips": rotation.from_axis_angle(np.array([0.6, 0, 0.8]), 2.0)}),
        rigs.posed({"rightUpperLeg": swing(-Y, Z - 0.1 * Y), "rightLowerLeg": swing(Z, -Y - 0.1 * Z)}),
    ],
    ids=["t-pose", "a-pose", "forward", "lying", "splayed", "along bones", "bent arm", "thrown", "sitting"],
)  # fmt: skip
def test_rigs_whose_axes_are_known(step, axes):
    assert_neutral(placed(step, axes=axes), axes)


def test_joints_carried_by_translation_have_a_rest_pose_too(step):
    assert_neutral(placed(step, has_root=True, axes=rigs.a_pose()), rigs.a_pose())


def test_axes_at_odd_angles_are_found_from_bending_elbows_and_knees():
    motion = dancer.take("kick", n_beats=8).clip
    roll = {name: rotation.from_axis_angle(X, 0.5) for name in ("leftUpperArm", "rightUpperArm")}
    axes = {name: rotation.mul(q, roll.get(name, rotation.IDENTITY)) for name, q in rigs.along_bones().items()}
    assert_neutral(placed(motion, axes=axes), axes, 1e-4, [name for name in roll])


def test_a_rest_pose_along_the_bones_needs_no_more_than_a_frame(step):
    rig = placed(step, axes=rigs.along_bones())
    one = dataclasses.replace(rig, position=rig.position[9:10], orientation=rig.orientation[9:10])
    legs = [side + part for side in ("left", "right") for part in ("UpperArm", "LowerArm", "UpperLeg", "LowerLeg")]
    assert_neutral(one, rigs.along_bones(), 1e-6, ["hips", *legs])


def test_a_back_that_curves_tilts_neither_arms_nor_head(step):
    tilt = rotation.from_axis_angle(X, 0.3)
    curved = rigs.posed({"neck": tilt, "head": rotation.inv(tilt), "chest": rotation.inv(tilt), "upperChest": tilt})
    neutral = alignment.neutral_orientations(rig := placed(step, axes=curved))
    for name in ("head", "leftUpperArm", "rightHand"):
        assert rotation.angle_between(neutral[rig.at[name]], rotation.IDENTITY) < 1e-6


@pytest.mark.parametrize(
    ("planted_rad", "kept"), [(alignment.FLAT_PITCH_RAD, False), (alignment.FLAT_PITCH_RAD - 0.5, True), (None, True)]
)
def test_a_foot_that_slopes_at_rest_is_flat_if_planted_feet_slope(step, planted_rad, kept):
    sloping = rotation.from_axis_angle(X, 0.4)
    rig = placed(step, axes=rigs.posed({"leftFoot": sloping, "rightFoot": sloping}))
    rig = dataclasses.replace(rig, planted_pitch_rad=planted_rad)
    foot = alignment.neutral_orientations(rig)[rig.at["leftFoot"]]
    wanted = rotation.IDENTITY if kept else rotation.inv(sloping)
    assert rotation.angle_between(foot, wanted) < 1e-6


def test_flat_feet_under_spread_legs_stay_flat(step):
    spread = rotation.from_axis_angle(Z, 0.3)
    axes = rigs.posed({"leftUpperLeg": spread, "leftFoot": rotation.inv(spread)})
    foot = alignment.neutral_orientations(rig := placed(step, axes=axes))[rig.at["leftFoot"]]
    assert rotation.angle_between(foot, rotation.IDENTITY) < 1e-6


def test_turn_takes_both_directions():
    q = alignment.turn((X, Y), (Z, X))
    np.testing.assert_allclose(rotation.apply(q, X), Z, atol=1e-12)
    np.testing.assert_allclose(rotation.apply(q, Y), X, atol=1e-12)
    slanted = alignment.turn((2 * X, X + Y), (Y, Z))
    np.testing.assert_allclose(rotation.apply(slanted, X), Y, atol=1e-12)


def test_directions_of_bones():
    np.testing.assert_allclose(alignment.bone_direction("leftUpperArm"), X)
    np.testing.assert_allclose(alignment.bone_direction("rightLowerLeg"), -Y)
    np.testing.assert_allclose(
        alignment.foot_direction(alignment.FLAT_PITCH_RAD), alignment.bone_direction("leftFoot"), atol=1e-12
    )
    np.testing.assert_allclose(alignment.unit(np.array([[0.0, 3, 4], [0, 0, 0]])), [[0, 0.6, 0.8], [0, 0, 0]])


def test_rest_position_takes_the_usual_translation(step):
    rig = placed(step, has_root=True)
    hips = rig.rest[rig.at["hips"]]
    np.testing.assert_allclose(hips, np.median(rig.position[:, rig.at["hips"]], axis=0))
    np.testing.assert_allclose(rig.rest[rig.at["head"]] - hips, CANONICAL.offset_xyz_m[1:6].sum(axis=0), atol=1e-12)


@pytest.mark.parametrize("degrees", [15, 30])
def test_elbows_that_bend_at_odd_angles_leave_heads_and_hands_as_they_are_carried(degrees):
    """Beyond 10 degrees off its axes no joint of a rig is taken for square."""
    motion = dancer.take("kick", n_beats=8).clip
    still = motion.rotation_wxyz.copy()
    ends = [JOINTS.index(name) for name in ("head", "leftHand", "rightHand")]
    still[:, ends] = rotation.IDENTITY
    motion = dataclasses.replace(motion, rotation_wxyz=still)
    roll = {
        name: rotation.from_axis_angle(X, np.radians(degrees)) for name in ("leftUpperArm", "rightUpperArm", "head")
    }
    axes = {name: rotation.mul(q, roll.get(name, rotation.IDENTITY)) for name, q in rigs.along_bones().items()}
    assert_neutral(placed(motion, axes=axes), axes, 1e-4, ["leftUpperArm", "rightUpperArm", "head"])
