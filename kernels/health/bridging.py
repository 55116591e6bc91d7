"""Frames that are never shown, bridged: what follows looks at a whole motion, and none of it is the fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kernels import rotation
from kernels.types import Clip


def bridge(clip: Clip, is_fenced: NDArray[np.bool_]) -> Clip:
    """Put a straight way between the frames around each fenced span in its place.

    Parameters
    ----------
    clip : Clip of F frames
    is_fenced : (F,) bool

    Returns
    -------
    Clip
        At the clip's ends the nearest frame that may be shown is held. As it was where all is fenced, or nothing.
    """
    shown = np.flatnonzero(~is_fenced)
    if len(shown) in (0, clip.n_frames):
        return clip
    frame = np.arange(clip.n_frames)
    at = np.interp(frame, shown, np.arange(len(shown)))
    left, right = shown[np.floor(at).astype(np.int64)], shown[np.ceil(at).astype(np.int64)]
    share = np.clip((frame - left) / np.maximum(right - left, 1), 0.0, 1.0)

    def straight(values: NDArray[np.float64]) -> NDArray[np.float64]:
        weight = share.reshape(-1, *[1] * (values.ndim - 1))
        return np.where(is_fenced.reshape(weight.shape), (1 - weight) * values[left] + weight * values[right], values)

    turned = rotation.slerp(clip.rotation_wxyz[left], clip.rotation_wxyz[right], share[:, None])
    moved = clip.translation_xyz_m
    return replace(
        clip,
        root_xyz_m=straight(clip.root_xyz_m),
        rotation_wxyz=np.where(is_fenced[:, None, None], turned, clip.rotation_wxyz),
        translation_xyz_m=None if moved is None else straight(moved),
    )
