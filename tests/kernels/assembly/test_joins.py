"""Shapes of blends: ends, the seam itself, nothing to do, and how rough each is."""

from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.assembly.blend import assemble
from kernels.assembly.joins import PROBE_S, SHAPES, Side, ease, one_way_slerp
from kernels.motion.velocity import jerk
from kernels.skeleton.canonical import CANONICAL
from schemas.settings import DanceSettings

HALF_S = 0.2


def side(place_m, speed_m_per_s, angle_rad, spin_rad_per_s, x):
    """A body of two joints that travels along x and turns about a slanted axis, evenly."""
    axis = np.array([0.6, 0.0, 0.8])

    def at(time_s):
        root = np.stack([place_m + speed_m_per_s * time_s, np.ones_like(time_s), np.zeros_like(time_s)], -1)
        turn = rotation.exp((angle_rad + spin_rad_per_s * time_s)[:, None] * axis)
        return root, np.stack([turn, rotation.mul(turn, turn)], axis=1)

    return Side(*at(x * HALF_S), *at(np.array([-PROBE_S, 0.0, PROBE_S])))


def test_ease_rises_without_slope_at_its_ends():
    np.testing.assert_allclose(ease(np.array([-1.0, 0.0, 0.5, 1.0, 2.0])), [0, 0, 0.5, 1, 1])
    assert ease(np.array([0.01]))[0] < 4e-4


@pytest.mark.parametrize("shape", SHAPES)
def test_a_blend_starts_on_the_one_clip_is_midway_on_the_seam_and_ends_on_the_other(shape):
    x = np.array([-1.0, 0.0, 1.0])
    before, after = side(0.0, 0.0, 0.0, 0.0, x), side(0.2, 0.0, 0.8, 0.0, x)
    root, turned = SHAPES[shape](x, HALF_S, before, after)
    np.testing.assert_allclose(root[:, 0], [0, 0.1, 0.2], atol=1e-12)
    angle = rotation.angle_between(rotation.IDENTITY, turned)
    np.testing.assert_allclose(angle, np.outer([0, 0.5, 1], [0.8, 1.6]), atol=1e-7)


@pytest.mark.parametrize("shape", SHAPES)
def test_one_clip_going_on_is_left_alone(shape):
    x = np.linspace(-1, 1, 41)
    same = side(0.1, 0.7, 0.2, 1.1, x)
    root, turned = SHAPES[shape](x, HALF_S, same, same)
    np.testing.assert_allclose(root, same.root_xyz_m, atol=1e-12)
    np.testing.assert_allclose(rotation.angle_between(turned, same.rotation_wxyz), 0, atol=1e-7)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_blend_joins_place_and_speed_of_both_clips(shape):
    x = np.linspace(-1, 1, 4001)
    before, after = side(0.0, 0.8, 0.0, 2.0, x), side(0.05, -0.4, 0.3, -1.0, x)
    root, turned = SHAPES[shape](x, HALF_S, before, after)
    step_s = HALF_S / 2000
    speed = np.diff(root[:, 0]) / step_s
    spin = rotation.log(rotation.mul(turned[1:], rotation.inv(turned[:-1]))) / step_s
    assert np.abs(np.diff(speed)).max() < 0.02
    assert np.abs(np.diff(spin, axis=0)).max() < 0.06
    if shape != "linear_slerp":
        np.testing.assert_allclose([speed[0], speed[-1]], [0.8, -0.4], atol=0.02)


def test_a_linear_share_has_a_kink_at_its_ends_and_the_others_do_not():
    x = np.linspace(-1, 1, 401)
    before, after = side(0.0, 0.0, 0.0, 0.0, x), side(0.2, 0.0, 0.0, 0.0, x)
    first = {name: SHAPES[name](x, HALF_S, before, after)[0][1, 0] for name in SHAPES}
    assert first["linear_slerp"] == pytest.approx(0.2 / 400)
    assert max(first["slerp"], first["inertial"]) < 0.01 * first["linear_slerp"]


def test_settings_know_the_shapes():
    for name in SHAPES:
        assert DanceSettings(blend_shape=name).blend_shape == name
    with pytest.raises(ValueError, match="blend_shape"):
        DanceSettings(blend_shape="cut")


@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_is_far_smoother_than_a_cut(shape, phrases, clips):
    steps = phrases(("step", 0.25, 6, 0.5, 0.5), ("wave", 0.75, 6, 0.5, 0.5), blend_s=0.4)
    asked = {"skeleton": CANONICAL, "frame_rate_hz": 60.0, "duration_s": float(steps.song_end_s[-1])}
    blended = assemble(steps, clips, shape=shape, **asked)
    cut = assemble(replace(steps, blend_s=np.zeros(len(steps.blend_s))), clips, shape=shape, **asked)
    assert jerk(blended.position_xyz_m, 60.0).max() < 0.5 * jerk(cut.position_xyz_m, 60.0).max()


def test_an_unknown_shape_is_refused(phrases, clips):
    steps = phrases(("step", 0.25, 6, 0.5, 0.5))
    with pytest.raises(ValueError, match="want one of slerp, linear_slerp, inertial, got 'cut'"):
        assemble(steps, clips, skeleton=CANONICAL, frame_rate_hz=60.0, duration_s=3.0, shape="cut")


def turning(start_deg, end_deg, n=13):
    """A hand that turns evenly about its own axis, (n, 1, 4)."""
    angle = np.radians(np.linspace(start_deg, end_deg, n))
    return rotation.from_axis_angle(np.array([1.0, 0.0, 0.0]), angle)[:, None]


@pytest.mark.parametrize("apart_deg", [(150, 150), (150, 210), (170, 190), (195, 165), (150, 240)])
def test_hands_that_differ_by_half_a_turn_go_one_way_round(apart_deg):
    """Thirteen frames at 30 a second; the shorter arc changes its side in the midst of the blend."""
    before, after = turning(0, 0), turning(*apart_deg)
    share = ease(np.linspace(0, 1, 13))
    mixed = one_way_slerp(before, after, share)
    steps = np.degrees(rotation.angle_between(mixed[:-1], mixed[1:]))
    assert steps.max() < 45
    np.testing.assert_allclose(rotation.angle_between(mixed[[0, -1]], np.stack([before[0], after[-1]])), 0, atol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(mixed, axis=-1), 1, atol=1e-12)


def test_the_way_round_is_the_shorter_one_where_both_clips_have_a_say():
    before, after = turning(0, 0), turning(190, 150)
    share = np.full(13, 0.5)
    mixed = one_way_slerp(before, after, share)
    angle = np.degrees(2 * np.arctan2(mixed[:, 0, 1], mixed[:, 0, 0]))
    np.testing.assert_allclose(angle, np.linspace(95, 75, 13), atol=1e-9)


def test_poses_less_than_half_a_turn_apart_take_the_shorter_arc(clips):
    one, two = (clips[name].rotation_wxyz[40:60] for name in ("step", "twist"))
    share = np.linspace(0, 1, 20)
    wanted = rotation.slerp(one, two, share[:, None])
    np.testing.assert_allclose(rotation.angle_between(one_way_slerp(one, two, share), wanted), 0, atol=1e-7)
    assert one_way_slerp(one[:0], two[:0], share[:0]).shape == (0, 22, 4)
