"""Weight effort, stops, bumps and their scaling, on motions whose answer is known."""

import numpy as np
import pytest

from kernels import rotation
from kernels.motion.motion_features import (
    FEATURE_RATE_HZ,
    at_feature_rate,
    between,
    bumps,
    contacts_at_feature_rate,
    link_directions,
    link_weights,
    motion_features,
    robust_unit,
    stops,
    weight_effort,
)
from kernels.skeleton.canonical import CANONICAL
from kernels.synthetic.dancer import place, take

ARM = np.array([-1, 0, 1]), np.array([[0.0, 1, 0], [0, 0.5, 0], [0.5, 0, 0]])


def swinging(n_frames, rate_hz, *, swing_hz=1.0, size_rad=0.5):
    """Hips, chest above them, and an arm that swings in the plane of the body: turns twice a cycle."""
    angle = size_rad * np.sin(2 * np.pi * swing_hz * np.arange(n_frames) / rate_hz)
    hips = np.tile([0.0, 1, 0], (n_frames, 1))
    chest = hips + np.array([0, 0.5, 0])
    hand = chest + 0.5 * np.stack([np.cos(angle), np.sin(angle), np.zeros(n_frames)], axis=1)
    return np.stack([hips, chest, hand], axis=1), np.tile(rotation.IDENTITY, (n_frames, 1))


def features(position, root, rate_hz, **how):
    return motion_features(position, root, parent=ARM[0], offset_xyz_m=ARM[1], frame_rate_hz=rate_hz, **how)


def test_effort_of_a_turning_link_is_its_speed_by_its_share_of_length():
    turn = np.arange(50) * 0.01
    direction = np.stack([np.tile([0.0, 1, 0], (50, 1)), np.stack([np.cos(turn), np.sin(turn), 0 * turn], 1)], axis=1)
    effort = weight_effort(direction, np.array([0.25, 0.75]))
    np.testing.assert_allclose(effort, 0.75 * 0.01 * FEATURE_RATE_HZ, rtol=1e-9)


def test_weights_are_shares_of_length():
    np.testing.assert_allclose(link_weights(ARM[1], ARM[0]), [0.5, 0.5])
    assert link_weights(CANONICAL.offset_xyz_m, CANONICAL.parent).sum() == pytest.approx(1)


def test_a_swing_stops_twice_a_cycle():
    found = features(*swinging(481, 120.0), 120.0)
    peaks = np.flatnonzero((found.rhythm[1:-1] > found.rhythm[:-2]) & (found.rhythm[1:-1] >= found.rhythm[2:])) + 1
    np.testing.assert_allclose(peaks / 120, np.arange(0.25, 4, 0.5), atol=2 / 120)
    assert np.percentile(found.rhythm, 99) == pytest.approx(1)
    assert np.percentile(found.intensity, 99) == pytest.approx(1)
    assert (found.rhythm >= 0).all()
    assert (found.rhythm == 0).any()


def test_impulses_are_one_value_a_stop():
    found = features(*swinging(481, 120.0), 120.0, width_s=0.0)
    assert np.count_nonzero(found.rhythm) == 8


def test_intensity_is_the_largest_effort_between_stops():
    values = np.array([1.0, 3, 0, 2, 5])
    np.testing.assert_array_equal(between(values, np.array([2])), [3, 3, 5, 5, 5])
    np.testing.assert_array_equal(between(values, np.array([0, 2, 2, 5])), [3, 3, 5, 5, 5])
    np.testing.assert_array_equal(between(values, np.zeros(0, np.int64)), [5] * 5)
    assert len(between(values[:0], np.array([0]))) == 0


def test_the_frame_rate_does_not_matter():
    fine = features(*swinging(481, 120.0), 120.0)
    coarse = features(*swinging(121, 30.0), 30.0)
    assert len(fine.rhythm) == len(coarse.rhythm) == 481
    np.testing.assert_allclose(coarse.effort_rad_per_s, fine.effort_rad_per_s, atol=0.05)
    np.testing.assert_allclose(coarse.rhythm, fine.rhythm, atol=0.15)


