"""Positions mirrored through the source: magnetic trackers cannot tell a place from its opposite.

The dipole field is the same at p and at -p, so a tracker that loses its hemisphere reports -p with the right
orientation, until it finds back.
"""

from __future__ import annotations

import numpy as np

from kernels.calibration.records import Bools, RecordingFinding
from kernels.types import Float

_WINDOW = 5
"""Usable frames before and after a jump whose medians are compared. Chosen by hand: shorter visits are outliers."""

_LEAST_JUMP_M = 0.2
"""Chosen by hand above what a limb moves in a frame."""

_MIRRORED = 0.2
"""How far from opposite, as a share of the jump, two places may be. Chosen by hand."""

_TELLING = 0.8
"""Share of the one half's distance from the other sensors that the right half has at most. Chosen by hand."""

_WHOLLY = 0.5
"""The same for a sensor that never jumps, so that good recordings stay as they are. Chosen by hand."""

_GLANCES = 400
"""Frames at which the middle of a body is taken. Chosen for speed, by hand."""


def undo_hemispheres(
    position_xyz_m: Float, is_usable: Bools, *, sensors: tuple[str, ...]
) -> tuple[Float, list[RecordingFinding]]:
    """Find where a sensor jumps to the opposite place and turn it back.

    Parameters
    ----------
    position_xyz_m : (F, S, 3) float, metres, the source at the origin
    is_usable : (F, S) bool
    sensors : S names

    Returns
    -------
    position_xyz_m : (F, S, 3) float64
    findings : list of RecordingFinding
        A warning for each sensor that was turned back, with the first mirrored frame; an error where it cannot be told
        which half of the recording is mirrored.

    Notes
    -----
    A jump is where the medians of five usable frames before and after lie further than 20 cm apart, but opposite within
    a fifth of that. Shorter visits to the other side are outliers like others. Of the two halves that the jumps
    divide a sensor's frames into, the mirrored one lies farther from the other sensors; a sensor that never jumps is
    mirrored where it would lie less than half as far from them.
    """
    turned = np.array(position_xyz_m, np.float64)
    findings: list[RecordingFinding] = []
    signs = np.ones(is_usable.shape)
    for s in range(len(sensors)):
        signs[:, s] = _signs(turned[:, s], is_usable[:, s])
    is_jumping = np.asarray((signs < 0).any(axis=0))
    others = _middle(turned, is_usable & (signs > 0))
    for s in range(len(sensors)):
        here, there = _distances(turned[:, s] * signs[:, s, None], is_usable[:, s], others)
        if there < (1.0 if is_jumping[s] else _WHOLLY) * here:
            signs[:, s] *= -1
    for s in range(len(sensors)):
        if (signs[:, s] > 0).all():
            continue
        name, sign = sensors[s], signs[:, s]
        away = _distances(turned[:, s] * sign[:, None], is_usable[:, s], others)
        frame = int(np.flatnonzero(sign < 0)[0])
        turned[:, s] *= sign[:, None]
        what = (
            f"{name}: want positions in one hemisphere of the source, got them mirrored through it in "
            f"{int((sign < 0).sum())} frames from frame {frame} on"
        )
        if away[0] > _TELLING * away[1] and is_jumping[s]:
            cure = "which ones cannot be told so near the source; set the tracker's hemisphere and record again"
            findings.append(RecordingFinding("error", name, frame, f"{what}; {cure}"))
        else:
            cure = "they were turned back; set the tracker's hemisphere, or stay on one side of the source"
            findings.append(RecordingFinding("warning", name, frame, f"{what}; {cure}"))
    return turned, findings


def _signs(place: Float, is_usable: Bools) -> Float:
    """1 or -1 for each frame (F,): changes at every jump, 1 at first."""
    good = np.flatnonzero(is_usable)
    sign = np.ones(len(place))
    if len(good) < 2 * _WINDOW:
        return sign
    p = place[good]
    # nothing jumps to the other side unless two frames following each other are opposite
    step, across = _length(np.diff(p, axis=0)), _length(p[1:] + p[:-1])
    candidate = np.flatnonzero((step > _LEAST_JUMP_M / 2) & (across < 0.5 * step)) + 1
    last = -_WINDOW
    for k in candidate:
        if k - last < _WINDOW:
            continue
        before = np.median(p[max(k - _WINDOW, 0) : k], axis=0)
        after = np.median(p[k : k + _WINDOW], axis=0)
        apart, opposite = float(_length(after - before)), float(_length(after + before))
        if apart > _LEAST_JUMP_M and opposite < _MIRRORED * apart:
            sign[good[k] :] *= -1
            last = int(k)
    return sign


def _middle(place: Float, is_usable: Bools) -> Float:
    """Median over the usable sensors (F, 3) at some frames; NaN at the others, and with fewer than three sensors."""
    middle = np.full((len(place), 3), np.nan)
    some = np.arange(0, len(place), max(len(place) // _GLANCES, 1))
    some = some[is_usable[some].sum(axis=1) >= 3]
    if len(some):
        middle[some] = np.nanmedian(np.where(is_usable[some, :, None], place[some], np.nan), axis=1)
    return middle


def _distances(place: Float, is_usable: Bools, others: Float) -> tuple[float, float]:
    """Median distance of a sensor from the others, as it is and mirrored; 0 and 0 where nothing can be compared."""
    both = is_usable & np.isfinite(others[:, 0])
    if not both.any():
        return 0.0, 0.0
    here, there = (float(np.median(_length(way * place[both] - others[both]))) for way in (1, -1))
    return here, there


def _length(vector: Float) -> Float:
    length: Float = np.sqrt(np.sum(vector * vector, axis=-1))
    return length
