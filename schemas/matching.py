"""Tables of matches: which clips follow which part of a song."""

from __future__ import annotations

import pyarrow as pa

from schemas import fields as f
from schemas.music import MUSIC_SEGMENT
from schemas.table import Column, Table

_START_FRAME = next(c for c in MUSIC_SEGMENT.columns if c.name == "start_frame_index")

MATCH = Table(
    name="match",
    version=1,
    meaning="One of the clips whose rhythm is most like that of one segment of a song, by equation 1 of [Yagi2009].",
    key=("song_id", "segment_index", "rank_number"),
    columns=(
        f.SONG_ID,
        f.SEGMENT_INDEX,
        Column("rank_number", pa.int32(), "Place by score, 1 is the best; equal scores by clip, scale and start."),
        f.CLIP_ID,
        Column("scale_ratio", pa.float32(), "Clip time over song time: 0.90 to 1.10 in steps of 0.02."),
        _START_FRAME,
        Column("score", pa.float64(), "C: sum of a b / (a + b) over the segment, music a, motion b; higher is better."),
        Column("music_ratio", pa.float64(), "C over half the sum of a: 1 where the motion equals the music."),
        Column("mutual_ratio", pa.float64(), "Four times C over the sums of a and b: 1 only where both are equal."),
    ),
)
