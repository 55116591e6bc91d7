"""The examination of clips: what comes out of clean takes and of takes with one thing wrong."""

from dataclasses import replace

import numpy as np
import pytest

from assets.formats import bvh
from kernels import rotation
from kernels.health.body_in_motion import BodyInMotion
from kernels.health.examine import examine
from kernels.skeleton.naming import map_joints
from kernels.synthetic import dancer, rigs
from kernels.synthetic.rigs import RigPlan
from kernels.types import Clip

RIGS = {
    "own": None,
    "along bones": RigPlan(axes=rigs.along_bones(), has_root=True),
    "arms down, twisted, no toes": RigPlan(
        axes=rigs.a_pose(), twisted=("leftLowerArm", "rightUpperLeg"), without=("leftToes", "rightToes")
    ),
}


def take(move="step", rate_hz=30.0, rig="own", n_beats=10):
    clip = dancer.take(move, n_beats=n_beats, frame_rate_hz=rate_hz).clip
    return clip if RIGS[rig] is None else rigs.author(clip, RIGS[rig])


def look(clip):
    return examine(clip, map_joints(clip.skeleton))


def turned(clip, joint, first, last, angle_rad, axis=(0.6, 0.0, 0.8)):
    q = clip.rotation_wxyz.copy()
    k = clip.skeleton.index(joint)
    by = rotation.from_axis_angle(np.array(axis), angle_rad)
    q[first : last + 1, k] = rotation.mul(q[first : last + 1, k], by)
    return replace(clip, rotation_wxyz=q)


def off_deg(a: Clip, b: Clip):
    return float(np.degrees(rotation.angle_between(a.rotation_wxyz, b.rotation_wxyz)).max())


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("move", dancer.MOVES)
@pytest.mark.parametrize("rate_hz", [24.0, 120.0])
def test_clean_dances_raise_nothing(move, rate_hz, rig):
    clip = take(move, rate_hz, rig)
    found = look(clip)
    assert found.faults == ()
    assert found.clip is clip
    assert found.is_fenced.shape == (clip.n_frames,)


@pytest.mark.parametrize("rate_hz", [24.0, 60.0, 240.0])
@pytest.mark.parametrize("joint", ["hips", "leftHand", "head", "rightToes", "spine"])
def test_a_flip_of_one_frame_is_mended_and_said(joint, rate_hz):
    clip = take("wave", rate_hz)
    at = round(1.2 * rate_hz)
    found = look(turned(clip, joint, at, at, 1.6))
    assert [(f.kind, f.verdict, f.joint, f.first, f.last) for f in found.faults] == [("flip", "mended", joint, at, at)]
    assert "turns 92° in one frame" in found.faults[0].reason
    assert off_deg(found.clip, clip) < 1.0
    assert not found.is_fenced.any()


def test_a_sign_or_a_whole_turn_is_no_flip():
    clip = take("kick")
    q = clip.rotation_wxyz.copy()
    q[20:31, 5] *= -1.0
    assert look(replace(clip, rotation_wxyz=q)).faults == ()


def test_a_flip_that_stays_is_fenced_on_both_sides():
    clip = take("bounce")
    found = look(turned(clip, "leftFoot", 60, clip.n_frames - 1, 2.0))
    assert {(f.kind, f.verdict, f.joint) for f in found.faults} == {("flip", "fenced", "leftFoot")}
    assert np.flatnonzero(found.is_fenced).tolist() == [59, 60]
    assert found.clip.rotation_wxyz[70, clip.skeleton.index("leftFoot")] == pytest.approx(
        turned(clip, "leftFoot", 60, 200, 2.0).rotation_wxyz[70, clip.skeleton.index("leftFoot")]
    )


def test_half_a_second_of_flips_is_fenced_and_named_for_its_gimbal():
    clip = take("rock", 60.0)
    rng = np.random.default_rng(3)
    bad = clip
    for frame in range(60, 90):
        bad = turned(bad, "rightUpperArm", frame, frame, rng.uniform(1.0, 3.0), axis=(0.0, 1.0, 0.0))
    found = look(bad)
    assert {f.verdict for f in found.faults} == {"fenced"}
    assert "gimbal" in {f.kind for f in found.faults}
    assert found.is_fenced[60:90].all()
    assert found.is_fenced.sum() <= 34


def test_a_pop_of_the_root_is_mended():
    clip = take("twist")
    root = clip.root_xyz_m.copy()
    root[40:42] += [0.2, 0.1, 0.0]
    found = look(replace(clip, root_xyz_m=root))
    assert [(f.kind, f.verdict, f.first, f.last) for f in found.faults] == [("pop", "mended", 40, 41)]
    assert np.abs(found.clip.root_xyz_m - clip.root_xyz_m).max() < 0.005


