"""Poses at joints: differences by hand, thresholds from motions whose pace is known."""

import numpy as np
import pytest

from kernels.matching.connect import (
    LEAST_POSE_RAD,
    LEAST_SPEED_RAD_PER_S,
    ConnectionThresholds,
    JointPoses,
    calibrate,
    connects,
    differences,
    own_changes,
    poses_at,
)


def turning(n_frames, rad_per_s):
    """One link that turns evenly, (F, 1, 3)."""
    angle = np.arange(n_frames) / 120 * rad_per_s
    return np.stack([np.cos(angle), np.sin(angle), np.zeros(n_frames)], axis=1)[:, None]


WEIGHT = np.ones(1)


def test_velocity_is_that_of_the_turn_at_the_pace_of_the_dance():
    found = poses_at(turning(60, 2.0), np.array([0.25, 0.25]), pace=np.array([1.0, 0.5]))
    np.testing.assert_allclose(np.linalg.norm(found.velocity, axis=-1)[:, 0], [2.0, 1.0], rtol=1e-3)


def test_differences_of_a_quarter_turn():
    a = JointPoses(np.array([[[1.0, 0, 0]]]), np.array([[[0.0, 2, 0]]]))
    b = JointPoses(np.array([[[0.0, 1, 0]], [[1.0, 0, 0]]]), np.array([[[0.0, 2, 0]], [[0.0, -1, 0]]]))
    pose, speed = differences(a, b, WEIGHT)
    np.testing.assert_allclose(pose, [[np.pi / 2, 0]])
    np.testing.assert_allclose(speed, [[0, 3]])


def test_links_count_by_weight():
    a = JointPoses(np.array([[[1.0, 0, 0], [1, 0, 0]]]), np.zeros((1, 2, 3)))
    b = JointPoses(np.array([[[0.0, 1, 0], [1, 0, 0]]]), np.zeros((1, 2, 3)))
    pose, _ = differences(a, b, np.array([0.25, 0.75]))
    np.testing.assert_allclose(pose, np.pi / 8)


def test_thresholds_are_what_a_body_turns_by_itself():
    limits = calibrate([own_changes(turning(600, 3.0), WEIGHT, apart_s=0.1)])
    assert limits.pose_rad == pytest.approx(0.3, rel=0.01)
    assert limits.speed_rad_per_s == pytest.approx(2 * 3.0 * np.sin(0.15), rel=0.01)


def test_neighbours_of_a_clip_connect():
    direction = turning(600, 3.0)
    limits = calibrate([own_changes(direction, WEIGHT, apart_s=0.1)])
    near, far = (poses_at(direction, np.array([2.0 + d]), pace=np.ones(1)) for d in (0.05, 0.5))
    here = poses_at(direction, np.array([2.0]), pace=np.ones(1))
    assert connects(*differences(here, near, WEIGHT), limits).all()
    assert not connects(*differences(here, far, WEIGHT), limits).any()


def test_long_clips_have_no_more_say_than_short_ones():
    short, long = (own_changes(turning(n, s), WEIGHT, apart_s=0.1) for n, s in ((60, 4.0), (6000, 1.0)))
    assert calibrate([short, long]).pose_rad == pytest.approx(0.4, rel=0.01)


def test_standing_still_and_nothing_at_all_give_the_least():
    for changes in (
        [],
        [own_changes(turning(3, 1.0), WEIGHT, apart_s=0.1)],
        [own_changes(turning(60, 0), WEIGHT, apart_s=0.1)],
    ):
        limits = calibrate(changes)
        assert (limits.pose_rad, limits.speed_rad_per_s) == (LEAST_POSE_RAD, LEAST_SPEED_RAD_PER_S)


def test_one_frame_has_a_pose_and_no_velocity():
    found = poses_at(turning(1, 1.0), np.array([0.0, 9.0]), pace=np.ones(2))
    np.testing.assert_array_equal(found.velocity, np.zeros((2, 1, 3)))
    np.testing.assert_allclose(found.direction[:, 0, 0], 1)


def test_each_clip_has_the_same_say_however_long_it_is():
    short = (np.full(20, 0.4), np.full(20, 4.0))
    long = (np.full(2000, 0.1), np.full(2000, 1.0))
    assert calibrate([short, long]) == calibrate([long, short]) == ConnectionThresholds(0.4, 4.0)


def test_thresholds_are_the_95th_percentile():
    pose, speed = np.arange(1, 101) / 100, np.arange(100, 0, -1.0)
    assert calibrate([(pose, speed)]) == ConnectionThresholds(0.95, 95.0)


def test_a_clip_that_tells_nothing_does_not_count():
    told = (np.full(5, 0.3), np.full(5, 2.0))
    assert calibrate([(np.zeros(0), np.zeros(0)), told]) == ConnectionThresholds(0.3, 2.0)


def test_each_threshold_has_its_own_floor():
    assert calibrate([(np.full(5, 0.01), np.full(5, 2.0))]) == ConnectionThresholds(LEAST_POSE_RAD, 2.0)
    assert calibrate([(np.full(5, 0.3), np.full(5, 0.01))]) == ConnectionThresholds(0.3, LEAST_SPEED_RAD_PER_S)


def test_a_difference_at_its_threshold_connects_and_both_must():
    limits = ConnectionThresholds(0.5, 2.0)
    pose, speed = np.array([0.5, 0.5, 0.51, 0.1]), np.array([2.0, 2.01, 0.1, 0.1])
    np.testing.assert_array_equal(connects(pose, speed, limits), [True, False, False, True])


def test_velocity_is_taken_over_two_frames_on_either_side_and_over_what_there_is_at_the_ends():
    direction = (np.arange(6.0) ** 3)[:, None, None] * np.ones((1, 1, 3))
    found = poses_at(direction, np.array([0, 1, 3, 5]) / 120, pace=np.ones(4))
    by_hand = [(8 - 0) / 2, (27 - 0) / 3, (125 - 1) / 4, (125 - 27) / 2]  # a frame
    np.testing.assert_allclose(found.velocity[:, 0, 0], 120 * np.array(by_hand))


def test_a_pose_is_that_of_the_nearest_frame():
    direction = np.arange(6.0)[:, None, None] * np.ones((1, 1, 3))
    found = poses_at(direction, np.array([-1.0, 1.4 / 120, 1.6 / 120, 9.0]), pace=np.ones(4))
    np.testing.assert_array_equal(found.direction[:, 0, 0], [0, 1, 2, 5])


def test_a_clip_tells_of_at_most_200_moments_and_a_short_one_of_each():
    pose, speed = own_changes(turning(6000, 1.0), WEIGHT, apart_s=0.1)
    assert len(pose) == len(speed) == 200
    assert [len(own_changes(turning(n, 1.0), WEIGHT, apart_s=0.1)[0]) for n in (16, 17, 20)] == [0, 1, 4]


def test_moments_are_at_least_a_frame_apart():
    pose, _ = own_changes(turning(60, 3.0), WEIGHT, apart_s=1e-6)
    np.testing.assert_allclose(pose, 3.0 / 120)
