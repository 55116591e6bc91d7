"""Motions of a clip: made-up gestures found one by one at any rate, with noise, and what is no motion."""

import numpy as np
import pytest

from kernels import rotation
from kernels.motion.key_poses import (
    CHANGE_WEIGHT,
    PARTS,
    KeyPoses,
    _longer,
    _shorter,
    acceleration,
    angular_speed,
    key_poses,
    pose_vectors,
    to_poses,
    to_vectors,
)
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import JOINTS
from kernels.synthetic.hidden_rules import hidden_rules, perform


def performed(rate_hz=30.0, interval_s=0.5, n=40, seed=2):
    return perform(hidden_rules(seed=1), n_motions=n, interval_s=interval_s, frame_rate_hz=rate_hz, seed=seed)


def found(clip, noise_rad=0.0):
    _, world = kinematics.place(clip)
    if noise_rad:
        shake = np.random.default_rng(0).normal(0, noise_rad, (*world.shape[:2], 3))
        world = rotation.mul(world, rotation.exp(shake))
    return key_poses(angular_speed(world, clip.frame_rate_hz))


def test_sixteen_parts():
    assert len(PARTS) == len(set(PARTS)) == 16
    assert set(PARTS) <= set(JOINTS)


@pytest.mark.parametrize(
    ("rate_hz", "interval_s"), [(24.0, 0.5), (30.0, 0.5), (60.0, 0.45), (120.0, 0.6), (100.0, 0.4)]
)
def test_every_gesture_is_a_motion_whatever_the_frame_rate(rate_hz, interval_s):
    made = performed(rate_hz, interval_s)
    motions = found(made.clip)
    assert len(motions.start_s) == 40
    assert np.abs(motions.start_s - made.edge_s[:-1]).max() < 0.05
    assert (motions.start_s < motions.peak_s).all()
    assert (motions.peak_s < motions.end_s).all()
    np.testing.assert_array_equal(motions.start_s[1:], motions.end_s[:-1])


def test_noise_of_markers_changes_little():
    made = performed()
    noisy = found(made.clip, noise_rad=0.01)
    assert abs(len(noisy.start_s) - 40) <= 1
    near = np.abs(noisy.start_s[:, None] - made.edge_s[None]).min(axis=1)
    assert np.percentile(near, 95) < 0.05


def test_a_pendulum_moves_twice_a_swing():
    time_s = np.arange(0, 6, 1 / 120)
    speed = np.abs(np.cos(2 * np.pi * 0.5 * time_s))
    motions = key_poses(speed)
    np.testing.assert_allclose(motions.start_s, 0.5 + np.arange(len(motions.start_s)), atol=0.02)
    np.testing.assert_allclose(motions.end_s - motions.start_s, 1.0, atol=0.02)


def test_lengths_are_bounded():
    rng = np.random.default_rng(0)
    speed = np.convolve(rng.random(4000), np.ones(15) / 15, "same") * 5
    for shortest, longest in ((0.25, 2.0), (0.4, 1.0)):
        length = np.diff(
            np.append(*(lambda k: (k.start_s, k.end_s[-1:]))(key_poses(speed, shortest_s=shortest, longest_s=longest)))
        )
        assert length.min() >= shortest - 0.01
        assert length.max() <= longest + 0.01
    slow = np.abs(np.cos(2 * np.pi * 0.1 * np.arange(0, 30, 1 / 120)))
    assert np.diff(key_poses(slow * 3).start_s).max() <= 2.01


@pytest.mark.parametrize("speed", [np.zeros(0), np.zeros(1), np.zeros(5), np.ones(600)])
def test_what_does_not_move_has_no_motions(speed):
    assert len(key_poses(speed).start_s) == 0
    assert len(acceleration(speed)) == len(speed)


def humps(*parts, still_s=0.3):
    """Speed at 120 Hz of gestures one after another, each a hump (seconds, highest), at rest before and after."""
    n = round(still_s * 120)
    before, after = 0.001 * np.arange(n, 0, -1.0) / n, 0.001 * np.arange(n) / n
    each = [high * np.sin(np.pi * np.arange(round(long_s * 120)) / round(long_s * 120)) ** 2 for long_s, high in parts]
    return np.concatenate([before, *each, after])


def edges_s(motions):
    return np.append(motions.start_s, motions.end_s[-1:])


