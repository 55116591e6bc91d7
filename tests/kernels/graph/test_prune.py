import itertools

import numpy as np
import pytest

from kernels.graph.prune import has_endless_dance, keep_all, keep_endless, keep_strongest, remove_dead_ends

ALL = [keep_all, remove_dead_ends, keep_strongest, keep_endless]


def can_dance_for_ever(graph, node):
    """By walking: n + 1 steps in a row from a node are possible only round a loop."""
    ends = {node}
    jumps = set(zip(graph.source.tolist(), graph.target.tolist(), strict=True))
    for _ in range(len(graph.clip_index) + 1):
        ready = ends | {t for s, t in jumps if s in ends}
        ends = {int(graph.next_node[u]) for u in ready if graph.next_node[u] >= 0}
    return bool(ends)


def test_a_loop_with_tails(make_graph):
    # clip 0: 0-1-2-3, clip 1: 4-5; back from 2 to 1 makes a loop 1-2, 0 leads in, 3 and all of clip 1 lead out
    graph = make_graph([[0, 1, 2, 3], [0, 2]], [(2, 1, 1.0), (3, 4, 1.0)], both_ways=False)
    np.testing.assert_array_equal(keep_endless(graph).is_kept, [1, 1, 1, 0, 0, 0])
    np.testing.assert_array_equal(keep_strongest(graph).is_kept, [0, 1, 1, 0, 0, 0])
    # 5 has degree one, then 4, then 3; then 0; the pair 1, 2 is joined twice
    np.testing.assert_array_equal(remove_dead_ends(graph).is_kept, [0, 1, 1, 0, 0, 0])
    assert has_endless_dance(graph)


def test_loss_is_counted(make_graph):
    graph = make_graph([[0, 1, 2, 3], [0, 2]], [(2, 1, 1.0), (3, 4, 1.0)], both_ways=False)
    got = keep_endless(graph)
    assert (got.n_nodes_lost, got.n_clips_lost, got.lost_s, got.total_s) == (3, 1, 3.0, 5.0)
    none = keep_all(graph)
    assert (none.n_nodes_lost, none.n_clips_lost, none.lost_s, none.total_s) == (0, 0, 0.0, 5.0)


def test_two_transitions_in_a_row_are_no_dance(make_graph):
    # 1 -> 2 and 2 -> 0 would make a loop of bare edges, but at 2, the last of its clip, nothing can be danced
    graph = make_graph([[0, 1], [0]], [(1, 2, 1.0), (2, 0, 1.0)], both_ways=False)
    assert not has_endless_dance(graph)
    assert not keep_strongest(graph).is_kept.any()


def test_a_loop_on_one_stretch(make_graph):
    graph = make_graph([[0, 1]], [(1, 0, 1.0)], both_ways=False)
    np.testing.assert_array_equal(keep_endless(graph).is_kept, [1, 1])
    np.testing.assert_array_equal(keep_strongest(graph).is_kept, [1, 1])


def test_of_two_loops_the_strongest_is_the_larger_or_the_first(make_graph):
    larger = make_graph([[0, 1], [0, 1, 2]], [(1, 0, 1.0), (4, 2, 1.0)], both_ways=False)
    np.testing.assert_array_equal(keep_strongest(larger).is_kept, [0, 0, 1, 1, 1])
    equal = make_graph([[0, 1], [0, 1]], [(1, 0, 1.0), (3, 2, 1.0)], both_ways=False)
    np.testing.assert_array_equal(keep_strongest(equal).is_kept, [1, 1, 0, 0])
    np.testing.assert_array_equal(keep_endless(equal).is_kept, [1, 1, 1, 1])


def test_dead_ends_of_the_patent_may_leave_a_one_way_street(make_graph):
    # the loop of clip 0 leads by two ways into clip 1, from which nothing returns: degrees are above one, still stuck
    graph = make_graph([[0, 1, 2], [0, 1, 2]], [(2, 0, 1.0), (1, 3, 1.0), (2, 4, 1.0), (1, 5, 1.0)], both_ways=False)
    assert remove_dead_ends(graph).is_kept.all()
    np.testing.assert_array_equal(keep_endless(graph).is_kept, [1, 1, 1, 0, 0, 0])


@pytest.mark.parametrize("seed", range(30))
def test_endless_agrees_with_walking(make_random_graph, seed):
    graph = make_random_graph(seed, n_clips=4)
    expected = [can_dance_for_ever(graph, node) for node in range(len(graph.clip_index))]
    np.testing.assert_array_equal(keep_endless(graph).is_kept, expected)


@pytest.mark.parametrize("seed", range(30))
def test_orders_of_loss(make_random_graph, seed):
    graph = make_random_graph(seed, n_clips=4)
    strongest, endless = keep_strongest(graph), keep_endless(graph)
    assert (endless.is_kept | ~strongest.is_kept).all()
    assert strongest.is_kept.any() == endless.is_kept.any() == has_endless_dance(graph)
    kept = remove_dead_ends(graph).is_kept
    low = np.minimum(graph.source, graph.target)
    pairs = set(zip(low.tolist(), np.maximum(graph.source, graph.target).tolist(), strict=True))
    for node in np.flatnonzero(kept):
        joined = sum(kept[a] and kept[b] for a, b in pairs if node in (a, b))
        beside = sum(
            kept[a] and kept[b]
            for a, b in itertools.pairwise(range(len(kept)))
            if graph.next_node[a] == b
            if node in (a, b)
        )
        assert joined + beside > 1


@pytest.mark.parametrize("prune", ALL)
def test_empty_graph_and_lone_beats(make_graph, prune):
    assert prune(make_graph([])).is_kept.shape == (0,)
    lone = prune(make_graph([[0.5], [0.5]]))
    assert lone.total_s == 0
    assert lone.n_nodes_lost == (0 if prune is keep_all else 2)


def test_a_node_without_any_edge_goes_and_a_pair_joined_both_ways_counts_once(make_graph):
    # clip 0 is a lone beat; the transitions 1 -> 3 and 3 -> 1 are one edge of degree, beside the way on
    graph = make_graph([[0], [0, 1], [0, 1]], [(1, 3, 1.0)])
    assert not remove_dead_ends(graph).is_kept.any()
    ring = make_graph([[0], [0, 1], [0, 1]], [(1, 3, 1.0), (2, 4, 1.0)])
    np.testing.assert_array_equal(remove_dead_ends(ring).is_kept, [0, 1, 1, 1, 1])


def test_nodes_entered_by_a_jump_and_danced_on_from_belong_to_the_strongest(make_graph):
    """No step ends on the first beat of a clip, yet the loop needs it: it is kept where the loop enters there."""
    graph = make_graph([[0, 1], [0, 1]], [(1, 2, 1.0), (3, 0, 1.0)], both_ways=False)
    assert keep_strongest(graph).is_kept.all()
    beside = make_graph([[0, 1], [0, 1], [0, 1]], [(1, 2, 1.0), (3, 0, 1.0), (1, 4, 1.0)], both_ways=False)
    np.testing.assert_array_equal(keep_strongest(beside).is_kept, [1, 1, 1, 1, 0, 0])


def test_time_is_lost_where_either_beat_is(make_graph):
    graph = make_graph([[0, 1, 3, 6]], [(2, 1, 1.0)], both_ways=False)
    got = keep_strongest(graph)
    np.testing.assert_array_equal(got.is_kept, [False, True, True, False])
    assert (got.lost_s, got.total_s, got.n_clips_lost) == (4.0, 6.0, 0)
