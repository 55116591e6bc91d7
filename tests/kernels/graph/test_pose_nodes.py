"""Poses that are wished for, on nodes and on steps."""

import numpy as np
import pytest

from kernels.graph.beat_features import beat_features
from kernels.graph.nodes import beat_nodes
from kernels.graph.path import STEPS
from kernels.graph.pose_nodes import (
    ON_TIME_S,
    PosePrice,
    SongMoment,
    furthest_ratio,
    is_own_moment,
    own_moments,
    pose_pin,
    pose_price,
    pose_ratio,
    pose_steps,
    song_moment,
)
from kernels.graph.transitions import N_NEAREST, nearest


def test_a_ratio_is_that_of_a_seam(make_dance):
    """The figures of the search for seams, and zero for the pose itself wherever and whichever way it stands."""
    turned, position = make_dance(60.0, 6.0)
    time_s = np.arange(0.5, 5.6, 0.5)
    features = beat_features(turned, position, frame_rate_hz=60.0, time_s=time_s)
    ratio = pose_ratio(features, features)
    np.testing.assert_allclose(ratio, ratio.T)
    assert not np.diag(ratio).any()
    listed = nearest(features, beat_nodes([time_s], [6.0]), min_margin_s=0.0)
    np.testing.assert_allclose(ratio[listed.row, listed.other], listed.weight, rtol=1e-12)
    moved, there = make_dance(60.0, 6.0, heading_rad=1.3, shift_m=(4.0, 0.0, -2.0))
    other = beat_features(moved, there, frame_rate_hz=60.0, time_s=time_s)
    np.testing.assert_allclose(np.diag(pose_ratio(features, other)), 0, atol=1e-9)


def test_how_far_a_pose_may_be():
    assert furthest_ratio(np.array([5.0, 1.0, np.inf]), 2.0) == 2.0
    assert furthest_ratio(np.arange(3.0, 40.0), 2.0) == 3.0 + N_NEAREST - 1
    assert furthest_ratio(np.array([7.0, 5.0, np.inf]), 2.0) == 7.0
    assert furthest_ratio(np.zeros(0), 2.0) == 2.0
    assert furthest_ratio(np.full(3, np.inf), 2.0) == 2.0


def test_prices():
    """Near ones by their distance, the own moment however far, and where there is neither the nearest."""
    none = np.zeros(4, bool)
    ratio, apart_m = np.array([0.0, 1.0, 2.0, np.inf]), np.array([0.0, 0.1, 0.2, np.inf])
    asked = {"threshold": 2.0, "weight_per_m": 10.0}
    np.testing.assert_array_equal(pose_price(ratio, apart_m, none, **asked), [0, 1, np.inf, np.inf])
    own = np.array([False, False, True, False])
    np.testing.assert_array_equal(pose_price(ratio, apart_m, own, **asked), [0, 1, 2, np.inf])
    np.testing.assert_array_equal(pose_price(ratio + 9, apart_m, none, **asked), [0, 1, 2, np.inf])
    np.testing.assert_array_equal(pose_price(ratio + 9, apart_m, own, **asked), [np.inf, np.inf, 2, np.inf])


def test_steps_on_a_beat(make_graph):
    """Steps from a near node pay, those that end there must end at one, none passes over the beat."""
    graph = make_graph([[0.0, 0.5, 1.0, 1.5]])
    price = np.array([np.inf, 0.25, np.inf, np.inf])
    found = pose_steps(graph, 2, price, 4)
    one, two, half = (STEPS.index(step) for step in ((1, 1), (2, 1), (1, 2)))
    for kind in (one, two, half):
        np.testing.assert_array_equal(found[2, kind], price)
    np.testing.assert_array_equal(found[1, one], [0, np.inf, np.inf, np.inf])
    np.testing.assert_array_equal(found[0, half], [0, np.inf, np.inf, np.inf])
    assert np.isinf(found[1, two]).all()
    assert np.isinf(found[1, half]).all()
    assert set(found) == {(2, one), (2, two), (2, half), (1, one), (1, two), (1, half), (0, half)}


