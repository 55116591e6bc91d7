"""The motion graph as tables of nodes and transitions, and back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from assets.tables.pack import clip_names, to_numbers
from kernels.types import Float, Int, MotionGraph
from schemas.graph import MOTION_GRAPH_EDGE, MOTION_GRAPH_NODE
from schemas.keys import is_mirrored, source_clip


def from_motion_graph_node(
    graph: MotionGraph,
    clip_ids: Sequence[str],
    beat_index: Int,
    labels: Sequence[str],
    is_kept: NDArray[np.bool_],
    is_of_pulse: Sequence[bool] | None = None,
) -> pa.Table:
    """Pack the nodes of a motion graph, N rows.

    ``clip_ids``, ``labels`` and ``is_of_pulse`` are by clip index; without the last all nodes are beats.
    """
    pulse = np.ones(len(clip_ids) + 1, bool) if is_of_pulse is None else np.array([*is_of_pulse, True], bool)
    columns = [
        pa.array(np.arange(len(graph.time_s)), pa.int32()),
        pa.array([source_clip(clip_ids[c]) for c in graph.clip_index], pa.string()),
        pa.array([is_mirrored(clip_ids[c]) for c in graph.clip_index], pa.bool_()),
        pa.array(beat_index, pa.int32()),
        pa.array(pulse[graph.clip_index], pa.bool_()),
        pa.array(graph.time_s),
        pa.array(graph.next_node, pa.int32()),
        pa.array([labels[c] for c in graph.clip_index], pa.string()),
        *(
            pa.array(np.zeros(len(graph.time_s)) if values is None else values, pa.float32())
            for values in (graph.accent, graph.speed, graph.peak_jerk, graph.usual_jerk)
        ),
        pa.array(is_kept),
    ]
    return MOTION_GRAPH_NODE.check(pa.table(columns, schema=MOTION_GRAPH_NODE.arrow))


def from_motion_graph_edge(graph: MotionGraph, clip_ids: Sequence[str], distance: Float) -> pa.Table:
    """Pack the transitions of a motion graph, E rows."""
    columns = [
        pa.array(graph.source, pa.int32()),
        pa.array(graph.target, pa.int32()),
        pa.array([source_clip(clip_ids[c]) for c in graph.clip_index[graph.source]], pa.string()),
        pa.array([source_clip(clip_ids[c]) for c in graph.clip_index[graph.target]], pa.string()),
        pa.array(distance, pa.float32()),
        pa.array(graph.weight, pa.float32()),
    ]
    return MOTION_GRAPH_EDGE.check(pa.table(columns, schema=MOTION_GRAPH_EDGE.arrow))


def to_motion_graph(node: pa.Table, edge: pa.Table) -> tuple[MotionGraph, tuple[str, ...]]:
    """Unpack the kept part of a motion graph, and its clips by clip index."""
    kept = to_numbers(node["is_kept"]).astype(bool)
    number = np.where(kept, np.cumsum(kept) - 1, -1)
    node = node.filter(pa.array(kept))
    clip_of = clip_names(node)
    clip_ids = tuple(dict.fromkeys(clip_of))
    index = {clip: i for i, clip in enumerate(clip_ids)}
    following = to_numbers(node["next_node_index"]).astype(np.int64)
    source = number[to_numbers(edge["source_node_index"]).astype(np.int64)]
    target = number[to_numbers(edge["target_node_index"]).astype(np.int64)]
    inside = (source >= 0) & (target >= 0)
    graph = MotionGraph(
        clip_index=np.array([index[c] for c in clip_of], np.int64),
        time_s=to_numbers(node["time_s"]).astype(np.float64),
        next_node=np.where(following >= 0, number[np.maximum(following, 0)], -1) if len(number) else following,
        source=source[inside],
        target=target[inside],
        weight=to_numbers(edge["edge_cost"]).astype(np.float64)[inside],
        accent=to_numbers(node["accent_score"]).astype(np.float64),
        peak_jerk=to_numbers(node["jerk_m_per_s3"]).astype(np.float64),
        usual_jerk=to_numbers(node["clip_jerk_m_per_s3"]).astype(np.float64),
        speed=to_numbers(node["speed_m_per_s"]).astype(np.float64),
    )
    return graph, clip_ids
