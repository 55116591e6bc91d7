"""Other metrical levels and phases of known beats."""

import numpy as np
import pytest

from kernels.music.level import change_level, nudge
from kernels.types import BeatGrid


def grid(time_s, numbers=None, confidence=None):
    n = len(time_s)
    numbers = np.zeros(n, np.int64) if numbers is None else np.array(numbers, np.int64)
    bars = np.where(numbers > 0, np.maximum(np.cumsum(numbers == 1), 1), 0)
    return BeatGrid(
        time_s=np.array(time_s, np.float64),
        bar_number=bars,
        beat_in_bar_number=numbers,
        confidence=np.ones(n) if confidence is None else np.array(confidence, np.float64),
    )


def test_twice_as_fast_puts_beats_between():
    fast = change_level(grid([0, 1, 2, 4], [1, 2, 1, 2], [1, 0.5, 1, 1]), 2)
    assert fast.time_s.tolist() == [0, 0.5, 1, 1.5, 2, 3, 4]
    assert fast.beat_in_bar_number.tolist() == [1, 2, 3, 4, 1, 2, 3]
    assert fast.bar_number.tolist() == [1, 1, 1, 1, 2, 2, 2]
    assert fast.confidence.tolist() == [1, 0.5, 0.5, 0.5, 1, 1, 1]


def test_half_as_fast_keeps_downbeats():
    slow = change_level(grid(np.arange(9.0), [4, 1, 2, 3, 4, 1, 2, 3, 4]), 0.5)
    assert slow.time_s.tolist() == [1, 3, 5, 7]
    assert slow.beat_in_bar_number.tolist() == [1, 2, 1, 2]


def test_half_as_fast_in_three_loses_the_bars():
    slow = change_level(grid(np.arange(6.0), [1, 2, 3, 1, 2, 3]), 0.5)
    assert slow.time_s.tolist() == [0, 2, 4]
    assert slow.beat_in_bar_number.tolist() == [0, 0, 0]
    third = change_level(grid(np.arange(6.0), [1, 2, 3, 1, 2, 3]), 1 / 3)
    assert third.time_s.tolist() == [0, 3]
    assert third.beat_in_bar_number.tolist() == [1, 1]


def test_without_bars_confidence_decides():
    assert change_level(grid(np.arange(4.0), confidence=[0.2, 0.9, 0.2, 0.9]), 0.5).time_s.tolist() == [1, 3]
    assert change_level(grid(np.arange(4.0)), 0.5).time_s.tolist() == [0, 2]


def test_there_and_back():
    time_s = np.cumsum([0.5, 0.4, 0.6, 0.5, 0.5])
    np.testing.assert_allclose(change_level(change_level(grid(time_s), 3), 1 / 3).time_s, time_s)
    one = grid([0, 1])
    assert change_level(one, 1) is one


@pytest.mark.parametrize("factor", [0, -1, 1.5, 0.4, 9, float("nan")])
def test_other_factors_are_refused(factor):
    with pytest.raises(ValueError, match="factor"):
        change_level(grid([0, 1]), factor)


def test_nudge_by_half_a_beat_follows_the_tempo():
    moved = nudge(grid([0, 1, 3, 4], [1, 2, 1, 2]), beats=0.5)
    assert moved.time_s.tolist() == [0.5, 2, 3.5, 4.5]
    assert moved.beat_in_bar_number.tolist() == [1, 2, 1, 2]


def test_nudge_back_drops_what_lies_before_the_song():
    assert nudge(grid([0.2, 1.2, 2.2]), beats=-0.5).time_s.tolist() == pytest.approx([0.7, 1.7])
    assert nudge(grid([0.2, 1.2, 2.2]), seconds=-0.3).time_s.tolist() == pytest.approx([0.9, 1.9])


def test_nudge_there_and_back():
    time_s = np.array([1.0, 1.5, 2.0, 2.5])
    np.testing.assert_allclose(nudge(nudge(grid(time_s), beats=0.25), beats=-0.25).time_s, time_s)


def test_nudge_of_none_and_one():
    assert len(nudge(grid([]), beats=0.5).time_s) == 0
    assert nudge(grid([1.0]), beats=0.5, seconds=0.1).time_s.tolist() == [1.1]


def test_nudge_refuses_infinity():
    with pytest.raises(ValueError, match="finite"):
        nudge(grid([0, 1]), beats=float("inf"))


def test_counted_faster_without_bars_there_are_none():
    fast = change_level(grid([0, 1, 2]), 3)
    assert fast.beat_in_bar_number.tolist() == [0] * 7
    assert fast.bar_number.tolist() == [0] * 7


def test_beats_of_unknown_place_stay_so_beside_known_ones():
    fast = change_level(grid([0, 1, 2], [0, 1, 2]), 2)
    assert fast.beat_in_bar_number.tolist() == [0, 0, 1, 2, 3]


def test_fewer_beats_than_are_left_out_keep_the_surest():
    assert change_level(grid([0, 1], confidence=[0.2, 0.9]), 0.25).time_s.tolist() == [1]
    assert change_level(grid([]), 0.25).time_s.tolist() == []


def test_most_downbeats_decide_where_a_bar_is_odd():
    """Three bars of four, one of three, two of four: slower by half most downbeats are kept, and bars are given up."""
    numbers = [1, 2, 3, 4] * 3 + [1, 2, 3] + [1, 2, 3, 4] * 2
    slow = change_level(grid(np.arange(23.0), numbers), 0.5)
    assert slow.time_s[0] == 0
    assert set(slow.beat_in_bar_number.tolist()) == {0}
    assert set(slow.bar_number.tolist()) == {0}


def test_bars_stay_where_their_beats_divide():
    slow = change_level(grid(np.arange(8.0), [1, 2, 3, 4] * 2, np.arange(8) / 10), 0.5)
    assert slow.bar_number.tolist() == [1, 1, 2, 2]
    assert slow.beat_in_bar_number.tolist() == [1, 2, 1, 2]
    assert slow.confidence.tolist() == [0.0, 0.2, 0.4, 0.6]


def test_past_the_ends_the_first_and_the_last_interval_go_on():
    uneven = grid([5, 6, 8])
    assert nudge(uneven, beats=-1).time_s.tolist() == [4, 5, 6]
    assert nudge(uneven, beats=1).time_s.tolist() == [6, 8, 10]
    assert nudge(uneven, beats=-0.5, seconds=0.25).time_s.tolist() == [4.75, 5.75, 7.25]


def test_a_beat_moved_onto_the_start_stays_with_its_place():
    moved = nudge(grid([0.5, 1.0, 1.5], [4, 1, 2], [0.1, 0.2, 0.3]), seconds=-0.5)
    assert moved.time_s.tolist() == [0.0, 0.5, 1.0]
    gone = nudge(grid([0.5, 1.0, 1.5], [4, 1, 2], [0.1, 0.2, 0.3]), seconds=-0.6)
    assert gone.beat_in_bar_number.tolist() == [1, 2]
    assert gone.confidence.tolist() == [0.2, 0.3]


@pytest.mark.parametrize("factor", [8, 1 / 8])
def test_eight_times_is_the_most(factor):
    assert len(change_level(grid(np.arange(17.0)), factor).time_s) == (129 if factor > 1 else 3)
