"""Tables of songs: the files and their beats."""

from __future__ import annotations

import pyarrow as pa

from schemas import fields as f
from schemas.table import Column, Table

SONG = Table(
    name="song",
    version=1,
    meaning="One file of music under songs/.",
    key=("song_id", "path"),
    columns=(
        f.SONG_ID,
        f.PATH,
        f.SOURCE_SHA256,
        Column("kind", pa.string(), "What the file holds.", values=("audio", "midi", "unknown")),
        f.DURATION_S,
        Column("sample_rate_hz", pa.int32(), "Samples a second; 0 for MIDI."),
        Column("channel_count", pa.int32(), "Channels; 0 for MIDI."),
        Column("tempo_bpm", pa.float32(), "Median tempo of the beats; 0 when there are none."),
        f.STATE,
        f.REASON,
    ),
)

MUSIC_BEAT = Table(
    name="music_beat",
    version=1,
    meaning="One beat of one song.",
    key=("song_id", "beat_index"),
    columns=(
        f.SONG_ID,
        f.BEAT_INDEX,
        f.TIME_S,
        Column("bar_number", pa.int32(), "Bar, from 1; 0 where bars could not be told."),
        Column("beat_in_bar_number", pa.int32(), "Beat of its bar, 1 is the downbeat; 0 where bars could not be told."),
        f.CONFIDENCE_RATIO,
    ),
)

MUSIC_TEMPO = Table(
    name="music_tempo",
    version=1,
    meaning="One candidate for the metrical level of a song: the tempo found, half and double of it.",
    key=("song_id", "level_ratio"),
    columns=(
        f.SONG_ID,
        Column("level_ratio", pa.float32(), "Tempo of the candidate over the tempo chosen: 0.5, 1, 2 and so on."),
        Column("tempo_bpm", pa.float32(), "Median tempo of the candidate."),
        Column("tempo_score", pa.float32(), "Score, comparable within a song; higher is better."),
        Column("is_chosen", pa.bool_(), "Whether the beat table follows this level."),
    ),
)

MUSIC_LOUDNESS = Table(
    name="music_loudness",
    version=1,
    meaning="One instant of a song's loudness curve.",
    key=("song_id", "time_s"),
    columns=(
        f.SONG_ID,
        f.TIME_S,
        Column("loudness_db", pa.float32(), "Short-time A-weighted level relative to full scale."),
    ),
)

MUSIC_FEATURE = Table(
    name="music_feature",
    version=1,
    meaning="What one song does at one instant, 120 a second.",
    key=("song_id", "time_s"),
    columns=(f.SONG_ID, f.TIME_S, f.RHYTHM, f.INTENSITY),
)

MUSIC_SEGMENT = Table(
    name="music_segment",
    version=1,
    meaning="One span of a song that is danced with one piece of one clip.",
    key=("song_id", "segment_index"),
    columns=(
        f.SONG_ID,
        f.SEGMENT_INDEX,
        Column("start_s", pa.float64(), "Start in the song: a beat, or the first sample."),
        Column("end_s", pa.float64(), "End in the song: the next segment's start, or the song's end."),
        Column("start_frame_index", pa.int32(), "First value of the song's or the clip's features, 120 a second."),
        Column("frame_count", pa.int32(), "Values of the song's features."),
        Column("novelty_ratio", pa.float32(), "How much the music changes at the start, against its largest change."),
    ),
)

MUSIC_REPEAT = Table(
    name="music_repeat",
    version=1,
    meaning="One stretch of a song that plays an earlier one again.",
    key=("song_id", "repeat_index"),
    columns=(
        f.SONG_ID,
        Column("repeat_index", pa.int32(), "Repeat of its song, from 0."),
        Column("start_s", pa.float64(), "Start of the later stretch: a beat."),
        Column("end_s", pa.float64(), "End of the later stretch: a beat."),
        Column("source_start_s", pa.float64(), "Start of the earlier stretch: a beat."),
        Column("likeness_score", pa.float32(), "Mean likeness of its beats to the earlier ones, at most 1."),
    ),
)

PERCUSSION = Table(
    name="percussion",
    version=1,
    meaning="One stroke of a drum, or one onset of a band of audio, as General MIDI names it.",
    key=("song_id", "hit_index"),
    columns=(
        f.SONG_ID,
        Column("hit_index", pa.int32(), "Stroke of its song, from 0, by time, then key."),
        f.TIME_S,
        Column("key_number", pa.int32(), "Percussion key, 35 to 81; 36, 38 or 42 for the low, middle or high band."),
        Column("velocity", pa.int32(), "How hard, 1 to 127."),
        Column("heard_as", pa.string(), "Whether drums are told apart or only bands.", values=("drums", "bands")),
    ),
)

MELODY = Table(
    name="melody",
    version=1,
    meaning="One step of the melody of a MIDI song: how it goes from the note before.",
    key=("song_id", "note_index"),
    columns=(
        f.SONG_ID,
        Column("note_index", pa.int32(), "Step of its song, from 0."),
        f.TIME_S,
        Column("contour_index", pa.int32(), "How it goes: 0 leap down, 1 step down, 2 same, 3 step up, 4 leap up."),
    ),
)
