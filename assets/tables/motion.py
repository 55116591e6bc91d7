"""Skeletons, poses and motion beats as tables, and back: one ``from_x``/``to_x`` pair a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from assets.tables.pack import (
    by_clip,
    frame_rate_hz,
    from_rows,
    to_array,
    to_numbers,
    vector,
    vectors,
)
from kernels.health.turns import around
from kernels.health.verdicts import ClipFault
from kernels.motion.dance_pulse import DancePulse, other_levels
from kernels.motion.motion_beats import MotionBeats
from kernels.skeleton.canonical import JOINTS
from kernels.skeleton.naming import JointMapping
from kernels.skeleton.retarget import CanonicalMotion
from kernels.types import Clip, Float, Skeleton
from schemas.motion import CANONICAL_POSE, CLIP_FAULT, MOTION_BEAT, MOTION_TEMPO, MOTION_TURN, POSE, SKELETON

Mask = NDArray[np.bool_]


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


def from_clip_fault(clip_id: str, faults: Sequence[ClipFault], recorded: Clip) -> pa.Table:
    """Pack the faults of a clip, a row each, none where nothing is wrong; with how fast it turned as recorded."""
    n, rate_hz = len(faults), recorded.frame_rate_hz
    shown = [around(fault, recorded) for fault in faults]
    columns = [
        pa.array([clip_id] * n, pa.string()),
        pa.array(np.arange(n), pa.int32()),
        pa.array([fault.kind for fault in faults], pa.string()),
        pa.array([fault.joint for fault in faults], pa.string()),
        pa.array([fault.first / rate_hz for fault in faults], pa.float64()),
        pa.array([fault.last / rate_hz for fault in faults], pa.float64()),
        pa.array([fault.verdict for fault in faults], pa.string()),
        pa.array([fault.reason for fault in faults], pa.string()),
        pa.array([first / rate_hz for first, _ in shown], pa.float64()),
        pa.array([turn.astype(np.float32).tolist() for _, turn in shown], pa.list_(pa.float32())),
    ]
    return CLIP_FAULT.check(pa.table(columns, schema=CLIP_FAULT.arrow))


def from_pose(clip_id: str, clip: Clip, is_fenced: Mask | None = None) -> pa.Table:
    """Pack a clip on its own skeleton, F rows; without a fence every frame may be shown."""
    f = clip.n_frames
    moved = clip.translation_xyz_m
    columns = [
        pa.array([clip_id] * f, pa.string()),
        pa.array(np.arange(f), pa.int32()),
        pa.array(np.arange(f) / clip.frame_rate_hz),
        vector(clip.root_xyz_m),
        vectors(clip.rotation_wxyz),
        pa.nulls(f, POSE.arrow.field("translation_xyz_m").type) if moved is None else vectors(moved),
        pa.array(np.zeros(f, bool) if is_fenced is None else is_fenced, pa.bool_()),
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


def to_fence(rows: pa.Table) -> Mask:
    """Unpack which frames of one clip are never shown, (F,)."""
    return to_numbers(rows["is_fenced"]).astype(bool)


@dataclass(frozen=True, eq=False)
class CanonicalClip:
    """One clip on the canonical skeleton: (F, 3), (F, 22, 4) local, (F, 22, 3) world; (F,), what is never shown."""

    clip_id: str
    frame_rate_hz: float
    root_xyz_m: Float
    rotation_wxyz: Float
    position_xyz_m: Float
    is_fenced: Mask

    @property
    def duration_s(self) -> float:
        """Seconds from the first frame to the last."""
        return max(len(self.root_xyz_m) - 1, 0) / self.frame_rate_hz


def from_canonical_pose(
    clip_id: str, frame_rate_hz: float, motion: CanonicalMotion, is_fenced: Mask | None = None
) -> pa.Table:
    """Pack a clip on the canonical skeleton, F rows; the joints' order goes into the schema metadata."""
    f = len(motion.root_xyz_m)
    columns = [
        pa.array([clip_id] * f, pa.string()),
        pa.array(np.arange(f), pa.int32()),
        pa.array(np.arange(f) / frame_rate_hz),
        vector(motion.root_xyz_m),
        vectors(motion.rotation_wxyz),
        vectors(motion.position_xyz_m),
        pa.array(np.zeros(f, bool) if is_fenced is None else is_fenced, pa.bool_()),
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
        to_fence(rows),
    )


def to_canonical_poses(table: pa.Table) -> Iterator[CanonicalClip]:
    """Unpack every clip of a table of canonical poses, in order."""
    for rows in by_clip(table).values():
        yield to_canonical_pose(rows)


