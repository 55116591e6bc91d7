"""Bodies that slide."""

from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.health.body_in_motion import BodyInMotion
from kernels.health.slides import slides
from kernels.skeleton.naming import map_joints
from kernels.synthetic import dancer, rigs
from kernels.synthetic.rigs import RigPlan


def body(clip):
    return BodyInMotion(clip, map_joints(clip.skeleton))


def pushed(clip, first, n, way_m):
    share = np.clip((np.arange(clip.n_frames) - first) / n, 0, 1)
    return replace(clip, root_xyz_m=clip.root_xyz_m + share[:, None] * np.array([0.0, 0.0, way_m]))


def found(clip, hidden=False):
    return slides(body(clip), np.full(clip.n_frames, hidden))


@pytest.mark.parametrize("move", dancer.MOVES)
@pytest.mark.parametrize("rate_hz", [24.0, 120.0])
def test_planted_feet_do_not_slide(move, rate_hz):
    clip = dancer.take(move, n_beats=8, frame_rate_hz=rate_hz).clip
    assert found(clip) == []
    assert found(rigs.author(clip, RigPlan(without=("leftToes", "rightToes")))) == []


@pytest.mark.parametrize("rate_hz", [24.0, 30.0, 120.0])
def test_feet_that_glide_a_metre_are_fenced(rate_hz):
    clip = pushed(dancer.take("bounce", frame_rate_hz=rate_hz).clip, round(2 * rate_hz), round(rate_hz), 1.0)
    (fault,) = found(clip)
    assert (fault.kind, fault.verdict) == ("sliding", "fenced")
    assert abs(fault.first - 2 * rate_hz) <= max(2, rate_hz / 20)
    assert abs(fault.last - 3 * rate_hz) <= max(2, rate_hz / 20)
    assert "glide" in fault.reason
    assert found(clip, hidden=True) == []


def test_a_still_pose_that_drifts_slides_however_slowly():
    idle = dancer.take("idle").clip
    (fault,) = found(pushed(idle, 40, 30, 0.25))
    assert (fault.kind, fault.first, fault.last) == ("sliding", 40, 70)
    assert "pose stands still" in fault.reason
    assert found(pushed(idle, 40, 30, 0.05)) == []


def test_a_leap_is_no_slide():
    clip = dancer.take("bounce").clip
    up = np.zeros((clip.n_frames, 3))
    up[60:80, 1] = 0.3
    leap = pushed(clip, 62, 16, 1.2)
    assert found(replace(leap, root_xyz_m=leap.root_xyz_m + up)) == []


@pytest.mark.parametrize("rate_hz", [30.0, 120.0])
@pytest.mark.parametrize("deg_per_s", [540.0, 1440.0])
def test_a_spin_on_both_feet_is_no_slide(rate_hz, deg_per_s):
    for move in ("idle", "wave"):
        assert found(spun(dancer.take(move, n_beats=8, frame_rate_hz=rate_hz).clip, deg_per_s, beside_m=0.06)) == []


def test_who_stands_on_the_head_may_spin_there_and_who_stands_upright_and_far_from_the_axis_glides():
    clip = dancer.take("idle", n_beats=8).clip
    half = rotation.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.pi)
    turned = replace(clip, rotation_wxyz=clip.rotation_wxyz.copy())
    turned.rotation_wxyz[:, 0] = rotation.mul(half, turned.rotation_wxyz[:, 0])
    assert found(spun(turned, 900.0, beside_m=0.1)) == []
    assert "glide" in found(spun(clip, 540.0, beside_m=0.5))[0].reason


def spun(clip, deg_per_s, *, beside_m=0.0):
    """Turn a take evenly about a vertical axis through its hips, or beside them."""
    angle = np.radians(deg_per_s) * np.arange(clip.n_frames) / clip.frame_rate_hz
    turn = rotation.from_axis_angle(np.array([0.0, 1.0, 0.0]), angle)
    axis = clip.root_xyz_m.mean(axis=0) * [1.0, 0.0, 1.0] + [beside_m, 0.0, 0.0]
    turned = clip.rotation_wxyz.copy()
    turned[:, 0] = rotation.mul(turn, turned[:, 0])
    root = rotation.apply(turn, clip.root_xyz_m - axis) + axis
    return replace(clip, root_xyz_m=root, rotation_wxyz=rotation.continuous(turned))
