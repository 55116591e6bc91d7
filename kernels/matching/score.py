"""What a match is, and the search that tries everything: the reference for every other way of searching.

Conventions: a segment is the music's feature a[f], f = 0..L-1, a clip the motion's feature m[t], t = 0..T-1, both at
one rate, finite and non-negative. A candidate of a clip is a scale p / 50 and a first frame f0; it exists where its
last frame does, p (L - 1) + 50 f0 <= 50 (T - 1), decided in integers.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SCALE_DENOMINATOR = 50
SCALE_NUMERATORS = tuple(range(45, 56))
"""Scales 0.90, 0.92 to 1.10, as in [Yagi2009]."""

SCALES = tuple(p / SCALE_DENOMINATOR for p in SCALE_NUMERATORS)


@dataclass(frozen=True)
class Match:
    """A clip's best candidate for a segment.

    Parameters
    ----------
    segment_index, clip_index : int, from 0
    rank_number : int, from 1, the best first
    scale_index : int, into the scales of the search
        The clip is read at this many of its frames for every frame of music.
    start_frame_index : int, frame of the clip under the segment's first
    score : float, >= 0
        C of :func:`sums`.
    music_ratio : float, 0 to 2
        C / (sum of a / 2): 1 where the motion equals the music; 0 for silence.
    mutual_ratio : float, 0 to 1
        4 C / (sum of a + sum of b): 1 only where they are equal; 0 where both are silent.
    """

    segment_index: int
    rank_number: int
    clip_index: int
    scale_index: int
    start_frame_index: int
    score: float
    music_ratio: float
    mutual_ratio: float


def similarity(a: NDArray[np.floating], b: NDArray[np.floating]) -> NDArray[np.float64]:
    """Half the harmonic mean, a b / (a + b), element by element.

    Parameters
    ----------
    a, b : arrays that broadcast, finite, >= 0

    Returns
    -------
    float64, >= 0, at most the smaller of the two; 0 where both are 0
    """
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    total = a + b
    product = a * b
    return np.divide(product, total, out=np.zeros_like(total), where=total > 0)


def start_count(n_segment: int, n_clip: int, numerator: int) -> int:
    """Count the starts of a segment in a clip at the scale numerator / 50; 0 where it does not fit.

    Parameters
    ----------
    n_segment : int, L >= 1, frames of the segment
    n_clip : int, T >= 0, frames of the clip
    numerator : int, the scale times 50

    Returns
    -------
    int, >= 0
    """
    last = (numerator * (n_segment - 1) + SCALE_DENOMINATOR - 1) // SCALE_DENOMINATOR
    return max(n_clip - last, 0)


def sums(
    segment: NDArray[np.floating], clip: NDArray[np.floating], *, numerator: int, starts: NDArray[np.integer]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Score candidates of one clip at one scale: equation 1 of [Yagi2009], in float64, from first frame to last.

    Parameters
    ----------
    segment : (L,) float, finite, >= 0
    clip : (T,) float, finite, >= 0
    numerator : int, the scale times 50
    starts : (N,) int, each below :func:`start_count`

    Returns
    -------
    score : (N,) float64
        C = sum over f of a[f] b[f] / (a[f] + b[f]), with b[f] = m(f0 + scale f), linearly interpolated; 0 / 0 is 0.
    motion_sum : (N,) float64
        Sum of b.

    Notes
    -----
    The order of every operation is fixed, so a score has the same bits whichever other candidates are asked for.
    """
    a, m = np.asarray(segment, np.float64), np.asarray(clip, np.float64)
    padded = np.append(m, 0.0)  # a weight of 0 may read one past the end
    score = np.zeros(len(starts))
    motion_sum = np.zeros(len(starts))
    for f, value in enumerate(a):
        whole, rest = divmod(numerator * f, SCALE_DENOMINATOR)
        at = starts + whole
        b = padded[at]
        if rest:
            weight = rest / SCALE_DENOMINATOR
            b = (1.0 - weight) * b + weight * padded[at + 1]
        motion_sum += b
        if value > 0:  # h(0, b) = 0, and adding it changes no bit
            score += (value * b) / (value + b)
    return score, motion_sum


