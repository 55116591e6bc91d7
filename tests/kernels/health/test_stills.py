"""Frozen stretches, repeated frames, calibration poses at the ends."""

from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.health import stills
from kernels.health.body_in_motion import BodyInMotion
from kernels.skeleton.naming import map_joints
from kernels.synthetic import dancer
from kernels.types import Clip


def body(clip):
    return BodyInMotion(clip, map_joints(clip.skeleton))


def none(clip):
    return np.zeros(clip.n_frames, bool)


def held(clip, first, n):
    root, q = clip.root_xyz_m.copy(), clip.rotation_wxyz.copy()
    root[first : first + n], q[first : first + n] = root[first - 1], q[first - 1]
    return Clip(clip.skeleton, clip.frame_rate_hz, root, q)


def calibrated(clip, n, *, at_end=False, noise=1e-4):
    q = clip.rotation_wxyz.copy()
    rng = np.random.default_rng(2)
    pose = rotation.normalize(rotation.IDENTITY + noise * rng.standard_normal((n, *q.shape[1:])))
    if at_end:
        q[-n:] = pose
    else:
        q[:n] = pose
    return replace(clip, rotation_wxyz=rotation.continuous(q))


@pytest.fixture
def dance():
    return dancer.take("twist", n_beats=12).clip


@pytest.mark.parametrize("move", dancer.MOVES)
def test_a_dance_is_neither_frozen_nor_calibrated(move):
    clip = dancer.take(move, n_beats=8, frame_rate_hz=60.0).clip
    assert stills.frozen(body(clip), none(clip)) == (clip, [])
    assert stills.calibration_ends(body(clip)) == []


@pytest.mark.parametrize("rate_hz", [24.0, 120.0])
def test_half_a_second_without_any_motion_is_fenced(rate_hz):
    clip = dancer.take("twist", n_beats=12, frame_rate_hz=rate_hz).clip
    n = round(0.5 * rate_hz)
    bad = held(clip, round(2.1 * rate_hz), n)
    same, (fault,) = stills.frozen(body(bad), none(bad))
    assert same is bad
    assert (fault.kind, fault.verdict) == ("frozen", "fenced")
    assert (fault.first, fault.last) == (round(2.1 * rate_hz) - 1, round(2.1 * rate_hz) + n - 1)
    assert stills.frozen(body(bad), ~none(bad))[1] == []


def test_a_hold_that_eases_in_and_out_is_none(dance):
    t = np.clip(np.arange(dance.n_frames) / 60.0, 0, 1)
    ease = t**3 * (10 - 15 * t + 6 * t**2)
    angle = np.where(np.arange(dance.n_frames) < 60, ease, 1.0) + np.concatenate(
        [np.zeros(100), ease[: dance.n_frames - 100]]
    )
    q = np.tile(rotation.IDENTITY, (dance.n_frames, 22, 1))
    for k in range(1, 22):
        q[:, k] = rotation.from_axis_angle(np.array([1.0, 0, 0]), 0.2 * angle)
    drawn = replace(dance, rotation_wxyz=q, root_xyz_m=np.tile([0.0, 0.9, 0.0], (dance.n_frames, 1)))
    assert stills.frozen(body(drawn), none(drawn))[1] == []


def test_a_repeated_frame_that_the_next_makes_up_for_is_mended(dance):
    bad = held(dance, 70, 1)
    mended, (fault,) = stills.frozen(body(bad), none(bad))
    assert (fault.kind, fault.verdict, fault.first, fault.last) == ("frozen", "mended", 70, 70)
    assert np.degrees(rotation.angle_between(mended.rotation_wxyz, dance.rotation_wxyz)).max() < 0.5


def test_many_repeated_frames_are_told_once(dance):
    bad = dance
    for frame in range(20, 140, 10):
        bad = held(bad, frame, 1)
    _, faults = stills.frozen(body(bad), none(bad))
    mended = [fault for fault in faults if fault.verdict == "mended"]
    assert len(mended) == 1
    assert "times a frame says the one before again" in mended[0].reason


def test_a_pose_that_never_moves_is_doubtful(dance):
    still = held(dance, 1, dance.n_frames - 1)
    _, (fault,) = stills.frozen(body(still), none(still))
    assert (fault.kind, fault.verdict) == ("frozen", "doubtful")
    assert stills.calibration_ends(body(still)) == []


@pytest.mark.parametrize("n", [1, 20])
@pytest.mark.parametrize("at_end", [False, True])
def test_a_t_pose_at_an_end_is_fenced(dance, n, at_end):
    bad = calibrated(dance, n, at_end=at_end)
    (fault,) = stills.calibration_ends(body(bad))
    assert (fault.kind, fault.verdict) == ("tpose", "fenced")
    ends = (dance.n_frames - n, dance.n_frames - 1) if at_end else (0, n - 1)
    assert (fault.first, fault.last) == ends
    assert ("end" if at_end else "beginning") in fault.reason


def test_arms_that_pass_level_at_the_beginning_are_no_t_pose():
    clip = dancer.take("idle", n_beats=8).clip
    q = clip.rotation_wxyz.copy()
    t = np.arange(clip.n_frames) / 30.0
    for sign, name in ((1.0, "leftUpperArm"), (-1.0, "rightUpperArm")):
        q[:, clip.skeleton.index(name)] = rotation.from_axis_angle(np.array([0.0, 0, 1.0]), sign * np.sin(2 * t))
    assert stills.calibration_ends(body(replace(clip, rotation_wxyz=q))) == []
