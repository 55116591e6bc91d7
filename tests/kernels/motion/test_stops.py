"""Stops of a body: where parts turn, whatever their size and the clip's rate."""

import numpy as np
import pytest

from kernels.motion.stops import BODY_PARTS, STOP_RATE_HZ, at_stop_rate, landing_strength, stop_strength
from kernels.skeleton.canonical import JOINTS
from kernels.synthetic.dancer import place, take


def swing(rate_hz, reach_m):
    """One joint that turns each half second, first at 0.25 s, (F, 1, 3)."""
    time_s = np.arange(int(6 * rate_hz) + 1) / rate_hz
    position = np.zeros((len(time_s), 1, 3))
    position[:, 0, 0] = reach_m * np.sin(2 * np.pi * time_s)
    return position


@pytest.mark.parametrize("rate_hz", [24.0, 30.0, 120.0])
@pytest.mark.parametrize("reach_m", [0.1, 1.0])
def test_stops_are_the_turns(rate_hz, reach_m):
    strength = stop_strength(at_stop_rate(swing(rate_hz, reach_m), rate_hz), [[0]])
    turn = np.round((0.25 + 0.5 * np.arange(1, 11)) * STOP_RATE_HZ).astype(int)
    for at in turn:
        near = strength[at - 10 : at + 11]
        assert abs(int(near.argmax()) - 10) <= 1
        assert near.max() > 5 * strength[at - 15]


def test_a_small_turn_counts_nearly_as_a_large_one():
    small, large = (stop_strength(at_stop_rate(swing(60.0, m), 60.0), [[0]]).max() for m in (0.2, 1.0))
    assert small > 0.4 * large


def test_standing_still_has_no_stop():
    assert stop_strength(np.zeros((50, 22, 3))).max() == 0


def test_landing_is_the_bottom_of_a_bounce():
    made = take("bounce", frame_rate_hz=60.0)
    height = at_stop_rate(place(made), 60.0)[:, 0, 1]
    caught = landing_strength(height)
    at = np.round(made.beat_s[2:-2] * STOP_RATE_HZ).astype(int)
    assert caught[at].min() > 4 * caught[at + 15].max()


def test_parts_hold_each_joint_once_and_both_sides():
    flat = [joint for part in BODY_PARTS for joint in part]
    assert len(flat) == len(set(flat))
    assert {JOINTS[part[0]] for part in BODY_PARTS} == {
        "hips",
        "leftUpperLeg",
        "rightUpperLeg",
        "leftUpperArm",
        "rightUpperArm",
    }


def test_rate_is_brought_to_one():
    assert at_stop_rate(swing(24.0, 1.0), 24.0).shape == (6 * STOP_RATE_HZ + 1, 1, 3)


def test_refusals():
    with pytest.raises(ValueError, match="at least 4"):
        at_stop_rate(np.zeros((3, 1, 3)), 30.0)
    with pytest.raises(ValueError, match="not finite"):
        at_stop_rate(np.full((9, 1, 3), np.nan), 30.0)
