"""Which recording of each basic motion is danced: how recorded motions start and end, and the best row of them."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from assets.reading.clips import named_clips
from assets.stamps import Stored
from assets.tables.motion import CanonicalClip
from kernels.graph.beat_features import beat_features
from kernels.hmm import instances
from kernels.hmm.decode import Chain
from kernels.hmm.instances import Motions
from kernels.hmm.places import Places, missed_beats
from kernels.hmm.seams import REACH_S, Ends, concatenate_ends, limb_paths, own_cost, seam_cost
from kernels.hmm.viterbi import Spans
from kernels.matching.match_sequence import Candidates, Chosen, continues
from kernels.motion.velocity import accents, jerk_around, usable_frames
from kernels.types import Float, Int
from kernels.warp import warp_cost
from schemas.settings import HmmPathSettings


def ends_of(motions: Motions, clip_ids: tuple[str, ...], canonical_pose: Stored, *, blend_s: float) -> Ends:
    """Look at the poses at the ends of all motions, one clip at a time.

    Parameters
    ----------
    motions : Motions, at least one
    clip_ids : by clip index
    canonical_pose : Stored, poses of clips by session
    blend_s : float, seconds, >= 0, the usual blend
    """
    wanted = {clip_ids[i]: np.flatnonzero(motions.clip_index == i) for i in np.unique(motions.clip_index).tolist()}
    found: dict[str, Ends] = {}
    for moved in named_clips(canonical_pose, wanted):
        at = wanted[moved.clip_id]
        found[moved.clip_id] = _ends(moved, motions.start_s[at], motions.end_s[at], blend_s)
    return concatenate_ends([found[clip] for clip in wanted])


def _ends(moved: CanonicalClip, start_s: Float, end_s: Float, blend_s: float) -> Ends:
    n = len(start_s)
    time_s = np.minimum(np.concatenate([start_s, end_s]), moved.duration_s)
    rate_hz = moved.frame_rate_hz
    pose = beat_features(moved.rotation_wxyz, moved.position_xyz_m, frame_rate_hz=rate_hz, time_s=time_s).pose.linear
    limbs = limb_paths(moved.position_xyz_m, moved.rotation_wxyz[:, 0], frame_rate_hz=rate_hz, time_s=time_s)
    peak, usual = jerk_around(moved.position_xyz_m, moved.frame_rate_hz, time_s=time_s, reach_s=REACH_S)
    first, last = usable_frames(moved.position_xyz_m, moved.frame_rate_hz)
    half_s = max(blend_s / 2, 1e-9)
    return Ends(
        pose[:n],
        pose[n:],
        limbs[:n],
        limbs[n:],
        accents(moved.position_xyz_m, moved.frame_rate_hz, time_s=time_s[n:]),
        peak[:n],
        peak[n:],
        np.full(n, usual),
        np.clip((first / moved.frame_rate_hz + half_s - start_s) / half_s, 0.0, 1.0),
        np.clip((end_s + half_s - last / moved.frame_rate_hz) / half_s, 0.0, 1.0),
    )


@dataclass(frozen=True, eq=False)
class Recordings:
    """A recording for each span: candidates, which of them, the motions danced, and costs by column, (S,) each."""

    candidates: Sequence[Candidates]
    found: Chosen
    danced: Int
    costs: Mapping[str, Float]


def choose_recordings(
    motions: Motions,
    ends: Ends,
    places: Places,
    spans: Spans,
    decoded: Chain | None,
    crowded: Float,
    *,
    is_beat: NDArray[np.bool_],
    grid_s: Float,
    settings: HmmPathSettings,
) -> Recordings:
    """Choose a recording of each basic motion of a path: pace, beats, seams and repetition.

    Parameters
    ----------
    motions : Motions of I
    ends : Ends of them
    places : Places, wishes included
    spans : Spans of S
    decoded : Chain the spans were taken from, or None
    crowded : (G + D,) float, >= 0, what a seam at each point of the grid costs beside
    is_beat : (G + D,) bool
    grid_s : (G + D,) float, seconds
    settings : HmmPathSettings
    """
    where = list(zip(spans.start.tolist(), spans.length.tolist(), spans.state.tolist(), strict=True))
    fits, own = [], []
    for start, length, state in where:
        here, price = places.at[start][length - 1]
        same = motions.state[here] == state
        fits.append(here[same])
        own.append(price[same] - price[same].min())  # what the music says is the same for all of them
    start_cost, end_cost = own_cost(ends)
    seam_price = settings.seam_weight * (start_cost + end_cost) / 2
    first = None if decoded is None else decoded.motion
    short = instances.shortlist(motions, fits, own, seam=seam_price, keep=first)
    prices = [p[np.searchsorted(f, m)] for p, f, m in zip(own, fits, short, strict=True)]
    candidates = [
        Candidates(motions.clip_index[m], motions.start_s[m], motions.end_s[m], p)
        for m, p in zip(short, prices, strict=True)
    ]
    goes_on = [continues(a, b) for a, b in itertools.pairwise(candidates)]
    seam = [
        np.where(on, 0.0, settings.seam_weight * seam_cost(ends, a, b) + crowded[start])
        for on, (a, b), start in zip(goes_on, itertools.pairwise(short), spans.start[1:], strict=True)
    ]
    choice, repetition, total = instances.choose(short, prices, seam, repetition_weight=settings.repetition_weight)
    pairs = list(itertools.pairwise(choice))
    has_seam = np.array([False, *(not on[a, b] for on, (a, b) in zip(goes_on, pairs, strict=True))], bool)
    seam_costs = np.array([0.0, *(s[a, b] for s, (a, b) in zip(seam, pairs, strict=True))])
    danced = np.array([m[i] for m, i in zip(short, choice, strict=True)], np.int64)
    end = spans.start + spans.length
    warp = (grid_s[end] - grid_s[spans.start]) / (motions.end_s - motions.start_s)[danced]
    pace = settings.warp_weight * warp_cost(warp, instances.PACE)
    missed = missed_beats(is_beat, spans.start, end, ends.end_accent[danced])
    costs = {
        "transition_cost": seam_costs,
        "warp_cost": pace,
        "beat_cost": missed,
        "repetition_cost": repetition,
    }
    joined = np.ones(len(choice), bool)
    return Recordings(candidates, Chosen(choice, has_seam, joined, seam_costs, repetition, total), danced, costs)