def test_steps_at_the_ends_of_the_song(make_graph):
    graph = make_graph([[0.0, 0.5, 1.0, 1.5]])
    price = np.array([np.inf, 0.25, np.inf, np.inf])
    one, _, half = (STEPS.index(step) for step in ((1, 1), (2, 1), (1, 2)))
    assert {beat for beat, _ in pose_steps(graph, 0, price, 4)} == {0}
    last = pose_steps(graph, 4, price, 4)
    np.testing.assert_array_equal(last[3, one], [0.25, np.inf, np.inf, np.inf])
    np.testing.assert_array_equal(last[2, half], [0.25, np.inf, np.inf, np.inf])
    assert np.isinf(last[3, half]).all()
    assert (4, one) not in last


@pytest.mark.parametrize("beat", [0, 2, 4])
def test_no_node_at_all(make_graph, beat):
    assert all(len(price) == 0 for price in pose_steps(make_graph([]), beat, np.zeros(0), 4).values())


ONE, TWO, HALF = (STEPS.index(step) for step in ((1, 1), (2, 1), (1, 2)))


def test_own_moments_are_the_nearest_of_each_row_and_what_is_as_near():
    off_s = np.array([[0.3, 0.2, 0.2 + ON_TIME_S / 2, 0.2 + 3 * ON_TIME_S], [np.inf, 0.5, np.inf, 0.4], [np.inf] * 4])
    wanted = [[False, True, True, False], [False, False, False, True], [False] * 4]
    np.testing.assert_array_equal(own_moments(off_s), wanted)
    assert own_moments(np.zeros((2, 0))).shape == (2, 0)


@pytest.mark.parametrize(
    ("shown_s", "beat_s", "is_own"),
    [
        (1.3, [0.5, 1.25], True),  # as far as half of the interval, and the slack
        (1.45, [0.5, 1.25], False),
        (2.0, [3.0, 3.2], True),  # the nearest beat is 2 s away
        (3.04, [3.0, 3.2], True),
        (3.06, [3.0, 3.2], False),
        (1.04, [], True),
        (0.94, [], False),
    ],
)
def test_a_clip_shows_its_own_moment_as_nearly_as_its_beats_let_it(shown_s, beat_s, is_own):
    assert is_own_moment(shown_s, 1.0, np.array(beat_s)) is is_own


def test_a_moment_on_a_beat_has_that_beat_and_no_steps(make_graph):
    graph, grid_s = make_graph([[0.0, 0.5, 1.0, 1.5]]), np.array([0.0, 0.5, 1.0, 1.5])
    for moment_s, first, beat in ((0.0, 0, 0), (0.5 + ON_TIME_S / 2, 1, 1), (1.5, 2, 3)):
        found = song_moment(graph, grid_s, moment_s)
        assert (found.first, found.beat, list(found.steps)) == (first, beat, [])
        assert found.times_s.shape == (0, 4)


def test_between_beats_steps_pass_a_moment_of_their_clips(make_graph):
    """At a quarter of the second interval; two motion beats in one interval go twice as fast, one in two half."""
    graph, grid_s = make_graph([[0.0, 1.0, 2.0, 4.0]]), np.array([0.0, 0.5, 1.0, 1.5])
    found = song_moment(graph, grid_s, 0.625)
    assert (found.first, found.beat) == (1, -1)
    times = dict(zip(found.steps, found.times_s.tolist(), strict=True))
    assert set(times) == {(1, ONE), (1, TWO), (0, HALF), (1, HALF)}
    nan = np.nan
    np.testing.assert_allclose(times[1, ONE], [0.25, 1.25, 2.5, nan])
    np.testing.assert_allclose(times[1, TWO], [0.5, 1.75, nan, nan])
    np.testing.assert_allclose(times[0, HALF], [0.625, 1.625, 3.25, nan])
    np.testing.assert_allclose(times[1, HALF], [0.125, 1.125, 2.25, nan])
    assert set(song_moment(graph, grid_s, 1.25).steps) == {(2, ONE), (2, TWO), (1, HALF)}
    assert set(song_moment(graph, grid_s, 0.25).steps) == {(0, ONE), (0, TWO), (0, HALF)}


