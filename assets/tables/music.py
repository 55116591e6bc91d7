"""Beats, tempo and loudness of songs as tables, and back: one ``from_x``/``to_x`` pair a table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyarrow as pa

from assets.tables.pack import (
    from_rows,
    to_numbers,
)
from kernels.music.beats import TempoCandidate
from kernels.types import BeatGrid, Float
from schemas.music import MUSIC_BEAT, MUSIC_LOUDNESS, MUSIC_TEMPO


def from_music_beat(song_id: str, grid: BeatGrid) -> pa.Table:
    """Pack the beats of a song, B rows."""
    b = len(grid.time_s)
    columns = [
        pa.array([song_id] * b, pa.string()),
        pa.array(np.arange(b), pa.int32()),
        pa.array(grid.time_s),
        pa.array(grid.bar_number, pa.int32()),
        pa.array(grid.beat_in_bar_number, pa.int32()),
        pa.array(grid.confidence, pa.float32()),
    ]
    return MUSIC_BEAT.check(pa.table(columns, schema=MUSIC_BEAT.arrow))


def to_music_beat(rows: pa.Table) -> BeatGrid:
    """Unpack the beats of a song."""
    return BeatGrid(
        to_numbers(rows["time_s"]).astype(np.float64),
        to_numbers(rows["bar_number"]).astype(np.int64),
        to_numbers(rows["beat_in_bar_number"]).astype(np.int64),
        to_numbers(rows["confidence"]).astype(np.float64),
    )


def from_music_tempo(song_id: str, candidates: Sequence[TempoCandidate]) -> pa.Table:
    """Pack the candidates for a song's metrical level, one row each."""
    rows = [
        {
            "song_id": song_id,
            "level_ratio": c.level_ratio,
            "tempo_bpm": c.tempo_bpm,
            "tempo_score": c.score,
            "is_chosen": c.is_chosen,
        }
        for c in candidates
    ]
    return from_rows(MUSIC_TEMPO, rows)


def from_music_loudness(song_id: str, time_s: Float, loudness_db: Float) -> pa.Table:
    """Pack a song's loudness curve."""
    columns = [
        pa.array([song_id] * len(time_s), pa.string()),
        pa.array(time_s),
        pa.array(loudness_db, pa.float32()),
    ]
    return MUSIC_LOUDNESS.check(pa.table(columns, schema=MUSIC_LOUDNESS.arrow))
