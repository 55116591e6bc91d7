"""From the matches of a song to its steps: pieces of clips, how they join, and the best sequence of them."""

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from assets.dancing import licences
from assets.dancing.danced import Danced, Markdown
from assets.dancing.method import DanceOrder, Method
from assets.dancing.refusal import RefusalError
from assets.plots import draw as plots
from assets.plots import matching as matching_plots
from assets.reading.clips import read_clips
from assets.stamps import Stored, repeatable
from assets.tables import matching as matching_tables
from assets.tables import pack as tables
from assets.tables.matching import Rhythm, StoredMatches
from kernels.assembly.timing import blend_widths, cover
from kernels.matching import connect, intensity, path
from kernels.matching.pieces import ease_pace, longest_first, motion_under, other_starts, snap_start, split_span
from kernels.matching.score import SCALE_DENOMINATOR, ratios, similarity
from kernels.motion.features import FEATURE_RATE_HZ, at_feature_rate, link_directions, link_weights
from kernels.motion.velocity import usable_frames
from kernels.music.segments import Segments
from kernels.ranks import rank_correlation
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Choreography, Float
from schemas.settings import MatchPathSettings, Settings

EASY_WARP = (0.90, 1.10)
APART_S = 0.1
"""How far apart moments of one clip are that pass for neighbours: a quarter of the usual blend."""

WARP_COST, MARGIN_COST = 0.1, 0.5


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
class Piece:
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
        beats = tables.by_clip(motion_beat.read(key, clip_ids=here))
        for clip, rows in tables.by_clip(motion_feature.read(key, clip_ids=here)).items():
            clips[clip] = ClipFeatures(
                np.asarray(tables.to_numbers(rows["rhythm"]), np.float32),
                tables.to_numbers(rows["peak_effort_rad_per_s"]).astype(np.float64),
                tables.to_numbers(beats[clip]["time_s"]).astype(np.float64) if clip in beats else np.zeros(0),
            )
    music = music_feature.read(song_id)
    return LoadedMatches(
        segments,
        np.asarray(tables.to_numbers(music["rhythm"]), np.float32),
        tables.to_numbers(music["intensity"]).astype(np.float64),
        matches,
        clips,
    )


def _longest(motion_feature: Stored, may_dance: Container[str], *, most: int = 20) -> set[str]:
    sizes = {c: r.num_rows for key in motion_feature.keys for c, r in tables.by_clip(motion_feature.read(key)).items()}
    names = sorted(clip for clip in sizes if clip in may_dance)
    return {names[i] for i in longest_first(np.array([sizes[n] for n in names], np.int64), most=most)}


