"""The motion graph into tables and back, pruned and renumbered."""

import numpy as np

from assets.tables.graph import from_motion_graph_edge, from_motion_graph_node, to_motion_graph
from kernels.types import MotionGraph
from schemas.keys import mirrored


def test_graph_comes_back_pruned_and_renumbered():
    graph = MotionGraph(
        clip_index=np.array([0, 0, 0, 1, 1, 1]),
        time_s=np.array([0.0, 0.5, 1.0, 0.2, 0.7, 1.2]),
        next_node=np.array([1, 2, -1, 4, 5, -1]),
        source=np.array([1, 1, 4]),
        target=np.array([4, 5, 1]),
        weight=np.array([0.1, 0.2, 0.3]),
        accent=np.linspace(0, 1, 6),
    )
    kept = np.array([True, True, False, True, True, False])
    node = from_motion_graph_node(graph, ["s-a", "s-b"], np.array([0, 1, 2, 0, 1, 2]), ["x", "y"], kept)
    edge = from_motion_graph_edge(graph, ["s-a", "s-b"], np.array([1.0, 2.0, 3.0]))
    back, clips = to_motion_graph(node, edge)
    assert clips == ("s-a", "s-b")
    assert back.next_node.tolist() == [1, -1, 3, -1]
    assert list(zip(back.source.tolist(), back.target.tolist(), strict=True)) == [(1, 3), (3, 1)]
    np.testing.assert_allclose(back.accent, graph.accent[kept], atol=1e-7)
    assert edge["target_clip_id"].to_pylist() == ["s-b", "s-b", "s-a"]


def test_mirrored_clips_are_a_clip_and_a_flag_in_tables_and_a_name_of_their_own_in_a_graph():
    image = mirrored("s-a")
    graph = MotionGraph(
        clip_index=np.array([0, 0, 1, 1]),
        time_s=np.array([0.2, 0.7, 0.2, 0.7]),
        next_node=np.array([1, -1, 3, -1]),
        source=np.array([1]),
        target=np.array([2]),
        weight=np.array([0.1]),
    )
    labels, index, kept = ["x", "x"], np.array([0, 1, 0, 1]), np.ones(4, bool)
    node = from_motion_graph_node(graph, ["s-a", image], index, labels, kept)
    edge = from_motion_graph_edge(graph, ["s-a", image], np.array([1.0]))
    assert node["clip_id"].to_pylist() == ["s-a"] * 4
    assert node["is_mirrored"].to_pylist() == [False, False, True, True]
    assert edge["target_clip_id"].to_pylist() == ["s-a"]
    back, clips = to_motion_graph(node, edge)
    assert clips == ("s-a", image)
    assert back.clip_index.tolist() == [0, 0, 1, 1]


def test_graph_of_nothing():
    none = MotionGraph(*(np.zeros(0, int),), np.zeros(0), *(np.zeros(0, int),) * 3, np.zeros(0))
    node = from_motion_graph_node(none, [], np.zeros(0, int), [], np.zeros(0, bool))
    back, clips = to_motion_graph(node, from_motion_graph_edge(none, [], np.zeros(0)))
    assert clips == ()
    assert len(back.time_s) == 0


def test_beats_and_turns_of_a_clip_are_two_rows_of_one_clip():
    graph = MotionGraph(
        clip_index=np.array([0, 0, 1, 1, 1]),
        time_s=np.array([0.2, 0.7, 0.1, 0.5, 0.9]),
        next_node=np.array([1, -1, 3, 4, -1]),
        source=np.array([1]),
        target=np.array([2]),
        weight=np.array([0.1]),
    )
    index, kept = np.array([0, 1, 0, 1, 2]), np.ones(5, bool)
    node = from_motion_graph_node(graph, ["s-a", "s-a"], index, ["x", "x"], kept, [True, False])
    assert node["is_of_pulse"].to_pylist() == [True, True, False, False, False]
    edge = from_motion_graph_edge(graph, ["s-a", "s-a"], np.array([1.0]))
    back, clips = to_motion_graph(node, edge)
    assert clips == ("s-a",)
    assert back.next_node.tolist() == [1, -1, 3, 4, -1]
    assert back.time_s.tolist() == graph.time_s.tolist()
