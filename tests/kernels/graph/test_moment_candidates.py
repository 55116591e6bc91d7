"""Proposals against the search itself, with the proposal as a pin, and against every dance there is."""

import numpy as np
import pytest

from kernels.graph.costs import PathCosts
from kernels.graph.moment_candidates import Proposals, least_of_groups, price_groups
from kernels.graph.path import STEPS, InfeasiblePathError, find_path
from kernels.graph.pin_conflicts import Pin, admitted
from kernels.graph.program import PathProgram

COSTS = PathCosts(usage=0.0)


def proposals_of(graph, beat_s, starts, admissible=None, **prices):
    program = PathProgram(
        graph,
        beat_s,
        steps=STEPS,
        costs=COSTS,
        admissible=admissible,
        bounds=COSTS.hard_ratio,
        outside_price=0.0,
        **prices,
    )
    return Proposals(program, starts)


def searched(graph, beat_s, starts, mask, **prices):
    """Cost of the cheapest dance that the search finds under a mask; infinite where it finds none."""
    try:
        path = find_path(graph, beat_s, costs=COSTS, starts=starts, admissible=mask, strict=True, rounds=0, **prices)
    except InfeasiblePathError:
        return np.inf
    return path.total_cost


@pytest.mark.parametrize("seed", range(40))
def test_a_proposal_costs_what_its_pin_costs(seed, make_random_graph):
    graph = make_random_graph(seed, n_clips=4, n_beats=6, n_transitions=8)
    rng = np.random.default_rng(seed)
    n, n_nodes = int(rng.integers(2, 7)), len(graph.clip_index)
    beat_s = np.cumsum(rng.uniform(0.45, 0.6, n + 1))
    starts = np.flatnonzero(rng.random(n_nodes) < 0.6)
    price = rng.uniform(0, 1, n_nodes)
    wish = rng.uniform(0, 1, (n, n_nodes))
    mask = np.ones((n, n_nodes), bool) if seed % 2 else rng.random((n, n_nodes)) < 0.9
    found = proposals_of(graph, beat_s, starts, mask, stretch_price=price, interval_price=wish)
    asked = {"stretch_price": price, "interval_price": wish}
    best = searched(graph, beat_s, starts, mask, **asked)
    assert found.best_cost == pytest.approx(best)
    first = int(rng.integers(n))
    last = int(rng.integers(first + 1, n + 1))
    for clip in range(graph.clip_index.max() + 1):
        nodes = graph.clip_index == clip
        pinned = mask & admitted([Pin("p", first, last, nodes)], n, n_nodes)
        assert found.within(first, last, nodes) == pytest.approx(searched(graph, beat_s, starts, pinned, **asked))
    through = found.through(first)
    assert through.min() == pytest.approx(best)
    for node in range(n_nodes):
        one = np.arange(n_nodes) == node
        pinned = mask & admitted([Pin("p", first, first + 1, one)], n, n_nodes)
        assert through[node] == pytest.approx(searched(graph, beat_s, starts, pinned, **asked))


def test_the_cases_hold_both(make_random_graph):
    """Some of the graphs above can be danced, and some of their proposals cannot."""
    costs = []
    for seed in range(40):
        graph = make_random_graph(seed, n_clips=4, n_beats=6, n_transitions=8)
        found = proposals_of(graph, np.arange(4) * 0.5, np.arange(len(graph.clip_index)))
        costs.append(found.through(1))
    every = np.concatenate(costs)
    assert np.isfinite(every).any()
    assert np.isinf(every).any()


def test_by_hand(make_graph):
    """Two clips at the song's pace, joined at beat 2: staying costs nothing, the other clip one seam."""
    beats = np.arange(6) * 0.5
    graph = make_graph([beats, beats], [(2, 8, 0.2)], both_ways=False)
    found = proposals_of(graph, beats, np.array([0]))
    second = graph.clip_index == 1
    assert found.best_cost == 0.0
    assert found.within(4, 5, ~second) == 0.0
    assert found.within(4, 5, second) == pytest.approx(0.5 + 1.0)
    assert found.within(2, 5, second) == pytest.approx(0.5 + 1.0)
    assert np.isinf(found.within(1, 3, second))
    assert np.isinf(found.through(0, second)).all()


