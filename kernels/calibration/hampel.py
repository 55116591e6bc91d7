"""Entries that stand out from the frames around them: Hampel's rule [Hampel1974] about a running median of nine.

Conventions
-----------
Series are (F, S, C): frames, sensors, components; every function works on all sensors at once. An entry is one sensor
at one frame.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels.calibration.gaps import aligned, fill
from kernels.calibration.records import Bools
from kernels.types import Float

_LEAST_M = 0.015
_LEAST_QUATERNION = 0.05
"""Departures that are never outliers; of the quaternion the length of the difference. Chosen by hand above the noise of
suits, far below the 150 mm and 20 degrees of made-up outliers."""

_TURN_M_PER_S2 = 30.0
_TURN_RAD_PER_S2 = 100.0
"""What a limb does at a fast turn. Chosen by hand for hands that move at 3 Hz, on made-up recordings."""

_MOST_BAD = 5
"""Of the eight entries around one. Chosen as the majority."""

# Exchanges of a network after which the fifth of nine is their median [Devillard1998].
_NETWORK = "12 45 78 01 34 67 12 45 78 03 58 47 36 14 25 47 42 64 42"  # pairs of places, smaller to the first


def running_median(series: Float, *, stride: int = 1) -> Float:
    """Median of nine samples around each along the first axis, the ends repeated.

    Parameters
    ----------
    series : (F, ...) float
    stride : int, >= 1
        Samples from one to the next of the nine.

    Returns
    -------
    (F, ...) float64
    """
    if len(series) == 0:
        return series.copy()
    reach = 4 * stride
    padded = np.concatenate([np.repeat(series[:1], reach, axis=0), series, np.repeat(series[-1:], reach, axis=0)])
    tap = [padded[k * stride : k * stride + len(series)] for k in range(9)]
    for pair in _NETWORK.split():
        a, b = int(pair[0]), int(pair[1])
        tap[a], tap[b] = np.minimum(tap[a], tap[b]), np.maximum(tap[a], tap[b])
    return tap[4]


def find_outliers(
    position_xyz_m: Float, rotation_wxyz: Float, is_usable: Bools, *, frame_rate_hz: float, rounds: int = 3
) -> Bools:
    """Mark entries that stand out from the frames around them.

    Parameters
    ----------
    position_xyz_m : (F, S, 3) float, metres
    rotation_wxyz : (F, S, 4) float, unit
    is_usable : (F, S) bool
    frame_rate_hz : float, > 0
    rounds : int, >= 1
        What is marked is filled and the rest looked at again: bursts fall from their ends.

    Returns
    -------
    (F, S) bool
        A part of ``is_usable``.

    Notes
    -----
    Hampel's rule: an entry is an outlier where it lies further from the median of nine frames than six times what the
    sensor usually does, and than five times what it does within 20 frames, so that fast turns are not taken for
    outliers; but never within 15 mm, or 0.05 in the quaternion,
    nor within what 30 m/s² and 100 rad/s² do in two frames. The first and last four frames are held against a line
    through the medians next to them, four times as loosely: an outlier at an end must not vouch for
    itself. Nor must one that stands alone among bad ones, over which lines would be drawn from it: where five of the
    eight around an entry are bad, it is one too.
    """
    is_outlier = np.zeros_like(is_usable)
    # at a turn the median of nine lies as far off as the body gets in two frames
    turn_s2 = (2.0 / frame_rate_hz) ** 2
    least_m = max(_LEAST_M, _TURN_M_PER_S2 * turn_s2 / 2)
    least_q = max(_LEAST_QUATERNION, _TURN_RAD_PER_S2 * turn_s2 / 4)
    for _ in range(rounds):
        is_good = is_usable & ~is_outlier
        found = np.zeros_like(is_usable)
        for series, floor in ((position_xyz_m, least_m), (aligned(rotation_wxyz, is_good), least_q)):
            away = np.sqrt(np.sum((series - _expected(fill(series, is_good))) ** 2, axis=-1))
            usual = median_where(away, is_good)
            near = _nearby(np.where(is_good, away, usual))
            least = np.full((len(away), 1), floor)
            least[:4], least[-4:] = 4 * floor, 4 * floor
            found |= away > np.maximum(least, np.maximum(6.0 * usual, 5.0 * near))
        found &= is_good
        found |= is_good & (_around(~is_good | found) >= _MOST_BAD)
        if not found.any():
            break
        is_outlier |= found
    return is_outlier


def _expected(series: Float) -> Float:
    """Take the running median (F, S, C), drawn on in a line over the first and last four frames."""
    middle = running_median(series)
    if len(series) < 18:
        return middle
    step = np.arange(1, 5)[:, None, None]
    middle[3::-1] = middle[4] - step * (middle[8] - middle[4]) / 4.0
    middle[-4:] = middle[-5] + step * (middle[-5] - middle[-9]) / 4.0
    return middle


def _around(is_bad: Bools) -> NDArray[np.int64]:
    """Count the bad ones (F, S) within four frames of each entry."""
    total = np.concatenate([np.zeros((5, is_bad.shape[1]), np.int64), np.cumsum(is_bad, axis=0)])
    last = total[np.minimum(np.arange(len(is_bad)) + 9, len(total) - 1)]
    count: NDArray[np.int64] = last - total[: len(is_bad)]
    return count


def _nearby(away: Float) -> Float:
    """Median (F, S) over nine samples within 20 frames; at the ends that of frame 20."""
    near = running_median(away, stride=5)
    if len(away) > 40:
        near[:20], near[-20:] = near[20], near[-21]
    return near


def median_where(values: Float, is_good: Bools) -> Float:
    """Take the median of each column over its good rows.

    Parameters
    ----------
    values : (F, S) float
    is_good : (F, S) bool

    Returns
    -------
    (S,) float64
        0 where no row is good.
    """
    return np.array(
        [np.median(values[is_good[:, s], s]) if is_good[:, s].any() else 0.0 for s in range(values.shape[1])]
    )