def ratios(score: float, music_sum: float, motion_sum: float) -> tuple[float, float]:
    """C / (sum of a / 2) and 4 C / (sum of a + sum of b); 0 where the denominator is 0.

    Parameters
    ----------
    score : float, C >= 0
    music_sum, motion_sum : float, >= 0, sums of a and of b

    Returns
    -------
    music_ratio, mutual_ratio : float, >= 0
    """
    music = score / (music_sum / 2) if music_sum > 0 else 0.0
    total = music_sum + motion_sum
    return music, (4 * score / total if total > 0 else 0.0)


def music_sum(segment: NDArray[np.floating]) -> float:
    """Sum of a, from the first frame to the last, in float64.

    Parameters
    ----------
    segment : (L,) float, finite, >= 0

    Returns
    -------
    float, >= 0; 0 for no frame
    """
    total = 0.0
    for value in np.asarray(segment, np.float64).tolist():
        total += value
    return total


def check_series(series: Sequence[NDArray[np.floating]], name: str, *, shortest: int = 0) -> None:
    """Refuse features that no score is defined for.

    Parameters
    ----------
    series : sequence of arrays, to be (F,) float, finite, >= 0
    name : str, what they are, for the message
    shortest : int, least frames of each

    Raises
    ------
    ValueError
        If one is not (F,), shorter than `shortest`, not finite or negative; the message names it by its index.
    """
    for index, values in enumerate(series):
        if values.ndim != 1 or len(values) < shortest:
            raise ValueError(f"{name} {index}: want (F,) with F >= {shortest}, got {values.shape}")
        # the smallest and largest are not a number if any is not
        if values.size and not (values.min() >= 0 and values.max() < np.inf):
            what = "negative" if np.isfinite(values).all() else "not finite"
            raise ValueError(f"{name} {index}: want finite values >= 0, got {what}; mend the feature before matching")


def numerators(scales: Sequence[float]) -> tuple[int, ...]:
    """Scales as whole fiftieths.

    Parameters
    ----------
    scales : rising multiples of 1/50, at most 4

    Returns
    -------
    tuple of int, the scales times 50

    Raises
    ------
    ValueError
        If there is none, one is not a multiple of 1/50 within 1/50 to 4, or they do not rise.
    """
    wanted = tuple(round(scale * SCALE_DENOMINATOR) for scale in scales)
    exact = all(abs(p / SCALE_DENOMINATOR - scale) < 1e-9 for p, scale in zip(wanted, scales, strict=True))
    if (
        not wanted
        or not exact
        or min(wanted) < 1
        or max(wanted) > 4 * SCALE_DENOMINATOR
        or list(wanted) != sorted(set(wanted))
    ):
        raise ValueError(f"scales: want rising multiples of 1/{SCALE_DENOMINATOR} up to 4, got {tuple(scales)}")
    return wanted


def ranked(candidates: Iterable[Match], *, k: int) -> list[Match]:
    """Rank candidates of one segment: the best of each clip, then the k best clips, numbered from 1.

    Parameters
    ----------
    candidates : matches of one segment, in any order, any number of a clip
    k : int, >= 1

    Returns
    -------
    list of Match
        By falling score; equal scores by clip, scale, start. Fewer than k where there are fewer clips.
    """
    order = sorted(candidates, key=lambda m: (-m.score, m.clip_index, m.scale_index, m.start_frame_index))
    best: dict[int, Match] = {}
    for match in order:
        if len(best) == k:
            break
        best.setdefault(match.clip_index, match)
    return [
        Match(
            m.segment_index,
            rank,
            m.clip_index,
            m.scale_index,
            m.start_frame_index,
            m.score,
            m.music_ratio,
            m.mutual_ratio,
        )
        for rank, m in enumerate(best.values(), 1)
    ]


