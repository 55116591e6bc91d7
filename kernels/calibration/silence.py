"""Readings that say nothing: a tracker that lost its sensor repeats the last reading, or writes zeros."""

from __future__ import annotations

import numpy as np

from kernels.calibration.records import Bools, Recording, RecordingFinding
from kernels.types import Float

_LEAST_S = 0.25
_LEAST_FRAMES = 5
"""How long a reading is repeated. Chosen by hand: a sensor that noise never changes is not read."""

_MOVED_M = 0.05
"""Median of how far the other sensors move meanwhile. Chosen by hand, so that nobody who stands still is accused."""
_CURE = "they count as not heard; check its cable and its distance from the source"


def find_silent(recording: Recording) -> tuple[Bools, list[RecordingFinding]]:
    """Find entries that are called valid but hold no reading.

    Parameters
    ----------
    recording : Recording of F frames and S sensors

    Returns
    -------
    (F, S) bool
        Positions of exactly zero, which is inside the source; and readings that repeat the one before to the last bit
        for a quarter of a second or more while the other sensors moved by 5 cm, in the median.
    findings : list of RecordingFinding
        A warning for each kind, about the first sensor.
    """
    position, turned = recording.position_xyz_m, recording.rotation_wxyz
    is_zero = np.asarray(recording.is_valid & (position == 0).all(axis=-1))
    is_stuck = np.zeros_like(is_zero)
    same = (position[1:] == position[:-1]).all(axis=-1) & (turned[1:] == turned[:-1]).all(axis=-1)
    same &= recording.is_valid[1:] & recording.is_valid[:-1] & ~is_zero[1:]
    least = max(_LEAST_FRAMES, round(_LEAST_S * recording.frame_rate_hz))
    for s in np.flatnonzero(same.sum(axis=0) >= least):
        edge = np.flatnonzero(np.diff(np.concatenate([[False], same[:, s], [False]])))
        for first, end in zip(edge[::2].tolist(), edge[1::2].tolist(), strict=True):
            if end - first >= least and _moved(np.delete(position[first : end + 1], s, axis=1)) > _MOVED_M:
                is_stuck[first + 1 : end + 1, s] = True
    return is_zero | is_stuck, [
        *_told(recording, is_zero, "a position of exactly zero"),
        *_told(recording, is_stuck, "one reading repeated"),
    ]


def _told(recording: Recording, is_silent: Bools, what: str) -> list[RecordingFinding]:
    silent = np.flatnonzero(is_silent.any(axis=0))
    if len(silent) == 0:
        return []
    name, frame = recording.sensors[silent[0]], int(np.flatnonzero(is_silent[:, silent[0]])[0])
    others = f" ({len(silent) - 1} other sensors did so too)" if len(silent) > 1 else ""
    sentence = (
        f"{name}: want new readings while the body moves, got {what} in {int(is_silent[:, silent[0]].sum())} frames "
        f"from frame {frame} on{others}; {_CURE}"
    )
    return [RecordingFinding("warning", name, frame, sentence)]


def _moved(position: Float) -> float:
    """Median over the sensors (F, S, 3) of how far apart their places in these frames are; 0 where none is finite."""
    finite = np.isfinite(position)
    low = np.where(finite, position, np.inf).min(axis=0)
    high = np.where(finite, position, -np.inf).max(axis=0)
    size = np.sqrt(np.sum(np.maximum(high - low, 0.0) ** 2, axis=-1))
    return float(np.median(size)) if len(size) else 0.0
