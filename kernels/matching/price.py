"""What a stretch of a clip costs as the dance of a stretch of a song: as a match, in strength, and in pace."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.matching import intensity
from kernels.matching.pieces import ease_pace, motion_under, snap_start
from kernels.matching.score import SCALE_DENOMINATOR
from kernels.motion.motion_features import FEATURE_RATE_HZ
from kernels.ranks import rank_correlation
from kernels.runs import runs_of, touches
from kernels.types import Float
from kernels.warp import WarpWeights, is_easy, warp_cost

Rhythm = NDArray[np.float32]

PACE = WarpWeights(pace=0.1)
"""Price of a warp of 1.1: chosen by hand, as small beside a seam as the motion graph has it. Nothing is added outside
the easy bounds: pieces beyond them are for segments that have no others."""

LEAST_BEAT_S = 0.1
"""Beats nearer to an edge of a segment than this cut nothing off it, seconds. Chosen by hand: no beat of music is
as short."""


@dataclass(frozen=True, eq=False)
class ClipFeatures:
    """What the choice asks of a clip: (F,) rhythm and intensity before scaling at 120 Hz, (B,) beats in seconds.

    ``is_fenced`` marks what is never shown, (F,); None where all of it may be.
    """

    rhythm: Rhythm
    peak_effort: Float
    beat_s: Float
    is_fenced: NDArray[np.bool_] | None = None

    def stretch_s(self, *, apart_s: float = 0.0) -> tuple[float, float]:
        """Find the longest stretch that may be shown, the first of equals.

        Parameters
        ----------
        apart_s : float, seconds, >= 0, kept between it and what is fenced; nothing at the clip's own ends

        Returns
        -------
        start_s, end_s : float, seconds of the clip
            (0, 0) for none.
        """
        if self.is_fenced is None:
            return 0.0, self.duration_s
        bounds = runs_of(~self.is_fenced) / FEATURE_RATE_HZ
        bounds[bounds[:, 0] > 0, 0] += apart_s
        bounds[bounds[:, 1] < self.duration_s, 1] -= apart_s
        length = bounds[:, 1] - bounds[:, 0]
        if not len(bounds) or length.max() <= 0:
            return 0.0, 0.0
        start_s, end_s = bounds[np.argmax(length)]
        return float(start_s), float(end_s)

    def may_show(self, start_s: float, end_s: float) -> bool:
        """Whether nothing between two moments is fenced.

        Parameters
        ----------
        start_s, end_s : float, seconds of the clip; what lies outside it is left out
        """
        if self.is_fenced is None:
            return True
        return not touches(self.is_fenced, FEATURE_RATE_HZ, np.array([start_s]), np.array([end_s]))[0]

    @property
    def duration_s(self) -> float:
        """Seconds from the first value to the last."""
        return max(len(self.rhythm) - 1, 0) / FEATURE_RATE_HZ


@dataclass(frozen=True, eq=False)
class SongSpan:
    """A segment of a song as a clip is laid under it.

    Parameters
    ----------
    start_s, end_s : float, seconds, end > start
    first_frame_index : int, the frame at 120 Hz its rhythm begins with
    rhythm : (L,) float32
    intensity : (L,) float64
    beat_s : (B,) float64, seconds, the beats of the song
    """

    start_s: float
    end_s: float
    first_frame_index: int
    rhythm: Rhythm
    intensity: Float
    beat_s: Float


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


def lay_piece(
    place: Place,
    clip: ClipFeatures,
    span: SongSpan,
    *,
    edges: tuple[Float, Float],
    match_weight: float,
    intensity_weight: float,
    loss_ratio: float,
    eases: bool = False,
) -> MatchPiece:
    """Make one place of a clip a piece, brought to a beat of the clip where that costs little, and price it.

    Parameters
    ----------
    place : Place
    clip : ClipFeatures of its clip
    span : SongSpan
    edges : ((n - 1,), (n - 1,)) float, of the bins of intensity of the song and of the clips
    match_weight, intensity_weight : float, >= 0, the most that either may cost
    loss_ratio : float, 0 to 1, share of the score that a start on a beat, or an easier pace, may lose
    eases : bool, whether the pace is brought nearer to the clip's own

    Returns
    -------
    MatchPiece
    """
    numerator, start = place.numerator, place.start_frame_index
    if eases:
        numerator, start = ease_pace(
            span.rhythm, clip.rhythm, numerator=numerator, start_frame_index=start, loss_ratio=loss_ratio
        )
    frame = snap_start(
        span.rhythm,
        clip.rhythm,
        numerator=numerator,
        start_frame_index=start,
        beat_s=clip.beat_s,
        loss_ratio=loss_ratio,
    )
    scale = numerator / SCALE_DENOMINATOR
    # A segment starts between two frames; the clip's time under it moves along by as much.
    clip_s = max(frame / FEATURE_RATE_HZ + scale * (span.start_s - span.first_frame_index / FEATURE_RATE_HZ), 0.0)
    clip_end_s = min(clip_s + scale * (span.end_s - span.start_s), clip.duration_s)
    motion = motion_under(clip.peak_effort, len(span.rhythm), numerator=numerator, start=frame)
    warp = (span.end_s - span.start_s) / (clip_end_s - clip_s)
    return MatchPiece(
        place.clip_id,
        clip_s,
        clip_end_s,
        place.rank_number,
        match_weight * place.cost,
        intensity_weight * (1.0 - agreement(span, motion, edges)),
        float(warp_cost(warp, PACE)),
        frame != start,
        bool(is_easy(warp)),
    )


def agreement(span: SongSpan, motion: Float, edges: tuple[Float, Float]) -> float:
    """Agreement of the intensity of a motion with that of a span of a song.

    Parameters
    ----------
    span : SongSpan
    motion : (L,) float, intensity of the motion under it
    edges : ((n - 1,), (n - 1,)) float, of the bins of the song and of the clips

    Returns
    -------
    float, 0 to 1
    """
    inside = span.beat_s[(span.beat_s > span.start_s + LEAST_BEAT_S) & (span.beat_s < span.end_s - LEAST_BEAT_S)]
    cut_s = np.concatenate([[span.start_s], inside, [span.end_s]]) - span.start_s
    cut = np.rint(cut_s * FEATURE_RATE_HZ).astype(np.int64)
    return intensity.agreement(
        intensity.bhattacharyya(intensity.histogram(span.intensity, edges[0]), intensity.histogram(motion, edges[1])),
        rank_correlation(intensity.beat_means(span.intensity, cut), intensity.beat_means(motion, cut)),
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
