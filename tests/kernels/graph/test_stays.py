"""The price of phrases cut short, against every dance there is."""

from itertools import pairwise

import numpy as np
import pytest

from kernels.graph.costs import PathCosts, hurry_cost
from kernels.graph.moment_candidates import Proposals
from kernels.graph.path import STEPS, InfeasiblePathError, find_path
from kernels.graph.pin_conflicts import Pin, admitted
from kernels.graph.program import PathProgram


def random_case(seed, make_random_graph):
    rng = np.random.default_rng(seed)
    graph = make_random_graph(seed, n_clips=4, n_beats=7, n_transitions=30)
    beat_s = np.cumsum(rng.uniform(0.45, 0.6, int(rng.integers(4, 8))))
    costs = PathCosts(usage=0.0, seam=0.2, stay=float(rng.uniform(0.1, 4)), stay_beats=int(rng.integers(1, 6)))
    mask = rng.random((len(beat_s) - 1, len(graph.clip_index))) < 0.95
    return graph, beat_s, costs, mask, np.flatnonzero(rng.random(len(graph.clip_index)) < 0.7)


@pytest.mark.parametrize("seed", range(150))
def test_agrees_with_all_dances(seed, make_random_graph, every_dance):
    graph, beat_s, costs, mask, starts = random_case(seed, make_random_graph)
    every = every_dance(graph, beat_s, costs, starts, mask)
    if not every:
        with pytest.raises(InfeasiblePathError):
            find_path(graph, beat_s, costs=costs, starts=starts, admissible=mask, strict=True)
        return
    path = find_path(graph, beat_s, costs=costs, starts=starts, admissible=mask, strict=True)
    assert path.total_cost == pytest.approx(min(cost for cost, *_ in every), abs=1e-9)
    seams = [0, *path.beat_index[path.has_transition].tolist()]
    short = [max(costs.stay_beats - (b - a), 0) / costs.stay_beats * costs.stay for a, b in pairwise(seams)]
    np.testing.assert_allclose(path.stay_cost[path.has_transition], short)
    assert not path.stay_cost[~path.has_transition].any()


def test_the_cases_hold_stays_that_were_cut_short(make_random_graph, every_dance):
    """Some of the best dances above pay for a short stay, and some would be others without the price."""
    paid = changed = 0
    for seed in range(150):
        graph, beat_s, costs, mask, starts = random_case(seed, make_random_graph)
        free = PathCosts(usage=0.0, seam=0.2)
        every = every_dance(graph, beat_s, costs, starts, mask)
        if every:
            path, other = (
                find_path(graph, beat_s, costs=c, starts=starts, admissible=mask, strict=True) for c in (costs, free)
            )
            paid += path.stay_cost.sum() > 0
            changed += path.source_node.tolist() != other.source_node.tolist()
    assert paid > 5
    assert changed > 5


@pytest.mark.parametrize("seed", range(60))
def test_ties_go_by_one_rule(seed, make_graph, every_dance):
    """Costs in halves and quarters, added without rounding: of equal dances the one that the rule names."""
    rng = np.random.default_rng(seed)
    beats = [0.5 * np.arange(rng.integers(3, 6)) for _ in range(4)]
    n = sum(map(len, beats))
    pairs = {(int(s), int(t)) for s, t in rng.integers(0, n, (16, 2)) if t not in (s, s + 1)}
    graph = make_graph(beats, [(s, t, float(rng.integers(2))) for s, t in sorted(pairs)], both_ways=False)
    costs = PathCosts(
        usage=0.0, seam=0.5, transition_scale=1.0, stay=2.0, stay_beats=4, warp=0.0, stride=0.25, jump_back=0.5
    )
    beat_s = 0.5 * np.arange(7)
    every = every_dance(graph, beat_s, costs, np.arange(n))
    if not every:
        pytest.skip("this seed's graph has no dance of 6 beats")
    path = find_path(graph, beat_s, costs=costs, starts="any", strict=True)
    _, _, moves = min(every, key=lambda dance: dance[:2])
    kinds = [STEPS.index((m, d)) for m, d in zip(path.motion_span.tolist(), path.beat_span.tolist(), strict=True)]
    assert list(zip(path.beat_index.tolist(), path.source_node.tolist(), kinds, strict=True)) == moves


