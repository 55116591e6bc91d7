"""The measure of a rig: its bones come back, whatever its rest pose and joint frames."""

import numpy as np
import pytest

from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.body_measure import SOLE_M, _planted_pitch_rad, leg_length_m, measure
from kernels.skeleton.canonical import CANONICAL, JOINTS, LEG_LENGTH_M
from kernels.skeleton.naming import JointMapping, map_joints
from kernels.synthetic.dancer import take
from kernels.synthetic.rigs import RigPlan, a_pose, along_bones, author, splayed
from kernels.types import Clip, Skeleton

LIMBS = [name for name in JOINTS if name.endswith(("LowerArm", "Hand", "LowerLeg", "Foot"))]


@pytest.fixture(scope="module")
def motion():
    return take("step", n_beats=8, interval_s=0.5).clip


def lengths(skeleton):
    return {name: float(np.linalg.norm(skeleton.offset_xyz_m[skeleton.index(name)])) for name in LIMBS}


@pytest.mark.parametrize(
    "plan",
    [
        RigPlan(),
        RigPlan(axes=a_pose()),
        RigPlan(axes=splayed()),
        RigPlan(axes=along_bones()),
        RigPlan(has_root=True),
        RigPlan(twisted=("leftLowerArm", "rightLowerLeg")),
        RigPlan(without=("upperChest", "leftShoulder", "rightShoulder", "leftToes", "rightToes")),
    ],
    ids=["t", "a", "splayed", "along bones", "root", "twisted", "fewer joints"],
)
def test_bones_come_back(motion, plan):
    clip = author(motion, plan)
    found = measure(clip, map_joints(clip.skeleton))
    wanted = lengths(CANONICAL)
    for name, length in lengths(found.figure).items():
        assert length == pytest.approx(wanted[name], abs=1e-6), name
    assert found.scale_ratio == pytest.approx(1.0, abs=1e-6)
    rest = kinematics.rest_position(found.figure)
    feet = [JOINTS.index(side + part) for side in ("left", "right") for part in ("Foot", "Toes")]
    assert rest[feet, 1].min() == pytest.approx(SOLE_M, abs=1e-6)
    # Limbs stand in the canonical pose: arms along x, legs along -y.
    for side, sign in (("left", 1), ("right", -1)):
        hand, arm = rest[JOINTS.index(f"{side}Hand")], rest[JOINTS.index(f"{side}UpperArm")]
        np.testing.assert_allclose((hand - arm) / np.linalg.norm(hand - arm), [sign, 0, 0], atol=1e-6)


def test_stretched_bones_are_measured(motion):
    plan = RigPlan(stretch={"leftLowerLeg": 1.3, "rightLowerLeg": 1.3, "leftHand": 0.7})
    clip = author(motion, plan)
    figure = measure(clip, map_joints(clip.skeleton)).figure
    assert leg_length_m(figure) == pytest.approx(LEG_LENGTH_M + 0.3 * 0.41)
    assert lengths(figure)["leftHand"] == pytest.approx(0.7 * 0.25)


def test_the_floor_of_a_rest_pose_counts_where_it_is_one(motion):
    still = Clip(CANONICAL, 1.0, CANONICAL.offset_xyz_m[:1], np.tile(rotation.IDENTITY, (1, 22, 1)))
    mapping = JointMapping({name: name for name in JOINTS}, "vrm")
    toes = [JOINTS.index("leftToes")]
    high = measure(still, mapping, floor_m=-0.03).figure
    assert kinematics.rest_position(high)[toes, 1] == pytest.approx(0.05)
    far = measure(still, mapping, floor_m=-3.0).figure
    assert kinematics.rest_position(far)[toes, 1] == pytest.approx(SOLE_M)


def test_what_is_no_body(motion):
    mapping = JointMapping({name: name for name in JOINTS}, "vrm")
    none = Clip(CANONICAL, 30.0, np.zeros((0, 3)), np.zeros((0, 22, 4)))
    with pytest.raises(ValueError, match="want at least one frame"):
        measure(none, mapping)
    flat = Skeleton(JOINTS, CANONICAL.parent, np.zeros((22, 3)))
    with pytest.raises(ValueError, match="apart, got them in one place"):
        measure(Clip(flat, 30.0, motion.root_xyz_m, motion.rotation_wxyz), mapping)


@pytest.mark.parametrize("slope_m", [0.05, 0.0])
def test_the_slope_of_feet_is_that_of_planted_ones(slope_m):
    """Two feet that stand still for a second, their toes 12 cm ahead; without toes or frames there is none."""
    at = {name: k for k, name in enumerate(("leftFoot", "leftToes", "rightFoot", "rightToes"))}
    place = np.array([[0.1, slope_m, 0.0], [0.1, 0.0, 0.12], [-0.1, slope_m, 0.0], [-0.1, 0.0, 0.12]])
    position = np.tile(place, (30, 1, 1))
    clip = Clip(CANONICAL, 30.0, np.zeros((30, 3)), np.tile(rotation.IDENTITY, (30, 22, 1)))
    assert _planted_pitch_rad(at, position, clip) == pytest.approx(-np.arctan2(slope_m, 0.12))
    assert _planted_pitch_rad({"leftFoot": 0, "rightFoot": 2}, position, clip) is None
    assert _planted_pitch_rad(at, position[:, [0, 0, 2, 2]], clip) is None  # toes in the ankle's place
