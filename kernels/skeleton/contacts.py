"""When the feet stand on the floor, where the floor is, and how far planted feet slide.

Conventions
-----------
Feet are given by ankles and toes, (F, 2, 3) each, left first. A foot is on the floor when its ankle or its toes are.
Everything is in seconds and metres, so that the frame rate does not matter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.types import Float

Bool = NDArray[np.bool_]


@dataclass(frozen=True)
class ContactThresholds:
    """What counts as standing.

    A stretch of frames in which a point keeps below the loose limits is a contact if it gets below the tight ones.

    Parameters
    ----------
    tight_height_m, loose_height_m : float, metres above the height at which the point is when planted
    tight_speed_m_per_s, loose_speed_m_per_s : float
        Of the point in all three directions.
    smallest_s : float, seconds
        Shorter contacts are dropped.
    widest_gap_s : float, seconds
        Shorter gaps are closed.
    window_s : float, seconds
        Half of the span over which height and speed are taken.
    """

    tight_height_m: float = 0.03
    loose_height_m: float = 0.05
    tight_speed_m_per_s: float = 0.20
    loose_speed_m_per_s: float = 0.45
    smallest_s: float = 0.08
    widest_gap_s: float = 0.05
    window_s: float = 0.04


@dataclass(frozen=True, eq=False)
class FootContacts:
    """Contacts of both feet with the floor.

    Parameters
    ----------
    ankle, toes : (F, 2) bool
    floor_m : float, metres
        Height of the floor, under the soles.
    ankle_height_m, toes_height_m : float, metres
        Height of a planted ankle and of planted toes, in the world.
    """

    ankle: Bool
    toes: Bool
    floor_m: float
    ankle_height_m: float
    toes_height_m: float

    @property
    def foot(self) -> Bool:
        """Whether each foot is on the floor, (F, 2) bool."""
        return self.ankle | self.toes


def find_contacts(
    ankle_xyz_m: Float,
    toes_xyz_m: Float,
    *,
    frame_rate_hz: float,
    planted_height_m: tuple[float, float] | None = None,
    thresholds: ContactThresholds | None = None,
) -> FootContacts:
    """Find when ankles and toes stand still at their planted heights.

    Parameters
    ----------
    ankle_xyz_m, toes_xyz_m : (F, 2, 3) float, metres, world, Y up
        Left foot, right foot.
    frame_rate_hz : float, > 0
    planted_height_m : heights of a planted ankle and of planted toes where they are known
        Else estimated, see :func:`planted_heights`.
    thresholds : ContactThresholds, or None for the defaults

    Returns
    -------
    FootContacts
        Nothing in contact where F is 0. One frame is judged by height alone.

    Raises
    ------
    ValueError
        If shapes are not (F, 2, 3), a value is not finite, or the rate is not > 0.
    """
    _check_feet(ankle_xyz_m, toes_xyz_m, frame_rate_hz)
    limits = thresholds or ContactThresholds()
    if len(ankle_xyz_m) == 0:
        none = np.zeros((0, 2), bool)
        return FootContacts(none, none.copy(), 0.0, 0.0, 0.0)
    if planted_height_m is None:
        planted_height_m = planted_heights(ankle_xyz_m, toes_xyz_m, frame_rate_hz=frame_rate_hz)
    found = [
        _standing(point, height, frame_rate_hz, limits)
        for point, height in zip((ankle_xyz_m, toes_xyz_m), planted_height_m, strict=True)
    ]
    return FootContacts(found[0], found[1], min(planted_height_m), *planted_height_m)


def foot_contacts(foot_xyz_m: Float, frame_rate_hz: float) -> Bool:
    """Find when each foot is on the floor: :func:`find_contacts` with its defaults, in one array.

    Parameters
    ----------
    foot_xyz_m : (F, 4, 3) float, metres, world, Y up
        Left ankle, left toes, right ankle, right toes.
    frame_rate_hz : float, > 0

    Returns
    -------
    (F, 2) bool
        Left foot, right foot.

    Raises
    ------
    ValueError
        As :func:`find_contacts`.
    """
    if foot_xyz_m.ndim != 3 or foot_xyz_m.shape[1:] != (4, 3):
        raise ValueError(f"foot_xyz_m: want (F, 4, 3), got {foot_xyz_m.shape}")
    return find_contacts(foot_xyz_m[:, 0::2], foot_xyz_m[:, 1::2], frame_rate_hz=frame_rate_hz).foot


def planted_heights(ankle_xyz_m: Float, toes_xyz_m: Float, *, frame_rate_hz: float) -> tuple[float, float]:
    """Estimate the heights of a planted ankle and of planted toes.

    Parameters
    ----------
    ankle_xyz_m, toes_xyz_m : (F, 2, 3) float, metres, world, Y up
    frame_rate_hz : float, > 0

    Returns
    -------
    ankle_height_m, toes_height_m : float
        The lowest height at which the point keeps still for a good part of the clip: the median of its lowest
        cluster among frames slower than 0.3 m/s. Where nothing is ever slow, the lowest heights reached. Zero for an
        empty clip.
    """
    _check_feet(ankle_xyz_m, toes_xyz_m, frame_rate_hz)
    heights = []
    for point in (ankle_xyz_m, toes_xyz_m):
        if len(point) == 0:
            heights.append(0.0)
            continue
        height, speed = _height_and_speed(np.asarray(point, np.float64), frame_rate_hz, ContactThresholds().window_s)
        lowest = np.argmin(height, axis=1)[:, None]
        low = np.take_along_axis(height, lowest, axis=1)[:, 0]
        slow = low[np.take_along_axis(speed, lowest, axis=1)[:, 0] < 0.3]
        heights.append(_lowest_cluster(slow if len(slow) >= max(1, 0.05 * len(low)) else low))
    return heights[0], heights[1]


def foot_slide(ankle_xyz_m: Float, toes_xyz_m: Float, contacts: FootContacts, *, frame_rate_hz: float) -> float:
    """Measure how fast planted feet slide.

    Parameters
    ----------
    ankle_xyz_m, toes_xyz_m : (F, 2, 3) float, metres, world, Y up
    contacts : FootContacts of F frames
    frame_rate_hz : float, > 0

    Returns
    -------
    float, metres per second of contact
        The horizontal way (its length, so that ways there and back do not cancel) of the point in contact over each
        step between two frames in contact, over the time of those steps. Where ankle and toes are both in contact,
        the one that moves less: a foot that rolls does not slide. 0 without contact.

    Notes
    -----
    Averaging signed velocities instead, as published code does, lets slides in opposite directions cancel.
    """
    _check_feet(ankle_xyz_m, toes_xyz_m, frame_rate_hz)
    way = np.full((max(len(ankle_xyz_m) - 1, 0), 2), np.inf)
    for point, mask in ((ankle_xyz_m, contacts.ankle), (toes_xyz_m, contacts.toes)):
        step = np.linalg.norm(np.diff(point[..., [0, 2]], axis=0), axis=-1)
        way = np.minimum(way, np.where(mask[1:] & mask[:-1], step, np.inf))
    stands = np.isfinite(way)
    return float(way[stands].sum() / (stands.sum() / frame_rate_hz)) if stands.any() else 0.0


def _check_feet(ankle_xyz_m: Float, toes_xyz_m: Float, frame_rate_hz: float) -> None:
    for name, point in (("ankle_xyz_m", ankle_xyz_m), ("toes_xyz_m", toes_xyz_m)):
        if point.ndim != 3 or point.shape[1:] != (2, 3) or len(point) != len(ankle_xyz_m):
            raise ValueError(f"{name}: want (F, 2, 3), got {point.shape}")
        if not np.isfinite(point).all():
            raise ValueError(f"{name}: not finite; fill gaps before looking for contacts")
    if not frame_rate_hz > 0:
        raise ValueError(f"frame_rate_hz: want > 0, got {frame_rate_hz}")


def _height_and_speed(point: Float, frame_rate_hz: float, window_s: float) -> tuple[Float, Float]:
    """Find the mean height over half the window around each frame, and the lesser speed before and after it.

    (F, 2) each. The lesser of both, so that a short contact is not lost between two swings; 0 for one frame.
    """
    n = len(point)
    at = np.arange(n)
    half = int(window_s * frame_rate_hz / 2)
    before, after = np.maximum(at - half, 0), np.minimum(at + half, n - 1)
    total = np.concatenate([np.zeros((1, point.shape[1])), np.cumsum(point[..., 1], axis=0)])
    height = (total[after + 1] - total[before]) / (after + 1 - before)[:, None]
    step = min(max(1, round(window_s * frame_rate_hz)), n - 1)
    if step == 0:
        return height, np.zeros_like(height)
    speed = np.linalg.norm(point[step:] - point[:-step], axis=-1) * (frame_rate_hz / step)
    none = np.full((step, point.shape[1]), np.inf)
    return height, np.minimum(np.concatenate([speed, none]), np.concatenate([none, speed]))


def _standing(point: Float, planted_height_m: float, frame_rate_hz: float, limits: ContactThresholds) -> Bool:
    height, speed = _height_and_speed(np.asarray(point, np.float64), frame_rate_hz, limits.window_s)
    height = np.abs(height - planted_height_m)
    tight = (height < limits.tight_height_m) & (speed < limits.tight_speed_m_per_s)
    loose = (height < limits.loose_height_m) & (speed < limits.loose_speed_m_per_s)
    columns = [_mend(_reach(t, w), frame_rate_hz, limits) for t, w in zip(tight.T, loose.T, strict=True)]
    return np.stack(columns, axis=1)


def runs(mask: Bool) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and one-past-last index of each run of True in (F,) bool."""
    edge = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))
    return np.flatnonzero(edge == 1), np.flatnonzero(edge == -1)


