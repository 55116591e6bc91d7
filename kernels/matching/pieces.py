"""From a match to a piece of a clip: its start brought to a beat of the clip where that costs little.

Also what a segment is danced with when no clip is long enough for it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels.matching.score import SCALE_DENOMINATOR, similarity
from kernels.motion.motion_features import FEATURE_RATE_HZ
from kernels.types import Float, Int

SNAP_REACH_S = 0.12
"""A start is moved no further: more would be another match. Chosen by hand."""

OTHER_APART_S = 0.5
"""Starts of one clip nearer to each other than this are the same piece: about one beat. Tuned on 37 songs and 359 real
clips: with 1 or 2 s fewer beats are met."""

OTHER_LEAST_RATIO = 0.8
"""Starts of a clip that score less than this share of its best are not offered. Chosen by hand."""

_COARSE = 3
"""Frames between the starts tried first. Chosen as half the standard deviation of a bump."""


def motion_under(clip: NDArray[np.floating], n_frames: int, *, numerator: int, start: float) -> Float:
    """Read a clip's feature as a match does: b[f] = m(s f + f0), linearly interpolated.

    Parameters
    ----------
    clip : (T,) float, T >= 1
    n_frames : int, >= 0
    numerator : int, the scale s times 50
    start : float, f0

    Returns
    -------
    (n_frames,) float64; held at the clip's ends beyond them
    """
    at = start + numerator / SCALE_DENOMINATOR * np.arange(n_frames)
    return np.asarray(np.interp(at, np.arange(len(clip)), np.asarray(clip, np.float64)), np.float64)


def snap_start(
    segment: NDArray[np.floating],
    clip: NDArray[np.floating],
    *,
    numerator: int,
    start_frame_index: int,
    beat_s: Float,
    loss_ratio: float,
) -> int:
    """Move a match's start to the nearest beat of its clip, if the score loses less than a share.

    Parameters
    ----------
    segment : (L,) float, L >= 1
    clip : (T,) float
    numerator : int, the scale times 50
    start_frame_index : int, f0 of the match
    beat_s : (B,) float, seconds of the clip
    loss_ratio : float, 0 to 1
        Share of the score that may be lost; with 0 nothing is moved that would lose anything.

    Returns
    -------
    int, frame
        The start given where there is no beat within 120 ms, the piece would not lie in the clip, or too much is lost.
    """
    if not len(beat_s):
        return start_frame_index
    beat = np.rint(np.asarray(beat_s) * FEATURE_RATE_HZ).astype(np.int64)
    wanted = int(beat[np.argmin(np.abs(beat - start_frame_index))])
    last = wanted + numerator / SCALE_DENOMINATOR * (len(segment) - 1)
    is_near = abs(wanted - start_frame_index) <= SNAP_REACH_S * FEATURE_RATE_HZ
    if not is_near or wanted < 0 or last > len(clip) - 1:
        return start_frame_index
    before, after = (
        float(similarity(segment, motion_under(clip, len(segment), numerator=numerator, start=f)).sum())
        for f in (start_frame_index, wanted)
    )
    return wanted if after >= (1.0 - loss_ratio) * before else start_frame_index


def ease_pace(
    segment: NDArray[np.floating],
    clip: NDArray[np.floating],
    *,
    numerator: int,
    start_frame_index: int,
    loss_ratio: float,
) -> tuple[int, int]:
    """Bring a match at the slowest scale one step nearer to the clip's own pace, if the score loses less than a share.

    Segments with few onsets match best where the clip is slowest, only because its bumps are widest there.

    Parameters
    ----------
    segment, clip, numerator, start_frame_index : as :func:`snap_start`
    loss_ratio : float, 0 to 1

    Returns
    -------
    numerator, start_frame_index : int
        One fiftieth nearer to 1, at the best start within 120 ms; as given where nothing there fits or too much is
        lost.
    """
    nearer = numerator + int(np.sign(SCALE_DENOMINATOR - numerator))
    reach = round(SNAP_REACH_S * FEATURE_RATE_HZ)
    last = len(clip) - 1 - nearer / SCALE_DENOMINATOR * (len(segment) - 1)
    starts = [f for f in range(start_frame_index - reach, start_frame_index + reach + 1) if 0 <= f <= last]
    if nearer == numerator or not starts:
        return numerator, start_frame_index

    def score(p: int, f: int) -> float:
        return float(similarity(segment, motion_under(clip, len(segment), numerator=p, start=f)).sum())

    found = [score(nearer, f) for f in starts]
    best = int(np.argmax(found))
    if found[best] >= (1.0 - loss_ratio) * score(numerator, start_frame_index):
        return nearer, starts[best]
    return numerator, start_frame_index


def other_starts(
    segment: NDArray[np.floating],
    clip: NDArray[np.floating],
    *,
    numerator: int,
    start_frame_index: int,
    most: int,
) -> Int:
    """Find where else in its clip a match scores nearly as well, at its scale.

    A search keeps the best start of a clip. Motion that comes back, as steps do, matches about as well a few beats on,
    with other poses at its ends: that is what lets pieces connect.

    Parameters
    ----------
    segment : (L,) float, L >= 1, finite, >= 0
    clip : (T,) float, finite, >= 0
    numerator : int, the scale times 50
    start_frame_index : int, f0 of the match
    most : int, >= 0

    Returns
    -------
    (n,) int64, at most ``most``, the best first
        Peaks of the score, at least 0.5 s from the match and from each other, that reach 0.8 of its score. Looked for
        at every third frame and then near those, so that one of a lone impulse may be missed. None for silence.
    """
    scale = numerator / SCALE_DENOMINATOR
    n_starts = max(int(np.floor(len(clip) - 1 - scale * (len(segment) - 1) + 1e-9)) + 1, 0)
    sounding = np.flatnonzero(segment > 0)
    none = np.zeros(0, np.int64)
    if n_starts == 0 or not len(sounding) or most == 0:
        return none
    music, motion, at = np.asarray(segment, np.float64)[sounding], np.asarray(clip, np.float64), scale * sounding

    def score(starts: Int) -> Float:
        under = np.interp(starts[:, None] + at, np.arange(len(motion)), motion)
        return np.asarray(similarity(music, under).sum(axis=1), np.float64)

    least = OTHER_LEAST_RATIO * float(score(np.array([start_frame_index]))[0])
    coarse = np.arange(0, n_starts, _COARSE)
    found = score(coarse)
    around = np.concatenate([[-np.inf], found, [-np.inf]])
    peaks = np.flatnonzero((found > around[:-2]) & (found >= around[2:]) & (found > 0.9 * least))
    kept: list[int] = []
    for peak in peaks[np.argsort(-found[peaks], kind="stable")]:
        near = np.arange(max(coarse[peak] - _COARSE + 1, 0), min(coarse[peak] + _COARSE, n_starts))
        exact = score(near)
        start = int(near[np.argmax(exact)])
        is_apart = all(abs(start - k) >= OTHER_APART_S * FEATURE_RATE_HZ for k in (start_frame_index, *kept))
        if len(kept) < most and is_apart and exact.max() >= max(least, 1e-12):
            kept.append(start)
    return np.array(kept, np.int64) if kept else none


def split_span(start_s: float, end_s: float, *, beat_s: Float, longest_s: float) -> Float:
    """Cut a span of a song into parts that are short enough: at beats where there are any, evenly elsewhere.

    Parameters
    ----------
    start_s, end_s : float, seconds, end > start
    beat_s : (B,) float, seconds, increasing
    longest_s : float, seconds, > 0

    Returns
    -------
    (n + 1,) float64, seconds, increasing, from start to end
    """
    edges = [start_s]
    inside = [float(b) for b in beat_s if start_s + 0.1 < b < end_s - 0.1] + [end_s]
    for i, place in enumerate(inside):
        is_last = i + 1 == len(inside)
        if is_last or inside[i + 1] - edges[-1] > longest_s + 1e-9:
            n = max(int(np.ceil((place - edges[-1]) / longest_s - 1e-9)), 1)
            edges += [edges[-1] + (place - edges[-1]) * j / n for j in range(1, n)] + [place]
    return np.array(edges)


def longest_first(n_frames: Int, *, most: int) -> Int:
    """Find the longest clips: indices, equal ones in order, at most ``most``.

    Parameters
    ----------
    n_frames : (N,) int, frames of each clip
    most : int, >= 0

    Returns
    -------
    (min(N, most),) int64, indices of clips
    """
    return np.argsort(-np.asarray(n_frames), kind="stable")[:most]
