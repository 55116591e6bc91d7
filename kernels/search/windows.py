"""Long clips are searched by window: a hit is a clip and a time range."""

from __future__ import annotations

import numpy as np

from kernels.types import Float

WINDOW_S = 4.0
"""Chosen by hand."""

LONGEST_WHOLE_S = 8.0
"""Tuned on eight take-disjoint splits of real clips, with what is described of a clip
(`kernels/search/describe.py`)."""


def windows(duration_s: float, *, window_s: float = WINDOW_S, longest_whole_s: float = LONGEST_WHOLE_S) -> Float:
    """Cut a clip into windows that overlap by half.

    Parameters
    ----------
    duration_s : float, seconds, >= 0
    window_s : float, seconds, > 0
    longest_whole_s : float, seconds
        A clip no longer than this is one window.

    Returns
    -------
    (W, 2) float64, seconds, start and end of each, W >= 1
        Evenly spread, the first from the clip's start, the last to its end. ``[[0, 0]]`` for a clip of one frame.

    Raises
    ------
    ValueError
        If a length is out of range.
    """
    if not (duration_s >= 0 and window_s > 0 and longest_whole_s >= window_s):
        raise ValueError(
            f"windows: want duration >= 0 and longest_whole_s >= window_s > 0, got {duration_s}, {longest_whole_s}, "
            f"{window_s}"
        )
    if duration_s <= longest_whole_s:
        return np.array([[0.0, duration_s]])
    n = int(np.ceil((duration_s - window_s) / (window_s / 2))) + 1
    start = np.linspace(0.0, duration_s - window_s, n)
    return np.stack([start, start + window_s], axis=1)
