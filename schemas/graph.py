"""Tables of the motion graph."""

from __future__ import annotations

import pyarrow as pa

from schemas import fields as f
from schemas.table import Column, Table

NODE_INDEX = Column("node_index", pa.int32(), "Node of the motion graph, from 0, sorted by clip and time.")

MOTION_GRAPH_NODE = Table(
    name="motion_graph_node",
    version=4,
    meaning="One beat, or one turn, of one clip as a node of the motion graph.",
    key=("node_index",),
    columns=(
        NODE_INDEX,
        f.CLIP_ID,
        f.IS_MIRRORED,
        f.BEAT_INDEX,
        Column(
            "is_of_pulse",
            pa.bool_(),
            "Whether it is a beat (`motion_beat`, by `beat_index`); else a turn (`motion_turn`, by the same index).",
        ),
        f.TIME_S,
        Column("next_node_index", pa.int32(), "The clip's next beat; -1 at its last."),
        Column("label", pa.string(), "Label of the clip."),
        Column("accent_score", pa.float32(), "How plainly the body stops at this beat, 0 to 1."),
        Column("speed_m_per_s", pa.float32(), "Mean speed of the joints from this beat to the clip's next."),
        Column("jerk_m_per_s3", pa.float32(), "Roughest moment of the clip around this beat."),
        Column("clip_jerk_m_per_s3", pa.float32(), "Its clip's 99th percentile of jerk."),
        Column("is_kept", pa.bool_(), "False where pruning found that a dance could not go on from here."),
    ),
)

MOTION_GRAPH_EDGE = Table(
    name="motion_graph_edge",
    version=1,
    meaning="One transition: the dance may jump from a beat of one clip (`clip_id`) to a beat of another.",
    key=("source_node_index", "target_node_index"),
    columns=(
        Column("source_node_index", pa.int32(), "Node before the seam."),
        Column("target_node_index", pa.int32(), "Node after the seam."),
        f.CLIP_ID,
        Column("target_clip_id", pa.string(), "Clip after the seam."),
        Column("distance_score", pa.float32(), "Pose distance d(i,j); lower is closer."),
        Column(
            "edge_cost",
            pa.float32(),
            "Distance over how far both poses move there: d(i,j) / (d(i) + d(j)), equation 20 of JP5778523B2.",
        ),
    ),
)
