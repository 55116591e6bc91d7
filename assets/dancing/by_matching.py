"""From the matches of a song to its steps: pieces of clips, how they join, and the best sequence of them."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from assets.dancing import licences
from assets.dancing.danced import ChosenSteps, Markdown
from assets.dancing.match_pieces import LoadedMatches, MatchPiece, load_matches, pieces_of
from assets.dancing.method import DanceOrder, Method
from assets.dancing.refusal import RefusalError
from assets.plots import matching as matching_plots
from assets.plots.dance import phrase_table
from assets.reading.clips import named_clips, read_clips
from assets.stamps import Stored, repeatable
from kernels.assembly.timing import blend_widths, cover
from kernels.matching import connect, path
from kernels.motion.features import at_feature_rate, link_directions, link_weights
from kernels.motion.velocity import usable_frames
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Choreography, Float
from schemas.settings import Settings

APART_S = 0.1
"""Time between two moments of a clip that count as neighbours: pieces connect where they differ no more
than those. Tuned on real clips: at 0.017 s only a clip itself connects, at 0.2 s over half of all pairs do, with feet
that visibly slide."""

MARGIN_COST = 0.5
"""Price of a blend half of which would lie past the clip's end. Chosen by hand."""


def by_matching(found: LoadedMatches, canonical_pose: Stored, beat_s: Float, settings: Settings) -> ChosenSteps:
    """Choose one piece a segment: by rhythm, intensity, pace, joints and repetition.

    Parameters
    ----------
    found : LoadedMatches
    canonical_pose : Stored, poses of clips by session
    beat_s : (B,) float, seconds, increasing, over the whole song
    settings : Settings, of which ``match_path`` and ``dance`` are read

    Returns
    -------
    ChosenSteps

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
        "phrases": Markdown(phrase_table(steps)),
        "choice": Markdown(matching_plots.chosen(spans, used, chosen)),
    }
    return ChosenSteps(steps, costs, metadata)


def _share(masks: Sequence[Any]) -> float:
    n = sum(m.size for m in masks)
    return float(sum(int(m.sum()) for m in masks) / n) if n else 1.0


def joints_of(
    pieces: Sequence[Sequence[MatchPiece]], spans: Float, canonical_pose: Stored, *, blend_s: float, seam_weight: float
) -> tuple[connect.ConnectionThresholds, list[path.Joint]]:
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
    for moved in named_clips(canonical_pose, wanted):
        position = at_feature_rate(moved.position_xyz_m, moved.frame_rate_hz)
        root = at_feature_rate(moved.rotation_wxyz[:, 0], moved.frame_rate_hz)
        first, last = usable_frames(moved.position_xyz_m, moved.frame_rate_hz)
        usable_s = first / moved.frame_rate_hz, last / moved.frame_rate_hz
        yield moved.clip_id, link_directions(position, root, CANONICAL.parent), usable_s


def choose(inputs: Mapping[str, Stored], order: DanceOrder) -> ChosenSteps:
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
