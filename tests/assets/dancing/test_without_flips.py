"""A dance is looked at, and chosen again without what flips: at most three times, pins first, the best is kept."""

from dataclasses import replace

import numpy as np
import pytest

from assets.dancing.asked import Direction
from assets.dancing.avoided import AvoidedSpan, touched
from assets.dancing.chosen_steps import ChosenSteps
from assets.dancing.method import DanceOrder, Method
from assets.dancing.refusal import RefusalError
from assets.dancing.without_flips import MOST_ROUNDS, choose_without_flips
from kernels.types import BeatGrid, Choreography
from schemas.keys import mirrored
from schemas.settings import DanceSettings, Settings

RATE_HZ = 30.0
STILL = np.zeros(121)  # 4 s


def jump(at_s, turn_rad=1.5):
    """An arm that jumps once."""
    return np.where(np.arange(121) >= round(at_s * RATE_HZ), turn_rad, 0.0)


class Toy:
    """Dances one clip after the other for a second each: the first that shows nothing to be avoided."""

    def __init__(self, *rows, pins=()):
        self.rows, self.pins, self.asked = rows, pins, []

    def choose(self, inputs, order):
        self.asked.append(order.avoid)
        song = np.arange(2.0)
        for names, starts in self.rows:
            start = np.array(starts)
            if not touched(order.avoid, names, start, start + 1, blend_s=0.4).any():
                seam = np.array([False, True])
                steps = Choreography(tuple(names), song, song + 1, start, start + 1, seam, np.where(seam, 0.4, 0.0))
                return ChosenSteps(steps, {}, {"cost": 1.0}, self.pins)
        raise RefusalError("no clip can be danced")

    @property
    def method(self):
        return Method("toy", "1", ("canonical_pose",), (), self.choose)


@pytest.fixture
def order():
    time_s = np.arange(5) * 0.5
    beats = BeatGrid(time_s, np.zeros(5, int), np.zeros(5, int), np.ones(5))
    return DanceOrder("s", beats, 2.0, Settings(dance=DanceSettings(lock_feet=False)), Direction())


def test_what_flips_is_not_shown_where_there_is_another_way(stored_poses, order):
    poses = stored_poses(RATE_HZ, bad=jump(1.5), good=STILL)
    toy = Toy((("good", "bad"), (1.0, 1.0)), (("good", "good"), (1.0, 2.0)))
    found = choose_without_flips(toy.method, {"canonical_pose": poses}, order)
    assert found.steps.clip_id == ("good", "good")
    (span,) = found.avoided
    assert span.clip_id == "bad"
    assert span.start_s <= 1.5 <= span.end_s < span.start_s + 0.1
    assert toy.asked == [(), (span,)]
    assert found.metadata == {"cost": 1.0, "searches_again": 1, "avoided": [str(span)], "flips_left": []}


def test_a_dance_that_does_not_flip_is_chosen_once(stored_poses, order):
    poses = stored_poses(RATE_HZ, good=STILL)
    toy = Toy((("good", "good"), (1.0, 2.0)))
    found = choose_without_flips(toy.method, {"canonical_pose": poses}, order)
    assert toy.asked == [()]
    assert found.avoided == ()
    assert found.metadata["searches_again"] == 0


def test_the_image_of_a_clip_is_avoided_with_it(stored_poses, order):
    poses = stored_poses(RATE_HZ, bad=jump(1.5), good=STILL)
    toy = Toy((("good", mirrored("bad")), (1.0, 1.0)), (("good", "bad"), (1.0, 1.0)), (("good", "good"), (1.0, 2.0)))
    found = choose_without_flips(toy.method, {"canonical_pose": poses}, order)
    assert found.steps.clip_id == ("good", "good")
    assert [span.clip_id for span in found.avoided] == ["bad"]


def test_both_sides_of_a_blend_that_flips_are_avoided(stored_poses, order):
    poses = stored_poses(RATE_HZ, bad=jump(2.0, 2.6), good=STILL)
    toy = Toy((("bad", "good"), (1.0, 1.0)), (("good", "good"), (2.0, 2.2)))
    found = choose_without_flips(toy.method, {"canonical_pose": poses}, order)
    assert [span.clip_id for span in found.avoided] == ["bad", "good"]
    middle = [(span.start_s + span.end_s) / 2 for span in found.avoided]
    np.testing.assert_allclose(middle, [2.0, 1.0], atol=0.05)


