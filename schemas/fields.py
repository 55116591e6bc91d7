"""Columns used by more than one table, and the makers of columns."""

from __future__ import annotations

import pyarrow as pa

from schemas.table import Column

VECTOR = pa.list_(pa.float32(), 3)
QUATERNION = pa.list_(pa.float32(), 4)
VECTORS = pa.list_(VECTOR)
QUATERNIONS = pa.list_(QUATERNION)

CLIP_ID = Column("clip_id", pa.string(), "Clip: its session and its take, joined by '-'.")
SESSION = Column("session", pa.string(), "Capture session: one folder of clips, or a part of a large one.")
SONG_ID = Column("song_id", pa.string(), "Song: from its file's name.")
METHOD = Column("method_name", pa.string(), "Method that chose the choreography.")

PATH = Column("path", pa.string(), "Source file, relative to the studio.")
SOURCE_SHA256 = Column("source_sha256", pa.string(), "Hash of the source file's bytes, hexadecimal.")
STATE = Column("state", pa.string(), "Whether the source was read or refused.", values=("read", "refused"))
REASON = Column("reason", pa.string(), "Why it was refused, one sentence; null when it was read.", is_optional=True)
REASON_OF_FAULT = Column("reason", pa.string(), "What was found, with its figure, and what would help.")
DURATION_S = Column("duration_s", pa.float64(), "Length; 0 when refused.")

LABEL = Column("label", pa.string(), "What is danced or done, from clips.csv or the folder's name.")
IS_LABELLED = Column("is_labelled", pa.bool_(), "Whether clips.csv says the label; else it is the folder's name.")
STYLE = Column("style", pa.string(), "How it is done, from clips.csv; empty when not said.")
LICENCE = Column("licence", pa.string(), "Licence of the recording, from clips.csv; empty when not said.")

FRAME_INDEX = Column("frame_index", pa.int32(), "Frame of its clip or dance, from 0.")
TIME_S = Column("time_s", pa.float64(), "Time from the clip's first frame or the song's first decoded sample.")
ROOT_XYZ_M = Column("root_xyz_m", VECTOR, "World position of the root joint.")
ROTATION_WXYZ = Column(
    "rotation_wxyz", QUATERNIONS, "Rotation of each joint local to its parent; the root's in the world."
)
POSITION_XYZ_M = Column("position_xyz_m", VECTORS, "World position of each joint.")

IS_FENCED = Column("is_fenced", pa.bool_(), "Whether it is never shown: the clip is at fault there, or cut off.")

BEAT_INDEX = Column("beat_index", pa.int32(), "Beat of its clip or song, from 0.")
CONFIDENCE_RATIO = Column("confidence", pa.float32(), "How sure the detector is, 0 to 1.")

RHYTHM = Column("rhythm", pa.float32(), "Stops of the body, or onsets at beats, as bumps; the 99th percentile is 1.")
INTENSITY = Column("intensity", pa.float32(), "Drive of the motion, or level of the music; the 99th percentile is 1.")
SEGMENT_INDEX = Column("segment_index", pa.int32(), "Segment of its song, from 0.")

IS_MIRRORED = Column("is_mirrored", pa.bool_(), "Whether the clip is shown mirrored, left for right.")

WARP_RATIO = Column(
    "warp_ratio", pa.float32(), "Song time over clip time; above 1 the clip plays slower than recorded."
)