def by_matching(found: LoadedMatches, canonical_pose: Stored, beat_s: Float, settings: Settings) -> Danced:
    """Choose one piece a segment: by rhythm, intensity, pace, joints and repetition.

    Parameters
    ----------
    found : LoadedMatches
    canonical_pose : Stored, poses of clips by session
    beat_s : (B,) float, seconds, increasing, over the whole song
    settings : Settings, of which ``match_path`` and ``dance`` are read

    Returns
    -------
    Danced

    Raises
    ------
    RefusalError
        If there is no clip longer than one frame.
    """
    if not any(clip.duration_s > 0 for clip in found.clips.values()):
        raise RefusalError("no clip can be danced: none is longer than one frame; add clips")
    spans, pieces = pieces_of(found, beat_s, settings.match_path)
    clip_ids = sorted({p.clip_id for ps in pieces for p in ps})
    index = {clip: i for i, clip in enumerate(clip_ids)}
    candidates = [
        path.Candidates(
            np.array([index[p.clip_id] for p in ps], np.int64),
            np.array([p.start_s for p in ps]),
            np.array([p.end_s for p in ps]),
            np.array([p.cost for p in ps]),
        )
        for ps in pieces
    ]
    limits, joints = joints_of(
        pieces, spans, canonical_pose, blend_s=settings.dance.blend_s, seam_weight=settings.match_path.seam_weight
    )
    chosen = path.choose(
        candidates,
        joints,
        repetition_weight=settings.match_path.repetition_weight,
        unconnected_cost=settings.match_path.unconnected_cost or None,
    )
    steps, span_of = path.to_choreography(
        candidates,
        chosen,
        start_s=spans[:-1],
        end_s=spans[1:],
        beat_s=beat_s,
        clip_ids=tuple(clip_ids),
        blend_s=settings.dance.blend_s,
    )
    width = blend_widths(steps.song_start_s, steps.song_end_s, steps.has_seam, wanted_s=settings.dance.blend_s)
    steps = Choreography(
        steps.clip_id,
        steps.song_start_s,
        steps.song_end_s,
        steps.clip_start_s,
        steps.clip_end_s,
        steps.has_seam,
        width,
    )
    used = [ps[c] for ps, c in zip(pieces, chosen.choice, strict=True)]
    is_first = np.append(True, np.diff(span_of) > 0)
    by_span = {
        "transition_cost": chosen.seam_cost,
        "warp_cost": np.array([p.warp_cost for p in used]),
        "match_cost": np.array([p.match_cost for p in used]),
        "intensity_cost": np.array([p.intensity_cost for p in used]),
        "repetition_cost": chosen.repetition_cost,
    }
    costs = {name: np.where(is_first, values[span_of], 0.0) for name, values in by_span.items()}
    metadata = {
        "cost": chosen.total_cost,
        "seams": int(chosen.has_seam.sum()),
        "seams_beyond_thresholds": int((~chosen.is_connected).sum()),
        "threshold_pose_rad": limits.pose_rad,
        "threshold_speed_rad_per_s": limits.speed_rad_per_s,
        "share_of_pairs_that_connect": _share([j.is_connected for j in joints]),
        "clips": len(set(steps.clip_id)),
        "starts_snapped_to_clip_beats": sum(p.is_snapped for p in used),
        "spans_without_a_match": sum(p.rank_number == 0 for p in used),
        "phrases": Markdown(plots.phrase_table(steps)),
        "choice": Markdown(matching_plots.chosen(spans, used, chosen)),
    }
    return Danced(steps, costs, metadata)


def _share(masks: Sequence[Any]) -> float:
    n = sum(m.size for m in masks)
    return float(sum(int(m.sum()) for m in masks) / n) if n else 1.0