def test_where_the_dancer_stands_and_faces_does_not_matter():
    made = take("step", n_beats=6)
    position = place(made)
    root = made.clip.rotation_wxyz[:, 0]
    turn = rotation.from_heading(1.1)
    moved = rotation.apply(turn, position) + np.array([3.0, 0, -2])
    how = {"parent": CANONICAL.parent, "offset_xyz_m": CANONICAL.offset_xyz_m, "frame_rate_hz": made.clip.frame_rate_hz}
    a = motion_features(position, root, **how)
    b = motion_features(moved, rotation.mul(turn, root), **how)
    np.testing.assert_allclose(a.effort_rad_per_s, b.effort_rad_per_s, atol=1e-9)


def test_directions_are_unit_and_a_link_without_length_has_none():
    position = np.zeros((2, 3, 3))
    position[:, 1] = [0, 0.2, 0]
    position[:, 2] = [0, 0.2, 0]
    found = link_directions(position, np.tile(rotation.IDENTITY, (2, 1)), ARM[0])
    np.testing.assert_array_equal(found[0], [[0, 1, 0], [0, 0, 0]])


def test_standing_still_has_no_rhythm_and_no_intensity():
    position, root = swinging(240, 60.0, size_rad=1e-4)
    found = features(position, root, 60.0)
    assert 0 < found.effort_rad_per_s.max() < 0.02  # as measured
    assert not found.rhythm.any()
    assert not found.intensity.any()


@pytest.mark.parametrize("n_frames", [0, 1, 2, 3])
def test_shortest_clips(n_frames):
    found = features(*swinging(n_frames, 120.0), 120.0)
    assert len(found.rhythm) == len(found.intensity) == n_frames
    assert not found.rhythm.any()


def test_a_pose_before_the_take_is_no_stop_and_no_drive():
    position, root = swinging(361, 120.0)
    position = np.concatenate([position[:1] + np.array([5.0, 0, 0]), position])
    found = features(position, np.concatenate([root[:1], root]), 120.0)
    clean = features(*swinging(361, 120.0), 120.0)
    assert found.rhythm[0] == found.intensity[0] == 0
    np.testing.assert_allclose(found.rhythm[1:] / found.rhythm.max(), clean.rhythm / clean.rhythm.max(), atol=1e-9)
    for values in (found.rhythm, found.intensity):
        assert np.percentile(values, 99) == pytest.approx(1, abs=1e-12)


def test_bumps_are_cut_and_do_not_add_up():
    out = bumps(60, np.array([20.0, 22.0]), np.array([1.0, 0.5]), width_s=0.05)
    assert out[20] == 1.0
    assert out[22] < 1.0
    assert not out[:2].any()
    assert not out[41:].any()
    assert not bumps(0, np.array([3.0]), np.ones(1), width_s=0.05).size


def test_scaling_by_the_99th_percentile_or_the_largest():
    assert np.percentile(robust_unit(np.arange(1000.0)), 99) == pytest.approx(1)
    lonely = np.zeros(1000)
    lonely[3] = 7.0
    assert robust_unit(lonely)[3] == 1.0
    assert not robust_unit(np.zeros(5)).any()
    assert len(robust_unit(np.zeros(0))) == 0


def test_shallow_minima_are_no_stops():
    effort = 2 + 0.05 * np.cos(np.arange(600) / 10)
    assert len(stops(effort)[0]) == 0


def test_resampling_keeps_the_ends_and_few_frames():
    assert len(at_feature_rate(np.zeros((31, 2)), 30.0)) == 121
    np.testing.assert_allclose(at_feature_rate(np.array([0.0, 1.0]), 30.0), [0, 0.25, 0.5, 0.75, 1])
    assert len(at_feature_rate(np.zeros((1, 2)), 30.0)) == 1


def test_curves_stay_curves_at_the_feature_rate_and_three_frames_make_lines():
    time_s = np.arange(31) / 30.0
    wave = np.stack([np.sin(7 * time_s), np.cos(5 * time_s)], axis=1)
    dense_s = np.arange(121) / 120.0
    inner = slice(12, -12)  # natural ends are straight
    expected = np.stack([np.sin(7 * dense_s), np.cos(5 * dense_s)], axis=1)
    np.testing.assert_allclose(at_feature_rate(wave, 30.0)[inner], expected[inner], atol=1e-4)
    np.testing.assert_allclose(at_feature_rate(np.array([0.0, 2.0, 0.0]), 60.0), [0, 1, 2, 1, 0], atol=1e-12)
    np.testing.assert_array_equal(at_feature_rate(wave, 120.0), wave)


