"""Fenced frames, bridged."""

from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.health.bridging import bridge
from kernels.synthetic import dancer


@pytest.fixture(scope="module")
def clip():
    return dancer.take("step", n_beats=4).clip


def broken(clip, *frames):
    root, turned = clip.root_xyz_m.copy(), clip.rotation_wxyz.copy()
    root[list(frames)] += 5.0
    turned[list(frames), 0] = rotation.from_axis_angle(np.array([0.0, 1.0, 0.0]), 2.0)
    return replace(clip, root_xyz_m=root, rotation_wxyz=turned)


def fenced(clip, *frames):
    mask = np.zeros(clip.n_frames, bool)
    mask[list(frames)] = True
    return mask


def test_between_good_frames_lies_the_straight_way_and_the_others_stay(clip):
    found = bridge(broken(clip, 10, 11, 12), fenced(clip, 10, 11, 12))
    middle = (clip.root_xyz_m[9] + clip.root_xyz_m[13]) / 2
    np.testing.assert_allclose(found.root_xyz_m[11], middle, atol=1e-12)
    turn = rotation.slerp(clip.rotation_wxyz[9], clip.rotation_wxyz[13], 0.25)
    assert rotation.angle_between(found.rotation_wxyz[10], turn).max() < 1e-9
    rest = ~fenced(clip, 10, 11, 12)
    np.testing.assert_array_equal(found.rotation_wxyz[rest], clip.rotation_wxyz[rest])
    np.testing.assert_array_equal(found.root_xyz_m[rest], clip.root_xyz_m[rest])


def test_the_ends_hold_the_nearest_frame_that_may_be_shown(clip):
    n = clip.n_frames
    frames = [0, 1, n - 1]
    found = bridge(broken(clip, *frames), fenced(clip, *frames))
    for frame, kept in ((0, 2), (1, 2), (n - 1, n - 2)):
        np.testing.assert_allclose(found.root_xyz_m[frame], clip.root_xyz_m[kept])
        np.testing.assert_allclose(found.rotation_wxyz[frame], clip.rotation_wxyz[kept], atol=1e-12)


def test_joints_that_move_are_bridged_too(clip):
    moved = np.tile(clip.skeleton.offset_xyz_m, (clip.n_frames, 1, 1))
    moved[7] += 1.0
    found = bridge(replace(clip, translation_xyz_m=moved), fenced(clip, 7))
    np.testing.assert_allclose(found.translation_xyz_m[7], clip.skeleton.offset_xyz_m, atol=1e-12)


def test_nothing_or_everything_fenced_changes_nothing(clip):
    assert bridge(clip, np.zeros(clip.n_frames, bool)) is clip
    assert bridge(clip, np.ones(clip.n_frames, bool)) is clip
