from dataclasses import replace

import numpy as np
import pytest

from kernels.graph.costs import (
    PathCosts,
    beat_cost,
    intensity_price,
    is_within,
    jump_back_cost,
    rough_cost,
    stride_cost,
    transition_cost,
    usage_cost,
    weight_scale,
)
from kernels.warp import warp_cost


def test_warp_by_hand():
    costs = PathCosts(warp=0.1, leaving=2.0, warp_outside=4.0)
    ratio = np.array([1.0, 1.1, 1.25, 1.25**2 / 1.1])
    expected = [
        0.0,
        0.1,
        0.1 * (np.log(1.25) / np.log(1.1)) ** 2 + 2 + 4,
        0.1 * (np.log(ratio[3]) / np.log(1.1)) ** 2 + 2 + 8,
    ]
    np.testing.assert_allclose(warp_cost(ratio, costs.warp_weights), expected)


def test_warp_grows_away_from_the_clips_pace_and_jumps_at_the_soft_bound():
    costs = PathCosts()
    for ratio in (np.linspace(1, 3, 400), np.linspace(1, 0.3, 400)):
        assert (np.diff(warp_cost(ratio, costs.warp_weights)) > 0).all()
    inside, outside = warp_cost(np.array([0.9001, 0.8999]), costs.warp_weights)
    assert inside <= 0.15
    assert outside - inside > costs.leaving


@pytest.mark.parametrize(
    ("step", "expected"), [((1, 1), 0.0), ((2, 1), 0.25), ((1, 2), 0.25), ((4, 1), 0.5), ((2, 2), 0)]
)
def test_stride(step, expected):
    assert stride_cost(*step, PathCosts(stride=0.25)) == expected


def test_transitions_by_weight(make_graph):
    graph = make_graph([[0, 1, 2], [0, 1, 2]], [(1, 4, 2.0), (2, 3, 8.0)])
    costs = PathCosts(seam=0.5, transition=1.0, transition_scale=4.0)
    cost = dict(zip(graph.source.tolist(), transition_cost(graph, costs), strict=True))
    assert cost == {1: 1.0, 4: 1.0, 2: 2.5, 3: 2.5}
    default = transition_cost(graph, PathCosts())
    np.testing.assert_allclose(default, 0.5 + graph.weight / np.percentile(graph.weight, 95))
    assert len(transition_cost(make_graph([[0, 1]]), PathCosts())) == 0
    np.testing.assert_array_equal(transition_cost(make_graph([[0, 1], [0, 1]], [(1, 2, 0.0)]), PathCosts()), 0.5)


def test_going_back_in_the_same_clip_within_the_window(make_graph):
    graph = make_graph([[0, 1, 5, 20], [0, 1]], [(2, 0, 1.0), (2, 3, 1.0), (3, 1, 1.0), (2, 4, 1.0)], both_ways=False)
    cost = {
        (s, t): c
        for s, t, c in zip(
            graph.source.tolist(),
            graph.target.tolist(),
            jump_back_cost(graph, PathCosts(jump_back=0.7, jump_back_window_s=8.0)),
            strict=True,
        )
    }
    assert cost == {(2, 0): 0.7, (2, 3): 0.0, (3, 1): 0.0, (2, 4): 0.0}


def test_each_showing_costs_as_often_as_it_was_shown_before():
    got = usage_cost(np.array([4, 2, 4, 4, 2, 9]), 10, PathCosts(usage=0.5))
    np.testing.assert_array_equal(got, [0, 0, 0.5, 1.0, 0.5, 0])
    assert len(usage_cost(np.zeros(0, np.int64), 0, PathCosts())) == 0


def test_bounds_have_room_for_the_last_bits():
    assert is_within(np.array([0.5 / 0.4, 0.4 / 0.5, 1.2500001]), (0.8, 1.25)).tolist() == [True, True, False]


def test_errors():
    for change, message in [
        ({"seam": -1.0}, "seam: want finite"),
        ({"usage": np.inf}, "usage: want finite"),
        ({"transition_scale": 0.0}, "transition_scale"),
        ({"soft_ratio": (0.7, 1.1)}, "within the one before"),
        ({"hard_ratio": (0.8, 3.0)}, "within the one before"),
        ({"soft_ratio": (1.0, 1.1)}, "around 1"),
    ]:
        with pytest.raises(ValueError, match=message):
            PathCosts(**change)


def test_rough_recordings_around_a_seam_by_hand(make_graph):
    graph = make_graph([[0, 1, 2], [0, 1, 2], [0, 1, 2]], [(1, 4, 1.0), (1, 7, 1.0), (4, 7, 1.0)], both_ways=False)
    usual = np.repeat([100.0, 400.0, 800.0], 3)
    peak = np.where(np.arange(9) == 4, 1600.0, 50.0)
    cost = rough_cost(replace(graph, peak_jerk=peak, usual_jerk=usual), PathCosts(rough=0.5))
    found = dict(zip(zip(graph.source.tolist(), graph.target.tolist(), strict=True), cost, strict=True))
    assert found == {(1, 4): 0.5 * 4**2, (1, 7): 0.0, (4, 7): 0.5 * 2**2}  # the median clip is the second


