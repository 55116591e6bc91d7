"""Clips put upright, mirrored back, and their paths brought to one unit."""

from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.health import righting
from kernels.health.body_in_motion import BodyInMotion
from kernels.skeleton.naming import map_joints
from kernels.synthetic import dancer, rigs
from kernels.synthetic.rigs import RigPlan
from kernels.types import Clip


def body(clip):
    return BodyInMotion(clip, map_joints(clip.skeleton))


def mapped(clip, place, turn):
    return Clip(
        replace(clip.skeleton, offset_xyz_m=clip.skeleton.offset_xyz_m * place),
        clip.frame_rate_hz,
        clip.root_xyz_m * place,
        clip.rotation_wxyz * np.concatenate([[1.0], turn]),
        None if clip.translation_xyz_m is None else clip.translation_xyz_m * place,
    )


@pytest.fixture
def dance():
    return dancer.take("step").clip


def test_a_body_that_stands_on_its_feet_is_left_alone(dance):
    for right in (righting.turned_upright, righting.unmirrored, righting.in_one_unit):
        assert right(body(dance)) == (None, [])


def test_y_that_points_down_is_turned_up(dance):
    down = np.array([1.0, -1.0, -1.0])
    clip, (fault,) = righting.turned_upright(body(mapped(dance, down, down)))
    assert (fault.kind, fault.verdict, fault.first, fault.last) == ("up_axis", "mended", 0, dance.n_frames - 1)
    assert "y points down" in fault.reason
    assert clip.root_xyz_m == pytest.approx(dance.root_xyz_m)
    assert clip.rotation_wxyz == pytest.approx(dance.rotation_wxyz)


def head_down(height_m):
    """Turn a take over about its hips, at a height; it sways, so that its feet are planted nowhere."""
    dance = dancer.take("kick").clip
    over = rotation.from_axis_angle(np.array([1.0, 0, 0]), np.pi)
    q = dance.rotation_wxyz.copy()
    q[:, 0] = rotation.mul(over, q[:, 0])
    sway = 0.4 * np.sin(np.arange(dance.n_frames) / 3.0)
    root = np.stack([sway, np.full(len(sway), height_m), sway], axis=1)
    return replace(dance, rotation_wxyz=q, root_xyz_m=root)


def test_a_body_head_down_without_a_floor_at_either_end_is_doubted():
    clip, (fault,) = righting.turned_upright(body(head_down(1.8)))
    assert clip is None
    assert (fault.kind, fault.verdict) == ("up_axis", "doubtful")


def test_who_stands_on_the_head_is_left_alone():
    assert righting.turned_upright(body(head_down(0.7))) == (None, [])


def test_feet_that_go_round_while_the_hips_stay_do_not_fly():
    upside_down = head_down(0.7)
    turn = rotation.from_axis_angle(np.array([0.0, 1.0, 0]), 0.8 * np.arange(upside_down.n_frames))
    aside = rotation.from_axis_angle(np.array([0.0, 0, 1.0]), 0.6)
    q = upside_down.rotation_wxyz.copy()
    q[:, 0] = rotation.mul(turn, rotation.mul(aside, q[:, 0]))
    still = np.repeat(upside_down.root_xyz_m[:1], upside_down.n_frames, axis=0)
    assert righting.in_one_unit(body(replace(upside_down, rotation_wxyz=q, root_xyz_m=still))) == (None, [])


@pytest.mark.parametrize("plan", [RigPlan(), RigPlan(axes=rigs.along_bones(), has_root=True)])
def test_a_mirrored_take_is_mirrored_back(dance, plan):
    truth = rigs.author(dance, plan)
    mirrored = mapped(truth, np.array([-1.0, 1.0, 1.0]), np.array([1.0, -1.0, -1.0]))
    clip, (fault,) = righting.unmirrored(body(mirrored))
    assert (fault.kind, fault.verdict) == ("mirrored", "mended")
    assert "knees bend" in fault.reason
    assert body(clip).position_xyz_m == pytest.approx(body(truth).position_xyz_m)
    assert np.median(righting.knee_bend(body(clip))) > 0


