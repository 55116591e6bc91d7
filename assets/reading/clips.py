"""Clips as whatever dances asks for them: their rows, their canonical motions, and the mirror images of these."""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np
import polars as pl
from numpy.typing import NDArray

from assets.stamps import Stored
from assets.tables.motion import CanonicalClip, to_canonical_poses
from assets.tables.pack import read_rows
from kernels.skeleton.canonical import CANONICAL, mirror
from kernels.skeleton.kinematics import forward
from kernels.types import Choreography, Clip
from schemas.keys import mirrored, source_clip


def read_clips(clip: Stored, clip_ids: Collection[str] | None = None) -> pl.DataFrame:
    """Gather the rows of all sessions' clips that were read.

    Parameters
    ----------
    clip : Stored, rows of clips by session, at least one session
    clip_ids : of which clips; of all for None
    """
    return pl.concat([pl.DataFrame(read_rows(clip.read(key, clip_ids=clip_ids))) for key in clip.keys])


def image_of(moved: CanonicalClip) -> CanonicalClip:
    """Mirror a clip, left for right.

    Parameters
    ----------
    moved : CanonicalClip

    Returns
    -------
    CanonicalClip, by the name :func:`schemas.keys.mirrored` gives it
    """
    root, turned = mirror(moved.root_xyz_m, moved.rotation_wxyz)
    position, _ = forward(CANONICAL, root, turned)
    return CanonicalClip(mirrored(moved.clip_id), moved.frame_rate_hz, root, turned, position, moved.is_fenced)


def named_clips(canonical_pose: Stored, names: Collection[str]) -> Iterator[CanonicalClip]:
    """Read some clips, one at a time; those with names of mirrored ones, mirrored.

    Parameters
    ----------
    canonical_pose : Stored, poses of clips by session
    names : clips, or mirrored ones as :func:`schemas.keys.mirrored` names them

    Yields
    ------
    CanonicalClip, in the stored order, a clip before its image; those that are not there are left out
    """
    wanted = {source_clip(name) for name in names}
    for key in canonical_pose.keys:
        here = wanted & set(canonical_pose.stamp(key).clips)
        for moved in to_canonical_poses(canonical_pose.read(key, clip_ids=here)) if here else ():
            if moved.clip_id in names:
                yield moved
            if mirrored(moved.clip_id) in names:
                yield image_of(moved)


def load_clips(canonical_pose: Stored, steps: Choreography) -> dict[str, Clip]:
    """Read the canonical clips a choreography dances, and no others.

    Parameters
    ----------
    canonical_pose : Stored, poses of clips by session
    steps : Choreography

    Returns
    -------
    dict of Clip by the names of the steps
    """
    return {
        moved.clip_id: Clip(CANONICAL, moved.frame_rate_hz, moved.root_xyz_m, moved.rotation_wxyz)
        for moved in named_clips(canonical_pose, set(steps.clip_id))
    }


def load_fences(canonical_pose: Stored, steps: Choreography) -> dict[str, NDArray[np.bool_]]:
    """Read which frames of the clips of a choreography are never shown.

    Parameters
    ----------
    canonical_pose : Stored, poses of clips by session
    steps : Choreography

    Returns
    -------
    dict of (F,) bool by the names of the steps
    """
    return {moved.clip_id: moved.is_fenced for moved in named_clips(canonical_pose, set(steps.clip_id))}
