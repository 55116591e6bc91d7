"""Where recorded motions may be danced, and what that costs."""

import numpy as np
import pytest

from kernels.hmm.instances import PACE, Motions
from kernels.hmm.places import (
    CROWDED,
    MISSED_BEAT,
    MotionWish,
    Places,
    crowded_cost,
    finishing,
    keep_wishes,
    missed_beats,
    place,
    unkept_cost,
)
from kernels.hmm.viterbi import InfeasibleSpansError
from kernels.warp import warp_cost


def test_beats_passed_and_beats_ended_on():
    beat = np.array([True, False, True, False, True])
    found = missed_beats(beat, np.array([0, 0, 0]), np.array([1, 2, 4]), np.array([0.0, 0.25, 1.0]))
    np.testing.assert_allclose(found, [0.0, 0.75 * MISSED_BEAT, MISSED_BEAT])


def test_wishes_close_or_price_what_they_do_not_admit(some_motions, places_of):
    motions = some_motions()
    places = places_of(motions)
    wish = MotionWish(1, 3, np.arange(6) < 3)
    kept = keep_wishes(places, [wish])
    assert set(kept.at[1][1][0].tolist()) == {0, 1, 2}
    assert set(kept.at[3][1][0].tolist()) == set(range(6))
    soft = keep_wishes(places, [wish], price=0.5)
    np.testing.assert_allclose(soft.at[1][1][1] - places.at[1][1][1], np.where(np.arange(6) < 3, 0.0, 1.0))


def test_ends_of_the_song_are_crowded():
    np.testing.assert_allclose(
        crowded_cost(np.array([-0.1, 0.1, 1.0, 1.9, 2.1]), 2.0, blend_s=0.4),
        [CROWDED, CROWDED / 2, 0, CROWDED / 2, CROWDED],
    )


def test_what_nothing_can_follow_is_taken_out():
    one, none = (np.array([0]), np.zeros(1)), (np.zeros(0, np.int64), np.zeros(0))
    places = Places([[one, one], [none, none], [one, none]])
    kept = finishing(places)
    assert [[len(fits) for fits, _ in row] for row in kept.at] == [[0, 1], [0, 0], [1, 0]]
    with pytest.raises(InfeasibleSpansError) as told:
        finishing(Places([[one, one], [none, none], [none, none]]))
    assert told.value.interval == 2


def test_a_motion_stands_where_its_pace_is_within_the_hard_bounds():
    length = np.array([0.39, 0.4, 0.5, 0.625, 0.63])
    n = len(length)
    motions = Motions(np.arange(n), np.zeros(n, np.int64), np.zeros(n), length)
    grid, none = 0.5 * np.arange(3), np.zeros(3, bool)
    places = place(motions, grid, np.zeros((1, 1)), longest=2, is_beat=none, accent=np.zeros(n))
    assert places.at[0][0][0].tolist() == [1, 2, 3]
    np.testing.assert_allclose(places.at[0][0][1], warp_cost(0.5 / length[1:4], PACE))
    assert places.at[0][1][0].tolist() == []
    light = place(motions, grid, np.zeros((1, 1)), longest=1, is_beat=none, accent=np.zeros(n), warp_weight=0.5)
    np.testing.assert_allclose(light.at[0][0][1], 0.5 * warp_cost(0.5 / length[1:4], PACE))


def test_a_place_pays_for_beats_passed_and_for_the_music_under_it_as_far_as_the_song_goes():
    motions = Motions(np.zeros(1, np.int64), np.array([1]), np.zeros(1), np.ones(1))
    grid, is_beat = 0.5 * np.arange(4), np.array([True, True, True, False])
    log_music = np.array([[0.0, -1.0], [0.0, -3.0]])
    places = place(motions, grid, log_music, longest=2, is_beat=is_beat, accent=np.array([0.25]))
    assert places.at[0][1][1] == pytest.approx([MISSED_BEAT * (1 + 0.75) + 1 + 3])
    assert places.at[1][1][1] == pytest.approx([MISSED_BEAT + 3])  # ends past the last interval, on no beat


def test_where_wishes_overlap_each_counts_and_a_hard_one_closes(some_motions, places_of):
    motions = some_motions()
    places = places_of(motions)
    low, even = np.arange(6) < 3, np.arange(6) % 2 == 0
    both = keep_wishes(places, [MotionWish(0, 4, low), MotionWish(0, 4, even)], price=0.5)
    fits, cost = places.at[0][1]
    wanted = cost + 0.5 * 2 * (~low[fits]).astype(float) + 0.5 * 2 * (~even[fits]).astype(float)
    np.testing.assert_allclose(both.at[0][1][1], wanted)
    closed = keep_wishes(places, [MotionWish(0, 4, low), MotionWish(0, 4, even)])
    assert set(closed.at[0][1][0].tolist()) == {0, 2}


def test_a_wish_counts_the_intervals_that_a_motion_shares_with_it():
    wish = MotionWish(2, 5, np.ones(1, bool))
    found = wish.touched_by(np.array([0, 0, 1, 2, 4, 5]), np.array([2, 3, 9, 1, 4, 1]))
    assert found.tolist() == [0, 1, 3, 1, 1, 0]


def test_what_is_danced_in_place_of_a_wish_costs_by_the_interval():
    even, low = np.arange(4) % 2 == 0, np.arange(4) < 2
    start, length, motion = np.array([0, 2, 5]), np.array([2, 3, 1]), np.array([1, 3, 3])
    wishes = [MotionWish(1, 4, even), MotionWish(0, 3, low)]
    np.testing.assert_array_equal(unkept_cost(wishes, start, length, motion, price=0.5), [0.5, 1.0 + 0.5, 0.0])
    np.testing.assert_array_equal(unkept_cost([], start, length, motion, price=0.5), np.zeros(3))


def test_without_wishes_nothing_is_unkept():
    assert unkept_cost([], np.array([0, 2]), np.array([2, 1]), np.array([0, 1]), price=1.0).tolist() == [0.0, 0.0]
