"""Whether a clip can be a dancing person's."""

from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.health.body_in_motion import BodyInMotion
from kernels.health.plausible import implausible
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.naming import map_joints
from kernels.synthetic import dancer, rigs
from kernels.synthetic.rigs import RigPlan
from kernels.types import Clip, Skeleton

X = np.array([1.0, 0.0, 0.0])


def look(clip):
    righted, faults = implausible(BodyInMotion(clip, map_joints(clip.skeleton)))
    assert righted is None
    return [(fault.kind, fault.verdict) for fault in faults], " ".join(fault.reason for fault in faults)


def dog(*, trunk=1.8, arm=1.4, leg=0.6, pitch_rad=np.pi / 2):
    """A person's joints as a dog has them: the trunk lies, and the arms stand on the floor."""
    offset = CANONICAL.offset_xyz_m.copy()
    for k, name in enumerate(JOINTS):
        offset[k] *= trunk if name in ("spine", "chest", "upperChest", "neck") else 1.0
        offset[k] *= arm if name.endswith(("LowerArm", "Hand")) else 1.0
        offset[k] *= leg if name.endswith(("LowerLeg", "Foot")) else 1.0
    take = dancer.take("step").clip
    q = take.rotation_wxyz.copy()
    q[:, 0] = rotation.mul(q[:, 0], rotation.from_axis_angle(X, pitch_rad))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        k = JOINTS.index(side + "UpperLeg")
        q[:, k] = rotation.mul(rotation.from_axis_angle(X, -pitch_rad), q[:, k])
        q[:, JOINTS.index(side + "UpperArm")] = rotation.from_axis_angle(np.array([0.0, sign, 0.0]), -np.pi / 2)
        q[:, JOINTS.index(side + "LowerArm")] = rotation.IDENTITY
    return Clip(Skeleton(JOINTS, CANONICAL.parent, offset), 30.0, take.root_xyz_m * leg, q)


@pytest.mark.parametrize(
    "plan", [RigPlan(), RigPlan(axes=rigs.along_bones(), has_root=True), RigPlan(axes=rigs.lying())]
)
@pytest.mark.parametrize("move", dancer.MOVES)
def test_people_who_dance_are_plausible(move, plan):
    clip = rigs.author(dancer.take(move, n_beats=8).clip, plan)
    assert look(clip) == ([], "")


@pytest.mark.parametrize("pitch_deg", [55.0, 90.0])
def test_a_dog_is_refused_with_its_back_level_or_its_neck_high(pitch_deg):
    kinds, said = look(dog(pitch_rad=np.radians(pitch_deg)))
    assert kinds == [("proportions", "refused")]
    assert "four legs" in said


def test_a_person_on_all_fours_is_not_refused():
    assert look(dog(trunk=1.0, arm=1.0, leg=1.0))[0] == [("up_axis", "doubtful")]


def test_odd_proportions_are_doubted():
    clip = rigs.author(
        dancer.take("step").clip,
        RigPlan(stretch={s + p: 2.2 for s in ("left", "right") for p in ("LowerArm", "Hand")}),
    )
    kinds, said = look(clip)
    assert kinds == [("proportions", "doubtful")]
    assert "arms 1.4" in said


def test_limbs_that_stretch_are_doubted():
    clip = dancer.take("step").clip
    moved = np.tile(clip.skeleton.offset_xyz_m, (clip.n_frames, 1, 1))
    moved[:, JOINTS.index("leftFoot")] *= (1 + 0.3 * np.sin(np.arange(clip.n_frames) / 9.0))[:, None]
    kinds, said = look(replace(clip, translation_xyz_m=moved))
    assert kinds == [("proportions", "doubtful")]
    assert "leftLowerLeg is" in said


def test_a_body_that_lies_all_the_time_is_doubted():
    clip = dancer.take("wave").clip
    q = clip.rotation_wxyz.copy()
    q[:, 0] = rotation.mul(rotation.from_axis_angle(X, -np.pi / 2), q[:, 0])
    kinds, said = look(replace(clip, rotation_wxyz=q))
    assert kinds == [("up_axis", "doubtful")]
    assert "trunk lies" in said


@pytest.mark.parametrize(("factor", "word"), [(10.0, "speeded up"), (0.1, "slowed")])
def test_a_pace_that_no_person_has_is_doubted(factor, word):
    clip = dancer.take("step", n_beats=12, frame_rate_hz=30.0 if factor > 1 else 240.0).clip
    kinds, said = look(replace(clip, frame_rate_hz=clip.frame_rate_hz * factor))
    assert kinds == [("rate", "doubtful")]
    assert word in said


def test_rates_at_which_nobody_records_are_doubted():
    clip = dancer.take("kick", frame_rate_hz=30.0).clip
    for rate_hz in (8.0, 1000.0):
        kinds, said = look(replace(clip, frame_rate_hz=rate_hz))
        assert kinds == [("rate", "doubtful")]
        assert f"{rate_hz:g} frames a second" in said


def test_a_rest_pose_that_is_nobodys_is_doubted_where_no_limb_bends():
    stiff = dancer.take("idle", n_beats=4).clip
    q = np.tile(rotation.IDENTITY, (stiff.n_frames, 22, 1))
    stiff = rigs.author(replace(stiff, rotation_wxyz=q), RigPlan(axes=rigs.along_bones()))
    kinds, said = look(stiff)
    assert kinds == [("rest_pose", "doubtful")]
    assert "T-pose" in said