def test_contacts_take_the_nearest_frame():
    contact = np.array([[True, False], [False, False]])
    np.testing.assert_array_equal(contacts_at_feature_rate(~contact, 30.0, 99)[5:, 0], np.ones(94))
    assert contacts_at_feature_rate(contact[:0], 30.0, 0).shape == (0, 2)
    np.testing.assert_array_equal(contacts_at_feature_rate(contact, 30.0, 5)[:, 0], [1, 1, 1, 0, 0])


@pytest.mark.parametrize(("broken", "rate_hz"), [(np.nan, 30.0), (0.0, 0.0)])
def test_errors(broken, rate_hz):
    position, root = swinging(10, 30.0)
    position[3, 2, 1] += broken
    with pytest.raises(ValueError, match=r"position_m|frame_rate_hz"):
        features(position, root, rate_hz)


def test_four_frames_and_more_are_resampled_by_curves_and_fewer_by_lines():
    t = np.arange(31) / 30
    fine = at_feature_rate(np.sin(2 * np.pi * 2 * t), 30.0)
    np.testing.assert_allclose(fine[20:-20], np.sin(2 * np.pi * 2 * np.arange(121) / 120)[20:-20], atol=2e-3)
    bent = np.array([0.0, 1.0, 0.0])
    np.testing.assert_allclose(at_feature_rate(bent, 60.0), [0, 0.5, 1, 0.5, 0])
    assert at_feature_rate(np.append(bent, 1.0), 60.0)[1] != 0.5
    same = np.random.default_rng(0).normal(size=9)
    np.testing.assert_array_equal(at_feature_rate(same, 120.0), same)


def test_the_number_of_values_does_not_hang_on_rounding():
    for rate_hz, n in ((24.0, 50), (100.0, 206)):
        assert (n - 1) / rate_hz * 120 < round((n - 1) / rate_hz * 120)  # by the last bit
        assert len(at_feature_rate(np.zeros(n), rate_hz)) == round((n - 1) / rate_hz * 120) + 1


def test_a_drop_is_from_the_lower_of_the_two_highest_points_beside_it():
    effort = np.interp(np.arange(61), [0, 10, 20, 40, 60], [0.5, 3.0, 1.0, 8.0, 0.0])
    frame, drop = stops(effort)
    assert (frame.tolist(), drop.tolist()) == ([20], [2.0])


@pytest.mark.parametrize(("high", "low", "n"), [(1.0, 0.75, 1), (1.0, 0.85, 0), (10.0, 9.1, 1), (10.0, 9.3, 0)])
def test_a_stop_loses_a_fifth_of_a_radian_a_second_and_eight_hundredths_of_what_the_clip_moves_with(high, low, n):
    effort = np.interp(np.arange(201), [0, 100, 200], [high, low, high])
    assert len(stops(effort)[0]) == n


def test_a_bump_of_a_moment_between_frames_stands_between_them_and_ends_at_three_deviations():
    out = bumps(61, np.array([30.4]), np.ones(1), width_s=0.05)  # six frames
    np.testing.assert_allclose(out[[30, 31]], np.exp(-0.5 * (np.array([-0.4, 0.6]) / 6) ** 2))
    np.testing.assert_array_equal(np.flatnonzero(out), np.arange(13, 49))


def test_clips_of_two_frames_have_no_stop_and_of_one_no_effort():
    assert len(stops(np.array([3.0, 1.0]))[0]) == 0
    assert weight_effort(np.ones((1, 2, 3)), np.ones(2)).tolist() == [0.0]
    assert weight_effort(np.zeros((0, 2, 3)), np.ones(2)).tolist() == []


def test_effort_at_the_ends_is_that_of_the_step_there():
    angle = np.array([0.0, 0.01, 0.03, 0.06])
    direction = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)[:, None]
    np.testing.assert_allclose(weight_effort(direction, np.ones(1), rate_hz=1.0), [0.01, 0.015, 0.025, 0.03])


def test_a_body_that_turns_whole_rounds_on_the_spot_makes_no_effort():
    n = 241
    position, _ = swinging(n, 60.0, size_rad=0.0)
    heading = np.linspace(0, 6 * np.pi, n)
    turn = rotation.from_heading(heading)
    spun = rotation.apply(turn[:, None], position)
    found = features(spun, turn, 60.0)
    assert found.effort_rad_per_s.max() < 0.02
    assert not found.rhythm.any()
    assert (found.peak_effort_rad_per_s == found.effort_rad_per_s).all()  # of what stands still, as measured
