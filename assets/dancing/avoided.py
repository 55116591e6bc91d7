"""Stretches of clips that a dance is not to show."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from assets.reading.clips import named_clips
from assets.stamps import Stored
from kernels.runs import runs_of
from kernels.types import Float
from schemas.keys import source_clip


@dataclass(frozen=True, order=True)
class AvoidedSpan:
    """A stretch of a clip, and of its mirror image.

    Parameters
    ----------
    clip_id : of the clip itself
    start_s, end_s : float, seconds of the clip, both belong to it, start <= end
    """

    clip_id: str
    start_s: float
    end_s: float

    def __str__(self) -> str:
        """Say which stretch it is."""
        return f"{self.clip_id} from {self.start_s:.2f} to {self.end_s:.2f} s"


def touched(
    avoid: Sequence[AvoidedSpan], names: Sequence[str], start_s: Float, end_s: Float, *, blend_s: float
) -> NDArray[np.bool_]:
    """Find the stretches of clips that would show what is to be avoided.

    Parameters
    ----------
    avoid : what is not to be shown
    names : (N,) of clips or their mirror images
    start_s, end_s : (N,) float, seconds of the clips
    blend_s : float, seconds, >= 0, the usual blend, of which half is shown beyond either end

    Returns
    -------
    (N,) bool
    """
    out = np.zeros(len(names), bool)
    if not avoid or not len(names):
        return out
    clip = np.array([source_clip(str(name)) for name in names])
    half_s = blend_s / 2
    for span in avoid:
        out |= (clip == span.clip_id) & (start_s - half_s <= span.end_s) & (end_s + half_s >= span.start_s)
    return out


def fenced_spans(canonical_pose: Stored, clip_ids: set[str]) -> list[AvoidedSpan]:
    """List what of clips is fenced, with the way to the frames beside it, which is made of both.

    Parameters
    ----------
    canonical_pose : Stored, poses of clips by session
    clip_ids : of the clips to look at

    Returns
    -------
    list of AvoidedSpan, by clip, then time; empty where nothing is fenced
    """
    return [
        AvoidedSpan(moved.clip_id, max(first - 1, 0) / moved.frame_rate_hz, (last + 1) / moved.frame_rate_hz)
        for moved in sorted(named_clips(canonical_pose, clip_ids), key=lambda moved: moved.clip_id)
        for first, last in runs_of(moved.is_fenced).tolist()
    ]


def merged(spans: Iterable[AvoidedSpan]) -> tuple[AvoidedSpan, ...]:
    """Put spans in order and join those that overlap.

    Parameters
    ----------
    spans : in any order
    """
    out: list[AvoidedSpan] = []
    for span in sorted(spans):
        if out and out[-1].clip_id == span.clip_id and span.start_s <= out[-1].end_s:
            out[-1] = AvoidedSpan(span.clip_id, out[-1].start_s, max(out[-1].end_s, span.end_s))
        else:
            out.append(span)
    return tuple(out)
