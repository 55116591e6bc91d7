"""What is wrong with a clip, where, and what becomes of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from kernels.types import Clip

Verdict = Literal["mended", "fenced", "doubtful", "refused"]
"""*mended*: frames were put right, and are danced; *fenced*: they are never shown; *doubtful*: the clip is danced, and
somebody should look at it; *refused*: nothing of it is danced."""

FAULT_KINDS = (
    "body_count",
    "facing",
    "fast",
    "flip",
    "frozen",
    "gap",
    "gimbal",
    "mirrored",
    "pop",
    "proportions",
    "rate",
    "rest_pose",
    "root_path",
    "sliding",
    "tpose",
    "trimmed",
    "up_axis",
)
"""The kinds of fault there are, as the table ``clip_fault`` names them."""


@dataclass(frozen=True)
class ClipFault:
    """One fault of one clip.

    Parameters
    ----------
    kind : one of :data:`FAULT_KINDS`
    joint : name of the joint in the clip's own skeleton; empty for the whole body
    first, last : int, frames, both at fault, 0 <= first <= last
    verdict : see :data:`Verdict`
    reason : one sentence: what was found, with its figure, and what would help

    Raises
    ------
    ValueError
        If the kind is none of these, or the frames are not in order.
    """

    kind: str
    joint: str
    first: int
    last: int
    verdict: Verdict
    reason: str

    def __post_init__(self) -> None:
        if self.kind not in FAULT_KINDS:
            raise ValueError(f"kind: want one of {', '.join(FAULT_KINDS)}, got {self.kind!r}")
        if not 0 <= self.first <= self.last:
            raise ValueError(f"first, last: want 0 <= first <= last, got {self.first}, {self.last}")


@dataclass(frozen=True, eq=False)
class ExaminedClip:
    """A clip after its examination.

    Parameters
    ----------
    clip : Clip of F frames, mended where that was plain
    faults : in order of frames, then of joints
    """

    clip: Clip
    faults: tuple[ClipFault, ...] = ()

    @property
    def is_fenced(self) -> NDArray[np.bool_]:
        """Frames that are never shown, (F,) bool."""
        return fence_of(self.faults, self.clip.n_frames)

    @property
    def refusal(self) -> str:
        """Why nothing of it can be danced, sentences joined by "; "; empty where something can."""
        return "; ".join(dict.fromkeys(f.reason for f in self.faults if f.verdict == "refused"))


def fence_of(faults: Iterable[ClipFault], n_frames: int) -> NDArray[np.bool_]:
    """Mark the frames that are never shown.

    Parameters
    ----------
    faults : of one clip
    n_frames : int, F of it

    Returns
    -------
    (F,) bool
    """
    is_fenced = np.zeros(n_frames, bool)
    for fault in faults:
        if fault.verdict == "fenced":
            is_fenced[fault.first : fault.last + 1] = True
    return is_fenced


def within(examined: ExaminedClip, start_s: float | None, end_s: float | None) -> ExaminedClip:
    """Cut off what lies before and after a take: those frames are never shown.

    Parameters
    ----------
    examined : ExaminedClip of F frames
    start_s, end_s : float, seconds of the clip, or None where the take is not cut

    Returns
    -------
    ExaminedClip
        With a fault a cut; refused where fewer than two frames are left.
    """
    clip = examined.clip
    n, rate_hz = clip.n_frames, clip.frame_rate_hz
    first = 0 if start_s is None else max(int(np.ceil(start_s * rate_hz - 1e-6)), 0)
    last = n - 1 if end_s is None else min(int(np.floor(end_s * rate_hz + 1e-6)), n - 1)
    if n and last - first < 1 and (start_s is not None or end_s is not None):
        told = f"start_s and end_s leave nothing of its {clip.duration_s:.2f} s; correct them in clips.csv"
        cut = (ClipFault("trimmed", "", 0, n - 1, "refused", told),)
    else:
        told = "cut off by clips.csv"
        before = (ClipFault("trimmed", "", 0, first - 1, "fenced", told),) if first > 0 else ()
        after = (ClipFault("trimmed", "", last + 1, n - 1, "fenced", told),) if last < n - 1 else ()
        cut = (*before, *after)
    order = sorted((*examined.faults, *cut), key=lambda fault: (fault.first, fault.last))
    return ExaminedClip(clip, tuple(order))
