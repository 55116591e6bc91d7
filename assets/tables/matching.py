"""Features, segments and matches to Arrow tables and back; conventions as in :mod:`assets.tables`."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from assets.tables.pack import by_clip, from_rows, to_numbers
from kernels.matching.score import SCALE_DENOMINATOR, SCALES, Match
from kernels.motion.motion_features import MotionFeatures
from kernels.music.music_features import MusicFeatures
from kernels.music.repeats import Repeat
from kernels.music.segments import Segments
from kernels.types import Float, Int
from schemas.matching import MATCH
from schemas.motion import MOTION_FEATURE
from schemas.music import MUSIC_FEATURE, MUSIC_REPEAT, MUSIC_SEGMENT

Rhythm = NDArray[np.float32]


def from_motion_feature(
    clip_id: str, found: MotionFeatures, contact: NDArray[np.bool_], is_fenced: NDArray[np.bool_]
) -> pa.Table:
    """Pack a clip's features, F rows.

    Parameters
    ----------
    clip_id : str
    found : MotionFeatures, of F values
    contact : (F, 2) bool, left first
    is_fenced : (F,) bool, values of moments that are never shown

    Returns
    -------
    pa.Table, ``motion_feature``, F rows
    """
    f = len(found.rhythm)
    columns = [
        pa.array([clip_id] * f, pa.string()),
        pa.array(np.arange(f), pa.int32()),
        pa.array(found.time_s),
        pa.array(found.rhythm, pa.float32()),
        pa.array(found.intensity, pa.float32()),
        pa.array(found.effort_rad_per_s, pa.float32()),
        pa.array(found.peak_effort_rad_per_s, pa.float32()),
        pa.array(contact[:, 0]),
        pa.array(contact[:, 1]),
        pa.array(is_fenced),
    ]
    return MOTION_FEATURE.check(pa.table(columns, schema=MOTION_FEATURE.arrow))


def to_rhythms(table: pa.Table) -> dict[str, Rhythm]:
    """Unpack the rhythm of every clip as it is stored: float32, in the table's order of clips.

    Parameters
    ----------
    table : ``motion_feature``, of any clips

    Returns
    -------
    (F,) float32 by clip_id; empty without rows
    """
    return {clip: np.asarray(to_numbers(rows["rhythm"]), np.float32) for clip, rows in by_clip(table).items()}


def from_music_feature(song_id: str, found: MusicFeatures) -> pa.Table:
    """Pack a song's features, F rows.

    Parameters
    ----------
    song_id : str
    found : MusicFeatures, of F values

    Returns
    -------
    pa.Table, ``music_feature``, F rows
    """
    columns = [
        pa.array([song_id] * len(found.rhythm), pa.string()),
        pa.array(found.time_s),
        pa.array(found.rhythm, pa.float32()),
        pa.array(found.intensity, pa.float32()),
    ]
    return MUSIC_FEATURE.check(pa.table(columns, schema=MUSIC_FEATURE.arrow))


def from_music_segment(song_id: str, segments: Segments) -> pa.Table:
    """Pack a song's segments, S rows.

    Parameters
    ----------
    song_id : str
    segments : S Segments

    Returns
    -------
    pa.Table, ``music_segment``, S rows
    """
    s = len(segments.start_s)
    columns = [
        pa.array([song_id] * s, pa.string()),
        pa.array(np.arange(s), pa.int32()),
        pa.array(segments.start_s),
        pa.array(segments.end_s),
        pa.array(segments.start_frame_index, pa.int32()),
        pa.array(segments.frame_count, pa.int32()),
        pa.array(segments.novelty, pa.float32()),
    ]
    return MUSIC_SEGMENT.check(pa.table(columns, schema=MUSIC_SEGMENT.arrow))


def strength_between(feature: pa.Table, grid_s: Float) -> Float:
    """Average the intensity of the music between beats.

    Parameters
    ----------
    feature : rows of ``music_feature`` of one song
    grid_s : (K + 1,) float, seconds

    Returns
    -------
    (K,) float64; zeros where the song has none
    """
    total = np.append(0.0, np.cumsum(to_numbers(feature["intensity"]).astype(np.float64)))
    edge = np.clip(np.searchsorted(to_numbers(feature["time_s"]), grid_s), 0, len(total) - 1)
    return np.asarray((total[edge[1:]] - total[edge[:-1]]) / np.maximum(np.diff(edge), 1), np.float64)


def from_music_repeat(song_id: str, repeats: Sequence[Repeat], grid_s: Float) -> pa.Table:
    """Pack the repeats of a song.

    Parameters
    ----------
    song_id : str
    repeats : in order
    grid_s : (K + 1,) float, seconds, the beats they were found on

    Returns
    -------
    Rows of ``music_repeat``
    """
    return from_rows(
        MUSIC_REPEAT,
        [
            {
                "song_id": song_id,
                "repeat_index": i,
                "start_s": float(grid_s[r.first]),
                "end_s": float(grid_s[r.last]),
                "source_start_s": float(grid_s[r.source]),
                "likeness_score": r.likeness,
            }
            for i, r in enumerate(repeats)
        ],
    )


def to_music_repeat(rows: pa.Table, grid_s: Float) -> list[Repeat]:
    """Unpack the repeats of a song onto its beats.

    Parameters
    ----------
    rows : of ``music_repeat`` of one song
    grid_s : (K + 1,) float, seconds

    Returns
    -------
    list of Repeat, without those whose beats have gone
    """
    found = []
    for row in rows.to_pylist():
        first, last, source = (
            int(np.abs(grid_s - row[name]).argmin()) for name in ("start_s", "end_s", "source_start_s")
        )
        if source < first < last <= len(grid_s) - 1:
            found.append(Repeat(first, last, source, row["likeness_score"]))
    return found


def to_music_segment(rows: pa.Table) -> Segments:
    """Unpack a song's segments.

    Parameters
    ----------
    rows : ``music_segment`` of one song

    Returns
    -------
    Segments
    """
    return Segments(
        to_numbers(rows["start_s"]).astype(np.float64),
        to_numbers(rows["end_s"]).astype(np.float64),
        to_numbers(rows["start_frame_index"]).astype(np.int64),
        to_numbers(rows["frame_count"]).astype(np.int64),
        to_numbers(rows["novelty_ratio"]).astype(np.float64),
    )


def to_rhythm(table: pa.Table) -> Rhythm:
    """Read the rhythm of a song.

    Parameters
    ----------
    table : table ``music_feature``, the rows of one song

    Returns
    -------
    (F,) float32
    """
    return np.asarray(to_numbers(table["rhythm"]), np.float32)


def segment_rhythms(segments: Segments, rhythm: Rhythm) -> list[Rhythm]:
    """Cut a song's rhythm into its segments.

    Parameters
    ----------
    segments : S Segments
    rhythm : (F,) float32, of the whole song

    Returns
    -------
    S views of it, (L,) each
    """
    ends = segments.start_frame_index + segments.frame_count
    return [rhythm[a:b] for a, b in zip(segments.start_frame_index, ends, strict=True)]


def from_matches(song_id: str, found: Sequence[Sequence[Match]], clip_ids: Sequence[str]) -> pa.Table:
    """Pack the matches of a song, best first within each segment; ``clip_ids`` by clip index.

    Parameters
    ----------
    song_id : str
    found : one list of Match a segment
    clip_ids : names by clip index

    Returns
    -------
    pa.Table, ``match``, one row a match
    """
    every = [m for matches in found for m in matches]
    columns = [
        pa.array([song_id] * len(every), pa.string()),
        pa.array([m.segment_index for m in every], pa.int32()),
        pa.array([m.rank_number for m in every], pa.int32()),
        pa.array([clip_ids[m.clip_index] for m in every], pa.string()),
        pa.array([SCALES[m.scale_index] for m in every], pa.float32()),
        pa.array([m.start_frame_index for m in every], pa.int32()),
        pa.array([m.score for m in every], pa.float64()),
        pa.array([m.music_ratio for m in every], pa.float64()),
        pa.array([m.mutual_ratio for m in every], pa.float64()),
    ]
    return MATCH.check(pa.table(columns, schema=MATCH.arrow))


@dataclass(frozen=True, eq=False)
class StoredMatches:
    """Matches of one segment, (N,) each, best first.

    Parameters
    ----------
    clip_ids : N names
    numerator : int64, scale times 50
    start_frame_index : int64
    score, music_ratio, mutual_ratio : float64
    """

    clip_ids: tuple[str, ...]
    numerator: Int
    start_frame_index: Int
    score: Float
    music_ratio: Float
    mutual_ratio: Float

    def only(self, kept: Sequence[bool]) -> StoredMatches:
        """Take some of them.

        Parameters
        ----------
        kept : N truths
        """
        mask = np.array(kept, bool)
        return StoredMatches(
            tuple(itertools.compress(self.clip_ids, mask)),
            self.numerator[mask],
            self.start_frame_index[mask],
            self.score[mask],
            self.music_ratio[mask],
            self.mutual_ratio[mask],
        )


def to_matches(table: pa.Table, n_segments: int) -> list[StoredMatches]:
    """Unpack the matches of a song, one record a segment, empty for a segment without.

    Parameters
    ----------
    table : ``match`` of one song
    n_segments : int, >= 0

    Returns
    -------
    n_segments records
    """
    segment = to_numbers(table["segment_index"])
    found = []
    for index in range(n_segments):
        rows = table.filter(pa.array(segment == index)).sort_by("rank_number")
        found.append(
            StoredMatches(
                tuple(rows["clip_id"].to_pylist()),
                np.rint(to_numbers(rows["scale_ratio"]).astype(np.float64) * SCALE_DENOMINATOR).astype(np.int64),
                to_numbers(rows["start_frame_index"]).astype(np.int64),
                *(to_numbers(rows[c]).astype(np.float64) for c in ("score", "music_ratio", "mutual_ratio")),
            )
        )
    return found
