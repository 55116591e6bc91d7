import numpy as np
import pytest

from kernels.graph import repetition
from kernels.graph.costs import PathCosts
from kernels.graph.path import find_path


@pytest.fixture
def two_rooms(make_graph):
    """Four equal clips of 4 stretches; each one's end leads to every other's start, a little dearer to later ones."""
    jumps = [(4 + 5 * a, 5 * b, 1.0 + 0.01 * b) for a in range(4) for b in range(4) if a != b]
    return make_graph([0.5 * np.arange(5)] * 4, jumps, both_ways=False)


def cheapest(graph, n_beats, costs):
    """Least total cost, repetition included, over every dance beat on beat; music and clips at one pace."""
    scale = np.percentile(graph.weight, 95)
    jumps = {}
    for s, t, w in zip(graph.source.tolist(), graph.target.tolist(), graph.weight, strict=True):
        back_s = graph.time_s[s] - graph.time_s[t]
        goes_back = graph.clip_index[s] == graph.clip_index[t] and 0 <= back_s <= costs.jump_back_window_s
        jumps.setdefault(s, []).append((t, costs.seam + costs.transition * w / scale + costs.jump_back * goes_back))
    best, used = [np.inf], {}

    def dance(beat, ready, cost):
        if cost >= best[0] or beat == n_beats:
            best[0] = min(best[0], cost)
            return
        for node, seam in ready:
            end = int(graph.next_node[node])
            if end >= 0:
                before = used.get(node, 0)
                used[node] = before + 1
                dance(beat + 1, [(end, 0.0), *jumps.get(end, [])], cost + seam + costs.usage * before)
                used[node] = before

    dance(0, [(node, 0.0) for node in np.setdiff1d(np.arange(len(graph.clip_index)), graph.next_node)], 0.0)
    return best[0]


def shown(path):
    return np.bincount(path.source_node, minlength=20).reshape(4, 5)[:, 0]


def test_without_rounds_the_cheapest_loop_comes_again(two_rooms):
    path = find_path(two_rooms, 0.5 * np.arange(33), rounds=0)
    np.testing.assert_array_equal(shown(path), [4, 4, 0, 0])
    assert path.repetition_cost.sum() == pytest.approx(0.5 * 8 * (1 + 2 + 3))


def test_rounds_show_every_clip_as_often(two_rooms):
    path = find_path(two_rooms, 0.5 * np.arange(33), rounds=2)
    np.testing.assert_array_equal(shown(path), [2, 2, 2, 2])
    assert path.repetition_cost.sum() == pytest.approx(0.5 * 16)


def test_unpriced_usage_changes_nothing(two_rooms):
    path = find_path(two_rooms, 0.5 * np.arange(33), costs=PathCosts(usage=0.0), rounds=2)
    np.testing.assert_array_equal(shown(path), [4, 4, 0, 0])


def test_what_cannot_be_spread_stays(make_graph):
    graph = make_graph([0.5 * np.arange(5)], [(4, 0, 1.0)], both_ways=False)
    path = find_path(graph, 0.5 * np.arange(13), rounds=3)
    np.testing.assert_array_equal(path.source_node, [0, 1, 2, 3] * 3)
    np.testing.assert_allclose(path.repetition_cost, [0] * 4 + [1.5, 0.5, 0.5, 0.5] + [2.0, 1, 1, 1])


def test_windows_of_half_time_fit_together(two_rooms, monkeypatch):
    # every step covers two music beats, windows begin and end between them
    monkeypatch.setattr(repetition, "WINDOWS", (7, 3))
    path = find_path(two_rooms, 0.25 * np.arange(65), rounds=3, steps=((1, 1), (1, 2)))
    assert path.beat_span.sum() == 64
    assert shown(path).max() - shown(path).min() <= 1


@pytest.mark.parametrize("seed", range(6))
def test_more_rounds_never_cost_more(make_random_graph, seed):
    graph = make_random_graph(seed, n_clips=12, n_beats=8, n_transitions=60)
    costs = [find_path(graph, 0.5 * np.arange(61), rounds=r).total_cost for r in range(4)]
    assert costs == sorted(costs, reverse=True)
    assert costs[1] < costs[0]


def test_near_the_cheapest_of_all_dances(make_graph):
    ratios = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        beats = [0.5 * np.arange(rng.integers(2, 5)) for _ in range(4)]
        n = sum(map(len, beats))
        jumps = {(int(s), int(t)) for s, t in rng.integers(0, n, (14, 2)) if t not in (s, s + 1)}
        graph = make_graph(beats, [(s, t, float(rng.integers(1, 5))) for s, t in sorted(jumps)], both_ways=False)
        best = cheapest(graph, 12, PathCosts())
        if np.isfinite(best):
            found = find_path(graph, 0.5 * np.arange(13), steps=((1, 1),)).total_cost
            assert found >= best - 1e-9
            ratios.append(found / best)
    assert len(ratios) > 20
    assert np.mean(np.array(ratios) < 1 + 1e-9) > 0.6
    assert np.mean(ratios) < 1.05
