"""How long basic motions last, and which lengths a song's beats leave them.

A motion is danced from one point of the grid to another, faster or slower than it was recorded by at most the warp
bounds, so that it ends on a beat. How probable a length is, is told by the lengths of the motions themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.types import Float, Int
from kernels.warp import EASY_WARP, HARD_WARP

LEAST_WARP, MOST_WARP = HARD_WARP
"""Song time over clip time of a motion: never outside."""

HARD_LOG = -6.0
"""Beyond the easy bounds a motion counts so much less, natural log: danced only where nothing else fits. Chosen by
hand."""

WIDTH = 0.05
"""Standard deviation of the bump that each motion's length makes, in natural log: five per cent. Chosen by hand, half
of the easy bounds."""

MOST_PARTS = 4
"""Parts of a beat: motions are no shorter than a sixteenth note. Chosen by hand."""

LONGEST_SPAN = 8
"""Parts of beats that a motion may last. Chosen for time, by hand."""


def parts_per_beat(beat_interval_s: float, motion_s: Float) -> int:
    """Into how many parts a beat is cut, so that a motion of usual length lasts about one of them.

    Parameters
    ----------
    beat_interval_s : float, seconds, > 0
    motion_s : (n,) float, seconds, lengths of motions

    Returns
    -------
    int, 1 to 4: the beat over the median length, rounded; 1 where there is no motion
    """
    if not len(motion_s):
        return 1
    return int(np.clip(round(beat_interval_s / float(np.median(motion_s))), 1, MOST_PARTS))


def subdivide(grid_s: Float, parts: int) -> Float:
    """Cut every interval of a grid evenly into parts, (K + 1,) to (K * parts + 1,) float64, seconds."""
    even = np.arange(len(grid_s) - 1)[:, None] + np.arange(parts)[None] / parts
    return np.append(np.interp(even.reshape(-1), np.arange(len(grid_s)), grid_s), grid_s[-1])


@dataclass(frozen=True, eq=False)
class MotionGrid:
    """The points of a song between which motions are danced.

    Parameters
    ----------
    point_s : (G + D,) float64, seconds: the G + 1 ends of intervals that motions take, and D - 1 beyond
    parts : int, >= 1, intervals to a beat
    longest : int, D >= 1, most intervals that a motion takes
    """

    point_s: Float
    parts: int
    longest: int

    @property
    def inner_s(self) -> Float:
        """Ends of the intervals within the song, (G + 1,) float64, seconds."""
        return self.point_s[: len(self.point_s) - self.longest + 1]

    @property
    def is_beat(self) -> NDArray[np.bool_]:
        """Whether each point is a beat, (G + D,) bool."""
        return np.asarray(np.arange(len(self.point_s)) % self.parts == 0)

    @property
    def beat_interval_s(self) -> float:
        """Median length of an interval times the parts of a beat, seconds."""
        return float(np.median(np.diff(self.point_s))) * self.parts


def motion_grid(beat_s: Float, motion_s: Float) -> MotionGrid:
    """Cut the beats of a song as finely as motions are short.

    Parameters
    ----------
    beat_s : (K + 1,) float, seconds, increasing, K >= 1
    motion_s : (n,) float, seconds, > 0, lengths of motions, n >= 1

    Returns
    -------
    MotionGrid
        Of the parts of :func:`parts_per_beat`. D is what the longest motion takes of parts of median length at its
        slowest, 1 to :data:`LONGEST_SPAN`; beyond the song the grid goes on in steps of that length.
    """
    parts = parts_per_beat(float(np.median(np.diff(beat_s))), motion_s)
    inner_s = subdivide(beat_s, parts)
    step_s = float(np.median(np.diff(inner_s)))
    longest = int(np.clip(np.floor(motion_s.max() * MOST_WARP / step_s), 1, LONGEST_SPAN))
    return MotionGrid(np.append(inner_s, inner_s[-1] + step_s * (1 + np.arange(longest - 1))), parts, longest)


def log_durations(grid_s: Float, motion_s: Sequence[Float], *, longest: int) -> Float:
    """Log probabilities of spans by how long motions of each state last.

    Parameters
    ----------
    grid_s : (K + L + 1,) float, seconds, increasing
        The grid, and L further points that the last spans may reach; L >= longest - 1.
    motion_s : (N,) arrays of lengths of the motions of each state, seconds, > 0
    longest : int, >= 1, D

    Returns
    -------
    (K, D, N) float64
        A span of d intervals gets the sum of a bump round each motion's length, as a share of all lengths there are
        or, where none of them suits the state, of the length that would suit it best: over d they sum to at most 1, and
        a state is passed over where the beats leave it no good length. -inf where no motion reaches within the bounds.
    """
    n_intervals = len(grid_s) - longest
    step = np.arange(longest) + 1
    log_span = np.log(grid_s[np.arange(n_intervals)[:, None] + step[None]] - grid_s[:n_intervals, None])
    out = np.full((n_intervals, longest, len(motion_s)), -np.inf)
    # On a fine scale of log lengths each state's curve is made once, then read off.
    fine = np.linspace(log_span.min() - 0.01, log_span.max() + 0.01, 2048)
    for i, lengths in enumerate(motion_s):
        if not len(lengths):
            continue
        known, n_each = np.unique(np.round(np.log(lengths).astype(np.float64), 3), return_counts=True)
        off = fine[:, None] - known[None]
        within = (off >= np.log(LEAST_WARP)) & (off <= np.log(MOST_WARP))
        easy = (off >= np.log(EASY_WARP[0])) & (off <= np.log(EASY_WARP[1]))
        bump = np.exp(-0.5 * (off / WIDTH) ** 2) * np.where(easy, 1.0, np.exp(HARD_LOG)) * within
        curve = bump @ (n_each / n_each.sum())
        found = np.interp(log_span, fine, curve)
        suited = np.maximum(found.sum(axis=1, keepdims=True), _best(np.asarray(known, np.float64), n_each))
        with np.errstate(divide="ignore"):
            out[:, :, i] = np.where(found > 0, np.log(found / suited), -np.inf)
    return out


def _best(log_length: Float, n_each: Int) -> float:
    """Height of the curve at the length that suits best."""
    off = log_length[:, None] - log_length[None]
    near = np.exp(-0.5 * (off / WIDTH) ** 2) * (np.abs(off) <= np.log(EASY_WARP[1]))
    return float((near @ (n_each / n_each.sum())).max())
