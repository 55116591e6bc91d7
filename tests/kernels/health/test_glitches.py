"""What becomes of jumps: mended, fenced, told once."""

from dataclasses import replace

import numpy as np

from kernels import rotation
from kernels.health import glitches
from kernels.health.body_in_motion import BodyInMotion
from kernels.health.verdicts import ClipFault
from kernels.skeleton.naming import map_joints
from kernels.synthetic import dancer


def body(clip):
    return BodyInMotion(clip, map_joints(clip.skeleton))


def none(clip):
    return np.zeros(clip.n_frames, bool)


def spoilt(clip, joints, frames, angle_rad):
    q = clip.rotation_wxyz.copy()
    for joint in joints:
        k = clip.skeleton.index(joint)
        q[frames, k] = rotation.mul(q[frames, k], rotation.from_axis_angle(np.array([0.0, 1.0, 0.0]), angle_rad))
    return replace(clip, rotation_wxyz=q)


def test_a_clean_take_comes_back_as_it_is():
    clip = dancer.take("kick").clip
    assert glitches.mend(body(clip), none(clip)) == (clip, [])


def test_several_joints_of_one_frame_are_mended_and_told_once():
    clip = dancer.take("twist").clip
    mended, (fault,) = glitches.mend(body(spoilt(clip, ["head", "leftHand", "rightFoot"], [31], 1.2)), none(clip))
    assert (fault.kind, fault.verdict, fault.first, fault.last) == ("flip", "mended", 31, 31)
    assert "so do 2 more joints" in fault.reason
    assert np.degrees(rotation.angle_between(mended.rotation_wxyz, clip.rotation_wxyz)).max() < 1.0


def test_a_few_frames_are_mended_and_many_are_fenced():
    clip = dancer.take("bounce", frame_rate_hz=60.0).clip
    _, (few,) = glitches.mend(body(spoilt(clip, ["leftUpperArm"], range(80, 85), 1.2)), none(clip))
    assert (few.verdict, few.first, few.last) == ("mended", 80, 84)
    bad = spoilt(clip, ["leftUpperArm"], range(80, 110), 1.2)
    same, (many,) = glitches.mend(body(bad), none(clip))
    assert (many.verdict, many.first, many.last) == ("fenced", 79, 110)
    assert "not shown" in many.reason
    assert same is bad


def test_a_bad_first_or_last_frame_is_fenced_since_one_side_is_missing():
    clip = dancer.take("bounce").clip
    _, faults = glitches.mend(body(spoilt(clip, ["leftUpperArm"], [0], 1.2)), none(clip))
    assert [(f.verdict, f.first) for f in faults] == [("fenced", 0)]
    _, faults = glitches.mend(body(spoilt(clip, ["leftUpperArm"], [clip.n_frames - 1], 1.2)), none(clip))
    assert [(f.verdict, f.last) for f in faults] == [("fenced", clip.n_frames - 1)]


def test_takes_that_were_joined_are_cut_where_many_joints_jump_together():
    clip = dancer.take("idle").clip
    many = ["leftUpperArm", "rightUpperArm", "leftLowerArm", "rightLowerArm", "head", "spine"]
    _, faults = glitches.mend(body(spoilt(clip, many, range(100, clip.n_frames), 0.6)), none(clip))
    assert {(f.verdict, f.first, f.last) for f in faults} == {("fenced", 99, 100)}
    assert glitches.mend(body(spoilt(clip, many[:1], range(100, clip.n_frames), 0.6)), none(clip))[1] == []


def test_faults_of_one_kind_in_the_same_frames_are_told_once():
    a, b = (ClipFault("flip", joint, 3, 4, "fenced", f"{joint} turns") for joint in ("head", "neck"))
    c = ClipFault("flip", "head", 1, 1, "mended", "head turned")
    told = glitches.told_once([a, b, c])
    assert [f.first for f in told] == [1, 3]
    assert told[1].reason == "head turns; so does neck"
    assert glitches.told_once([]) == []


def test_half_turns_there_and_back_are_told_from_one_turn_that_goes_on():
    clip = dancer.take("idle").clip
    k = clip.skeleton.index("head")
    turning = rotation.from_axis_angle(np.array([0.0, 1.0, 0.0]), 0.05 * np.arange(clip.n_frames))
    q = clip.rotation_wxyz.copy()
    q[:, k] = rotation.mul(q[:, k], turning)
    clip = replace(clip, rotation_wxyz=rotation.continuous(q))
    for angle_rad in (3.0, np.pi, 3.3):
        mended, (fault,) = glitches.mend(body(spoilt(clip, ["head"], [31], angle_rad)), none(clip))
        assert (fault.kind, fault.verdict, fault.first, fault.last) == ("flip", "mended", 31, 31)
        assert np.degrees(rotation.angle_between(mended.rotation_wxyz, clip.rotation_wxyz)).max() < 1.0
