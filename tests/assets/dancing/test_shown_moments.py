"""Sentences on frames of a dance: which joint, when, of which clips."""

from dataclasses import replace

import numpy as np
import pytest

from assets.dancing.shown_moments import flip_sentences, move_sentence, shown_at
from kernels.assembly.blend import assemble
from kernels.assembly.one_frame_flips import FurthestMove, OneFrameFlip
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.synthetic.dancer import take
from kernels.types import Choreography
from schemas.keys import mirrored


@pytest.fixture
def steps():
    """Two steps of a second each, the second clip mirrored, joined by a blend of 0.4 s."""
    names, starts = ("day-step", mirrored("day-wave")), np.array([1.0, 2.0])
    song = np.array([0.0, 1.0])
    return Choreography(names, song, song + 1, starts, starts + 1, np.array([False, True]), np.array([0.0, 0.4]))


@pytest.fixture
def made(steps):
    clips = {steps.clip_id[0]: take("step").clip, steps.clip_id[1]: take("wave").clip}
    return assemble(steps, clips, skeleton=CANONICAL, frame_rate_hz=30.0, duration_s=2.0)


def test_a_frame_shows_one_clip_or_two(made, steps):
    assert shown_at(made, steps, 15) == [("day-step", pytest.approx(1.5, abs=0.02))]
    (first, first_s), (second, second_s) = shown_at(made, steps, 28)
    assert (first, second) == steps.clip_id
    assert (first_s, second_s) == (pytest.approx(1.933, abs=0.02), pytest.approx(1.933, abs=0.02))


def test_a_flip_is_said_with_its_time_and_its_clips(made, steps):
    hand = JOINTS.index("leftHand")
    flips = [OneFrameFlip(15, hand, np.radians(149)), OneFrameFlip(31, 0, np.radians(60), is_of_body=True)]
    plain, blended = flip_sentences(flips, made, steps)
    assert plain == "leftHand turns 149° from one frame to the next at 0.50 s, in day-step at 1.50 s"
    assert blended == (
        "hips turns 60° in the world from one frame to the next at 1.03 s, "
        "in the blend of day-wave, mirrored, at 2.03 s with day-step at 2.03 s"
    )
    assert flip_sentences([], made, steps) == ()


def test_the_furthest_move_is_said(made, steps):
    found = FurthestMove(15, JOINTS.index("head"), 9.25, 1.4)
    assert move_sentence(found, made, replace(steps)) == (
        "head moves at 9.2 m/s at 0.50 s, 1.40 times the fastest frame of the clips shown, in day-step at 1.50 s"
    )