def test_a_short_motion_is_joined_across_the_weaker_braking():
    weak_last = key_poses(humps((1.0, 8.0), (0.4, 1.0), (1.0, 8.0)), shortest_s=0.5)
    np.testing.assert_allclose(edges_s(weak_last), [0.3, 1.3, 2.7], atol=0.06)
    weak_first = key_poses(humps((1.0, 1.0), (0.4, 4.0), (1.0, 8.0)), shortest_s=0.5)
    np.testing.assert_allclose(edges_s(weak_first), [0.3, 1.7, 2.7], atol=0.06)


def test_the_shortest_motion_goes_first_and_the_outermost_ends_stay():
    inf = np.inf
    np.testing.assert_array_equal(_longer(np.array([0, 10, 100]), np.array([inf, 9.0, 1.0]), 30), [0, 100])
    np.testing.assert_array_equal(_longer(np.array([0, 10, 100]), np.array([1.0, 9.0, 1.0]), 30), [0, 100])
    np.testing.assert_array_equal(_longer(np.array([0, 90, 100]), np.array([inf, 9.0, 1.0]), 30), [0, 100])
    # 20 to 25 goes by its weaker end; what is left of it is long enough
    edge, depth = np.array([0, 20, 25, 60]), np.array([inf, 2.0, 3.0, 1.0])
    np.testing.assert_array_equal(_longer(edge, depth, 21), [0, 25, 60])
    np.testing.assert_array_equal(_longer(edge, depth[[0, 2, 1, 3]], 20), [0, 20, 60])


def test_of_equal_brakings_the_earlier_is_taken_out_and_a_motion_just_long_enough_stays():
    edge = np.array([0, 40, 50, 90])
    np.testing.assert_array_equal(_longer(edge, np.array([np.inf, 2.0, 2.0, 2.0]), 20), [0, 50, 90])
    np.testing.assert_array_equal(_longer(edge, np.array([np.inf, 2.0, 2.0, 2.0]), 10), edge)


def test_a_clip_that_is_one_motion_too_short_has_none():
    assert len(_longer(np.array([0, 29]), np.array([np.inf, 1.0]), 30)) == 0
    np.testing.assert_array_equal(_longer(np.array([0, 30]), np.array([np.inf, 1.0]), 30), [0, 30])
    assert len(key_poses(humps((0.4, 8.0)), shortest_s=0.6).start_s) == 0
    assert len(key_poses(humps((0.8, 8.0)), shortest_s=0.6).start_s) == 1


def test_a_long_motion_is_cut_evenly_and_one_as_long_as_may_be_is_not():
    np.testing.assert_array_equal(_shorter(np.array([0, 100, 350]), 100), [0, 100, 183, 267, 350])


def test_the_first_motion_starts_before_any_braking_and_what_follows_the_last_is_left_out():
    motions = key_poses(humps((0.8, 6.0), (0.8, 6.0)))
    np.testing.assert_allclose(edges_s(motions), [0.3, 1.1, 1.9], atol=0.06)
    launched = key_poses(humps((0.8, 6.0), (0.8, 6.0))[: round(1.4 * 120)])  # the second one is never braked
    np.testing.assert_allclose(edges_s(launched), [0.3, 1.1], atol=0.06)
    braking = key_poses(humps((0.8, 6.0), (0.8, 6.0))[round(0.75 * 120) :])  # the first one's launch is not seen
    np.testing.assert_allclose(edges_s(braking), [0.35, 1.15], atol=0.06)


def test_the_time_of_the_first_value_is_added():
    speed = humps((0.8, 6.0), (0.8, 6.0))
    for one, two in zip(vars(key_poses(speed)).values(), vars(key_poses(speed, first_s=7.5)).values(), strict=True):
        np.testing.assert_allclose(two, one + 7.5)


def test_a_motion_launches_hardest_at_its_peak():
    (peak_s,) = key_poses(humps((1.0, 6.0))).peak_s
    assert peak_s == pytest.approx(0.3 + 0.25, abs=0.03)  # of a squared sine a quarter on


def test_trembling_is_no_motion_and_slight_motions_beside_great_ones_are_none():
    assert len(key_poses(humps((0.6, 0.05), (0.6, 0.05))).start_s) == 0  # extrema of 0.2 rad/s2
    slight = ((0.6, 0.3),) * 3
    np.testing.assert_allclose(edges_s(key_poses(humps(*slight))), [0.3, 0.9, 1.5, 2.1], atol=0.06)
    beside = humps((0.6, 20.0), slight[1], (0.6, 20.0))  # the slight one's are below 6 % of the range
    np.testing.assert_allclose(edges_s(key_poses(beside)), [0.3, 0.9, 2.1], atol=0.06)