def test_of_dances_that_all_flip_the_one_with_the_fewest_is_kept_and_said(stored_poses, order):
    twice = np.where(np.arange(121) >= 50, 1.5, 0.0) + np.where(np.arange(121) >= 40, 1.5, 0.0)
    poses = stored_poses(RATE_HZ, two=twice, one=jump(1.5), good=STILL)
    rows = [(("good", "two"), (1.0, 1.0)), (("good", "one"), (1.0, 1.0))]
    toy = Toy(*rows)
    found = choose_without_flips(toy.method, {"canonical_pose": poses}, order)
    assert found.steps.clip_id == ("good", "one")
    (sentence,) = found.metadata["flips_left"]
    assert sentence.startswith("leftUpperArm turns 86°")
    assert "in one at 1.5" in sentence
    assert {span.clip_id for span in found.avoided} == {"two"}


def test_it_is_chosen_again_three_times_at_most(stored_poses, order):
    clips = {f"bad{k}": jump(1.5) for k in range(6)}
    poses = stored_poses(RATE_HZ, good=STILL, **clips)
    toy = Toy(*((("good", name), (1.0, 1.0)) for name in clips))
    found = choose_without_flips(toy.method, {"canonical_pose": poses}, order)
    assert len(toy.asked) == 1 + MOST_ROUNDS
    assert found.metadata["searches_again"] == MOST_ROUNDS
    assert found.steps.clip_id == ("good", "bad0")  # none has fewer


def test_pins_win_and_the_rest_is_avoided(stored_poses, order):
    """The first step flips and is pinned, so it stays; the second gives way."""
    poses = stored_poses(RATE_HZ, pinned=jump(1.5), bad=jump(1.5), good=STILL)
    rows = [(("pinned", "bad"), (1.0, 1.0)), (("pinned", "good"), (1.0, 1.0))]
    toy = Toy(*rows, pins=["0=clip:pinned", None])
    found = choose_without_flips(toy.method, {"canonical_pose": poses}, order)
    assert found.steps.clip_id == ("pinned", "good")
    assert {span.clip_id for span in found.avoided} == {"bad"}
    (sentence,) = found.metadata["flips_left"]
    assert "in pinned at 1.5" in sentence


def test_without_poses_nothing_is_looked_at_and_refusals_are_the_methods_own(stored_poses, order):
    toy = Toy((("good", "bad"), (1.0, 1.0)))
    assert choose_without_flips(toy.method, {}, order).metadata == {"cost": 1.0}
    nothing = replace(order, avoid=(AvoidedSpan("bad", 1.0, 2.0),))
    with pytest.raises(RefusalError, match="no clip can be danced"):
        choose_without_flips(toy.method, {"canonical_pose": stored_poses(RATE_HZ, good=STILL)}, nothing)


def test_the_rate_of_the_finished_frames_decides(stored_poses, order):
    """26 degrees a frame at 30 a second are no flip, and neither are 13 at 60."""
    ramp = np.clip(np.arange(121) - 45, 0, 4) / 4 * 1.8
    poses = stored_poses(RATE_HZ, fast=ramp, good=STILL)
    toy = Toy((("good", "fast"), (1.0, 1.0)))
    for rate_hz in (30.0, 60.0):
        found = choose_without_flips(toy.method, {"canonical_pose": poses}, order, frame_rate_hz=rate_hz)
        assert found.metadata["flips_left"] == []


def test_where_a_clip_flips_again_is_avoided_at_once(stored_poses, order):
    """One search, not one for each of the flips of a clip."""
    twice = jump(1.5) + jump(3.0)
    poses = stored_poses(RATE_HZ, bad=twice, good=STILL)
    rows = [(("good", "bad"), (1.0, 1.0)), (("good", "bad"), (1.0, 2.5)), (("good", "good"), (1.0, 2.0))]
    toy = Toy(*rows)
    found = choose_without_flips(toy.method, {"canonical_pose": poses}, order)
    assert found.steps.clip_id == ("good", "good")
    assert found.metadata["searches_again"] == 1
    assert [round((span.start_s + span.end_s) / 2, 1) for span in found.avoided] == [1.5, 3.0]
