"""Poses that are wished for, on nodes and on steps."""

import numpy as np
import pytest

from kernels.graph.beat_features import beat_features
from kernels.graph.nodes import beat_nodes
from kernels.graph.path import STEPS
from kernels.graph.pose_nodes import furthest_ratio, pose_price, pose_ratio, pose_steps
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
