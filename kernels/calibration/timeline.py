"""When the samples of a tracker were taken, and what it would have said at even times.

A tracker samples at an even rate; the computer that writes them down is told late, now and then many at once. Times
that crowd together are therefore times of arrival: the samples are counted, and the earliest arrivals tell the rate and
which samples were lost. Times that only waver are taken at their word, and the stream is interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels import rotation
from kernels.types import Float, Int

_COMMON_HZ = (20, 24, 25, 30, 40, 48, 50, 60, 75, 80, 90, 100, 120, 144, 150, 160, 180, 200, 240)
"""Rates that trackers, cameras and screens have, by convention."""

_LONGEST_PAUSE_S = 5.0
"""Chosen by hand: what is further apart is two takes."""

_LEAST_STEP_S = 0.001
_MOST_STEP_S = 0.2
"""Steps of a recording of a body. Chosen by hand: 5 to 1000 frames a second."""

_FINER = {"milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9}
"""In seconds, by definition."""

_ON_GRID = 0.25
_BURST = 0.25
"""Share of a step: times this near to the grid are on it; steps this short are a burst. Chosen by hand."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """How the samples of a stream lie on an even grid.

    Parameters
    ----------
    rate_hz : float, > 0
    kind : "even", "burst" or "uneven"
    place : (F,) int64, rising, from 0
        Place of each sample on the grid; for uneven streams the nearest.
    n_places : int
        Length of the grid.
    """

    rate_hz: float
    kind: str
    place: Int
    n_places: int

    @property
    def n_lost(self) -> int:
        """Places no sample is for."""
        return self.n_places - len(np.unique(self.place))


def timeline(time_s: Float) -> Timeline:
    """Find the even grid behind the times of a stream.

    Parameters
    ----------
    time_s : (F,) float, seconds, rising; equal neighbours are allowed

    Returns
    -------
    Timeline

    Raises
    ------
    ValueError
        If there are fewer than two samples, times fall or do not advance, or the stream pauses for more than five
        seconds.
    """
    time_s = np.asarray(time_s, np.float64) - (time_s[0] if len(time_s) else 0.0)
    if len(time_s) < 2 or not time_s[-1] > 0:
        raise ValueError(f"time_s: want at least two samples at different times, got {len(time_s)}")
    step = np.diff(time_s)
    if (step < 0).any():
        at = int(np.flatnonzero(step < 0)[0]) + 1
        raise ValueError(f"time_s: want rising times, got {time_s[at]:g} after {time_s[at - 1]:g} at sample {at}")
    usual_s = float(np.median(step))
    unit = next((name for name, scale in _FINER.items() if _LEAST_STEP_S <= usual_s * scale <= _MOST_STEP_S), None)
    if usual_s > _MOST_STEP_S and unit:
        raise ValueError(
            f"time_s: want seconds, got steps of {usual_s:g}; they look like {unit}: name the column so, as time_ms"
        )
    if step.max() > _LONGEST_PAUSE_S:
        at = int(step.argmax())
        raise ValueError(
            f"time_s: want one take, got a pause of {step[at]:.1f} s after {time_s[at]:.1f} s; cut the recording there"
        )
    mean_s = time_s[-1] / (len(time_s) - 1)
    if np.mean(step < _BURST * mean_s) > 0.02:
        return _from_arrivals(time_s)
    period_s = float(np.median(step))
    place = np.append(0, np.cumsum(np.maximum(np.rint(step / period_s), 0))).astype(np.int64)
    slope_s, start_s = np.polyfit(place, time_s, 1) if place[-1] else (period_s, 0.0)
    is_even = (np.diff(place) > 0).all() and np.abs(time_s - start_s - slope_s * place).max() < _ON_GRID * slope_s
    if is_even:
        return Timeline(_clean_hz(1 / slope_s, 0.005), "even", place, int(place[-1]) + 1)
    rate_hz = _clean_hz(1 / mean_s, 0.02)
    nearest = np.rint(time_s * rate_hz).astype(np.int64)
    return Timeline(rate_hz, "uneven", nearest, int(np.floor(time_s[-1] * rate_hz + 1e-6)) + 1)


def _clean_hz(rate_hz: float, tolerance: float) -> float:
    near = min(_COMMON_HZ, key=lambda hz: abs(hz - rate_hz))
    return float(near) if abs(near - rate_hz) <= tolerance * near else float(np.round(rate_hz, 4))


def _from_arrivals(time_s: Float) -> Timeline:
    """Count samples; where even the earliest arrivals come a whole step later than before, samples were lost."""
    n = len(time_s)
    long_step = np.diff(time_s)
    rate_hz = _clean_hz((n - 1) / time_s[-1], 0.02)
    if rate_hz not in _COMMON_HZ:
        rate_hz = _clean_hz(1 / float(np.median(long_step[long_step > _BURST / rate_hz])), 0.02)
    delay_s = time_s - np.arange(n) / rate_hz
    least_s = np.minimum.accumulate(delay_s[::-1])[::-1]
    lost = np.maximum(np.floor((least_s - least_s[0]) * rate_hz + 0.3), 0).astype(np.int64)
    place = np.arange(n) + lost
    return Timeline(rate_hz, "burst", place, int(place[-1]) + 1)


def onto_grid(
    line: Timeline, time_s: Float, position_xyz_m: Float, rotation_wxyz: Float, is_valid: NDArray[np.bool_]
) -> tuple[Float, Float, NDArray[np.bool_]]:
    """Bring a stream of S sensors onto its even grid.

    Parameters
    ----------
    line : from :func:`timeline`
    time_s : (F,) float, seconds
    position_xyz_m, rotation_wxyz, is_valid : (F, S, 3), (F, S, 4), (F, S)

    Returns
    -------
    (G, S, 3), (G, S, 4), (G, S)
        NaN and not valid at places no sample is for. Uneven streams are interpolated between valid neighbours no more
        than two and a half steps apart, rotations along the shortest arc; others are only put in their places.
    """
    g, s = line.n_places, is_valid.shape[1]
    position, turned = np.full((g, s, 3), np.nan), np.full((g, s, 4), np.nan)
    valid = np.zeros((g, s), bool)
    if line.kind != "uneven":
        position[line.place], turned[line.place], valid[line.place] = position_xyz_m, rotation_wxyz, is_valid
        return position, turned, valid
    time_s = np.asarray(time_s, np.float64) - time_s[0]
    at_s = np.arange(g) / line.rate_hz
    for k in range(s):
        known = np.flatnonzero(is_valid[:, k])
        if len(known) < 2:
            continue
        right = np.clip(np.searchsorted(time_s[known], at_s, side="left"), 1, len(known) - 1)
        a, b = known[right - 1], known[right]
        width_s = time_s[b] - time_s[a]
        share = np.clip((at_s - time_s[a]) / np.where(width_s > 0, width_s, 1.0), 0.0, 1.0)
        near_s = np.minimum(np.abs(at_s - time_s[a]), np.abs(at_s - time_s[b]))
        is_near = (width_s <= 2.5 / line.rate_hz) | (near_s <= 0.01 / line.rate_hz)
        is_near &= (at_s >= time_s[known[0]] - 0.5 / line.rate_hz) & (at_s <= time_s[known[-1]] + 0.5 / line.rate_hz)
        valid[:, k] = is_near
        mixed = (1 - share)[:, None] * position_xyz_m[a, k] + share[:, None] * position_xyz_m[b, k]
        position[is_near, k] = mixed[is_near]
        turned[is_near, k] = rotation.slerp(rotation_wxyz[a, k], rotation_wxyz[b, k], share)[is_near]
    return position, turned, valid


@dataclass(frozen=True, eq=False)
class Collapsed:
    """Rows that repeat what was said, brought down to one a sample.

    Parameters
    ----------
    row : (F,) int64
        Last row of each sample.
    arrived_row : (F,) int64
        First row of each sample: its time is the time of arrival.
    is_new : (F, S) bool
        Whether a sensor said something new in the sample.
    """

    row: Int
    arrived_row: Int
    is_new: NDArray[np.bool_]


def collapse(time_s: Float, values: Float) -> Collapsed:
    """Find the samples of a tracker that writes a row whenever one of its sensors was heard, or none.

    Parameters
    ----------
    time_s : (N,) float, seconds, rising
    values : (N, S, C) float
        What each sensor says in each row; NaN for nothing.

    Returns
    -------
    Collapsed
        A sample begins where the sensor that opens a round says something new: of those heard most often, the one
        that the longest waits precede; and, while that one is not heard, where another speaks a second time. A sensor
        that hardly ever changes counts as heard.
    """
    same = (values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1]))
    is_new = np.concatenate([np.ones((1, values.shape[1]), bool), ~same.all(axis=-1)])
    count = is_new.sum(axis=0)
    wait_s = np.diff(time_s, prepend=time_s[0])
    often = np.flatnonzero(count >= 0.95 * count.max() - 1)
    opener = often[np.argmax([np.median(wait_s[is_new[:, s]]) for s in often])]
    first = _rounds(is_new, opener)
    heard = np.add.reduceat(is_new, first, axis=0) > 0
    heard[:, count < 0.5 * len(first)] = True
    return Collapsed(np.append(first[1:], len(time_s)) - 1, first, heard)


def _rounds(is_new: NDArray[np.bool_], opener: int) -> Int:
    """First rows of the rounds in which every sensor speaks once."""
    first = np.flatnonzero(is_new[:, opener])
    spoken = is_new.copy()
    spoken[0] = False  # what stands in the first row may be a word of the round before
    often = np.add.reduceat(spoken, first, axis=0, dtype=np.int64).max(axis=1) > 1
    more: list[int] = []
    end = np.append(first[1:], len(is_new))
    for start, stop in zip(first[often].tolist(), end[often].tolist(), strict=True):
        heard = spoken[start].copy()
        for row in range(start + 1, stop):
            if (spoken[row] & heard).any():
                more.append(row)
                heard = spoken[row].copy()
            else:
                heard |= spoken[row]
    return np.sort(np.concatenate([first, np.array(more, np.int64)]))
