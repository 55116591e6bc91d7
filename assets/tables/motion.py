"""Skeletons, poses and motion beats as tables, and back: one ``from_x``/``to_x`` pair a table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pyarrow as pa

from assets.tables.pack import (
    by_clip,
    frame_rate_hz,
    to_array,
    to_numbers,
    vector,
    vectors,
)
from kernels.motion.motion_beats import MotionBeats
from kernels.skeleton.canonical import JOINTS
from kernels.skeleton.naming import JointMapping
from kernels.skeleton.retarget import CanonicalMotion
from kernels.types import Clip, Float, Skeleton
from schemas.motion import CANONICAL_POSE, MOTION_BEAT, POSE, SKELETON


def from_skeleton(clip_id: str, skeleton: Skeleton, mapping: JointMapping) -> pa.Table:
    """Pack a source skeleton, J rows, each with the canonical joints it drives, joined by commas."""
    j = len(skeleton.joints)
    drives: dict[str, list[str]] = {}
    for name, joint in mapping.joint.items():
        drives.setdefault(joint, []).append(name)
    columns = [
        pa.array([clip_id] * j, pa.string()),
        pa.array(np.arange(j), pa.int32()),
        pa.array(skeleton.joints, pa.string()),
        pa.array(skeleton.parent, pa.int32()),
        vector(skeleton.offset_xyz_m),
        pa.array([",".join(drives[name]) if name in drives else None for name in skeleton.joints], pa.string()),
    ]
    return SKELETON.check(pa.table(columns, schema=SKELETON.arrow))


def to_skeleton(rows: pa.Table) -> tuple[Skeleton, JointMapping]:
    """Unpack one clip's skeleton, and which of its joints is which canonical one."""
    joints = tuple(rows["joint_name"].to_pylist())
    parent = to_numbers(rows["parent_index"]).astype(np.int64)
    skeleton = Skeleton(joints, parent, to_array(rows["offset_xyz_m"]))
    driven = {
        name: joint
        for joint, names in zip(joints, rows["canonical_joint"].to_pylist(), strict=True)
        for name in (names or "").split(",")
        if name
    }
    return skeleton, JointMapping({name: driven[name] for name in JOINTS if name in driven}, "stored")


def from_pose(clip_id: str, clip: Clip) -> pa.Table:
    """Pack a clip on its own skeleton, F rows."""
    f = clip.n_frames
    moved = clip.translation_xyz_m
    columns = [
        pa.array([clip_id] * f, pa.string()),
        pa.array(np.arange(f), pa.int32()),
        pa.array(np.arange(f) / clip.frame_rate_hz),
        vector(clip.root_xyz_m),
        vectors(clip.rotation_wxyz),
        pa.nulls(f, POSE.arrow.field("translation_xyz_m").type) if moved is None else vectors(moved),
    ]
    return POSE.check(pa.table(columns, schema=POSE.arrow))


def to_pose(rows: pa.Table, skeleton: Skeleton) -> Clip:
    """Unpack one clip on its own skeleton."""
    moved = rows["translation_xyz_m"]
    return Clip(
        skeleton,
        frame_rate_hz(rows),
        to_array(rows["root_xyz_m"]),
        to_array(rows["rotation_wxyz"]),
        None if moved.null_count == len(moved) else to_array(moved),
    )


@dataclass(frozen=True, eq=False)
class CanonicalClip:
    """One clip on the canonical skeleton: (F, 3), (F, 22, 4) local, (F, 22, 3) world."""

    clip_id: str
    frame_rate_hz: float
    root_xyz_m: Float
    rotation_wxyz: Float
    position_xyz_m: Float

    @property
    def duration_s(self) -> float:
        """Seconds from the first frame to the last."""
        return max(len(self.root_xyz_m) - 1, 0) / self.frame_rate_hz


def from_canonical_pose(clip_id: str, frame_rate_hz: float, motion: CanonicalMotion) -> pa.Table:
    """Pack a clip on the canonical skeleton, F rows; the joints' order goes into the schema metadata."""
    f = len(motion.root_xyz_m)
    columns = [
        pa.array([clip_id] * f, pa.string()),
        pa.array(np.arange(f), pa.int32()),
        pa.array(np.arange(f) / frame_rate_hz),
        vector(motion.root_xyz_m),
        vectors(motion.rotation_wxyz),
        vectors(motion.position_xyz_m),
    ]
    table = CANONICAL_POSE.check(pa.table(columns, schema=CANONICAL_POSE.arrow))
    return CANONICAL_POSE.with_metadata(table, {"joints": ",".join(JOINTS)})


def to_canonical_pose(rows: pa.Table) -> CanonicalClip:
    """Unpack one clip on the canonical skeleton; its rate is read from the times, 1 Hz for a single frame."""
    return CanonicalClip(
        rows["clip_id"][0].as_py(),
        frame_rate_hz(rows),
        to_array(rows["root_xyz_m"]),
        to_array(rows["rotation_wxyz"]),
        to_array(rows["position_xyz_m"]),
    )


def to_canonical_poses(table: pa.Table) -> Iterator[CanonicalClip]:
    """Unpack every clip of a table of canonical poses, in order."""
    for rows in by_clip(table).values():
        yield to_canonical_pose(rows)


def from_motion_beat(clip_id: str, beats: MotionBeats, frame_rate_hz: float, *, first_frame: int = 0) -> pa.Table:
    """Pack the beats of a clip, B rows, none when it has none; found in the clip from ``first_frame`` on."""
    b = len(beats.time_s)
    time_s = beats.time_s + first_frame / frame_rate_hz
    columns = [
        pa.array([clip_id] * b, pa.string()),
        pa.array(np.arange(b), pa.int32()),
        pa.array(np.round(time_s * frame_rate_hz), pa.int32()),
        pa.array(time_s),
        pa.array(np.full(b, beats.confidence), pa.float32()),
        pa.array(np.full(b, beats.interval_s), pa.float32()),
        pa.array(np.full(b, beats.component_share), pa.float32()),
        pa.array(np.full(b, beats.peak_share), pa.float32()),
    ]
    return MOTION_BEAT.check(pa.table(columns, schema=MOTION_BEAT.arrow))
