"""Motions made comparable."""

import numpy as np
import pytest

from kernels import rotation
from kernels.search.normalise import (
    N_CHANNELS,
    TRAVEL,
    channels,
    heading_rad,
    leg_length_m,
    normalise,
    resample,
)
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS, LEG_LENGTH_M

REST = kinematics.rest_position(CANONICAL)[None]


@pytest.mark.parametrize("degrees", [0, 45, 90, 135, 180, 225, 270, 315])
def test_facing_is_found_all_round(degrees):
    """At 90 and 180 degrees the arc tangent of a quotient fails; both arguments apart do not."""
    angle = np.radians(degrees)
    turned = rotation.apply(rotation.from_heading(angle), REST)
    assert np.angle(np.exp(1j * (heading_rad(turned)[0] - angle))) == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(normalise(turned), normalise(REST), atol=1e-12)


def test_first_frame_goes_to_the_origin_and_the_path_stays(dance):
    moved = rotation.apply(rotation.from_heading(2.0), dance) + np.array([5.0, 0.0, -3.0])
    path = normalise(moved)
    np.testing.assert_allclose(path, normalise(dance), atol=1e-9)
    np.testing.assert_allclose(path[0, 0, [0, 2]], 0, atol=1e-12)
    travelled = np.linalg.norm((dance[-1, 0] - dance[0, 0])[[0, 2]])
    scale = LEG_LENGTH_M / leg_length_m(dance)
    assert np.linalg.norm(path[-1, 0, [0, 2]]) == pytest.approx(scale * travelled, abs=1e-9)


def test_every_frame_by_itself_forgets_travel(dance):
    each = normalise(dance, per_frame=True)
    np.testing.assert_allclose(each[:, 0, [0, 2]], 0, atol=1e-12)
    np.testing.assert_allclose(np.angle(np.exp(1j * heading_rad(each))), 0, atol=1e-9)


@pytest.mark.parametrize("factor", [0.5, 1.0, 1.7])
def test_size_is_that_of_the_legs(dance, factor):
    np.testing.assert_allclose(normalise(factor * dance), normalise(dance), atol=1e-9)
    np.testing.assert_allclose(normalise(factor * REST, is_sized=False)[0, 0, 1], factor * REST[0, 0, 1])


def test_heading_goes_on_where_the_hips_stand_one_above_the_other():
    sideways = rotation.apply(rotation.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.pi / 2), REST)
    turned = rotation.apply(rotation.from_heading(1.0), REST)
    angle = heading_rad(np.concatenate([turned, sideways, turned]))
    np.testing.assert_allclose(angle, 1.0, atol=1e-9)
    np.testing.assert_array_equal(heading_rad(sideways), [0.0])


def test_heading_does_not_jump_by_whole_turns():
    angle = np.linspace(0, 6 * np.pi, 100)
    spun = np.concatenate([rotation.apply(rotation.from_heading(a), REST) for a in angle])
    np.testing.assert_allclose(heading_rad(spun), angle, atol=1e-9)


def test_frame_rate_changes_nothing():
    time_s = {rate: np.arange(int(2 * rate) + 1) / rate for rate in (30.0, 120.0)}
    sway = {rate: REST + np.sin(3 * t)[:, None, None] * np.array([0.1, 0.0, 0.0]) for rate, t in time_s.items()}
    a, b = (resample(sway[rate], rate, 0.5, 1.5) for rate in (30.0, 120.0))
    assert len(a) == len(b) == 16
    np.testing.assert_allclose(a, b, atol=1e-3)


@pytest.mark.parametrize(("start_s", "end_s", "n"), [(0, 1, 16), (0.5, 0.5, 1), (0, 9, 31), (2.0, 2.0, 1)])
def test_a_stretch_ends_with_the_clip(start_s, end_s, n):
    assert resample(np.repeat(REST, 61, axis=0), 30.0, start_s, end_s).shape == (n, 22, 3)


def test_one_frame_stands_still():
    found = channels(REST)
    assert found.shape == (1, N_CHANNELS)
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found[0, 66:], 0)


def test_without_travel_a_walk_on_the_spot_is_a_walk(dance):
    walked = dance + np.linspace(0, 3, len(dance))[:, None, None] * np.array([0.0, 0.0, 1.0])
    on_spot, away = (channels(m, has_travel=False) for m in (dance, walked))
    np.testing.assert_allclose(away, on_spot, atol=1e-4)
    assert np.abs(channels(walked)[:, TRAVEL] - channels(dance)[:, TRAVEL]).max() > 1


@pytest.mark.parametrize("shape", [(0, 22, 3), (4, 21, 3), (4, 22)])
def test_other_shapes_are_refused(shape):
    with pytest.raises(ValueError, match="position_xyz_m: want"):
        normalise(np.zeros(shape))


def test_gaps_are_refused():
    with pytest.raises(ValueError, match="finite"):
        normalise(np.full((2, 22, 3), np.nan))


def test_a_leg_is_the_median_over_frames_of_both_sides_mean():
    legs = np.repeat(REST, 5, axis=0)
    legs[0] *= 9.0
    assert leg_length_m(legs) == pytest.approx(LEG_LENGTH_M)
    longer = REST.copy()
    left = [JOINTS.index(f"left{part}") for part in ("LowerLeg", "Foot")]
    longer[:, left[1], 1] -= 0.2  # one shin 20 cm longer
    assert leg_length_m(longer) == pytest.approx(LEG_LENGTH_M + 0.1)


def test_a_body_without_legs_keeps_its_size():
    np.testing.assert_array_equal(normalise(np.zeros((2, 22, 3))), np.zeros((2, 22, 3)))


def test_hips_that_are_not_yet_seen_face_as_they_do_when_they_are():
    sideways = rotation.apply(rotation.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.pi / 2), REST)
    turned = rotation.apply(rotation.from_heading(1.0), REST)
    np.testing.assert_allclose(heading_rad(np.concatenate([sideways, turned])), 1.0, atol=1e-9)


def test_a_stretch_lies_straight_between_frames_and_one_beyond_the_clip_is_its_end():
    rising = np.arange(4.0)[:, None, None] * np.ones((1, 22, 3))
    np.testing.assert_allclose(resample(rising, 1.0, 0.5, 2.5, rate_hz=2.0)[:, 0, 0], [0.5, 1.0, 1.5, 2.0, 2.5])
    np.testing.assert_allclose(resample(rising, 1.0, 2.0, 99.0, rate_hz=2.0)[:, 0, 0], [2.0, 2.5, 3.0])
    np.testing.assert_allclose(resample(rising, 1.0, 7.0, 9.0)[:, 0, 0], [3.0])
    np.testing.assert_allclose(resample(rising[:1], 1.0, 0.0, 9.0)[:, 0, 0], [0.0])
