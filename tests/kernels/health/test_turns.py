"""How fast a joint turns around a fault."""

from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.health.turns import around, turn_rad_per_s
from kernels.health.verdicts import ClipFault
from kernels.synthetic import dancer


@pytest.fixture(scope="module")
def flipped():
    """A step whose head turns by a radian for one frame, 20."""
    clip = dancer.take("step", n_beats=6).clip
    turned = clip.rotation_wxyz.copy()
    head = clip.skeleton.index("head")
    turned[20, head] = rotation.mul(turned[20, head], rotation.from_axis_angle(np.array([0.0, 1.0, 0.0]), 1.0))
    return replace(clip, rotation_wxyz=turned)


def test_a_flip_turns_in_and_out_again(flipped):
    speed = turn_rad_per_s(flipped, "head")
    assert speed.shape == (flipped.n_frames,)
    assert speed[20] == pytest.approx(flipped.frame_rate_hz, rel=0.05)
    assert speed[21] == pytest.approx(flipped.frame_rate_hz, rel=0.05)
    assert speed[[18, 23]].max() < 0.1 * flipped.frame_rate_hz
    assert speed[0] == speed[1]
    np.testing.assert_array_equal(turn_rad_per_s(flipped, "")[[20, 21]], speed[[20, 21]])


def test_what_is_shown_lies_around_the_fault_and_within_the_clip(flipped):
    rate_hz = flipped.frame_rate_hz
    first, speed = around(ClipFault("flip", "head", 20, 20, "mended", "it flips"), flipped)
    assert first == max(20 - round(0.4 * rate_hz), 0)
    assert speed.argmax() + first in (20, 21)
    n = flipped.n_frames
    first, speed = around(ClipFault("frozen", "", 0, n - 1, "fenced", "it stands"), flipped)
    assert (first, len(speed)) == (0, min(round(2.0 * rate_hz) + round(0.4 * rate_hz) + 1, n))


def test_one_frame_does_not_turn(flipped):
    one = replace(flipped, root_xyz_m=flipped.root_xyz_m[:1], rotation_wxyz=flipped.rotation_wxyz[:1])
    assert turn_rad_per_s(one, "head").tolist() == [0.0]
