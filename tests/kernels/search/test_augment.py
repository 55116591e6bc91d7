"""The same motion otherwise."""

import numpy as np
import pytest

from kernels.search.augment import Augmentation, mirror, vary
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.canonical import mirror as mirror_motion
from kernels.synthetic.dancer import take


def test_twice_mirrored_is_as_before(dance):
    np.testing.assert_allclose(mirror(mirror(dance)), dance)
    left, right = JOINTS.index("leftHand"), JOINTS.index("rightHand")
    np.testing.assert_allclose(mirror(dance)[:, left], dance[:, right] * [-1, 1, 1])


def test_mirrored_positions_are_those_of_the_mirrored_motion():
    clip = take("wave", n_beats=4, interval_s=0.5).clip
    position, _ = kinematics.place(clip)
    root, turned = mirror_motion(clip.root_xyz_m, clip.rotation_wxyz)
    other, _ = kinematics.forward(CANONICAL, root, turned)
    np.testing.assert_allclose(mirror(position), other, atol=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_a_variation_is_a_part_at_another_pace(dance, seed):
    varied = vary(dance, np.random.default_rng(seed), Augmentation(joint_noise_m=0.0), longest=64)
    assert 0.7 * len(dance) / 1.2 - 2 <= len(varied) <= min(1.2 * len(dance) + 1, 64)
    apart = np.linalg.norm(varied[0] - dance, axis=(-1, -2)).min()
    assert apart < 1e-9


def test_nothing_is_longer_than_asked(dance, rng):
    assert all(len(vary(dance, rng, Augmentation(), longest=16)) <= 16 for _ in range(30))


def test_one_frame_stays_one_frame(dance, rng):
    assert vary(dance[:1], rng, Augmentation(), longest=64).shape == (1, 22, 3)


def test_the_seed_says_it_all(dance):
    a, b = (vary(dance, np.random.default_rng(3), Augmentation(), longest=64) for _ in range(2))
    np.testing.assert_array_equal(a, b)


def test_joints_are_off_as_far_as_said_and_a_third_of_that_differs_frame_by_frame():
    still = np.zeros((64, 22, 3))
    how = Augmentation(stretch_ratio=1.0, least_part_ratio=1.0, joint_noise_m=0.03)
    varied = np.stack([vary(still, np.random.default_rng(seed), how, longest=64) for seed in range(20)])
    same = varied.mean(axis=1)
    assert same.std() == pytest.approx(0.03, rel=0.05)
    assert (varied - same[:, None]).std() == pytest.approx(0.01, rel=0.03)


def test_a_short_motion_is_not_cut_below_half_a_second():
    motion = np.arange(10.0)[:, None, None] * np.ones((1, 22, 3))
    how = Augmentation(stretch_ratio=1.0, least_part_ratio=0.1, joint_noise_m=0.0)
    n = {len(vary(motion, np.random.default_rng(seed), how, longest=64)) for seed in range(60)}
    assert n == {7, 8, 9, 10}  # of 15 frames a second
