"""Poses at joints: differences by hand, thresholds from motions whose pace is known."""

import numpy as np
import pytest

from kernels.matching.connect import (
    LEAST_POSE_RAD,
    LEAST_SPEED_RAD_PER_S,
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
