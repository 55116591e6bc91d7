from dataclasses import replace

import numpy as np
import pytest

from kernels.graph.costs import PathCosts, stride_cost
from kernels.graph.path import STEPS, InfeasiblePathError, find_path, to_choreography
from kernels.warp import warp_cost

NO_USAGE = PathCosts(usage=0.0)


def brute_force(graph, beat_s, costs=NO_USAGE, steps=STEPS, starts=None, admissible=None):
    """Every path there is: (steps outside the hard bounds, cost) of the best, or None."""
    n_beats = len(beat_s) - 1
    scale = np.percentile(graph.weight, 95) if len(graph.weight) else 1.0
    jumps = {}
    for s, t, w in zip(graph.source.tolist(), graph.target.tolist(), graph.weight, strict=True):
        cost = costs.seam + costs.transition * w / scale
        back_s = graph.time_s[s] - graph.time_s[t]
        if graph.clip_index[s] == graph.clip_index[t] and 0 <= back_s <= costs.jump_back_window_s:
            cost += costs.jump_back
        jumps.setdefault(s, []).append((t, cost))
    best = [None]

    def dance(beat, ready, n_outside, cost):
        if beat == n_beats:
            best[0] = min(best[0] or (np.inf, np.inf), (n_outside, cost))
            return
        for node, seam in ready:
            for m, d in steps:
                end = node
                for _ in range(m):
                    end = int(graph.next_node[end]) if end >= 0 else -1
                if end < 0 or beat + d > n_beats:
                    continue
                if admissible is not None and not admissible[beat : beat + d, node].all():
                    continue
                ratio = (beat_s[beat + d] - beat_s[beat]) / (graph.time_s[end] - graph.time_s[node])
                low, high = costs.last_resort_ratio
                if not low <= ratio <= high:
                    continue
                outside = not costs.hard_ratio[0] <= ratio <= costs.hard_ratio[1]
                price = seam + float(warp_cost(ratio, costs.warp_weights)) + stride_cost(m, d, costs)
                if graph.accent is not None:
                    price += costs.missed_beat * (d - graph.accent[end])
                dance(beat + d, [(end, 0.0), *jumps.get(end, [])], n_outside + outside, cost + price)

    if starts is None:
        starts = [i for i in range(len(graph.clip_index)) if i not in set(graph.next_node.tolist())]
    dance(0, [(node, 0.0) for node in starts], 0, 0.0)
    return best[0]


def check_legal(path, graph, beat_s, costs=NO_USAGE, steps=STEPS):
    """Every music interval once, along clips, transitions that exist, components that are what they say."""
    ends = path.beat_index + path.beat_span
    assert path.beat_index[0] == 0
    assert ends[-1] == len(beat_s) - 1
    np.testing.assert_array_equal(path.beat_index[1:], ends[:-1])
    jumps = set(zip(graph.source.tolist(), graph.target.tolist(), strict=True))
    for i in range(len(path.source_node)):
        assert (path.motion_span[i], path.beat_span[i]) in steps
        node = path.source_node[i]
        for _ in range(path.motion_span[i]):
            node = graph.next_node[node]
        assert node == path.end_node[i]
        moved = i > 0 and path.source_node[i] != path.end_node[i - 1]
        assert path.has_transition[i] == moved
        assert not moved or (path.end_node[i - 1], path.source_node[i]) in jumps
        assert moved == (path.transition_cost[i] > 0)
    ratio = (beat_s[ends] - beat_s[path.beat_index]) / (graph.time_s[path.end_node] - graph.time_s[path.source_node])
    np.testing.assert_allclose(path.warp_ratio, ratio)
    np.testing.assert_allclose(path.warp_cost, warp_cost(ratio, costs.warp_weights))
    low, high = costs.hard_ratio
    np.testing.assert_array_equal(path.is_outside, (ratio < low * (1 - 1e-9)) | (ratio > high * (1 + 1e-9)))


def test_one_clip_in_time_is_danced_as_it_is(make_graph):
    graph = make_graph([[0.2, 0.7, 1.2, 1.7]])
    path = find_path(graph, np.array([10.0, 10.5, 11.0]))
    np.testing.assert_array_equal(path.source_node, [0, 1])
    np.testing.assert_array_equal(path.end_node, [1, 2])
    np.testing.assert_array_equal(path.beat_index, [0, 1])
    np.testing.assert_allclose(path.warp_ratio, 1)
    assert not path.has_transition.any()
    assert path.total_cost == pytest.approx(0)


