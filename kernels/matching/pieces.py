"""From a match to a piece of a clip: its start brought to a beat of the clip where that costs little.

Also what a segment is danced with when no clip is long enough for it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels.matching.score import SCALE_DENOMINATOR, similarity
from kernels.motion.features import FEATURE_RATE_HZ
from kernels.types import Float, Int

SNAP_REACH_S = 0.12
"""A start is moved no further: more would be another match."""


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
    """Find the longest clips: indices, equal ones in order, at most ``most``."""
    return np.argsort(-np.asarray(n_frames), kind="stable")[:most]
