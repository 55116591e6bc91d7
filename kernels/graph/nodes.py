"""The beats of all clips as nodes, and where a dance may leave one and enter another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.runs import runs_of
from kernels.types import Float, Int

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class BeatNodes:
    """Every beat of every clip.

    Parameters
    ----------
    clip_index : (N,) int64, >= 0, ascending
    time_s : (N,) float64, seconds from the clip's first frame, strictly increasing within a clip
    start_s, end_s : (N,) float64, seconds, the stretch of the clip around each node that may be shown

    Raises
    ------
    ValueError
        If shapes differ, the nodes are not sorted by clip and time, or a time lies outside its stretch.
    """

    clip_index: Int
    time_s: Float
    start_s: Float
    end_s: Float

    def __post_init__(self) -> None:
        n = len(self.clip_index)
        for name in ("clip_index", "time_s", "start_s", "end_s"):
            if getattr(self, name).shape != (n,):
                raise ValueError(f"{name}: want ({n},), got {getattr(self, name).shape}")
        step = np.diff(self.clip_index)
        if n and (self.clip_index[0] < 0 or (step < 0).any() or (np.diff(self.time_s)[step == 0] <= 0).any()):
            raise ValueError("clip_index, time_s: want nodes sorted by clip, then by time, no time twice; sort them")
        if not ((self.time_s >= self.start_s - 1e-6) & (self.time_s <= self.end_s + 1e-6)).all():
            raise ValueError("time_s: want within the clip's stretch; check the beats against the clip they came from")

    def __len__(self) -> int:
        return len(self.clip_index)

    @property
    def next_node(self) -> Int:
        """The clip's next beat, (N,) int64; -1 at its last, and at the last before frames that are never shown."""
        n = len(self)
        return np.where(np.append(self._goes_on, np.zeros(min(n, 1), bool)), np.arange(1, n + 1), -1)

    @property
    def previous_node(self) -> Int:
        """The clip's beat before, (N,) int64; -1 at its first, and at the first after frames that are never shown."""
        n = len(self)
        return np.where(np.append(np.zeros(min(n, 1), bool), self._goes_on), np.arange(-1, n - 1), -1)

    @property
    def _goes_on(self) -> Mask:
        """Whether each node and the one after it lie in one stretch of one clip, (N - 1,)."""
        return np.asarray((np.diff(self.clip_index) == 0) & (np.diff(self.start_s) == 0), bool)

    def may_leave(self, min_margin_s: float = 0.0) -> Mask:
        """Nodes that a transition may start from, (N,): danced to, and with frames behind them for half a blend."""
        return (self.previous_node >= 0) & (self.end_s - self.time_s >= min_margin_s)

    def may_enter(self, min_margin_s: float = 0.0) -> Mask:
        """Nodes that a transition may arrive at, (N,): the clip goes on, and has frames before for half a blend."""
        return (self.next_node >= 0) & (self.time_s - self.start_s >= min_margin_s)

    def same_moment(self, guard_s: float) -> tuple[Int, Int]:
        """Ranges [first, last) of nodes of each node's stretch nearer in time than ``guard_s``, itself included."""
        first, last = np.arange(len(self)), np.arange(1, len(self) + 1)
        starts = np.flatnonzero(self.previous_node < 0)
        for start, end in zip(starts, np.append(starts, len(self))[1:], strict=True):
            time_s = self.time_s[start:end]
            first[start:end] = np.minimum(start + np.searchsorted(time_s, time_s - guard_s, "right"), first[start:end])
            last[start:end] = np.maximum(start + np.searchsorted(time_s, time_s + guard_s, "left"), last[start:end])
        return first, last


def beat_nodes(time_s: Sequence[Float], duration_s: Sequence[float]) -> BeatNodes:
    """Line up the beats of clips that may be shown whole.

    Parameters
    ----------
    time_s : one (B,) float array a clip, seconds from its first frame, strictly increasing
    duration_s : one float a clip, seconds

    Returns
    -------
    BeatNodes, clips numbered in the order given; a clip without beats has no node

    Raises
    ------
    ValueError
        If the two differ in length, or a clip's beats do not increase or leave the clip.
    """
    if len(time_s) != len(duration_s):
        raise ValueError(f"duration_s: want one a clip, {len(time_s)}, got {len(duration_s)}")
    counts = [len(beats) for beats in time_s]
    time = np.concatenate([*time_s, np.zeros(0)]).astype(np.float64)
    end_s = np.repeat(np.asarray(duration_s, np.float64), counts)
    return BeatNodes(np.repeat(np.arange(len(counts)), counts), time, np.zeros(len(time)), end_s)


def stretch_around(beat_s: Float, is_fenced: Mask, frame_rate_hz: float) -> tuple[Float, Float]:
    """Find the stretch of a clip around each beat that may be shown.

    Parameters
    ----------
    beat_s : (B,) float, seconds, each of a frame that is not fenced
    is_fenced : (F,) bool, frames that are never shown
    frame_rate_hz : float, > 0

    Returns
    -------
    start_s, end_s : (B,) float64, seconds
    """
    stretch = runs_of(~is_fenced)
    if not len(beat_s) or not len(stretch):
        return np.zeros(len(beat_s)), np.zeros(len(beat_s))
    frame = np.rint(np.asarray(beat_s) * frame_rate_hz)
    bounds = stretch[np.clip(np.searchsorted(stretch[:, 0], frame, side="right") - 1, 0, None)] / frame_rate_hz
    # A beat lies between frames: half a frame past the last one it is still that stretch's.
    return np.minimum(bounds[:, 0], beat_s), np.maximum(bounds[:, 1], beat_s)


SAME_INSTANT_S = 0.07
"""Two rows of instants nearer than this are told apart by nobody: the window of beat measures, by convention."""

SAME_SHARE = 0.8
"""Share of either row that lies on the other where they are one row. Chosen by hand."""


def is_same_row(one_s: Float, other_s: Float) -> bool:
    """Whether two rows of instants of a clip are one: as nodes of both it would be shown twice at the price of once.

    Parameters
    ----------
    one_s, other_s : (B,), (C,) float, seconds, increasing

    Returns
    -------
    bool
        False where one of them is empty.
    """
    if not len(one_s) or not len(other_s):
        return False
    is_near = np.abs(np.asarray(one_s)[:, None] - np.asarray(other_s)) <= SAME_INSTANT_S
    return bool(is_near.any(axis=1).mean() >= SAME_SHARE and is_near.any(axis=0).mean() >= SAME_SHARE)
