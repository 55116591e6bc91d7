"""Pieces of clips that the spans of a song may be danced with, and what each would cost."""

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from assets.stamps import Stored
from assets.tables import matching as matching_tables
from assets.tables import pack
from assets.tables.matching import Rhythm, StoredMatches
from kernels.matching import intensity
from kernels.matching.pieces import ease_pace, longest_first, motion_under, other_starts, snap_start, split_span
from kernels.matching.score import SCALE_DENOMINATOR, ratios, similarity
from kernels.motion.features import FEATURE_RATE_HZ
from kernels.music.segments import Segments
from kernels.ranks import rank_correlation
from kernels.types import Float
from kernels.warp import EASY_WARP
from schemas.settings import MatchPathSettings

WARP_COST = 0.1
"""Price of a warp of 1.1. Chosen by hand, as small beside a seam as the motion graph has it."""


@dataclass(frozen=True, eq=False)
class ClipFeatures:
    """What the choice asks of a clip: (F,) rhythm and intensity before scaling at 120 Hz, (B,) beats in seconds."""

    rhythm: Rhythm
    peak_effort: Float
    beat_s: Float

    @property
    def duration_s(self) -> float:
        """Seconds from the first value to the last."""
        return max(len(self.rhythm) - 1, 0) / FEATURE_RATE_HZ


@dataclass(frozen=True, eq=False)
class LoadedMatches:
    """A song's segments and music, their matches, and the clips these are in."""

    segments: Segments
    rhythm: Rhythm
    intensity: Float
    matches: Sequence[StoredMatches]
    clips: Mapping[str, ClipFeatures]


@dataclass(frozen=True)
class Place:
    """Where a clip goes with a segment: a match, or another start in the clip of one.

    ``rank_number`` is the match's, ``cost`` what it lacks as a match, 0 to 1 (:func:`match_cost`).
    """

    clip_id: str
    rank_number: int
    numerator: int
    start_frame_index: int
    cost: float


@dataclass(frozen=True)
class MatchPiece:
    """A stretch of a clip a span of the song may be danced with, and its own costs.

    ``start_s`` and ``end_s`` are seconds of the clip; ``rank_number`` is 0 where it fills a span without a match.
    """

    clip_id: str
    start_s: float
    end_s: float
    rank_number: int
    match_cost: float
    intensity_cost: float
    warp_cost: float
    is_snapped: bool = False
    is_easy: bool = True

    @property
    def cost(self) -> float:
        """Sum of its own costs."""
        return self.match_cost + self.intensity_cost + self.warp_cost


def load_matches(
    song_id: str,
    match: Stored,
    music_segment: Stored,
    music_feature: Stored,
    motion_feature: Stored,
    motion_beat: Stored,
    *,
    may_dance: Container[str],
) -> LoadedMatches:
    """Read a song's matches and the clips they name that may be danced; where there are none, the longest clips too.

    Parameters
    ----------
    song_id : str
    match, music_segment, music_feature : Stored, by song
    motion_feature, motion_beat : Stored, by session
    may_dance : clip_ids

    Returns
    -------
    LoadedMatches
    """
    segments = matching_tables.to_music_segment(music_segment.read(song_id))
    every = matching_tables.to_matches(match.read(song_id), len(segments.start_s))
    matches = [m.only([clip in may_dance for clip in m.clip_ids]) for m in every]
    wanted = {clip for m in matches for clip in m.clip_ids}
    if any(not m.clip_ids for m in matches):
        wanted |= _longest(motion_feature, may_dance)
    clips: dict[str, ClipFeatures] = {}
    for key in motion_feature.keys:
        here = wanted & set(motion_feature.stamp(key).clips)
        if not here:
            continue
        beats = pack.by_clip(motion_beat.read(key, clip_ids=here))
        for clip, rows in pack.by_clip(motion_feature.read(key, clip_ids=here)).items():
            clips[clip] = ClipFeatures(
                np.asarray(pack.to_numbers(rows["rhythm"]), np.float32),
                pack.to_numbers(rows["peak_effort_rad_per_s"]).astype(np.float64),
                pack.to_numbers(beats[clip]["time_s"]).astype(np.float64) if clip in beats else np.zeros(0),
            )
    music = music_feature.read(song_id)
    return LoadedMatches(
        segments,
        np.asarray(pack.to_numbers(music["rhythm"]), np.float32),
        pack.to_numbers(music["intensity"]).astype(np.float64),
        matches,
        clips,
    )