def test_what_is_not_in_the_song(make_graph):
    beats = np.arange(4) * 0.5
    found = proposals_of(make_graph([beats]), beats, np.array([0]))
    with pytest.raises(ValueError, match="want 0 <= first < last <= 3"):
        found.through(3)
    with pytest.raises(ValueError, match="want 0 <= first < last <= 3"):
        found.within(2, 2, np.ones(4, bool))
    nothing = proposals_of(make_graph([]), beats, np.zeros(0, int))
    assert np.isinf(nothing.best_cost)
    assert len(nothing.through(1)) == 0


def test_the_least_of_each_group_and_where_it_is_first():
    value, group = np.array([3.0, 1.0, 1.0, np.inf, 2.0]), np.array([2, 0, 0, 3, 2])
    least, index = least_of_groups(value, group, 5)
    np.testing.assert_array_equal(least, [1, np.inf, 2, np.inf, np.inf])
    assert index.tolist() == [1, -1, 4, 3, -1]
    assert least_of_groups(np.zeros(0), np.zeros(0, int), 2)[1].tolist() == [-1, -1]


@pytest.fixture
def three_parts(make_graph):
    """A song of 5 intervals; clip 1 is joined to clip 0, clip 2 to clip 1 at a price, and clip 3 to none."""
    beats = np.arange(6) * 0.5
    return make_graph([beats] * 4, [(2, 8, 0.2), (9, 15, 0.4)], both_ways=False), beats


def test_groups_are_priced_in_one_interval_by_their_cheapest_step(three_parts):
    graph, beats = three_parts
    found = proposals_of(graph, beats, np.array([0]))
    prices = price_groups([found], 4, 5, graph.clip_index, np.array([True, True, True, True]), most=0)
    through = found.through(4)
    for clip in range(4):
        nodes = graph.clip_index == clip
        assert prices.cost[clip] == through[nodes].min()
    assert prices.node[1] == 10
    assert np.isinf(prices.cost[3])
    assert not prices.is_left.any()
    some = price_groups([found], 4, 5, graph.clip_index, np.array([True, False, True, True]), most=0)
    assert np.isinf(some.cost[1])
    assert some.node[1] == -1


def test_over_several_intervals_the_least_bounds_are_priced_and_the_rest_left(three_parts):
    graph, beats = three_parts
    found = proposals_of(graph, beats, np.array([0]))
    every = np.ones(4, bool)
    prices = price_groups([found], 3, 5, graph.clip_index, every, most=9)
    for clip in range(4):
        assert prices.cost[clip] == found.within(3, 5, graph.clip_index == clip)
    assert (prices.node == -1).all()
    assert not prices.is_left.any()
    one = price_groups([found], 3, 5, graph.clip_index, every, most=1)
    assert one.cost[0] == prices.cost[0]
    assert np.isinf(one.cost[1:]).all()
    assert one.is_left[1]
    assert not one.is_left[[0, 3]].any()


def test_what_the_first_song_cannot_the_next_may(three_parts):
    graph, beats = three_parts
    strict, free = (proposals_of(graph, beats, starts) for starts in (np.array([0]), np.arange(24)))
    for last in (4, 5):
        both = price_groups([strict, free], 3, last, graph.clip_index, np.ones(4, bool), most=9)
        alone = price_groups([strict], 3, last, graph.clip_index, np.ones(4, bool), most=9)
        assert np.isinf(alone.cost[3])
        assert both.cost[3] == free.within(3, last, graph.clip_index == 3)
        known = np.isfinite(alone.cost)
        np.testing.assert_array_equal(both.cost[known], alone.cost[known])