def from_motion_beat(
    clip_id: str,
    beats: MotionBeats | DancePulse,
    frame_rate_hz: float,
    *,
    first_frame: int = 0,
    is_fenced: Mask | None = None,
) -> pa.Table:
    """Pack the beats of a clip, B rows, none when it has none; found in the clip from ``first_frame`` on.

    Beats of frames that are never shown are left out.
    """
    time_s = beats.time_s + first_frame / frame_rate_hz
    if is_fenced is not None:
        frame = np.round(time_s * frame_rate_hz).astype(np.int64)
        time_s = time_s[~is_fenced[np.clip(frame, 0, len(is_fenced) - 1)]]
    b = len(time_s)
    if isinstance(beats, DancePulse):
        confidence, shares = beats.confidence_probability, (0.0, 0.0)
        interval_s = 60.0 / beats.tempo_bpm if b else 0.0
    else:
        confidence, interval_s = beats.confidence, beats.interval_s
        shares = beats.component_share, beats.peak_share
    columns = [
        pa.array([clip_id] * b, pa.string()),
        pa.array(np.arange(b), pa.int32()),
        pa.array(np.round(time_s * frame_rate_hz), pa.int32()),
        pa.array(time_s),
        *(pa.array(np.full(b, value), pa.float32()) for value in (confidence, interval_s, *shares)),
    ]
    return MOTION_BEAT.check(pa.table(columns, schema=MOTION_BEAT.arrow))


def from_motion_turn(
    clip_id: str, turns: MotionBeats, frame_rate_hz: float, *, first_frame: int, is_fenced: Mask
) -> pa.Table:
    """Pack the turns of a clip, a row each; found from ``first_frame`` on, those never shown left out."""
    time_s = turns.time_s + first_frame / frame_rate_hz
    frame = np.clip(np.round(time_s * frame_rate_hz).astype(np.int64), 0, len(is_fenced) - 1)
    is_shown = ~is_fenced[frame]
    n = int(is_shown.sum())
    columns = [
        pa.array([clip_id] * n, pa.string()),
        pa.array(np.arange(n), pa.int32()),
        pa.array(frame[is_shown], pa.int32()),
        pa.array(time_s[is_shown]),
        pa.array(np.full(n, turns.interval_s), pa.float32()),
    ]
    return MOTION_TURN.check(pa.table(columns, schema=MOTION_TURN.arrow))


def from_motion_tempo(clip_id: str, beats: MotionBeats | DancePulse, *, beat_count: int) -> pa.Table:
    """Pack the tempo of a clip, one row; ``beat_count`` are the beats of it that may be shown."""
    has_pulse = len(beats.time_s) > 0
    if isinstance(beats, DancePulse):
        tempo, levels = beats.tempo_bpm, (beats.slower_bpm, beats.faster_bpm)
        confidence, level, spread = beats.confidence_probability, beats.level_probability, beats.spread_ratio
    else:
        tempo = 60.0 / beats.interval_s if has_pulse else 0.0
        levels, confidence, level, spread = other_levels(tempo), beats.confidence, 0.0, 0.0
    row = {
        "clip_id": clip_id,
        "tempo_bpm": tempo if has_pulse else None,
        "confidence_probability": confidence,
        "has_pulse": has_pulse,
        "slower_bpm": levels[0] if has_pulse and levels[0] else None,
        "faster_bpm": levels[1] if has_pulse and levels[1] else None,
        "level_probability": level if has_pulse else 0.0,
        "tempo_spread_ratio": spread if has_pulse else 0.0,
        "beat_count": beat_count,
    }
    return from_rows(MOTION_TEMPO, [row])


@dataclass(frozen=True)
class ClipTempo:
    """Tempo of a clip; ``tempo_bpm`` is 0 where it has no pulse, a level is 0 where it is none."""

    tempo_bpm: float
    confidence_probability: float
    slower_bpm: float
    faster_bpm: float
    level_probability: float

    @property
    def has_pulse(self) -> bool:
        """Whether the clip has beats."""
        return self.tempo_bpm > 0


def to_motion_tempo(table: pa.Table) -> dict[str, ClipTempo]:
    """Unpack the tempi of clips, by clip."""
    names = ("tempo_bpm", "confidence_probability", "slower_bpm", "faster_bpm", "level_probability")
    return {row["clip_id"]: ClipTempo(*(row[name] or 0.0 for name in names)) for row in table.to_pylist()}