def test_a_transition_takes_no_time_and_costs_its_weight(make_graph):
    graph = make_graph([[0, 0.5, 1.0], [0, 0.5, 1.0]], [(2, 3, 4.0)], both_ways=False)
    costs = PathCosts(seam=0.5, transition=1.0, transition_scale=8.0)
    path = find_path(graph, 0.5 * np.arange(5), costs=costs)
    np.testing.assert_array_equal(path.source_node, [0, 1, 3, 4])
    np.testing.assert_array_equal(path.has_transition, [False, False, True, False])
    np.testing.assert_allclose(path.transition_cost, [0, 0, 1.0, 0])
    assert path.total_cost == pytest.approx(1.0)


def test_the_first_step_has_no_transition(make_graph):
    graph = make_graph([[0, 0.5], [0, 0.9]], [(0, 2, 1.0)], both_ways=True)
    path = find_path(graph, np.array([0, 0.9]), starts=np.array([0]), costs=PathCosts(hard_ratio=(0.5, 2.0)))
    np.testing.assert_array_equal(path.source_node, [0])


@pytest.mark.parametrize(
    ("interval_s", "span", "motion_span", "ratio"),
    [(0.5, 1, 1, 1.0), (1.0, 1, 2, 1.0), (0.25, 2, 1, 1.0), (0.55, 1, 1, 1.1)],
)
def test_half_and_double_time_before_stretching(make_graph, interval_s, span, motion_span, ratio):
    graph = make_graph([0.5 * np.arange(12)])
    path = find_path(graph, interval_s * np.arange(5))
    assert (path.beat_span == span).all()
    assert (path.motion_span == motion_span).all()
    np.testing.assert_allclose(path.warp_ratio, ratio)
    np.testing.assert_allclose(path.stride_cost, PathCosts().stride if span != motion_span else 0)


def test_uneven_song_beats_are_followed(make_graph):
    graph = make_graph([0.5 * np.arange(9)])
    beat_s = np.cumsum([0, 0.5, 0.47, 0.53, 0.5, 0.46])
    np.testing.assert_allclose(find_path(graph, beat_s).warp_ratio, np.diff(beat_s) / 0.5)


def test_a_clip_in_tempo_is_worth_a_seam(make_graph):
    # the first clip would have to be played at 1.2; the second is in time, one seam away
    graph = make_graph([0.5 * np.arange(9), 0.6 * np.arange(9)], [(1, 9, 1.0)], both_ways=False)
    path = find_path(graph, 0.6 * np.arange(7), starts=np.array([0]))
    np.testing.assert_array_equal(graph.clip_index[path.source_node], [0, 1, 1, 1, 1, 1])


def test_nodes_that_cannot_reach_the_last_beat_are_not_used(make_graph):
    # clip 1 fits better but ends too soon, and nothing leads out of it
    graph = make_graph([0.54 * np.arange(9), 0.5 * np.arange(4)], [(1, 9, 0.0)], both_ways=False)
    path = find_path(graph, 0.5 * np.arange(7))
    assert (graph.clip_index[path.source_node] == 0).all()
    np.testing.assert_array_equal(graph.clip_index[find_path(graph, 0.5 * np.arange(4)).source_node], [1, 1, 1])


def test_going_back_costs(make_graph):
    graph = make_graph([0.5 * np.arange(3), 0.5 * np.arange(3)], [(2, 0, 1.0), (2, 3, 1.5)], both_ways=False)
    there = find_path(graph, 0.5 * np.arange(5), starts=np.array([0]), costs=NO_USAGE)
    np.testing.assert_array_equal(there.source_node, [0, 1, 3, 4])
    free = PathCosts(jump_back=0.0, usage=0.0)
    back = find_path(graph, 0.5 * np.arange(5), starts=np.array([0]), costs=free)
    np.testing.assert_array_equal(back.source_node, [0, 1, 0, 1])
    priced = PathCosts(jump_back=0.01, usage=0.0)
    np.testing.assert_array_equal(
        find_path(graph, 0.5 * np.arange(5), starts=np.array([0]), costs=priced).repetition_cost, [0, 0, 0.01, 0]
    )


