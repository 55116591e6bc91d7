"""A dance on other bodies: the same dance, its feet where they stood."""

from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.skeleton import grounding, kinematics
from kernels.skeleton.body_fit import fit, put_on
from kernels.skeleton.body_measure import measure
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.contacts import find_contacts, foot_slide
from kernels.skeleton.naming import map_joints
from kernels.skeleton.retarget import retarget
from kernels.synthetic.dancer import take
from kernels.synthetic.rigs import RigPlan, a_pose, along_bones, author
from kernels.types import Clip, Skeleton

PLANS = {
    "own": RigPlan(),
    "a pose": RigPlan(axes=a_pose()),
    "along bones": RigPlan(axes=along_bones()),
    "root above": RigPlan(has_root=True),
    "twist joints": RigPlan(twisted=("leftLowerArm", "leftLowerLeg")),
    "few joints": RigPlan(without=("chest", "upperChest", "neck", "leftToes", "rightToes")),
}


@pytest.fixture(scope="module")
def dance():
    """A dance on the canonical skeleton that steps, turns and travels."""
    made = take("step", n_beats=12, interval_s=0.5).clip
    moved = retarget(made, map_joints(made.skeleton))
    return Clip(CANONICAL, made.frame_rate_hz, moved.root_xyz_m, moved.rotation_wxyz)


def feet(clip):
    position, _ = kinematics.place(clip)
    return position[:, grounding.ANKLES], position[:, grounding.TOES]


def slide(dance, fitted):
    """Slide of the feet that the dance plants, on both bodies: cm/s."""
    planted = find_contacts(*feet(dance), frame_rate_hz=dance.frame_rate_hz, planted_height_m=(0.08, 0.02))
    return [100 * foot_slide(*feet(c), planted, frame_rate_hz=dance.frame_rate_hz) for c in (dance, fitted)]


def stretched(**factors):
    """The canonical skeleton with some bones longer, standing on the floor."""
    offset = CANONICAL.offset_xyz_m.copy()
    for joint, factor in factors.items():
        for k, name in enumerate(JOINTS):
            if name.endswith(joint):
                offset[k] *= factor
    position = kinematics.rest_position(Skeleton(JOINTS, CANONICAL.parent, offset))
    offset[0, 1] -= position[grounding.TOES, 1].min() - 0.02
    return Skeleton(JOINTS, CANONICAL.parent, offset)


def test_the_own_body_changes_nothing(dance):
    fitted = fit(dance, CANONICAL)
    np.testing.assert_allclose(kinematics.place(fitted)[0], kinematics.place(dance)[0], atol=1e-4)


def test_twice_the_size_is_the_dance_twice_as_large(dance):
    double = Skeleton(JOINTS, CANONICAL.parent, 2 * CANONICAL.offset_xyz_m)
    fitted = fit(dance, double)
    np.testing.assert_allclose(kinematics.place(fitted)[0], 2 * kinematics.place(dance)[0], atol=2e-4)


@pytest.mark.parametrize(
    "figure",
    [
        stretched(LowerLeg=1.3),
        stretched(Foot=0.7, Toes=1.5),
        stretched(UpperLeg=1.5, Toes=0.6),
        stretched(LowerLeg=0.8, Foot=1.25, LowerArm=1.4),
    ],
    ids=["long thighs", "short shins, long feet", "wide hips, short feet", "other knees"],
)
def test_feet_stay_planted_and_above_the_floor(dance, figure):
    fitted = fit(dance, figure)
    own, here = slide(dance, fitted)
    assert here <= 1.5 * own + 0.3
    ankle, toes = feet(fitted)
    assert min(ankle[..., 1].min(), toes[..., 1].min()) > -0.002
    before, after = (np.abs(np.diff(clip.root_xyz_m, 3, axis=0)).max() for clip in (dance, fitted))
    assert after < 2 * before + 1e-4  # the hips sink without a jerk
    # What is no leg turns as in the dance.
    turned, wanted = kinematics.place(fitted)[1], kinematics.place(dance)[1]
    rest = [k for k, name in enumerate(JOINTS) if not name.endswith(("UpperLeg", "LowerLeg"))]
    assert rotation.angle_between(turned[:, rest], wanted[:, rest]).max() < 1e-6


@pytest.mark.parametrize("plan", PLANS.values(), ids=PLANS)
def test_a_dance_put_on_a_rig_and_brought_back_is_the_dance(dance, plan):
    rig = author(take("wave", n_beats=8, interval_s=0.5).clip, plan)
    mapping = map_joints(rig.skeleton)
    character = measure(rig, mapping)
    worn = put_on(fit(dance, character.figure), character)
    assert worn.skeleton.joints == rig.skeleton.joints
    position, _ = kinematics.place(worn)
    figure, _ = kinematics.place(fit(dance, character.figure))
    for name, k in character.at.items():
        if name.endswith(("Arm", "Hand", "Leg", "Foot")):
            np.testing.assert_allclose(position[:, k], figure[:, JOINTS.index(name)], atol=0.02)
    back = retarget(worn, mapping)
    angle = rotation.angle_between(back.rotation_wxyz, dance.rotation_wxyz)
    assert np.degrees(np.median(angle)) < 1.5
    assert np.degrees(np.percentile(angle, 99)) < 12


def test_what_is_not_canonical_is_refused(dance):
    rig = author(dance, RigPlan(has_root=True))
    with pytest.raises(ValueError, match="want the 22 canonical joints"):
        fit(rig, CANONICAL)


def test_what_hangs_from_the_hips_without_a_name_turns_with_them(dance):
    rig = author(dance, RigPlan())
    joints = (*rig.skeleton.joints, "tail")
    offset = np.concatenate([rig.skeleton.offset_xyz_m, [[0.0, 0.0, -0.2]]])
    turned = np.concatenate([rig.rotation_wxyz, np.tile(rotation.IDENTITY, (rig.n_frames, 1, 1))], axis=1)
    tailed = Clip(Skeleton(joints, np.append(rig.skeleton.parent, 0), offset), 30.0, rig.root_xyz_m, turned)
    character = measure(tailed, map_joints(tailed.skeleton))
    around = dance.rotation_wxyz.copy()
    around[:, 0] = rotation.mul(rotation.from_heading(1.0), around[:, 0])
    worn = put_on(fit(replace(dance, rotation_wxyz=around), character.figure), character)
    _, orientation = kinematics.place(worn)
    assert rotation.angle_between(orientation[:, 0], rotation.IDENTITY).min() > 0.5
    np.testing.assert_allclose(rotation.angle_between(orientation[:, -1], orientation[:, 0]), 0.0, atol=1e-6)
