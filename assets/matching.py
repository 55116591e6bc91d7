"""Matches: for every segment of a song, the clips whose rhythm is most like its own."""

from collections.abc import Iterator, Sequence
from typing import Any, Protocol

import dagster as dg
import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from assets.declare import table_asset
from assets.partitions import EVERY, SONG, lake_key
from assets.plots import matching as matching_plots
from assets.sources.sources import Studio
from assets.stamps import Part, Parts, Progress, Stored
from assets.tables import matching as matching_tables
from assets.tables.matching import Rhythm, StoredMatches
from kernels.matching.score import SCALE_DENOMINATOR, Match
from kernels.music.segments import Segments
from schemas.matching import MATCH


class SegmentMatcher(Protocol):
    """Finds the best clips of segments; see :class:`kernels.opencl.match.Matcher`."""

    def index(self, clips: Sequence[NDArray[Any]]) -> Any:  # noqa: ANN401 - what only the matcher itself reads
        """Prepare a catalogue for many songs.

        Parameters
        ----------
        clips : sequence of (T,) float, finite, >= 0, in ascending order of their keys
        """
        ...

    def matches(self, segments: Sequence[NDArray[Any]], clips: Any, *, k: int) -> Sequence[Sequence[Match]]:  # noqa: ANN401
        """Find the k best clips of every segment, of an index or of clips.

        Parameters
        ----------
        segments : sequence of (L,) float, L >= 1, finite, >= 0
        clips : what :meth:`index` made, or clips
        k : int, >= 1

        Returns
        -------
        one list a segment, the best first
        """
        ...


@table_asset(
    MATCH,
    group="dance",
    code_version="1",
    settings="matching.candidates",
    partitions=SONG,
    ins={"motion_feature": dg.AssetIn(partition_mapping=EVERY)},
    checks={"every_segment": "Every segment has clips it may be danced with, and where there is music they fit it."},
)
def match(
    context: dg.AssetExecutionContext,
    music_segment: Stored,
    music_feature: Stored,
    motion_feature: Stored,
    studio: dg.ResourceParam[Studio],
    matcher: dg.ResourceParam[SegmentMatcher],
    progress: dg.ResourceParam[Progress],
) -> Iterator[dg.Output[Parts] | dg.AssetCheckResult]:
    """Compare every segment of a song with every clip at every scale and start, exactly."""
    keys = [lake_key(key) for key in context.partition_keys]
    progress.begin("matching songs", len(keys))
    rhythms, left_out = catalogue(motion_feature)
    clip_ids = sorted(rhythms)
    index = matcher.index([rhythms[clip] for clip in clip_ids])
    k = studio.settings().matching.candidates
    facts = {
        "clips": len(clip_ids),
        "device": getattr(matcher, "name", "reference"),
        "clips_left_out": "; ".join(left_out) or "none",
    }
    made, poor = [], []
    for key in keys:
        segments, parts = segmented(music_segment.read(key), music_feature.read(key))
        found = matcher.matches(parts, index, k=k) if parts and clip_ids else [[] for _ in parts]
        table = matching_tables.from_matches(key, found, clip_ids)
        stored = matching_tables.to_matches(table, len(parts))
        poor += [f"{key}: segment {i}" for i in without_match(parts, stored)]
        pictures = _pictures(segments, parts, stored, rhythms)
        made.append(Part(key, table, metadata={**facts, "segments": len(parts), **pictures}))
        progress.step()
    yield dg.Output(Parts(made))
    yield dg.AssetCheckResult(
        check_name="every_segment",
        asset_key=MATCH.name,
        passed=not poor and not left_out,
        severity=dg.AssetCheckSeverity.WARN,
        metadata={"without_match": ", ".join(poor[:40]) or "none", "clips_left_out": ", ".join(left_out) or "none"},
    )


def segmented(music_segment: pa.Table, music_feature: pa.Table) -> tuple[Segments, list[Rhythm]]:
    """Read the segments of a song, and the rhythm of each.

    Parameters
    ----------
    music_segment, music_feature : tables of these names, the rows of one song
    """
    segments = matching_tables.to_music_segment(music_segment)
    return segments, matching_tables.segment_rhythms(segments, matching_tables.to_rhythm(music_feature))


def without_match(parts: Sequence[Rhythm], stored: Sequence[StoredMatches]) -> list[int]:
    """List the segments that no clip fits: without a match, or where something sounds and the best is no better than 0.

    Parameters
    ----------
    parts : (L,) float32, rhythm of each segment
    stored : StoredMatches of each segment, the best first
    """
    return [i for i, m in enumerate(stored) if not len(m.score) or (parts[i].any() and not m.score[0] > 0)]


def catalogue(motion_feature: Stored) -> tuple[dict[str, Rhythm], list[str]]:
    """Rhythm of every clip as stored, and the clips left out because theirs is none to compare with.

    Parameters
    ----------
    motion_feature : Stored, features of clips by session

    Returns
    -------
    rhythms : (F,) float32 by clip_id
    left_out : one sentence a clip
    """
    rhythms: dict[str, Rhythm] = {}
    left_out = []
    for key in motion_feature.keys:
        for clip, rhythm in matching_tables.to_rhythms(motion_feature.read(key)).items():
            if np.isfinite(rhythm).all() and (rhythm >= 0).all():
                rhythms[clip] = rhythm
            else:
                left_out.append(f"{clip}: its rhythm is not finite")
    return rhythms, left_out


def _pictures(
    segments: Segments, parts: Sequence[Rhythm], stored: Sequence[StoredMatches], rhythms: dict[str, Rhythm]
) -> dict[str, dg.MetadataValue[Any]]:
    return {
        "matches": dg.MetadataValue.md(matching_plots.segment_matches(segments, stored)),
        "curves": dg.MetadataValue.md(_curves(segments, parts, stored, rhythms)),
    }


def _curves(
    segments: Segments, parts: Sequence[Rhythm], stored: Sequence[StoredMatches], rhythms: dict[str, Rhythm]
) -> str:
    """Lay the rhythm of the segment with the best score of all over that of its best clips."""
    scored = [(float(m.mutual_ratio[0]), -i) for i, m in enumerate(stored) if len(m.score)]
    if not scored:
        return "no segment has a match"
    index = -max(scored)[1]
    best = stored[index]
    motions = []
    for rank in range(min(4, len(best.score))):
        clip, scale = best.clip_ids[rank], best.numerator[rank] / SCALE_DENOMINATOR
        at = best.start_frame_index[rank] + scale * np.arange(len(parts[index]))
        motion = np.interp(at, np.arange(len(rhythms[clip])), rhythms[clip])
        name = f"{rank + 1}: {clip} at {scale:.2f}, C {best.score[rank]:.2f}, mutual {best.mutual_ratio[rank]:.2f}"
        motions.append((name, np.asarray(motion, np.float64)))
    title = f"segment {index}, {segments.start_s[index]:.2f} to {segments.end_s[index]:.2f} s"
    return matching_plots.matched_curves(title, np.asarray(parts[index], np.float64), motions)
