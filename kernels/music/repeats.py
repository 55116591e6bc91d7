"""Where a song comes back to what it played before: a chorus again, a verse again.

Stripes of likeness along the diagonals of the song's self-similarity [Foote1999], on beats, the longest and clearest
first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.types import Float

LEAST_BEATS = 16
"""Shorter likeness is a loop or a riff, not a part of the song. Chosen by hand: four bars of four."""

SMOOTHED_BEATS = 8
"""Chosen by hand: two bars of four."""

ALIKE = 0.65
"""Mean likeness from which music is the same again. Chosen above 0.3 to 0.55, measured on real songs as what one
stretch in a hundred, taken at random, has by chance."""

MONOTONE = 0.97
"""Likeness of neighbouring beats from which nothing happens: silence and held notes repeat nothing. Chosen by hand."""


@dataclass(frozen=True)
class Repeat:
    """A stretch that plays an earlier one again.

    Parameters
    ----------
    first, last : int, beat intervals first <= k < last of the later stretch
    source : int, beat interval where the earlier one begins
    likeness : float, mean likeness, at most 1
    """

    first: int
    last: int
    source: int
    likeness: float


def find_repeats(feature: Float, *, least_beats: int = LEAST_BEATS, alike: float = ALIKE) -> list[Repeat]:
    """Find the stretches that play earlier ones again.

    Parameters
    ----------
    feature : (K, D) float, what is heard in each beat interval, :func:`kernels.music.segments.beat_features`
    least_beats : int, >= 1
    alike : float, 0 to 1, mean likeness over eight beats from which music is the same

    Returns
    -------
    list of Repeat, by first beat
        No interval repeats two others, and none repeats what is a repeat itself. Empty where nothing comes again, and
        for a song of fewer than twice the least beats.

    Raises
    ------
    ValueError
        If a shape or a limit does not fit, or a value is not finite.
    """
    if feature.ndim != 2 or not np.isfinite(feature).all():
        raise ValueError(f"feature: want finite (K, D), got {feature.shape}")
    if least_beats < 1 or not 0 < alike <= 1:
        raise ValueError(f"least_beats, alike: want >= 1 and 0 to 1, got {least_beats} and {alike}")
    n = len(feature)
    size = np.linalg.norm(feature, axis=1, keepdims=True)
    unit = np.where(size > 1e-9, feature / np.maximum(size, 1e-9), 0.0)
    likeness = np.einsum("id,jd->ij", unit, unit)
    moves = np.append(np.diagonal(likeness, 1) < MONOTONE, n > 0)
    found: list[Repeat] = []
    for lag in range(least_beats, n - least_beats + 1):
        found += _stripes(np.diagonal(likeness, -lag), moves[: n - lag], lag, least_beats, alike)
    taken, used = np.zeros(n, bool), np.zeros(n, bool)
    kept = []
    # Of about equally long ones the earliest source, so that the third chorus repeats the first as the second does.
    for r in sorted(found, key=lambda r: (-round((r.last - r.first) * r.likeness / SMOOTHED_BEATS), r.source, r.first)):
        later, earlier = slice(r.first, r.last), slice(r.source, r.source + r.last - r.first)
        if not (taken[later].any() or used[later].any() or taken[earlier].any()):
            taken[later], used[earlier] = True, True
            kept.append(r)
    return sorted(kept, key=lambda r: r.first)


def _stripes(likeness: Float, moves: NDArray[np.bool_], lag: int, least_beats: int, alike: float) -> list[Repeat]:
    """Find the long runs of likeness at one lag; runs longer than the lag are cut to it."""
    width = min(SMOOTHED_BEATS, len(likeness))
    mean = np.convolve(likeness, np.full(width, 1.0 / width), "valid")
    lively = np.convolve(moves, np.full(width, 1.0 / width), "valid") >= 0.5
    edge = np.diff(np.concatenate([[0], ((mean >= alike) & lively).astype(np.int8), [0]]))
    found = []
    for a, b in zip(np.flatnonzero(edge == 1).tolist(), np.flatnonzero(edge == -1).tolist(), strict=True):
        alone = np.flatnonzero(likeness[a : b + width - 1] >= alike) + a
        first, end = int(alone[0]), min(int(alone[-1]) + 1, int(alone[0]) + lag)
        if end - first >= least_beats:
            found.append(Repeat(first + lag, end + lag, first, float(likeness[first:end].mean())))
    return found
