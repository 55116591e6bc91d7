"""Pieces of clips that the spans of a song may be danced with, and what each would cost."""

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from assets.dancing.avoided import AvoidedSpan, touched
from assets.stamps import Stored
from assets.tables import matching as matching_tables
from assets.tables import pack
from assets.tables.matching import Rhythm, StoredMatches
from kernels.matching import intensity
from kernels.matching.pieces import longest_first, motion_under, other_starts, split_span
from kernels.matching.price import ClipFeatures, MatchPiece, Place, SongSpan, lay_piece, match_cost
from kernels.matching.score import ratios, similarity
from kernels.motion.motion_features import FEATURE_RATE_HZ
from kernels.music.segments import Segments
from kernels.types import Float
from schemas.settings import MatchPathSettings


@dataclass(frozen=True, eq=False)
class LoadedMatches:
    """A song's segments and music, their matches, and the clips these are in."""

    segments: Segments
    rhythm: Rhythm
    intensity: Float
    matches: Sequence[StoredMatches]
    clips: Mapping[str, ClipFeatures]


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
                pack.to_numbers(rows["is_fenced"]).astype(bool),
            )
    music = music_feature.read(song_id)
    return LoadedMatches(
        segments,
        matching_tables.to_rhythm(music),
        pack.to_numbers(music["intensity"]).astype(np.float64),
        matches,
        clips,
    )


def _longest(motion_feature: Stored, may_dance: Container[str], *, most: int = 20) -> set[str]:
    sizes = {c: r.num_rows for key in motion_feature.keys for c, r in pack.by_clip(motion_feature.read(key)).items()}
    names = sorted(clip for clip in sizes if clip in may_dance)
    return {names[i] for i in longest_first(np.array([sizes[n] for n in names], np.int64), most=most)}


def pieces_of(
    found: LoadedMatches, beat_s: Float, settings: MatchPathSettings, *, blend_s: float = 0.0
) -> tuple[Float, list[list[MatchPiece]]]:
    """Pieces every span of the song may be danced with: (S + 1,) edges of the spans, and S lists.

    A segment without a match of which nothing is fenced becomes as many spans as the longest stretch of a clip that may
    be shown needs, each with the beginnings of the longest.

    Parameters
    ----------
    found : LoadedMatches
    beat_s : (B,) float, seconds, increasing
    settings : MatchPathSettings
    blend_s : float, seconds, >= 0, the usual blend, of which half is shown beyond either end

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
            first = int(found.segments.start_frame_index[i])
            music = found.intensity[first : first + len(parts[i])]
            span = SongSpan(start_s, end_s, first, parts[i], music, beat_s)

            def lay(place: Place, span: SongSpan = span, *, eases: bool = False) -> MatchPiece:
                return lay_piece(
                    place,
                    found.clips[place.clip_id],
                    span,
                    edges=(song_edges, clip_edges),
                    match_weight=settings.match_weight,
                    intensity_weight=settings.intensity_weight,
                    loss_ratio=settings.snap_loss_ratio,
                    eases=eases,
                )

            made = _shown([lay(place) for place in places], found.clips, blend_s)
            # Pieces far from their own pace are for segments that have no others.
            easy = [p for p in made if p.is_easy]
            if not easy:
                made = _shown([lay(place, eases=True) for place in places], found.clips, blend_s)
                easy = [p for p in made if p.is_easy]
            if made:
                every.append(easy or made)
                edges.append(end_s)
                continue
        names = sorted(found.clips)
        begin_s, stop_s = np.array([found.clips[n].stretch_s(apart_s=blend_s / 2) for n in names]).T
        order = longest_first(np.rint((stop_s - begin_s) * FEATURE_RATE_HZ).astype(np.int64), most=20)
        longest_s = float(stop_s[order[0]] - begin_s[order[0]])
        for a, b in zip(*_pairs(split_span(start_s, end_s, beat_s=beat_s, longest_s=longest_s)), strict=True):
            every.append(
                [
                    MatchPiece(
                        names[n],
                        float(begin_s[n]),
                        float(begin_s[n]) + b - a,
                        0,
                        settings.match_weight,
                        settings.intensity_weight,
                        0.0,
                    )
                    for n in order
                    if stop_s[n] - begin_s[n] >= b - a - 1e-9
                ]
            )
            edges.append(b)
    return np.array(edges), every


def _pairs(edges: Float) -> tuple[list[float], list[float]]:
    return edges[:-1].tolist(), edges[1:].tolist()


def _shown(pieces: list[MatchPiece], clips: Mapping[str, ClipFeatures], blend_s: float) -> list[MatchPiece]:
    """Leave out pieces of which, or of the blends at whose ends, something is fenced."""
    half_s = blend_s / 2
    return [p for p in pieces if clips[p.clip_id].may_show(p.start_s - half_s, p.end_s + half_s)]


def without_touched(pieces: Sequence[MatchPiece], avoid: Sequence[AvoidedSpan], *, blend_s: float) -> list[MatchPiece]:
    """Leave out the pieces of a span that show what is to be avoided; the cheapest stays where all of them do.

    Parameters
    ----------
    pieces : of one span, at least one
    avoid : stretches of clips
    blend_s : float, seconds, the usual blend

    Returns
    -------
    list of MatchPiece, in the same order
    """
    start_s, end_s = np.array([[p.start_s, p.end_s] for p in pieces]).T
    bad = touched(avoid, [p.clip_id for p in pieces], start_s, end_s, blend_s=blend_s)
    kept = [piece for piece, is_bad in zip(pieces, bad.tolist(), strict=True) if not is_bad]
    return kept or [min(pieces, key=lambda piece: piece.cost)]


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