def _longest(motion_feature: Stored, may_dance: Container[str], *, most: int = 20) -> set[str]:
    sizes = {c: r.num_rows for key in motion_feature.keys for c, r in pack.by_clip(motion_feature.read(key)).items()}
    names = sorted(clip for clip in sizes if clip in may_dance)
    return {names[i] for i in longest_first(np.array([sizes[n] for n in names], np.int64), most=most)}


def pieces_of(found: LoadedMatches, beat_s: Float, settings: MatchPathSettings) -> tuple[Float, list[list[MatchPiece]]]:
    """Pieces every span of the song may be danced with: (S + 1,) edges of the spans, and S lists.

    A segment without a match becomes as many spans as the longest clip needs, each with the longest clips' beginnings.

    Parameters
    ----------
    found : LoadedMatches
    beat_s : (B,) float, seconds, increasing
    settings : MatchPathSettings

    Returns
    -------
    edges : (S + 1,) float64, seconds
    pieces : S lists, none empty
    """
    song_edges = intensity.quantile_edges(found.intensity)
    clip_edges = intensity.quantile_edges(
        np.concatenate([clip.peak_effort for _, clip in sorted(found.clips.items())] or [np.zeros(0)])
    )
    parts = matching_tables.segment_rhythms(found.segments, found.rhythm)
    edges: list[float] = [0.0]
    every: list[list[MatchPiece]] = []
    for i, matches in enumerate(found.matches):
        start_s, end_s = float(found.segments.start_s[i]), float(found.segments.end_s[i])
        if matches.clip_ids:
            places = places_of(matches, parts[i], found.clips, most=settings.other_starts)
            cut = (song_edges, clip_edges)
            made = [_piece(found, i, place, parts[i], beat_s, cut, settings) for place in places]
            # Pieces far from their own pace are for segments that have no others.
            easy = [p for p in made if p.is_easy]
            if not easy:
                made = [_piece(found, i, place, parts[i], beat_s, cut, settings, is_eased=True) for place in places]
                easy = [p for p in made if p.is_easy]
            every.append(easy or made)
            edges.append(end_s)
            continue
        names = sorted(found.clips)
        order = longest_first(np.array([len(found.clips[n].rhythm) for n in names], np.int64), most=20)
        longest_s = found.clips[names[order[0]]].duration_s
        for a, b in zip(*_pairs(split_span(start_s, end_s, beat_s=beat_s, longest_s=longest_s)), strict=True):
            every.append(
                [
                    MatchPiece(names[n], 0.0, b - a, 0, settings.match_weight, settings.intensity_weight, 0.0)
                    for n in order
                    if found.clips[names[n]].duration_s >= b - a - 1e-9
                ]
            )
            edges.append(b)
    return np.array(edges), every


def _pairs(edges: Float) -> tuple[list[float], list[float]]:
    return edges[:-1].tolist(), edges[1:].tolist()