def test_hips_that_move_below_a_still_root_are_mended_too():
    clip = take("twist", rig="along bones")
    moved = clip.translation_xyz_m.copy()
    moved[50, 1] += [0.0, 0.0, 0.4]
    found = look(replace(clip, translation_xyz_m=moved))
    assert [(f.kind, f.verdict, f.first, f.last) for f in found.faults] == [("pop", "mended", 50, 50)]
    assert np.abs(found.clip.translation_xyz_m - clip.translation_xyz_m).max() < 0.005


def test_a_joint_that_turns_fast_and_smoothly_is_fenced_without_a_flip():
    clip = take("idle")
    angle = np.zeros(clip.n_frames)
    angle[50:58] = np.cumsum(np.radians([10, 30, 50, 55, 50, 30, 10, 0]))
    angle[58:] = angle[57]
    q = clip.rotation_wxyz.copy()
    k = clip.skeleton.index("leftLowerArm")
    q[:, k] = rotation.mul(q[:, k], rotation.from_axis_angle(np.array([1.0, 0, 0]), angle))
    found = look(replace(clip, rotation_wxyz=q))
    assert {(f.kind, f.verdict) for f in found.faults} == {("fast", "fenced")}
    assert np.flatnonzero(found.is_fenced).tolist() == [51, 52, 53, 54]


def test_a_spin_is_shown_however_fast_the_body_turns():
    clip = take("idle")
    spin = rotation.from_heading(np.radians(60.0) * np.clip(np.arange(clip.n_frames) - 40, 0, 12))
    q = clip.rotation_wxyz.copy()
    q[:, 0] = rotation.mul(spin, q[:, 0])
    found = look(replace(clip, rotation_wxyz=q, root_xyz_m=rotation.apply(spin, clip.root_xyz_m)))
    assert {f.kind for f in found.faults} <= {"fast"}
    assert not found.is_fenced[43:50].any()


def test_a_clip_of_which_little_is_left_is_refused():
    clip = take("bounce", n_beats=5)
    rng = np.random.default_rng(1)
    bad = clip
    for frame in range(5, clip.n_frames - 6):
        axis = rng.standard_normal(3)
        bad = turned(bad, "head", frame, frame, rng.uniform(1.5, 3.0), axis=axis / np.linalg.norm(axis))
    found = look(bad)
    assert "are left to show" in found.refusal
    assert "head" in found.refusal


def test_a_clip_of_no_frames_or_one_has_no_faults():
    clip = take()
    for n in (0, 1, 2, 3):
        few = Clip(clip.skeleton, 30.0, clip.root_xyz_m[:n], clip.rotation_wxyz[:n])
        assert look(few).faults == ()


def test_wrongs_of_the_whole_are_righted_before_frames_are_looked_at():
    clip = take("kick")
    down = np.array([1.0, -1.0, -1.0])
    upside_down = Clip(
        replace(clip.skeleton, offset_xyz_m=clip.skeleton.offset_xyz_m * down),
        30.0,
        clip.root_xyz_m * down,
        clip.rotation_wxyz * np.concatenate([[1.0], down]),
    )
    found = look(turned(upside_down, "head", 33, 33, 2.0))
    assert [(f.kind, f.verdict) for f in found.faults] == [("up_axis", "mended"), ("flip", "mended")]
    assert off_deg(found.clip, clip) < 1.0
    assert found.clip.root_xyz_m == pytest.approx(clip.root_xyz_m)


@pytest.fixture
def cases(data_dir):
    folder = data_dir / "cases" / "clips"
    if not folder.is_dir():
        pytest.skip("no field cases there")
    return folder


def look_at(path):
    taken = bvh.to_clip(bvh.read(path))
    return examine(taken.clip, taken.mapping)


@pytest.mark.parametrize(
    "name",
    [
        "plain",
        "guard_armature_minus_90",
        "guard_rest_collapsed",
        "guard_rest_first_frame_crouched",
        "guard_root_without_position",
    ],
)
def test_field_cases_that_are_right_raise_nothing(cases, name):
    assert look_at(cases / f"{name}.bvh").faults == ()


@pytest.mark.parametrize(("name", "kind"), [("left_handed_x", "mirrored"), ("offsets_m_root_cm", "root_path")])
def test_field_cases_that_are_wrong_as_a_whole_are_put_right(cases, name, kind):
    found = look_at(cases / f"{name}.bvh")
    assert [(f.kind, f.verdict) for f in found.faults] == [(kind, "mended")]
    truth = np.load(cases / "truth.npz")
    body = BodyInMotion(found.clip, map_joints(found.clip.skeleton))
    at = [found.clip.skeleton.index(str(joint)) for joint in truth["joints"]]
    assert np.abs(body.position_xyz_m[:, at] - truth["position_xyz_m"]).max() < 1e-3


def test_a_field_case_of_two_dancers_is_refused(cases):
    found = look_at(cases / "couple_namespaces.bvh")
    assert "'Ann:Hips'" in found.refusal
    assert "'Bob:Hips'" in found.refusal
