"""Outliers as the body shows them: a glitch of one sensor tears its joints apart, a fast movement does not.

Held against the frames around it alone, an entry of a fast hand looks like an outlier, and at few frames a second an
outlier like a fast hand. The distance between the two ends of a joint moves only as far as the sensors slide on the
skin, however fast the body moves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels import rotation
from kernels.calibration.gaps import fill
from kernels.calibration.hampel import median_where, running_median
from kernels.calibration.joints import solve_pair
from kernels.calibration.records import PARENT, Bools
from kernels.types import Float

_TORN = 4.0
_TORN_M = 0.015
"""A joint is torn so many times farther from its median than is usual, and no less than so far. Tuned on made-up
recordings of two generators at 30 and 60 Hz, together with `_WHOLE`, `_NEAR` and `_SUSPECT`: false alarms at 60 Hz fell
from 0.8 to 0.02 % of entries, outliers found at 30 Hz rose from 79 to 99 %."""

_WHOLE = 2.5
_WHOLE_M = 0.008
_NEAR = 4.0
"""A joint is whole within so many times what is usual, or so far, and no farther apart than so many times the median of
its ends' distance. Tuned on the same recordings."""

_SUSPECT = 0.6
"""What an outlier by its own movement adds to the share of joints torn. Tuned on the same recordings."""

_MOST_FRAMES = 2000
_LEAST_FRAMES = 120
"""Frames joints are solved from at most, for speed, and at least. Chosen by hand."""

_ABOVE = np.array(PARENT[1:])
_BELOW = np.arange(1, len(PARENT))
"""Sensors at the two ends of every joint, by definition of the tree."""


def judge_by_joints(position_xyz_m: Float, rotation_wxyz: Float, is_usable: Bools, is_outlier: Bools) -> Bools:
    """Judge again which entries are outliers, by the joints between the sensors of a body.

    Parameters
    ----------
    position_xyz_m : (F, 17, 3) float, metres, the sensors in their order
    rotation_wxyz : (F, 17, 4) float, unit
    is_usable : (F, 17) bool
    is_outlier : (F, 17) bool
        As judged by each sensor alone.

    Returns
    -------
    (F, 17) bool
        A part of ``is_usable``. The same as came where fewer than 120 frames have both sensors of every joint good.

    Notes
    -----
    Joints are solved from the entries taken for good; then the vector between the two ends of each joint is held
    against its median over nine frames. Where it lies farther off than four times what is usual for the joint, one of
    the two sensors is wrong: that of which the larger share of joints is torn, those rather that
    stand out by themselves too.
    An entry whose joints all hold, within two and a half times what is usual, and
    lie no farther apart than four times their median, is no outlier.
    """
    is_good = is_usable & ~is_outlier
    both = is_good[:, _ABOVE] & is_good[:, _BELOW]
    if len(is_good) == 0 or both.sum(axis=0).min() < _LEAST_FRAMES:
        return is_outlier
    apart = _apart(position_xyz_m, rotation_wxyz, is_good)
    is_there = is_usable[:, _ABOVE] & is_usable[:, _BELOW]
    is_torn = np.zeros_like(is_there)
    far, usual = np.zeros(is_there.shape), np.zeros(is_there.shape[1])
    for _ in range(2):  # the second time without what was torn
        trusted = is_there & ~is_torn
        middle = running_median(fill(apart, trusted))
        middle[:4], middle[-4:] = middle[4], middle[-5]  # an outlier at an end must not vouch for itself
        far = np.sqrt(np.sum((apart - middle) ** 2, axis=-1))
        usual = median_where(far, trusted)
        is_torn = is_there & (far > np.maximum(_TORN * usual, _TORN_M))
    is_blamed = _blame(is_torn, is_there, is_outlier)
    size = np.sqrt(np.sum(apart * apart, axis=-1))
    # in a long burst the median of nine is one of the burst: what is cleared must also be as near as it ever is
    is_near = size < np.maximum(_NEAR * median_where(size, is_there & ~is_torn), _WHOLE_M)
    is_whole = is_there & is_near & (far < np.maximum(_WHOLE * usual, _WHOLE_M))
    open_joints = is_there & ~(is_blamed[:, _ABOVE] | is_blamed[:, _BELOW])
    cleared = _of_sensors(open_joints & is_whole) == _of_sensors(open_joints)
    cleared &= _of_sensors(open_joints) > 0
    judged: Bools = is_usable & (is_blamed | (is_outlier & ~cleared))
    return judged


def _apart(position: Float, turned: Float, is_good: Bools) -> Float:
    """Vectors between the two ends of every joint (F, 16, 3), joints solved from the good entries of some frames."""
    R = rotation.to_matrix(np.moveaxis(turned, 1, 0))
    place = np.ascontiguousarray(np.moveaxis(position, 1, 0))
    step = max(len(position) // _MOST_FRAMES, 1)
    apart = np.zeros((len(position), len(_BELOW), 3))
    for k, (i, j) in enumerate(zip(_ABOVE, _BELOW, strict=True)):
        good = (is_good[:, i] & is_good[:, j])[::step]
        found = solve_pair((R[i, ::step], place[i, ::step]), (R[j, ::step], place[j, ::step]), good)
        apart[:, k] = place[j] + R[j] @ found.in_child_m - place[i] - R[i] @ found.in_parent_m
    return apart


def _of_sensors(joints: Bools) -> NDArray[np.int64]:
    """Count the joints marked (F, 16) at each sensor, (F, 17)."""
    count = np.zeros((len(joints), len(PARENT)), np.int64)
    count[:, 1:] += joints
    for k, i in enumerate(_ABOVE):
        count[:, i] += joints[:, k]
    return count


def _blame(is_torn: Bools, is_there: Bools, is_suspect: Bools) -> Bools:
    """Name the sensors (F, 17) that explain the torn joints, one after the other in each frame."""
    blamed = np.zeros((len(is_torn), len(PARENT)), np.bool_)
    rows = np.flatnonzero(is_torn.any(axis=1))
    torn, there = is_torn[rows], is_there[rows]
    for _ in range(len(PARENT)):
        busy = torn.any(axis=1)
        if not busy.any():
            break
        rows, torn, there = rows[busy], torn[busy], there[busy]
        n_torn, n_there = _of_sensors(torn), _of_sensors(there)
        guilt = n_torn / np.maximum(n_there, 1) + 1e-3 * n_torn + _SUSPECT * (is_suspect[rows] & (n_torn > 0))
        worst = np.argmax(guilt, axis=1)
        blamed[rows, worst] = True
        of_worst = (worst[:, None] == _ABOVE) | (worst[:, None] == _BELOW)
        torn &= ~of_worst
        there &= ~of_worst
    return blamed
