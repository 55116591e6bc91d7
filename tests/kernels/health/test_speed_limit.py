"""Nothing that is shown turns faster than a dance may."""

import numpy as np
import pytest

from kernels import rotation
from kernels.health.body_in_motion import BodyInMotion
from kernels.health.speed_limit import LIMIT_DEG_PER_S, fast_turns
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.naming import map_joints
from kernels.types import Clip


def turning(joint, steps_deg, rate_hz=30.0, axis=(1.0, 0.0, 0.0)):
    """A body that stands still, but for one joint."""
    f = 40
    angle = np.zeros(f)
    angle[20 : 20 + len(steps_deg)] = np.cumsum(np.radians(steps_deg))
    angle[20 + len(steps_deg) :] = np.radians(np.sum(steps_deg))
    q = np.tile(rotation.IDENTITY, (f, len(JOINTS), 1))
    q[:, JOINTS.index(joint)] = rotation.from_axis_angle(np.array(axis), angle)
    clip = Clip(CANONICAL, rate_hz, np.tile([0.0, 0.95, 0.0], (f, 1)), q)
    return BodyInMotion(clip, map_joints(CANONICAL))


def found(body, hidden=()):
    is_hidden = np.zeros(body.clip.n_frames, bool)
    is_hidden[list(hidden)] = True
    return [(t.joint, t.first, t.last, t.is_sudden, t.is_in_world) for t in fast_turns(body, is_hidden)]


@pytest.mark.parametrize("rate_hz", [24.0, 30.0, 120.0])
def test_the_limit_is_one_of_speed(rate_hz):
    step = LIMIT_DEG_PER_S / rate_hz
    assert found(turning("leftHand", [step * 0.99] * 2, rate_hz)) == []
    assert found(turning("leftHand", [step * 1.01] * 2, rate_hz))[0][:4] == ("leftHand", 19, 21, False)


def test_what_comes_out_of_nothing_or_is_faster_than_any_joint_is_sudden():
    assert found(turning("head", [20.0, 50.0, 20.0])) == [("head", 20, 21, False, False)]
    assert found(turning("head", [2.0, 50.0, 2.0])) == [("head", 20, 21, True, False)]
    assert found(turning("head", [40.0, 80.0, 40.0])) == [("head", 20, 21, True, False)]


def test_the_hips_flip_only_where_nothing_carries_their_turn_on():
    assert found(turning("hips", [80.0] * 4, axis=(0.0, 1.0, 0.0))) == []
    lone = found(turning("hips", [80.0], axis=(0.0, 1.0, 0.0)))
    assert ("hips", 19, 20, True, True) in lone
    there_and_back = found(turning("hips", [80.0, -80.0], axis=(0.0, 1.0, 0.0)))
    assert ("hips", 19, 21, True, True) in there_and_back


def test_small_turns_of_many_joints_that_add_up_in_the_world_are_found():
    body = turning("hips", [30.0])
    q = body.clip.rotation_wxyz.copy()
    q[:, JOINTS.index("spine")] = q[:, JOINTS.index("head")] = q[:, 0]
    clip = Clip(CANONICAL, 30.0, body.clip.root_xyz_m, q)
    assert {t[0] for t in found(BodyInMotion(clip, body.mapping))} >= {"head", "spine"}


def test_steps_from_and_to_hidden_frames_are_never_shown():
    body = turning("leftFoot", [60.0])
    assert found(body)[0][:3] == ("leftFoot", 19, 20)
    assert found(body, hidden=[20]) == []
    assert found(body, hidden=[19]) == []


def test_too_few_frames_hold_no_step():
    body = turning("head", [60.0])
    one = Clip(CANONICAL, 30.0, body.clip.root_xyz_m[:1], body.clip.rotation_wxyz[:1])
    assert fast_turns(BodyInMotion(one, body.mapping), np.zeros(1, bool)) == []
