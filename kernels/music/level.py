"""What a person may ask of beats that were found: another metrical level, another phase."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels.types import BeatGrid

Float = NDArray[np.float64]

LARGEST_FACTOR = 8
"""Chosen by hand: three octaves."""


def change_level(grid: BeatGrid, factor: float) -> BeatGrid:
    """Count faster or slower.

    Parameters
    ----------
    grid : BeatGrid
    factor : float
        On the tempo: a whole number up to 8, or one over it. 2 puts a beat between each two; 0.5 keeps every second.

    Returns
    -------
    BeatGrid
        New beats lie evenly between the old ones, with the lower confidence of the two. Of the ways to leave beats
        out, the one that keeps the downbeats is taken; where bars are unknown, the one that keeps most confidence
        (the earliest of equals). Bars stay where their beats divide; where they do not, places in the bar become 0.

    Raises
    ------
    ValueError
        If the factor is not of that kind.
    """
    whole = round(factor) if factor >= 1 else round(1.0 / factor) if factor > 0 else 0
    if not (1 <= whole <= LARGEST_FACTOR and abs((factor if factor >= 1 else 1.0 / factor) - whole) < 1e-6):
        raise ValueError(
            f"factor: want 1 to {LARGEST_FACTOR} or one over it, got {factor}; count twice or half as fast"
        )
    if whole == 1 or len(grid.time_s) == 0:
        return grid
    return _faster(grid, whole) if factor > 1 else _slower(grid, whole)


def nudge(grid: BeatGrid, *, beats: float = 0.0, seconds: float = 0.0) -> BeatGrid:
    """Move all beats.

    Parameters
    ----------
    grid : BeatGrid
    beats : float
        In beats, along the tempo of each place: 0.5 moves to the off-beats, negative is earlier.
    seconds : float
        Added afterwards.

    Returns
    -------
    BeatGrid
        Without the beats that would lie before the song. Past the ends the first and the last interval go on; a
        single beat has no interval and moves by seconds alone. Bars move along.

    Raises
    ------
    ValueError
        If a shift is not finite.
    """
    if not (np.isfinite(beats) and np.isfinite(seconds)):
        raise ValueError(f"beats, seconds: want finite shifts, got {beats} and {seconds}")
    time_s = grid.time_s
    n = len(time_s)
    if n > 1 and beats:
        place = np.arange(n) + beats
        before = time_s[0] + place * (time_s[1] - time_s[0])
        after = time_s[-1] + (place - (n - 1)) * (time_s[-1] - time_s[-2])
        inside = np.interp(place, np.arange(n), time_s)
        time_s = np.where(place < 0, before, np.where(place > n - 1, after, inside))
    time_s = time_s + seconds
    kept = time_s >= 0
    return BeatGrid(
        time_s=time_s[kept],
        bar_number=grid.bar_number[kept],
        beat_in_bar_number=grid.beat_in_bar_number[kept],
        confidence=grid.confidence[kept],
    )


def _faster(grid: BeatGrid, whole: int) -> BeatGrid:
    n = len(grid.time_s)
    place = np.arange((n - 1) * whole + 1)
    left, part = place // whole, place % whole
    right = np.minimum(left + 1, n - 1)
    number = grid.beat_in_bar_number[left]
    return BeatGrid(
        time_s=np.interp(place / whole, np.arange(n), grid.time_s),
        bar_number=grid.bar_number[left],
        beat_in_bar_number=np.where(number > 0, (number - 1) * whole + part + 1, 0),
        confidence=np.where(
            part == 0, grid.confidence[left], np.minimum(grid.confidence[left], grid.confidence[right])
        ),
    )


def _slower(grid: BeatGrid, whole: int) -> BeatGrid:
    number = grid.beat_in_bar_number
    downbeats = np.flatnonzero(number == 1)
    if len(downbeats):
        phase = int(np.bincount(downbeats % whole, minlength=whole).argmax())
    else:
        phase = int(np.argmax([grid.confidence[i::whole].sum() for i in range(min(whole, len(number)))]))
    kept = np.arange(phase, len(number), whole)
    divides = bool((number[kept] > 0).all() and ((number[kept] - 1) % whole == 0).all())
    return BeatGrid(
        time_s=grid.time_s[kept],
        bar_number=grid.bar_number[kept] if divides else np.zeros(len(kept), np.int64),
        beat_in_bar_number=(number[kept] - 1) // whole + 1 if divides else np.zeros(len(kept), np.int64),
        confidence=grid.confidence[kept],
    )
