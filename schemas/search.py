"""Tables of motion search."""

from __future__ import annotations

import pyarrow as pa

from schemas import fields as f
from schemas.table import Column, Table

N_EMBEDDING = 512

WINDOW_INDEX = Column("window_index", pa.int32(), "Window of its clip, from 0.")
START_S = Column("start_s", pa.float64(), "Where the window begins, from the clip's first frame.")
END_S = Column("end_s", pa.float64(), "Where the window ends, from the clip's first frame.")

MOTION_ENCODER = Table(
    name="motion_encoder",
    version=1,
    meaning="One array of the trained encoder; what it was trained on stands in the file's metadata as `provenance`.",
    key=("parameter_name",),
    columns=(
        Column("parameter_name", pa.string(), "Part of the encoder and name within it, joined by a dot."),
        Column("shape", pa.list_(pa.int32()), "Shape of the array."),
        Column("elements", pa.list_(pa.float32()), "Its values, last axis fastest."),
    ),
)

MOTION_EMBEDDING = Table(
    name="motion_embedding",
    version=2,
    meaning="One window of one clip as the vector it is searched by.",
    key=("clip_id", "window_index"),
    columns=(
        f.CLIP_ID,
        WINDOW_INDEX,
        START_S,
        END_S,
        Column("embedding", pa.list_(pa.float32(), N_EMBEDDING), "Unit vector; like motions lie close together."),
        Column(
            "track_m",
            pa.list_(pa.float32()),
            "Head, elbows, hands, knees and feet seen from the body, 27 numbers a frame at 7.5 Hz, of the whole clip; "
            "it stands with the clip's first window and is empty with others.",
        ),
    ),
)

MOTION_INDEX = Table(
    name="motion_index",
    version=2,
    meaning="One row of the search index: a window, and what a search may be narrowed by; its vector is the "
    "same row of the file that the metadata names as `vectors`; what joints "
    "do stands in the file named as `tracks`.",
    key=("row_index",),
    columns=(
        Column("row_index", pa.int32(), "Row of the index, from 0, sorted by clip and window."),
        f.CLIP_ID,
        f.SESSION,
        WINDOW_INDEX,
        START_S,
        END_S,
        f.LABEL,
        f.IS_LABELLED,
        f.STYLE,
        f.LICENCE,
        f.DURATION_S,
        f.PATH,
        Column("row_key", pa.int64(), "Window and vector as a number: a window embedded anew has another."),
        Column("track_index", pa.int64(), "First frame of its clip among the tracks."),
        Column("track_count", pa.int32(), "Frames of its clip's track."),
        Column("map_x_score", pa.float32(), "Place on the map of the catalogue; like motions lie close together."),
        Column("map_y_score", pa.float32(), "The map's other axis."),
    ),
)

LABEL_PROPOSAL = Table(
    name="label_proposal",
    version=1,
    meaning="One label proposed for one clip that clips.csv gives none.",
    key=("clip_id", "rank_number"),
    columns=(
        f.CLIP_ID,
        Column("rank_number", pa.int32(), "Place among the clip's proposals, from 1."),
        Column("proposed_label", pa.string(), "Label of its nearest labelled clips."),
        Column("vote_ratio", pa.float32(), "Share of the nearest labelled clips' votes, the nearer the heavier."),
        Column("nearest_clip_id", pa.string(), "The nearest clip of that label."),
        Column("distance_score", pa.float32(), "Its distance, 0 to 2; lower is closer."),
        Column(
            "is_sure", pa.bool_(), "Whether the vote is clear and the nearest clip is as near as labelled ones are."
        ),
    ),
)