def test_changes_count_twice_as_much_as_the_pose_they_start_from():
    poses = np.zeros((1, 3, 2, 3))
    poses[0, :, 1, 1] = [1.0, 1.5, 0.5]
    vector = to_vectors(poses).reshape(3, 2, 3)[:, 1, 1]
    np.testing.assert_array_equal(vector, [1.0, CHANGE_WEIGHT * 0.5, -CHANGE_WEIGHT * 0.5])
    assert CHANGE_WEIGHT > 1


def test_poses_between_frames_lie_on_lines_and_beyond_the_clip_at_its_ends():
    position = np.zeros((4, 22, 3))
    position[:, 1, 1] = [1.0, 2.0, 4.0, 8.0]
    root = np.tile(rotation.IDENTITY, (4, 1))
    motions = KeyPoses(np.array([0.25]), np.array([1.5]), np.array([9.0]))
    vector = pose_vectors(position, root, 1.0, motions)
    np.testing.assert_allclose(to_poses(vector)[0, :, 1, 1], [1.25, 3.0, 8.0])


def test_how_high_the_hips_are_counts():
    position = np.zeros((4, 22, 3))
    position[..., 1] = 0.9
    motions = KeyPoses(np.zeros(1), np.ones(1), np.full(1, 2.0))
    vector = pose_vectors(position, np.tile(rotation.IDENTITY, (4, 1)), 1.0, motions)
    np.testing.assert_allclose(to_poses(vector)[0, 0, :, 1], 0.9)


def test_short_clips_have_no_speed():
    one = np.tile(rotation.IDENTITY, (1, len(JOINTS), 1))
    assert (angular_speed(one, 30.0) == 0).all()
    two = np.concatenate([one, np.tile(rotation.from_heading(1.0), (1, len(JOINTS), 1))])
    assert len(angular_speed(two, 30.0)) == 5
    assert (angular_speed(two, 30.0) == 0).all()


def test_where_the_dancer_is_and_faces_does_not_count():
    made = performed(n=6)
    position, _ = kinematics.place(made.clip)
    motions = found(made.clip)
    turn = rotation.from_heading(1.1)
    moved = rotation.apply(turn, position) + np.array([3.0, 0.0, -2.0])
    root = rotation.mul(turn, made.clip.rotation_wxyz[:, 0])
    one = pose_vectors(position, made.clip.rotation_wxyz[:, 0], 30.0, motions)
    np.testing.assert_allclose(pose_vectors(moved, root, 30.0, motions), one, atol=1e-9)
    np.testing.assert_allclose(to_vectors(to_poses(one)), one, atol=1e-12)
    assert np.abs(to_poses(one)[:, 0, 0, [0, 2]]).max() < 1e-9


def test_a_single_frame_and_no_motion_give_no_vectors_and_one():
    position = np.zeros((1, 22, 3))
    root = rotation.IDENTITY[None]
    none = KeyPoses(np.zeros(0), np.zeros(0), np.zeros(0))
    assert pose_vectors(position, root, 30.0, none).shape == (0, 198)
    one = KeyPoses(np.zeros(1), np.zeros(1), np.zeros(1))
    assert pose_vectors(position, root, 30.0, one).shape == (1, 198)


def test_what_cannot_be_cut_is_refused():
    with pytest.raises(ValueError, match="orientation_wxyz"):
        angular_speed(np.zeros((5, 3, 4)), 30.0)
    with pytest.raises(ValueError, match="finite"):
        angular_speed(np.full((5, 22, 4), np.nan), 30.0)
    with pytest.raises(ValueError, match="frame_rate_hz"):
        angular_speed(np.zeros((5, 22, 4)), 0.0)
    with pytest.raises(ValueError, match="shortest_s"):
        key_poses(np.zeros(100), shortest_s=1.0, longest_s=1.99)
    with pytest.raises(ValueError, match="shortest_s"):
        key_poses(np.zeros(100), shortest_s=0.0, longest_s=1.5)
    assert len(key_poses(np.zeros(100), shortest_s=1.0, longest_s=2.0).start_s) == 0
    with pytest.raises(ValueError, match="finite"):
        key_poses(np.full(100, np.nan))
