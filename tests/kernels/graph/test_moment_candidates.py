"""Proposals against the search itself, with the proposal as a pin, and against every dance there is."""

import numpy as np
import pytest

from kernels.graph.costs import PathCosts
from kernels.graph.moment_candidates import Proposals
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
