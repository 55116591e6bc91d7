"""How long basic motions last, and which lengths a song's beats leave them.

A motion is danced from one point of the grid to another, faster or slower than it was recorded by at most the warp
bounds, so that it ends on a beat. How probable a length is, is told by the lengths of the motions themselves.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kernels.types import Float

LEAST_WARP, MOST_WARP = 0.8, 1.25
"""Song time over clip time of a motion: never outside."""

WIDTH = 0.05
"""Standard deviation of the bump that each motion's length makes, in natural log: five per cent."""

MOST_PARTS = 4


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
        A span of d intervals gets the sum of a bump round each motion's length; over d they sum to 1. -inf where no
        motion reaches within the warp bounds, for a whole state where none does.
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
        known, n_each = np.unique(np.round(np.log(lengths), 3), return_counts=True)
        off = fine[:, None] - known[None]
        within = (off >= np.log(LEAST_WARP)) & (off <= np.log(MOST_WARP))
        curve = (np.exp(-0.5 * (off / WIDTH) ** 2) * within) @ (n_each / n_each.sum())
        found = np.interp(log_span, fine, curve)
        total = found.sum(axis=1, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            out[:, :, i] = np.where(found > 0, np.log(found / total), -np.inf)
    return out