@pytest.mark.parametrize("seed", range(120))
def test_agrees_with_all_paths(make_random_graph, seed):
    rng = np.random.default_rng(1000 + seed)
    graph = make_random_graph(seed)
    beat_s = np.cumsum(rng.uniform(0.3, 0.8, rng.integers(2, 7)))
    expected = brute_force(graph, beat_s)
    if expected is None:
        with pytest.raises(InfeasiblePathError):
            find_path(graph, beat_s, costs=NO_USAGE)
        return
    path = find_path(graph, beat_s, costs=NO_USAGE)
    check_legal(path, graph, beat_s)
    assert int(path.is_outside.sum()) == expected[0]
    assert path.total_cost == pytest.approx(expected[1], abs=1e-9)
    if expected[0] == 0:
        assert find_path(graph, beat_s, costs=NO_USAGE, strict=True).total_cost == path.total_cost
    else:
        with pytest.raises(InfeasiblePathError, match=r"warp 0\.8 to 1\.25|no transition"):
            find_path(graph, beat_s, costs=NO_USAGE, strict=True)


@pytest.mark.parametrize("seed", range(40))
def test_agrees_with_all_paths_under_other_arguments(make_random_graph, seed):
    rng = np.random.default_rng(2000 + seed)
    graph = make_random_graph(seed, n_clips=4, n_transitions=8)
    n = len(graph.clip_index)
    beat_s = np.cumsum(rng.uniform(0.4, 0.7, rng.integers(3, 6)))
    arguments = {
        "costs": PathCosts(usage=0.0, seam=0.1, stride=rng.uniform(0, 1), jump_back=rng.uniform(0, 3), leaving=0.3),
        "steps": [((1, 1),), ((1, 1), (3, 2)), ((2, 2), (1, 1), (2, 1))][seed % 3],
        "admissible": rng.random((len(beat_s) - 1, n)) < 0.8,
    }
    expected = brute_force(graph, beat_s, starts=range(n), **arguments)
    if expected is None:
        with pytest.raises(InfeasiblePathError):
            find_path(graph, beat_s, starts="any", **arguments)
        return
    path = find_path(graph, beat_s, starts="any", **arguments)
    check_legal(path, graph, beat_s, arguments["costs"], arguments["steps"])
    assert int(path.is_outside.sum()) == expected[0]
    assert path.total_cost == pytest.approx(expected[1], abs=1e-9)
    for at, span, node in zip(path.beat_index, path.beat_span, path.source_node, strict=True):
        assert arguments["admissible"][at : at + span, node].all()


@pytest.mark.parametrize("seed", range(40))
def test_agrees_with_all_paths_where_accents_are_known(make_random_graph, seed):
    rng = np.random.default_rng(3000 + seed)
    graph = make_random_graph(seed, n_clips=4, n_transitions=8)
    graph = replace(graph, accent=rng.random(len(graph.clip_index)))
    beat_s = np.cumsum(rng.uniform(0.4, 0.7, rng.integers(3, 6)))
    expected = brute_force(graph, beat_s, starts=range(len(graph.clip_index)))
    if expected is None:
        with pytest.raises(InfeasiblePathError):
            find_path(graph, beat_s, costs=NO_USAGE, starts="any")
        return
    path = find_path(graph, beat_s, costs=NO_USAGE, starts="any")
    check_legal(path, graph, beat_s)
    assert int(path.is_outside.sum()) == expected[0]
    assert path.total_cost == pytest.approx(expected[1], abs=1e-9)
    expected_cost = NO_USAGE.missed_beat * (path.beat_span - graph.accent[path.end_node])
    np.testing.assert_allclose(path.beat_cost, expected_cost)


def test_a_clip_that_stops_on_the_beat_is_preferred(make_graph):
    graph = make_graph([[0.0, 0.5, 1.0, 1.5], [0.0, 0.5, 1.0, 1.5]])
    plain = find_path(graph, np.array([0.0, 0.5, 1.0]))
    accented = find_path(replace(graph, accent=np.array([0.0] * 4 + [1.0] * 4)), np.array([0.0, 0.5, 1.0]))
    assert plain.source_node[0] == 0
    assert accented.source_node[0] == 4
    assert accented.beat_cost.sum() == 0


@pytest.mark.parametrize("seed", range(20))
def test_spreading_never_costs_more_and_stays_legal(make_random_graph, seed):
    graph = make_random_graph(seed, n_clips=6, n_beats=6, n_transitions=20)
    beat_s = 0.5 * np.arange(41)
    costs = PathCosts()
    try:
        exact = find_path(graph, beat_s, rounds=0)
    except InfeasiblePathError:
        pytest.skip("this seed's graph has no dance of 40 beats")
    spread = find_path(graph, beat_s, rounds=2)
    check_legal(spread, graph, beat_s, costs)
    key = [(int(path.is_outside.sum()), path.total_cost) for path in (spread, exact)]
    assert key[0] <= key[1]


