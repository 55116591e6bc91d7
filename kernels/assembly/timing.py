"""When a dance does what: a beat grid over the whole song, and the clock that warps clips to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from kernels.types import Choreography, Float


def cover(beat_s: Float, duration_s: float, *, gap_ratio: float = 1.6) -> tuple[Float, NDArray[np.bool_]]:
    """Extend beats to a grid that covers a song from its first sample to its last.

    Before the first and after the last beat the grid goes on at the tempo of the eight intervals next to it; a gap
    wider than ``gap_ratio`` local intervals (a break the tracker left out) is filled evenly.

    Parameters
    ----------
    beat_s : (B,) float, seconds, strictly increasing, B >= 2
    duration_s : float, seconds, > 0
    gap_ratio : float, > 1

    Returns
    -------
    grid_s : (K + 1,) float64, seconds, strictly increasing
        The first is at or before 0 (or a beat at most a nanosecond after it), the last at or after ``duration_s``.
    is_beat : (K + 1,) bool
        True for the beats given, False for those added.

    Raises
    ------
    ValueError
        If there are fewer than two beats, they do not increase, or the duration is not > 0.
    """
    beat = np.asarray(beat_s, np.float64)
    if len(beat) < 2 or not (np.diff(beat) > 0).all():
        raise ValueError(f"beat_s: want at least two beats in increasing order, got {len(beat)}; name a beats file")
    if not duration_s > 0:
        raise ValueError(f"duration_s: want > 0, got {duration_s}")
    gap = np.diff(beat)
    local = np.array([np.median(gap[max(i - 4, 0) : i + 5]) for i in range(len(gap))])
    n_fill = np.where(gap > gap_ratio * local, np.round(gap / local).astype(int), 1)
    inner = [beat[i] + gap[i] * np.arange(n) / n for i, n in enumerate(n_fill)]
    first, last = float(np.median(gap[:8])), float(np.median(gap[-8:]))
    n_before = max(int(np.ceil(beat[0] / first - 1e-9)), 0)
    n_after = max(int(np.ceil((duration_s - beat[-1]) / last - 1e-9)), 0)
    grid = np.concatenate(
        [beat[0] - first * np.arange(n_before, 0, -1), *inner, beat[-1:], beat[-1] + last * np.arange(1, n_after + 1)]
    )
    # Rounding must not leave the first sample outside, nor the last.
    grid[0], grid[-1] = min(grid[0], 0.0) if n_before else grid[0], max(grid[-1], duration_s) if n_after else grid[-1]
    return grid, np.isin(grid, beat)


@dataclass(frozen=True, eq=False)
class Clock:
    """How far into the motion a dance is at each moment of the song.

    Parameters
    ----------
    song_s : (S + 1,) float64, seconds: the steps' boundaries
    motion_s : (S + 1,) float64, seconds of motion danced up to each
    """

    song_s: Float
    motion_s: Float

    def at(self, time_s: Float) -> Float:
        """Seconds of motion danced up to a song time, (n,); linear beyond the ends.

        A monotone cubic through the boundaries [Fritsch1980], so that speed does not jump at a beat.

        Parameters
        ----------
        time_s : (n,) float, seconds of the song

        Returns
        -------
        (n,) float64, seconds of motion
        """
        cubic = scipy.interpolate.PchipInterpolator(self.song_s, self.motion_s)
        inside = np.clip(time_s, self.song_s[0], self.song_s[-1])
        slope = np.where(time_s < self.song_s[0], cubic(self.song_s[0], 1), cubic(self.song_s[-1], 1))
        motion: Float = cubic(inside) + slope * (time_s - inside)
        return motion


def clock(steps: Choreography) -> Clock:
    """Make the clock of a choreography of at least one step.

    Parameters
    ----------
    steps : Choreography of S steps

    Returns
    -------
    Clock of S + 1 boundaries

    Raises
    ------
    ValueError
        If there is no step.
    """
    if not len(steps.clip_id):
        raise ValueError("steps: want at least one, got none")
    song_s = np.append(steps.song_start_s, steps.song_end_s[-1])
    return Clock(song_s, np.append(0.0, np.cumsum(steps.clip_end_s - steps.clip_start_s)))


def trim(steps: Choreography, duration_s: float) -> tuple[Choreography, NDArray[np.int64]]:
    """Cut a choreography to the song: from its first sample to ``duration_s``.

    Parameters
    ----------
    steps : Choreography
        Starts at or before 0 and ends at or after ``duration_s``.
    duration_s : float, seconds, > 0

    Returns
    -------
    Choreography
        Steps wholly outside are gone; the first and last are cut in song and clip alike, their warp kept.
    (S',) int64
        Which steps remained.
    """
    kept = np.flatnonzero((steps.song_end_s > 1e-9) & (steps.song_start_s < duration_s - 1e-9))
    start, end = steps.song_start_s[kept], steps.song_end_s[kept]
    clip_start, clip_end = steps.clip_start_s[kept], steps.clip_end_s[kept]
    pace = (clip_end - clip_start) / (end - start)
    cut_start, cut_end = np.maximum(start, 0.0), np.minimum(end, duration_s)
    has_seam = steps.has_seam[kept].copy()
    blend_s = steps.blend_s[kept].copy()
    if len(kept):
        has_seam[0], blend_s[0] = False, 0.0
    return (
        Choreography(
            tuple(steps.clip_id[i] for i in kept),
            cut_start,
            cut_end,
            clip_start + pace * (cut_start - start),
            clip_end - pace * (end - cut_end),
            has_seam,
            blend_s,
        ),
        kept,
    )


def blend_widths(song_start_s: Float, song_end_s: Float, has_seam: NDArray[np.bool_], *, wanted_s: float) -> Float:
    """Width of the blend at each step's start: as wanted, but no two blends may overlap.

    Parameters
    ----------
    song_start_s, song_end_s : (S,) float, seconds
    has_seam : (S,) bool
    wanted_s : float, seconds, >= 0

    Returns
    -------
    (S,) float64, seconds
        0 without a seam. Half a blend never reaches past the middle of a step with a seam at both ends, nor past the
        whole of a step with one.
    """
    length = song_end_s - song_start_s
    before = np.append(np.inf, length[:-1] / np.where(has_seam[:-1], 1.0, 0.5))
    after = length / np.where(np.append(has_seam[1:], False), 1.0, 0.5)
    return np.where(has_seam, np.minimum(wanted_s, np.minimum(before, after)), 0.0)
