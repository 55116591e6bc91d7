"""Gaps that were filled in straight lines."""

import numpy as np
import pytest

from kernels import rotation
from kernels.health.body_in_motion import BodyInMotion
from kernels.health.fills import straight_fills
from kernels.skeleton.naming import map_joints
from kernels.synthetic import dancer
from kernels.types import Clip


def body(clip):
    return BodyInMotion(clip, map_joints(clip.skeleton))


def alive(rate_hz=30.0):
    """A take in which every joint moves, and trembles, as recorded ones do."""
    made = dancer.take("step", n_beats=12, frame_rate_hz=rate_hz).clip
    rng = np.random.default_rng(4)
    t = np.arange(made.n_frames) / rate_hz
    phase, pace = rng.uniform(0, 6.28, (2, 22, 3))
    sway = 0.12 * np.sin((1.5 + pace) * t[:, None, None] * 2 + phase)
    q = rotation.mul(made.rotation_wxyz, rotation.exp(sway + 0.001 * rng.standard_normal(sway.shape)))
    root = made.root_xyz_m + 0.02 * np.sin(3 * t)[:, None]
    return Clip(made.skeleton, rate_hz, root, rotation.continuous(q))


def filled(clip, first, last, *, euler):
    a, b = first - 1, last + 1
    share = np.linspace(0, 1, b - a + 1)[1:-1]
    q, root = clip.rotation_wxyz.copy(), clip.root_xyz_m.copy()
    if euler:
        angle = np.unwrap(rotation.to_euler(q[[a, b]], "zyx"), axis=0)
        between = angle[0] + share[:, None, None] * (angle[1] - angle[0])
        q[first:b] = rotation.from_euler(between, "zyx")
    else:
        q[first:b] = rotation.slerp(q[a], q[b], share[:, None] * np.ones(22))
    root[first:b] = root[a] + share[:, None] * (root[b] - root[a])
    return Clip(clip.skeleton, clip.frame_rate_hz, root, rotation.continuous(q))


@pytest.mark.parametrize("rate_hz", [24.0, 30.0, 120.0, 240.0])
@pytest.mark.parametrize("euler", [False, True])
def test_a_gap_of_half_a_second_is_found_where_it_lies(rate_hz, euler):
    clip = alive(rate_hz)
    assert straight_fills(body(clip)) == []
    first, last = round(1.6 * rate_hz), round(2.1 * rate_hz)
    (fault,) = straight_fills(body(filled(clip, first, last, euler=euler)))
    assert (fault.kind, fault.verdict, fault.joint) == ("gap", "fenced", "")
    assert abs(fault.first - first) <= max(2, rate_hz / 30)
    assert abs(fault.last - last) <= max(2, rate_hz / 30)
    assert "straight lines" in fault.reason


def test_a_gap_of_a_tenth_is_left_alone():
    clip = alive()
    assert straight_fills(body(filled(clip, 50, 52, euler=False))) == []


@pytest.mark.parametrize("move", dancer.MOVES)
def test_made_up_moves_that_go_evenly_are_no_gaps(move):
    assert straight_fills(body(dancer.take(move, n_beats=8, frame_rate_hz=24.0).clip)) == []


def test_a_pose_that_stands_or_few_frames_hold_no_gap():
    clip = alive()
    still = Clip(
        clip.skeleton, 30.0, np.tile(clip.root_xyz_m[:1], (60, 1)), np.tile(clip.rotation_wxyz[:1], (60, 1, 1))
    )
    assert straight_fills(body(still)) == []
    few = Clip(clip.skeleton, 30.0, clip.root_xyz_m[:2], clip.rotation_wxyz[:2])
    assert straight_fills(body(few)) == []


def test_an_even_spin_in_a_living_pose_is_no_gap():
    clip = alive()
    turn = rotation.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.radians(40.0) * np.arange(clip.n_frames))
    spun = clip.rotation_wxyz.copy()
    spun[:, 0] = rotation.mul(turn, clip.rotation_wxyz[0, 0])
    spun[:, 1:] = rotation.slerp(spun[:1, 1:], spun[:, 1:], np.full((1, 1), 0.04))
    still = np.repeat(clip.root_xyz_m[:1], clip.n_frames, axis=0)
    assert straight_fills(body(Clip(clip.skeleton, 30.0, still, rotation.continuous(spun)))) == []