def test_outside_the_bounds_only_where_nothing_else_reaches(make_graph):
    # the slow bar in the middle fits no clip: one step leaves the bounds, and is listed
    graph = make_graph([0.5 * np.arange(9)])
    beat_s = np.cumsum([0, 0.5, 0.5, 0.7, 0.5])
    path = find_path(graph, beat_s)
    np.testing.assert_array_equal(path.is_outside, [False, False, True, False])
    with pytest.raises(InfeasiblePathError, match=r"got none past beat 2 .1\.00 s.: no clip fits the song's tempo"):
        find_path(graph, beat_s, strict=True)


def test_fewest_outside_before_any_other_cost(make_graph):
    # twenty seams inside the bounds rather than one step outside them
    graph = make_graph([[0, 0.5], [0, 0.5]], [(1, 2, 5.0), (3, 0, 5.0)], both_ways=False)
    longer = make_graph(
        [[0, 0.5], [0, 0.5], 0.35 * np.arange(30)], [(1, 2, 5.0), (3, 0, 5.0), (1, 5, 0.0)], both_ways=False
    )
    costs = PathCosts(leaving=0.0, warp_outside=0.0, warp=0.0)
    beat_s = 0.5 * np.arange(21)
    for made in (graph, longer):
        path = find_path(made, beat_s, costs=costs, steps=((1, 1),), starts=np.array([0]))
        assert path.has_transition.sum() == 19
        assert not path.is_outside.any()


def test_far_from_the_tempo_is_refused_with_the_tempi(make_graph):
    graph = make_graph([0.5 * np.arange(9)])
    with pytest.raises(
        InfeasiblePathError, match=r"tempo.*1 music beats last 3\.000 s, 1 motion beats can last 0\.2"
    ) as e:
        find_path(graph, 3.0 * np.arange(4))
    assert (e.value.reason, e.value.beat_index, e.value.time_s) == ("tempo", 0, 0.0)
    assert "octave" in str(e.value)


def test_no_way_on_is_refused_where_it_happens(make_graph):
    graph = make_graph([0.5 * np.arange(4), 0.5 * np.arange(5)])
    with pytest.raises(InfeasiblePathError, match="no transition leads") as e:
        find_path(graph, 0.5 * np.arange(9), steps=((1, 1),))
    assert (e.value.reason, e.value.beat_index, e.value.time_s) == ("no_transition", 4, 2.0)


def test_nothing_to_dance(make_graph):
    for empty in (make_graph([]), make_graph([[]])):
        with pytest.raises(InfeasiblePathError, match="no node; add clips") as e:
            find_path(empty, np.arange(3.0))
        assert (e.value.reason, e.value.beat_index) == ("no_nodes", 0)
    with pytest.raises(InfeasiblePathError, match="as many beats as a step needs") as e:
        find_path(make_graph([[0.5], [0.7]]), np.arange(3.0))
    assert e.value.reason == "tempo"
    with pytest.raises(InfeasiblePathError, match="give starts") as e:
        find_path(make_graph([[0, 1, 2]]), np.arange(3.0), starts=np.zeros(0, int))
    assert e.value.reason == "no_start"


def test_nothing_admitted(make_graph):
    graph = make_graph([0.5 * np.arange(9)])
    admissible = np.ones((4, 9), bool)
    admissible[2] = False
    with pytest.raises(InfeasiblePathError, match=r"beat 2 .*admitted"):
        find_path(graph, 0.5 * np.arange(5), admissible=admissible)


@pytest.mark.parametrize("beat_s", [np.zeros(0), np.array([3.0])])
def test_no_music_interval_is_no_step(make_graph, beat_s):
    for graph in (make_graph([]), make_graph([[0, 1]])):
        path = find_path(graph, beat_s)
        assert len(path.source_node) == len(path.warp_ratio) == 0
        assert path.total_cost == 0


def test_one_music_interval(make_graph):
    graph = make_graph([[0, 0.6], [0, 0.5], [0, 0.45]])
    path = find_path(graph, np.array([0.0, 0.5]))
    np.testing.assert_array_equal([path.source_node, path.end_node], [[2], [3]])


