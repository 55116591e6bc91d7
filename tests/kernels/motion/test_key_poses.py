"""Motions of a clip: made-up gestures found one by one at any rate, with noise, and what is no motion."""

import numpy as np
import pytest

from kernels import rotation
from kernels.motion.key_poses import (
    PARTS,
    KeyPoses,
    acceleration,
    angular_speed,
    key_poses,
    pose_vectors,
    to_poses,
    to_vectors,
)
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import JOINTS
from kernels.synthetic.performance import hidden_rules, perform


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


def test_short_clips_have_no_speed():
    one = np.tile(rotation.IDENTITY, (1, len(JOINTS), 1))
    assert (angular_speed(one, 30.0) == 0).all()
    assert (angular_speed(np.repeat(one, 2, axis=0), 30.0) == 0).all()


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
        key_poses(np.zeros(100), shortest_s=1.0, longest_s=1.5)
    with pytest.raises(ValueError, match="finite"):
        key_poses(np.full(100, np.nan))
