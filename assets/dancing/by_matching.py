"""From the matches of a song to its steps: pieces of clips, how they join, and the best sequence of them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from assets.dancing import licences
from assets.dancing.avoided import AvoidedSpan
from assets.dancing.chosen_steps import ChosenSteps, Markdown
from assets.dancing.match_pieces import LoadedMatches, load_matches, pieces_of, without_touched
from assets.dancing.method import DanceOrder, Method
from assets.dancing.refusal import RefusalError
from assets.plots import matching as matching_plots
from assets.plots.dance import phrase_table
from assets.reading.clips import named_clips, read_clips
from assets.stamps import Stored, repeatable
from kernels.assembly.timing import blend_widths, cover
from kernels.matching import match_sequence
from kernels.matching.piece_joints import clip_directions, joints_of
from kernels.types import Float
from schemas.settings import Settings


def by_matching(
    found: LoadedMatches,
    canonical_pose: Stored,
    beat_s: Float,
    settings: Settings,
    *,
    avoid: Sequence[AvoidedSpan] = (),
) -> ChosenSteps:
    """Choose one piece a segment: by rhythm, intensity, pace, joints and repetition.

    Parameters
    ----------
    found : LoadedMatches
    canonical_pose : Stored, poses of clips by session
    beat_s : (B,) float, seconds, increasing, over the whole song
    settings : Settings, of which ``match_path`` and ``dance`` are read
    avoid : stretches of clips that are not to be shown where there is another piece

    Returns
    -------
    ChosenSteps

    Raises
    ------
    RefusalError
        If there is no clip longer than one frame.
    """
    blend_s = settings.dance.blend_s
    if not any(clip.duration_s > 0 for clip in found.clips.values()):
        raise RefusalError("no clip can be danced: none is longer than one frame; add clips")
    if not any(np.ptp(clip.stretch_s(apart_s=blend_s / 2)) > 0 for clip in found.clips.values()):
        raise RefusalError("no clip can be danced: what of them may be shown is shorter than a blend; add clips")
    spans, pieces = pieces_of(found, beat_s, settings.match_path, blend_s=blend_s)
    pieces = [without_touched(ps, avoid, blend_s=blend_s) for ps in pieces]
    clip_ids = sorted({p.clip_id for ps in pieces for p in ps})
    index = {clip: i for i, clip in enumerate(clip_ids)}
    candidates = [
        match_sequence.Candidates(
            np.array([index[p.clip_id] for p in ps], np.int64),
            np.array([p.start_s for p in ps]),
            np.array([p.end_s for p in ps]),
            np.array([p.cost for p in ps]),
        )
        for ps in pieces
    ]
    limits, joints = joints_of(
        pieces,
        spans,
        directions_of(canonical_pose, set(clip_ids)),
        blend_s=blend_s,
        seam_weight=settings.match_path.seam_weight,
    )
    chosen = match_sequence.choose(
        candidates,
        joints,
        repetition_weight=settings.match_path.repetition_weight,
        unconnected_cost=settings.match_path.unconnected_cost or None,
    )
    steps, span_of = match_sequence.to_choreography(
        candidates,
        chosen,
        start_s=spans[:-1],
        end_s=spans[1:],
        beat_s=beat_s,
        clip_ids=tuple(clip_ids),
        blend_s=blend_s,
    )
    width = blend_widths(steps.song_start_s, steps.song_end_s, steps.has_seam, wanted_s=blend_s)
    steps = replace(steps, blend_s=width)
    used = [ps[c] for ps, c in zip(pieces, chosen.choice, strict=True)]
    by_span = {
        "transition_cost": chosen.seam_cost,
        "warp_cost": np.array([p.warp_cost for p in used]),
        "match_cost": np.array([p.match_cost for p in used]),
        "intensity_cost": np.array([p.intensity_cost for p in used]),
        "repetition_cost": chosen.repetition_cost,
    }
    costs = {name: match_sequence.at_first_steps(values, span_of) for name, values in by_span.items()}
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


def directions_of(canonical_pose: Stored, wanted: set[str]) -> Iterator[tuple[str, Float, tuple[float, float]]]:
    """Take the link directions of the wanted clips, one clip at a time, and the seconds between which each is usable.

    Parameters
    ----------
    canonical_pose : Stored, poses of clips by session
    wanted : clip_ids

    Yields
    ------
    clip_id, and what :func:`kernels.matching.piece_joints.clip_directions` has of it
    """
    for moved in named_clips(canonical_pose, wanted):
        yield moved.clip_id, *clip_directions(moved.position_xyz_m, moved.rotation_wxyz[:, 0], moved.frame_rate_hz)


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
        return by_matching(found, inputs["canonical_pose"], beat_s, order.settings, avoid=order.avoid)


METHOD = Method(
    name="matching",
    version="8",
    inputs=(
        *("clip", "canonical_pose", "motion_feature", "motion_beat"),
        *("match", "music_segment", "music_feature"),
    ),
    settings=("match_path", "dance.blend_s"),
    choose=choose,
    keeps_pins=False,
)
