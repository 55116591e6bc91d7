"""The motions of one clip, from its canonical poses: cut once, the same way wherever they are needed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyarrow as pa

from assets.tables.motion import to_canonical_pose
from kernels.motion.key_poses import KeyPoses, angular_speed, key_poses, pose_vectors
from kernels.motion.velocity import usable_frames
from kernels.runs import touches
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Float
from schemas.settings import BasicMotionSettings


@dataclass(frozen=True, eq=False)
class Cut:
    """Motions of one clip, and their key poses as vectors, (N, D)."""

    clip_id: str
    motions: KeyPoses
    vectors: Float


def cut(rows: pa.Table, settings: BasicMotionSettings) -> Cut:
    """Cut one clip into motions; those that touch a fenced frame, or one no body moves to, are left out.

    Parameters
    ----------
    rows : table ``canonical_pose``, the rows of one clip, at least one
    settings : the ``[basic_motion]`` section

    Returns
    -------
    Cut
        Without motions where the clip has no key poses.
    """
    moved = to_canonical_pose(rows)
    first, last = usable_frames(moved.position_xyz_m, moved.frame_rate_hz)
    used = slice(first, last + 1)
    _, orientation = kinematics.forward(CANONICAL, moved.root_xyz_m[used], moved.rotation_wxyz[used])
    found = key_poses(
        angular_speed(orientation, moved.frame_rate_hz),
        shortest_s=settings.shortest_s,
        longest_s=settings.longest_s,
        first_s=first / moved.frame_rate_hz,
    )
    end_s = np.minimum(found.end_s, moved.duration_s)
    is_whole = ~touches(moved.is_fenced, moved.frame_rate_hz, found.start_s, end_s)
    found = KeyPoses(found.start_s[is_whole], found.peak_s[is_whole], end_s[is_whole])
    return Cut(
        moved.clip_id,
        found,
        pose_vectors(moved.position_xyz_m, moved.rotation_wxyz[:, 0], moved.frame_rate_hz, found),
    )