def test_ties_go_to_no_transition_then_the_lower_clip_and_node(make_graph):
    graph = make_graph([0.5 * np.arange(5)] * 3, [(2, 7, 1.0), (2, 12, 1.0)], both_ways=False)
    beat_s = 0.5 * np.arange(4)
    np.testing.assert_array_equal(find_path(graph, beat_s).source_node, [0, 1, 2])
    np.testing.assert_array_equal(find_path(graph, beat_s, starts="any").source_node, [0, 1, 2])
    np.testing.assert_array_equal(find_path(graph, beat_s, starts=np.array([11, 6])).source_node, [6, 7, 8])
    forced = make_graph([[0, 0.5], [0, 0.5], [0, 0.5]], [(1, 4, 1.0), (1, 2, 1.0)], both_ways=False)
    np.testing.assert_array_equal(find_path(forced, 0.5 * np.arange(3)).source_node, [0, 2])


@pytest.mark.parametrize("seed", range(10))
def test_same_again_and_shifted_song(make_random_graph, seed):
    graph = make_random_graph(seed, n_clips=6, n_beats=6, n_transitions=20)
    beat_s = 0.5 * np.arange(17)
    try:
        first = find_path(graph, beat_s)
    except InfeasiblePathError:
        pytest.skip("this seed's graph has no dance of 16 beats")
    for other in (find_path(graph, beat_s), find_path(graph, beat_s + 64.0)):
        np.testing.assert_array_equal(other.source_node, first.source_node)
        np.testing.assert_array_equal(other.beat_index, first.beat_index)


def test_written_as_choreography(make_graph):
    graph = make_graph([0.5 * np.arange(3), 0.1 + 0.5 * np.arange(3)], [(2, 3, 1.0)], both_ways=False)
    beat_s = 7 + 0.5 * np.arange(5)
    got = to_choreography(find_path(graph, beat_s), graph, beat_s=beat_s, clip_ids=("a", "b"), blend_s=0.2)
    assert got.clip_id == ("a", "a", "b", "b")
    np.testing.assert_allclose(got.song_start_s, [7, 7.5, 8, 8.5])
    np.testing.assert_allclose(got.clip_start_s, [0, 0.5, 0.1, 0.6])
    np.testing.assert_allclose(got.warp_ratio, 1)
    np.testing.assert_array_equal(got.has_seam, [False, False, True, False])
    np.testing.assert_array_equal(got.blend_s, [0, 0, 0.2, 0])


def test_errors(make_graph):
    graph = make_graph([[0, 0.5, 1.0]])
    good = {"beat_s": np.array([0, 0.5])}
    for change, message in [
        ({"beat_s": np.array([0, 0.5, 0.5])}, "beat_s"),
        ({"beat_s": np.array([0, np.nan])}, "beat_s"),
        ({"beat_s": np.zeros((2, 2))}, "beat_s"),
        ({"steps": ()}, "steps"),
        ({"steps": ((1, 1), (1, 1))}, "steps"),
        ({"steps": ((0, 1),)}, "steps"),
        ({"starts": "last"}, "starts"),
        ({"starts": np.array([3])}, "starts"),
        ({"admissible": np.ones((2, 3), bool)}, "admissible"),
        ({"rounds": -1}, "rounds"),
    ]:
        with pytest.raises(ValueError, match=message):
            find_path(graph, **(good | change))


def test_priced_stretches_are_avoided_and_accounted(make_graph):
    """Two equal clips: the dance takes the one that is not priced, and pays where both are."""
    beats = np.arange(6) * 0.5
    graph = make_graph([beats, beats])
    price = np.where(graph.clip_index == 0, 1.0, 0.0)
    path = find_path(graph, beats, costs=NO_USAGE, stretch_price=price)
    assert (graph.clip_index[path.source_node] == 1).all()
    assert path.diversity_cost.sum() == 0
    both = find_path(graph, beats, costs=NO_USAGE, stretch_price=price + 0.25)
    assert both.diversity_cost.sum() == pytest.approx(0.25 * 5)
    assert both.total_cost == pytest.approx(path.total_cost + 1.25)
    with pytest.raises(ValueError, match="stretch_price"):
        find_path(graph, beats, stretch_price=-price)