@pytest.mark.parametrize("seed", range(60))
def test_a_proposal_costs_what_its_pin_costs(seed, make_random_graph, every_dance):
    graph, beat_s, costs, mask, starts = random_case(seed, make_random_graph)
    n, n_nodes = mask.shape
    program = PathProgram(
        graph, beat_s, steps=STEPS, costs=costs, admissible=mask, bounds=costs.hard_ratio, outside_price=0.0
    )
    found = Proposals(program, starts)
    rng = np.random.default_rng(seed)
    first = int(rng.integers(n))
    last = int(rng.integers(first + 1, n + 1))

    def least(pinned):
        return min((cost for cost, *_ in every_dance(graph, beat_s, costs, starts, pinned)), default=np.inf)

    assert found.best_cost == pytest.approx(least(mask))
    through = found.through(first)
    for clip in range(int(graph.clip_index.max()) + 1):
        nodes = graph.clip_index == clip
        one = mask & admitted([Pin("p", first, first + 1, nodes)], n, n_nodes)
        assert through[nodes].min() == pytest.approx(least(one))
        more = mask & admitted([Pin("p", first, last, nodes)], n, n_nodes)
        assert found.within(first, last, nodes) == pytest.approx(least(more))


def test_a_phrase_is_finished_before_the_next(make_graph):
    """A detour of one beat through a third clip pays where stays count, and is left out."""
    beats = 0.5 * np.arange(9)
    graph = make_graph([beats] * 3, [(3, 12, 0.0), (13, 22, 0.0), (4, 22, 1.0)], both_ways=False)
    costs = {"usage": 0.0, "seam": 0.25, "transition_scale": 1.0}
    wish = np.zeros((8, 27))
    wish[5:, graph.clip_index != 2] = 9.0
    asked = {"starts": np.array([0]), "interval_price": wish}
    hop = find_path(graph, beats, costs=PathCosts(**costs), **asked)
    assert graph.clip_index[hop.source_node].tolist() == [0, 0, 0, 1, 2, 2, 2, 2]
    whole = find_path(graph, beats, costs=PathCosts(**costs, stay=2.0), **asked)
    assert graph.clip_index[whole.source_node].tolist() == [0, 0, 0, 0, 2, 2, 2, 2]
    assert whole.stay_cost.sum() == 0


def test_prices_by_hand():
    np.testing.assert_allclose(hurry_cost(PathCosts(stay=2.0, stay_beats=4)), [1.5, 1.0, 0.5, 0.0])
    for free in (PathCosts(stay=2.0, stay_beats=1), PathCosts(stay=0.0)):
        np.testing.assert_array_equal(hurry_cost(free), [0.0])
    with pytest.raises(ValueError, match="stay_beats: want >= 1"):
        PathCosts(stay_beats=0)


@pytest.mark.parametrize("seed", range(12))
def test_windows_agree_with_the_whole(seed, make_random_graph):
    """A window solved between its neighbours costs what the whole dance then costs."""
    graph = make_random_graph(seed, n_clips=8, n_beats=8, n_transitions=40)
    beat_s = 0.5 * np.arange(41)
    costs = PathCosts(usage=0.0, stay=3.0, stay_beats=5)
    free = PathCosts(usage=0.5, stay=3.0, stay_beats=5)
    try:
        exact = find_path(graph, beat_s, costs=costs)
    except InfeasiblePathError:
        pytest.skip("this seed's graph has no dance of 40 beats")
    program = PathProgram(
        graph, beat_s, steps=STEPS, costs=costs, admissible=None, bounds=costs.last_resort_ratio, outside_price=1e5
    )
    whole = program.solve(0, 40, after={40: program.at_the_end})
    starts = np.setdiff1d(np.arange(program.n_nodes), graph.next_node)
    moves = program.decode(whole, first=0, last=40, arrived=None, starts=starts)
    at = next(i for i, move in enumerate(moves) if move[0] >= 12)
    to = next(i for i, move in enumerate(moves) if move[0] >= 25)
    gone = program.ends(moves[at - 1])[1], program.beats_stayed(moves[:at])
    rest = next((b[0] - moves[to][0] for a, b in pairwise(moves[to:]) if program.ends(a)[1] != b[1]), None)
    after = {moves[to][0]: program.arrive_before(moves[to][1], rest)}
    part = program.solve(moves[at][0], moves[to][0], after=after)
    again = program.decode(part, first=moves[at][0], last=moves[to][0], arrived=gone, starts=starts)
    assert moves[:at] + again + moves[to:] == moves
    costs_of = [find_path(graph, beat_s, costs=free, rounds=r).total_cost for r in range(3)]
    assert costs_of == sorted(costs_of, reverse=True)
    assert exact.total_cost <= costs_of[0] + 1e-9