@pytest.mark.parametrize("leg_ratio", [0.5, 1.0, 3.0])
def test_straight_legs_are_told_by_their_toes_however_large_the_feet(leg_ratio):
    """By how far the toes point, not by how long the feet are."""
    clip = dancer.take("wave", n_beats=6).clip
    legs = [clip.skeleton.index(side + part) for side in ("left", "right") for part in ("UpperLeg", "LowerLeg", "Foot")]
    clip.rotation_wxyz[:, legs] = rotation.IDENTITY
    skeleton = replace(clip.skeleton, offset_xyz_m=clip.skeleton.offset_xyz_m * leg_ratio)
    truth = replace(clip, skeleton=skeleton, root_xyz_m=clip.root_xyz_m * leg_ratio)
    mirrored = mapped(truth, np.array([-1.0, 1.0, 1.0]), np.array([1.0, -1.0, -1.0]))
    _, (fault,) = righting.unmirrored(body(mirrored))
    assert (fault.kind, fault.verdict) == ("mirrored", "mended")
    assert righting.unmirrored(body(truth)) == (None, [])


def test_knees_that_bend_backwards_over_toes_that_point_ahead_are_refused(dance):
    q = dance.rotation_wxyz.copy()
    for name in ("leftLowerLeg", "rightLowerLeg"):
        k = dance.skeleton.index(name)
        q[:, k] = rotation.from_axis_angle(np.array([1.0, 0, 0]), -0.6)
    clip, (fault,) = righting.unmirrored(body(replace(dance, rotation_wxyz=q)))
    assert clip is None
    assert (fault.kind, fault.verdict) == ("facing", "refused")
    assert "knees bend backwards" in fault.reason


@pytest.mark.parametrize("scale", [100.0, 0.01, 1000.0])
def test_a_path_in_another_unit_is_scaled_back(dance, scale):
    clip, (fault,) = righting.in_one_unit(body(replace(dance, root_xyz_m=dance.root_xyz_m * scale)))
    assert (fault.kind, fault.verdict) == ("root_path", "mended")
    assert f"multiplied by {1 / scale:.4g}" in fault.reason
    assert clip.root_xyz_m == pytest.approx(dance.root_xyz_m)


def test_a_path_of_hips_below_a_still_root_is_scaled_back(dance):
    truth = rigs.author(dance, RigPlan(has_root=True))
    moved = truth.translation_xyz_m.copy()
    moved[:, 1] *= 100.0
    clip, (fault,) = righting.in_one_unit(body(replace(truth, translation_xyz_m=moved)))
    assert fault.verdict == "mended"
    assert clip.translation_xyz_m == pytest.approx(truth.translation_xyz_m)


def test_feet_that_fly_in_every_unit_are_refused(dance):
    away = np.arange(dance.n_frames)[:, None] * np.array([0.5, 0.3, 0.0])
    clip, (fault,) = righting.in_one_unit(body(replace(dance, root_xyz_m=dance.root_xyz_m + 50 + away)))
    assert clip is None
    assert (fault.kind, fault.verdict) == ("root_path", "refused")


def test_a_path_beyond_the_world_is_refused(dance):
    root = dance.root_xyz_m.copy()
    root[3] = 1e155
    clip, (fault,) = righting.in_one_unit(body(replace(dance, root_xyz_m=root)))
    assert clip is None
    assert (fault.kind, fault.verdict) == ("root_path", "refused")


def test_a_body_that_never_travels_or_has_one_frame_keeps_its_path(dance):
    assert righting.in_one_unit(body(replace(dance, root_xyz_m=0 * dance.root_xyz_m)))[1] == []
    one = Clip(dance.skeleton, 30.0, dance.root_xyz_m[:1], dance.rotation_wxyz[:1])
    assert righting.in_one_unit(body(one)) == (None, [])