def _reach(tight: Bool, loose: Bool) -> Bool:
    """Keep runs of ``loose`` with something ``tight`` in them: hysteresis that is the same backwards in time."""
    start, stop = runs(loose)
    count = np.concatenate([[0], np.cumsum(tight & loose)])
    out = np.zeros(len(loose), bool)
    for a, b in zip(start, stop, strict=True):
        out[a:b] = count[b] > count[a]
    return out


def _mend(mask: Bool, frame_rate_hz: float, limits: ContactThresholds) -> Bool:
    """Close short gaps, then drop short runs; a clip shorter than the shortest run is left alone."""
    out = mask.copy()
    start, stop = runs(~out)
    for a, b in zip(start, stop, strict=True):
        if a > 0 and b < len(out) and (b - a) / frame_rate_hz <= limits.widest_gap_s:
            out[a:b] = True
    start, stop = runs(out)
    for a, b in zip(start, stop, strict=True):
        if (b - a) / frame_rate_hz < limits.smallest_s and b - a < len(out):
            out[a:b] = False
    return out


def _lowest_cluster(height: Float) -> float:
    """Median of the lowest 3 cm band that holds a good share of the samples."""
    ordered = np.sort(height)
    upper = np.searchsorted(ordered, ordered + 0.03, side="right")
    share = upper - np.arange(len(ordered))
    first = int(np.argmax(share >= 0.5 * share.max()))
    return float(np.median(ordered[first : upper[first]]))