def pieces_of(found: LoadedMatches, beat_s: Float, settings: MatchPathSettings) -> tuple[Float, list[list[Piece]]]:
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
    every: list[list[Piece]] = []
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
                    Piece(names[n], 0.0, b - a, 0, settings.match_weight, settings.intensity_weight, 0.0)
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
) -> Piece:
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
    return Piece(
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


def joints_of(
    pieces: Sequence[Sequence[Piece]], spans: Float, canonical_pose: Stored, *, blend_s: float, seam_weight: float
) -> tuple[connect.Thresholds, list[path.Joint]]:
    """Compare the ends of all pieces with the starts of the next, and say which connect.

    Parameters
    ----------
    pieces : S lists of pieces
    spans : (S + 1,) float, seconds of the song
    canonical_pose : Stored, poses of clips by session
    blend_s : float, seconds of song, >= 0
        A blend that would reach past the usable part of a clip costs more.
    seam_weight : float, >= 0
        Cost of two poses as unlike as the limits.

    Returns
    -------
    limits : Thresholds, measured in the clips of these pieces
    joints : S - 1 Joint
    """
    n_links = len(CANONICAL.joints) - 1
    weight = link_weights(CANONICAL.offset_xyz_m, CANONICAL.parent)
    half_s = blend_s / 2
    ends = [_no_poses(len(ps), n_links) for ps in pieces]
    starts = [_no_poses(len(ps), n_links) for ps in pieces]
    lacking_end, lacking_start = ([np.zeros(len(ps)) for ps in pieces] for _ in range(2))
    of_clip: dict[str, list[tuple[int, int]]] = {}
    for i, ps in enumerate(pieces):
        for j, piece in enumerate(ps):
            of_clip.setdefault(piece.clip_id, []).append((i, j))
    changes = []
    for clip_id, direction, (first_s, last_s) in _directions(canonical_pose, set(of_clip)):
        changes.append(connect.own_changes(direction, weight, apart_s=APART_S))
        here = of_clip[clip_id]
        own = [pieces[i][j] for i, j in here]
        pace = np.array(
            [(p.end_s - p.start_s) / (spans[i + 1] - spans[i]) for (i, _), p in zip(here, own, strict=True)]
        )
        at_start = connect.poses_at(direction, np.array([p.start_s for p in own]), pace=pace)
        at_end = connect.poses_at(direction, np.array([p.end_s for p in own]), pace=pace)
        for n, (i, j) in enumerate(here):
            starts[i].direction[j], starts[i].velocity[j] = at_start.direction[n], at_start.velocity[n]
            ends[i].direction[j], ends[i].velocity[j] = at_end.direction[n], at_end.velocity[n]
            room = half_s * pace[n]
            if room > 0:
                lacking_start[i][j] = max(first_s + room - own[n].start_s, 0.0) / room
                lacking_end[i][j] = max(own[n].end_s + room - last_s, 0.0) / room
    limits = connect.calibrate(changes)
    joints = []
    for i in range(len(pieces) - 1):
        pose, speed = connect.differences(ends[i], starts[i + 1], weight)
        unlike = (pose / limits.pose_rad + speed / limits.speed_rad_per_s) / 2
        # A blend that reaches past a clip's end stands still there.
        stands = MARGIN_COST * (lacking_end[i][:, None] + lacking_start[i + 1][None])
        joints.append(path.Joint(seam_weight * unlike + stands, connect.connects(pose, speed, limits)))
    return limits, joints


def _no_poses(n: int, n_links: int) -> connect.JointPoses:
    return connect.JointPoses(np.zeros((n, n_links, 3)), np.zeros((n, n_links, 3)))


def _directions(canonical_pose: Stored, wanted: set[str]) -> Iterator[tuple[str, Float, tuple[float, float]]]:
    """Link directions of the wanted clips at 120 Hz, one clip at a time, and the seconds between which it is usable."""
    for key in canonical_pose.keys:
        here = wanted & set(canonical_pose.stamp(key).clips)
        rows: pa.Table | None = canonical_pose.read(key, clip_ids=here) if here else None
        for moved in tables.to_canonical_poses(rows) if rows is not None else ():
            position = at_feature_rate(moved.position_xyz_m, moved.frame_rate_hz)
            root = at_feature_rate(moved.rotation_wxyz[:, 0], moved.frame_rate_hz)
            first, last = usable_frames(moved.position_xyz_m, moved.frame_rate_hz)
            usable_s = first / moved.frame_rate_hz, last / moved.frame_rate_hz
            yield moved.clip_id, link_directions(position, root, CANONICAL.parent), usable_s


def choose(inputs: Mapping[str, Stored], order: DanceOrder) -> Danced:
    """Dance a song by its stored matches; see :class:`assets.dancing.method.Method`.

    Parameters
    ----------
    inputs : the tables of :data:`METHOD`, by name
    order : DanceOrder

    Raises
    ------
    RefusalError
        If licences forbid every clip, or as :func:`by_matching`.
    """
    allow = order.direction.allow
    licence_of = dict(read_clips(inputs["clip"]).select("clip_id", "licence").iter_rows())
    free = licences.free_to_join(licence_of, allow)
    if licence_of and not free:
        why = f"has a licence of {', '.join(allow)}" if allow else "may be changed"
        raise RefusalError(f"no clip may be danced: none {why}")
    tables_of_song = (inputs[name] for name in ("match", "music_segment", "music_feature"))
    of_clips = (inputs[name] for name in ("motion_feature", "motion_beat"))
    found = load_matches(order.song_id, *tables_of_song, *of_clips, may_dance=free)
    beat_s, _ = cover(order.beats.time_s, order.duration_s)
    with repeatable():
        return by_matching(found, inputs["canonical_pose"], beat_s, order.settings)


METHOD = Method(
    name="matching",
    version="5",
    inputs=(
        *("clip", "canonical_pose", "motion_feature", "motion_beat"),
        *("match", "music_segment", "music_feature"),
    ),
    settings=("match_path", "dance.blend_s"),
    choose=choose,
    keeps_pins=False,
)