def reference_matches(
    segments: Sequence[NDArray[np.floating]],
    clips: Sequence[NDArray[np.floating]],
    *,
    k: int,
    scales: Sequence[float] = SCALES,
) -> list[list[Match]]:
    """Find the k best clips of every segment by trying every candidate in float64.

    Parameters
    ----------
    segments : sequence of (L,) float, L >= 1, finite, >= 0
    clips : sequence of (T,) float, finite, >= 0
        In ascending order of their keys: equal scores go by the index of the clip, then of the scale, then the start.
    k : int, >= 1
    scales : rising multiples of 1/50

    Returns
    -------
    list, one a segment, of lists of Match, the best first
        Shorter than k where fewer clips are long enough.

    Raises
    ------
    ValueError
        If a feature is not (F,), not finite or negative, a segment is empty, k < 1 or the scales are not as wanted.
    """
    fiftieths = numerators(scales)
    check_query(segments, k=k)
    check_series(clips, "clip")
    found = []
    for segment_index, segment in enumerate(segments):
        a_sum = music_sum(segment)
        candidates = []
        for clip_index, clip in enumerate(clips):
            for scale_index, numerator in enumerate(fiftieths):
                n = start_count(len(segment), len(clip), numerator)
                if n == 0:
                    continue
                score, motion_sum = sums(segment, clip, numerator=numerator, starts=np.arange(n))
                start = int(np.argmax(score))  # the first of equals
                c = float(score[start])
                candidates.append(
                    Match(
                        segment_index,
                        0,
                        clip_index,
                        scale_index,
                        start,
                        c,
                        *ratios(c, a_sum, float(motion_sum[start])),
                    )
                )
        found.append(ranked(candidates, k=k))
    return found


def check_query(segments: Sequence[NDArray[np.floating]], *, k: int) -> None:
    """Refuse a question without an answer.

    Parameters
    ----------
    segments : sequence of arrays, to be (L,) float with L >= 1, finite, >= 0
    k : int, to be >= 1

    Raises
    ------
    ValueError
        If a segment is not (L,) with L >= 1, not finite or negative, or k < 1.
    """
    if k < 1:
        raise ValueError(f"k: want >= 1, got {k}")
    check_series(segments, "segment", shortest=1)


def merge_matches(shards: Sequence[Sequence[Sequence[Match]]], *, k: int) -> list[list[Match]]:
    """Merge what was found in parts of one catalogue into what the whole would have given.

    Parameters
    ----------
    shards : one a part, each with one list of matches a segment
        Clip indices count through the whole catalogue; each part holds its own k best.
    k : int, >= 1

    Returns
    -------
    list, one a segment, of lists of Match, ranked anew; empty without shards

    Raises
    ------
    ValueError
        If k < 1 or the parts do not have the same number of segments.
    """
    if k < 1:
        raise ValueError(f"k: want >= 1, got {k}")
    if len({len(shard) for shard in shards}) > 1:
        raise ValueError(f"shards: want one number of segments, got {sorted({len(shard) for shard in shards})}")
    return [ranked((m for part in parts for m in part), k=k) for parts in zip(*shards, strict=True)]


def sums_of_candidates(
    segments: NDArray[np.float64],
    frames: NDArray[np.float64],
    *,
    n_frames: NDArray[np.int64],
    segment: NDArray[np.int64],
    first: NDArray[np.int64],
    numerator: NDArray[np.int64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Score candidates of many segments and clips as :func:`sums` does, to the bit.

    Parameters
    ----------
    segments : (S, L) float64
        Filled up with zeros behind each segment.
    frames : (T,) float64
        Clips one after another.
    n_frames : (S,) int64, frames of each segment
    segment, first, numerator : (N,) int64
        Of each candidate: its segment, the frame in `frames` under the segment's first, its scale times 50.

    Returns
    -------
    score, motion_sum : (N,) float64
    """
    score = np.zeros(len(segment))
    motion_sum = np.zeros(len(segment))
    length = n_frames[segment]
    last = len(frames) - 1
    columns = np.ascontiguousarray(segments.T)
    for f in range(int(length.max(initial=0))):
        whole, rest = np.divmod(numerator * f, SCALE_DENOMINATOR)
        at = first + whole
        inside = f < length
        weight = rest / SCALE_DENOMINATOR
        b = (1.0 - weight) * frames[np.minimum(at, last)] + weight * frames[np.minimum(at + 1, last)]
        value = columns[f][segment]
        total = value + b
        np.add(motion_sum, b, out=motion_sum, where=inside)
        np.add(score, (value * b) / np.where(total > 0, total, 1.0), out=score, where=inside & (value > 0))
    return score, motion_sum