def test_no_node_has_a_moment(make_graph):
    found = song_moment(make_graph([]), np.array([0.0, 0.5]), 0.25)
    assert found.times_s.shape == (len(found.steps), 0)


PRICE = PosePrice(np.array([True, True, False, False]), 0.6, 2.0, 10.0)


def test_the_usable_moment_of_the_own_clip_is_admitted_however_far():
    apart = np.array([[9.0, 9.0, 1.0, 9.0], [0.1, 0.2, 0.3, 0.4]])
    shown_s = np.array([0.5, 1.0, 0.6, 0.6])
    inf = np.inf
    np.testing.assert_allclose(PRICE.of(apart, shown_s, np.ones(4, bool)), [1, inf, 3, inf])
    np.testing.assert_allclose(PRICE.of(apart, shown_s, np.array([False, True, True, True])), [inf, 2, 3, inf])
    both = PRICE.of(np.stack([apart, apart], 1), np.array([shown_s, shown_s + 0.4]), np.ones((2, 4), bool))
    np.testing.assert_allclose(both, [[1, inf, 3, inf]] * 2)
    later = PRICE.of(np.stack([apart, apart], 1), np.array([shown_s, shown_s - 0.45]), np.ones((2, 4), bool))
    np.testing.assert_allclose(later, [[1, inf, 3, inf], [inf, 2, 3, inf]])


def test_a_pin_on_a_beat_asks_starting_steps_and_on_the_last_ending_ones(make_graph):
    """The last beat of a clip starts no step, the first ends none: neither is its own moment there."""
    graph = make_graph([[0.0, 0.5, 1.0], [0.0]])
    far = np.full((2, 4), 9.0)
    none = np.zeros((2, 0, 4))
    price = PosePrice(np.array([True, True, True, False]), 2.0, 2.0, 1.0)
    on = pose_pin("p", graph, SongMoment(1, 1, [], np.zeros((0, 4))), price, far, none, last=4)
    assert (on.name, on.first, on.last, on.nodes.tolist()) == ("p", 1, 2, [True] * 4)
    np.testing.assert_array_equal(on.steps[1, ONE], [np.inf, 9, np.inf, np.inf])
    assert set(on.steps) == set(pose_steps(graph, 1, np.zeros(4), 4))
    early = PosePrice(price.is_clip, -1.0, 2.0, 1.0)
    end = pose_pin("p", graph, SongMoment(3, 4, [], np.zeros((0, 4))), early, far, none, last=4)
    np.testing.assert_array_equal(end.steps[3, ONE], [9, np.inf, np.inf, np.inf])  # it ends at the second beat
    np.testing.assert_array_equal(end.moved(-3).steps[0, ONE], [9, np.inf, np.inf, np.inf])  # it starts at the first


def test_a_pin_between_beats_prices_the_steps_that_pass(make_graph):
    graph = make_graph([[0.0, 0.5, 1.0, 1.5]])
    moment = song_moment(graph, np.array([0.0, 0.5, 1.0, 1.5]), 0.75)
    far = np.full((2, 4), 9.0)
    passing = np.full((2, len(moment.steps), 4), 9.0)
    one = moment.steps.index((1, ONE))
    passing[:, one] = [[1.0, 9.0, 9.0, 1.0], [0.5, 0.5, 0.5, 0.5]]
    price = PosePrice(np.zeros(4, bool), 0.0, 2.0, 2.0)
    pin = pose_pin("p", graph, moment, price, far, passing, last=3)
    assert set(pin.steps) == set(moment.steps)
    np.testing.assert_array_equal(pin.steps[1, ONE], [1, np.inf, np.inf, 1])
    assert np.isinf(pin.steps[1, TWO]).all()
    assert (pin.first, pin.moved(1).first) == (1, 2)
    assert set(pin.moved(1).steps) == set(pose_steps(graph, 2, np.zeros(4), 3))
