"""The health of a clip before it is retargeted."""

from __future__ import annotations

import numpy as np

from kernels.health.verdicts import ClipFault, ExaminedClip, fence_of
from kernels.skeleton.naming import JointMapping
from kernels.types import Clip


def examine(clip: Clip, mapping: JointMapping) -> ExaminedClip:
    """Examine a clip: what is plainly wrong is mended, what is not is fenced, doubted or refused.

    Parameters
    ----------
    clip : Clip of F frames on its own skeleton
    mapping : which of its joints is which canonical one

    Returns
    -------
    ExaminedClip
    """
    faults: list[ClipFault] = []
    is_fenced = fence_of(faults, clip.n_frames) if faults else np.zeros(clip.n_frames, bool)
    return ExaminedClip(clip, tuple(faults), is_fenced)