def places_of(matches: StoredMatches, part: Rhythm, clips: Mapping[str, ClipFeatures], *, most: int) -> list[Place]:
    """List the matches of a segment and, in each one's clip, at most ``most`` other starts; with what each costs.

    Parameters
    ----------
    matches : StoredMatches of one segment
    part : (L,) float32, its rhythm
    clips : the clips these are in, by name
    most : int, >= 0

    Returns
    -------
    list of Place: the matches by rank, then the other starts by rank
    """
    found = list(enumerate(matches.start_frame_index.tolist()))
    score, mutual = matches.score.tolist(), matches.mutual_ratio.tolist()
    for rank, start in enumerate(matches.start_frame_index.tolist()):
        rhythm, numerator = clips[matches.clip_ids[rank]].rhythm, int(matches.numerator[rank])
        for other in other_starts(part, rhythm, numerator=numerator, start_frame_index=start, most=most).tolist():
            motion = motion_under(rhythm, len(part), numerator=numerator, start=other)
            found.append((rank, other))
            score.append(float(similarity(part, motion).sum()))
            mutual.append(ratios(score[-1], float(part.sum(dtype=np.float64)), float(motion.sum()))[1])
    return [
        Place(matches.clip_ids[rank], rank + 1, int(matches.numerator[rank]), start, cost)
        for (rank, start), cost in zip(found, match_cost(np.array(score), np.array(mutual)).tolist(), strict=True)
    ]


def _piece(
    found: LoadedMatches,
    segment: int,
    place: Place,
    part: Rhythm,
    beat_s: Float,
    edges: tuple[Float, Float],
    settings: MatchPathSettings,
    *,
    is_eased: bool = False,
) -> MatchPiece:
    """Make one place of a clip a piece, and price it."""
    segments, clip = found.segments, found.clips[place.clip_id]
    numerator, start = place.numerator, place.start_frame_index
    if is_eased:
        numerator, start = ease_pace(
            part, clip.rhythm, numerator=numerator, start_frame_index=start, loss_ratio=settings.snap_loss_ratio
        )
    frame = snap_start(
        part,
        clip.rhythm,
        numerator=numerator,
        start_frame_index=start,
        beat_s=clip.beat_s,
        loss_ratio=settings.snap_loss_ratio,
    )
    scale = numerator / SCALE_DENOMINATOR
    start_s, end_s = float(segments.start_s[segment]), float(segments.end_s[segment])
    first = int(segments.start_frame_index[segment])
    # A segment starts between two frames; the clip's time under it moves along by as much.
    clip_s = max(frame / FEATURE_RATE_HZ + scale * (start_s - first / FEATURE_RATE_HZ), 0.0)
    clip_end_s = min(clip_s + scale * (end_s - start_s), clip.duration_s)
    music = found.intensity[first : first + len(part)]
    motion = motion_under(clip.peak_effort, len(part), numerator=numerator, start=frame)
    inside = beat_s[(beat_s > start_s + 0.1) & (beat_s < end_s - 0.1)]
    cut = np.rint((np.concatenate([[start_s], inside, [end_s]]) - start_s) * FEATURE_RATE_HZ).astype(np.int64)
    agreement = intensity.agreement(
        intensity.bhattacharyya(intensity.histogram(music, edges[0]), intensity.histogram(motion, edges[1])),
        rank_correlation(intensity.beat_means(music, cut), intensity.beat_means(motion, cut)),
    )
    warp = (end_s - start_s) / (clip_end_s - clip_s)
    return MatchPiece(
        place.clip_id,
        clip_s,
        clip_end_s,
        place.rank_number,
        settings.match_weight * place.cost,
        settings.intensity_weight * (1.0 - agreement),
        WARP_COST * abs(float(np.log(warp))) / float(np.log(1.1)),
        frame != start,
        EASY_WARP[0] - 1e-6 <= warp <= EASY_WARP[1] + 1e-6,
    )


def match_cost(score: Float, mutual_ratio: Float) -> Float:
    """Cost of each place, 0 to 1: half for its rank among them, half for what lacks to an equal rhythm.

    Its rank is the share of the others with a better score, so equal scores cost the same.

    Parameters
    ----------
    score : (N,) float, C of each place
    mutual_ratio : (N,) float, 0 to 1

    Returns
    -------
    (N,) float64, 0 to 1
    """
    better = np.searchsorted(np.sort(-score), -score)
    return np.asarray(0.5 * better / max(len(score) - 1, 1) + 0.5 * (1.0 - mutual_ratio), np.float64)