def test_roughness_not_known_or_nowhere_costs_nothing(make_graph):
    graph = make_graph([[0, 1, 2], [0, 1, 2]], [(1, 4, 1.0)])
    np.testing.assert_array_equal(rough_cost(graph, PathCosts()), 0)
    still = replace(graph, peak_jerk=np.zeros(6), usual_jerk=np.zeros(6))
    np.testing.assert_array_equal(rough_cost(still, PathCosts()), 0)
    assert len(rough_cost(make_graph([[0, 1]]), PathCosts())) == 0


def test_strong_music_wants_much_movement(make_graph):
    graph = make_graph([[0, 1], [0, 1]])
    np.testing.assert_array_equal(intensity_price(np.ones(3), graph, weight=1.0), np.zeros((3, 4)))
    moving = replace(graph, speed=np.array([0.1, 0.2, 0.3, 4.0]))
    price = intensity_price(np.array([9.0, 1.0]), moving, weight=2.0)
    rank = (np.arange(4) + 0.5) / 4
    np.testing.assert_allclose(price, 2 * np.stack([(0.75 - rank) ** 2, (0.25 - rank) ** 2]))
    np.testing.assert_array_equal(price, intensity_price(np.array([2.0, 0.5]), moving, weight=2.0))


def test_where_both_clips_are_wild_the_median_clip_is_what_is_usual(make_graph):
    """Three calm clips and two wild ones: between the wild ones a peak is measured against the calm."""
    graph = make_graph([[0, 1, 2]] * 5, [(10, 13, 1.0)], both_ways=False)
    usual = np.repeat([100.0, 100.0, 100.0, 400.0, 800.0], 3)
    loud = replace(graph, peak_jerk=np.where(np.arange(15) == 13, 1600.0, 50.0), usual_jerk=usual)
    np.testing.assert_allclose(rough_cost(loud, PathCosts(rough=0.5)), [0.5 * 4**2])
    calm = replace(graph, peak_jerk=np.full(15, 100.0), usual_jerk=usual)
    np.testing.assert_array_equal(rough_cost(calm, PathCosts()), [0.0])


def test_the_larger_peak_and_the_calmer_clip_decide_whichever_side_they_are_on(make_graph):
    graph = make_graph([[0, 1, 2]] * 3, [(1, 4, 1.0)])
    usual = np.repeat([100.0, 200.0, 200.0], 3)
    for loud in (1, 4):
        peak = np.where(np.arange(9) == loud, 800.0, 10.0)
        cost = rough_cost(replace(graph, peak_jerk=peak, usual_jerk=usual), PathCosts(rough=1.0))
        np.testing.assert_allclose(cost, [9.0, 9.0])


def test_roughness_of_one_kind_alone_is_not_known(make_graph):
    graph = make_graph([[0, 1, 2], [0, 1, 2]], [(1, 4, 1.0)])
    for known in ({"peak_jerk": np.full(6, 900.0)}, {"usual_jerk": np.full(6, 9.0)}):
        np.testing.assert_array_equal(rough_cost(replace(graph, **known), PathCosts()), 0)


def test_going_back_to_the_very_moment_and_by_the_whole_window_costs(make_graph):
    graph = make_graph([[0, 1, 9, 9.5], [0, 1]], [(2, 1, 1.0), (2, 2, 1.0), (2, 0, 1.0), (1, 2, 1.0)], both_ways=False)
    edge = list(zip(graph.source.tolist(), graph.target.tolist(), strict=True))
    cost = dict(zip(edge, jump_back_cost(graph, PathCosts(jump_back=0.7, jump_back_window_s=8.0)), strict=True))
    assert cost == {(2, 1): 0.7, (2, 2): 0.7, (2, 0): 0.0, (1, 2): 0.0}


def test_missed_beats_are_what_a_step_covers_less_how_plainly_it_stops(make_graph):
    graph = replace(make_graph([[0, 1, 2]]), accent=np.array([0.0, 0.25, 1.0]))
    costs = PathCosts(missed_beat=2.0)
    np.testing.assert_allclose(beat_cost(graph, np.array([1, 2, -1]), 1, costs), [1.5, 0.0, 0.0])
    np.testing.assert_allclose(beat_cost(graph, np.array([1, 2, -1]), 2, costs), [3.5, 2.0, 0.0])
    np.testing.assert_array_equal(beat_cost(make_graph([[0, 1, 2]]), np.array([1, 2, -1]), 1, costs), np.zeros(3))


def test_the_weight_of_a_poor_seam_is_the_costs_own_else_the_graphs_else_one(make_graph):
    graph = make_graph([[0, 1, 2], [0, 1, 2]], [(1, 4, 2.0), (2, 3, 8.0)])
    assert weight_scale(graph, PathCosts(transition_scale=4.0)) == 4.0
    assert weight_scale(graph, PathCosts()) == np.percentile(graph.weight, 95)
    assert weight_scale(make_graph([[0, 1]]), PathCosts()) == 1.0
    assert weight_scale(make_graph([[0, 1], [0, 1]], [(1, 2, 0.0)]), PathCosts()) == 1.0


def test_a_warp_on_its_soft_bound_is_inside(make_graph):
    costs = PathCosts(warp=0.0)
    on, past = warp_cost(np.array([1.1, 1.1001]), costs.warp_weights)
    assert on == 0
    assert past >= costs.leaving
    low_on, low_past = warp_cost(np.array([0.9, 0.8999]), costs.warp_weights)
    assert low_on == 0
    assert low_past >= costs.leaving