def test_soft_wishes_cost_and_can_be_overruled(make_graph):
    """A wished clip is danced where the way to it is cheaper than doing without it, and not where it is dearer."""
    beats = np.arange(7) * 0.5
    graph = make_graph([beats, beats], [(2, 9, 0.5), (10, 3, 0.5)], both_ways=False)
    wish = np.zeros((6, 14))
    wish[2:4, graph.clip_index == 0] = 1.0
    path = find_path(graph, beats, costs=NO_USAGE, starts=np.array([0]), interval_price=5.0 * wish)
    assert graph.clip_index[path.source_node].tolist()[2:4] == [1, 1]
    assert path.wish_cost.sum() == 0
    weak = find_path(graph, beats, costs=NO_USAGE, starts=np.array([0]), interval_price=0.2 * wish)
    assert (graph.clip_index[weak.source_node] == 0).all()
    assert weak.wish_cost.sum() == pytest.approx(0.4)
    with pytest.raises(ValueError, match="interval_price"):
        find_path(graph, beats, interval_price=wish[:, :3])


@pytest.mark.parametrize("starts", [[0, 4], [-1, 0], [-1, 4], [4]])
def test_starts_that_are_no_nodes_are_refused(make_graph, starts):
    graph = make_graph([[0, 0.5], [0, 0.5]], [(0, 3, 1.0)], both_ways=True)
    with pytest.raises(ValueError, match="starts: want 0 <= node < "):
        find_path(graph, 0.5 * np.arange(3), starts=np.array(starts))


@pytest.mark.parametrize("kind", ["stretch_price", "interval_price", "step_price"])
def test_fewest_outside_before_any_wish(make_graph, kind):
    """One step outside the bounds at whatever a wish makes of it, rather than two for nothing."""
    graph = make_graph([[0.0, 0.7, 1.2, 1.7], [0.0, 0.7, 1.4, 1.9]])
    dear = np.where(graph.clip_index == 0, 1e7, 0.0)
    price = {
        "stretch_price": dear,
        "interval_price": np.tile(dear, (3, 1)),
        "step_price": {(0, 0): dear},
    }[kind]
    path = find_path(graph, 0.5 * np.arange(4), steps=((1, 1),), costs=NO_USAGE, **{kind: price})
    assert path.is_outside.sum() == 1
    assert (graph.clip_index[path.source_node] == 0).all()


def test_forbidden_steps_do_not_count_as_the_dearest(make_graph):
    graph = make_graph([[0.0, 0.7, 1.2, 1.7]])
    forbidden = {(0, 0): np.array([1.0, np.inf, np.inf, np.inf])}
    path = find_path(graph, 0.5 * np.arange(4), steps=((1, 1),), costs=NO_USAGE, step_price=forbidden)
    assert np.isfinite(path.total_cost)
    assert path.wish_cost.tolist() == [1.0, 0.0, 0.0]


def test_starts_given_twice_and_out_of_order_are_the_same(make_graph):
    graph = make_graph([0.5 * np.arange(5), 0.5 * np.arange(5)])
    one, other = (find_path(graph, 0.5 * np.arange(4), starts=s) for s in (np.array([5, 0, 5]), np.array([0, 5])))
    np.testing.assert_array_equal(one.source_node, other.source_node)


def test_the_first_step_pays_for_no_transition_even_where_one_would_be_cheaper(make_graph):
    """The song begins where it begins: a jump before its first step is none, however dear the clip there."""
    graph = make_graph([0.5 * np.arange(4), 0.5 * np.arange(4)], [(0, 4, 0.0)], both_ways=False)
    dear = np.where(graph.clip_index == 0, 5.0, 0.0)
    path = find_path(graph, 0.5 * np.arange(4), starts=np.array([0]), stretch_price=dear, costs=PathCosts(seam=0.1))
    assert path.source_node[0] == 0
    assert not path.has_transition[0]


def test_no_rounds_leave_a_dance_that_shows_the_same_again(make_graph):
    graph = make_graph([0.5 * np.arange(5)] * 2, [(4, 0, 1.0), (4, 5, 1.5), (9, 0, 1.5)], both_ways=False)
    beat_s = 0.5 * np.arange(13)
    asked = {"starts": np.array([0]), "costs": PathCosts(jump_back=0.0)}
    once, spread = (find_path(graph, beat_s, rounds=rounds, **asked) for rounds in (0, 3))
    assert set(once.source_node.tolist()) == {0, 1, 2, 3}
    assert spread.total_cost < once.total_cost
    with pytest.raises(ValueError, match="rounds"):
        find_path(graph, beat_s, rounds=-1)
