"""Cubics over gaps."""

import numpy as np
import pytest

from kernels import rotation
from kernels.health import mending


def test_longest_gap_is_a_tenth_of_a_second_but_three_frames():
    assert [mending.longest_gap(hz) for hz in (24.0, 30.0, 60.0, 120.0, 240.0)] == [3, 3, 6, 12, 24]


def test_support_is_two_good_frames_on_each_side():
    good = np.ones(20, bool)
    assert mending.support(8, 8, good) == (6, 7, 9, 10)
    assert mending.support(8, 11, good) == (5, 7, 12, 14)
    assert mending.support(1, 1, good) is None
    assert mending.support(18, 18, good) is None
    good[10] = False
    assert mending.support(8, 8, good) is None


def test_a_cubic_motion_is_bridged_exactly():
    t = np.arange(30) / 10.0
    place = np.stack([t**3 - t, 2 * t**2, 1 - t], axis=1)
    assert mending.bridge_places(place, (9, 11, 15, 17)) == pytest.approx(place[12:15])
    angle = 0.3 * t**3 - 0.9 * t
    turn = rotation.from_axis_angle(np.array([0.0, 0.6, 0.8]), angle)
    bridged = mending.bridge_turns(turn, (9, 11, 15, 17))
    assert rotation.angle_between(bridged, turn[12:15]).max() < 1e-9


def test_a_turn_past_half_a_circle_is_bridged_the_way_it_goes():
    angle = np.radians(40.0) * np.arange(20)
    turn = rotation.from_axis_angle(np.array([1.0, 0.0, 0.0]), angle)
    bridged = mending.bridge_turns(turn, (6, 8, 11, 13))
    assert rotation.angle_between(bridged, turn[9:11]).max() < 1e-9


def test_doubt_is_how_far_the_same_gap_beside_it_would_be_off():
    good = np.ones(40, bool)

    def doubt(place, first=18, last=20, good=good):
        return mending.doubt(
            lambda frames: mending.bridge_places(place, frames),
            lambda a, b: float(np.abs(place[a : a + len(b)] - b).max()),
            first,
            last,
            good,
        )

    smooth = np.stack([np.arange(40) ** 2 / 100.0] * 3, axis=1)
    assert doubt(smooth) < 1e-9
    shaky = smooth.copy()
    shaky[23] += 5.0
    assert doubt(shaky) > 1.0
    assert doubt(smooth, good=np.arange(40) % 5 > 0) == np.inf
