"""Arrays to Arrow tables and back: one ``from_x``/``to_x`` pair a table.

Conventions: per-joint values are ``list<fixed_size_list<float32>[3 or 4]>``; one row a frame; tables of several clips
are the clips' rows one after the other, in the order given.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from kernels.assembly.blend import Dance, Lineage
from kernels.assembly.quality import Measure
from kernels.motion.beats import MotionBeats
from kernels.music.beats import TempoCandidate
from kernels.skeleton.canonical import JOINTS
from kernels.skeleton.naming import JointMapping
from kernels.skeleton.retarget import CanonicalMotion
from kernels.types import BeatGrid, Choreography, Clip, Float, Int, MotionGraph, Skeleton
from schemas.choreography import CHOREOGRAPHY, DANCE_POSE, DANCE_QUALITY, FRAME_LINEAGE
from schemas.fields import QUATERNION, VECTOR
from schemas.graph import MOTION_GRAPH_EDGE, MOTION_GRAPH_NODE
from schemas.keys import is_mirrored, mirrored, source_clip
from schemas.motion import CANONICAL_POSE, MOTION_BEAT, POSE, SKELETON
from schemas.music import MUSIC_BEAT, MUSIC_LOUDNESS, MUSIC_TEMPO
from schemas.table import Table


def from_rows(table: Table, rows: Sequence[Mapping[str, Any]]) -> pa.Table:
    """Pack rows of plain values; the table's own columns, in its order."""
    return table.check(pa.Table.from_pylist([dict(row) for row in rows], schema=table.arrow))


def concat(table: Table, parts: Iterable[pa.Table]) -> pa.Table:
    """Put tables of one kind under each other; empty for none. Metadata is the first part's."""
    found = list(parts)
    if not found:
        return table.empty()
    merged = pa.concat_tables([p.replace_schema_metadata(found[0].schema.metadata) for p in found])
    return table.check(merged.combine_chunks())


def by_clip(table: pa.Table, column: str = "clip_id") -> dict[str, pa.Table]:
    """Split a table whose rows of one clip stand together into clips, in order.

    Raises
    ------
    ValueError
        If a clip's rows are scattered.
    """
    if table.num_rows == 0:
        return {}
    key = table[column].combine_chunks()
    is_new = np.append(True, pc.not_equal(key[1:], key[:-1]).to_numpy(zero_copy_only=False))
    start = np.flatnonzero(is_new)
    end = np.append(start[1:], table.num_rows)
    parts = {key[int(s)].as_py(): table.slice(s, e - s) for s, e in zip(start, end, strict=True)}
    if len(parts) != len(start):
        raise ValueError(f"{column}: want the rows of one clip together, got them scattered; sort the table")
    return parts


def vectors(values: Float) -> pa.Array:
    """Pack (F, J, n) as a list of J fixed-size lists a row, float32."""
    f, j, n = values.shape
    flat = pa.array(np.ascontiguousarray(values, np.float32).reshape(-1))
    item = pa.FixedSizeListArray.from_arrays(flat, type={3: VECTOR, 4: QUATERNION}[n])
    offsets = pa.array(np.arange(f + 1, dtype=np.int32) * j)
    return pa.ListArray.from_arrays(offsets, item, type=pa.list_({3: VECTOR, 4: QUATERNION}[n]))


def vector(values: Float) -> pa.Array:
    """Pack (F, 3) as one fixed-size list a row, float32."""
    return pa.FixedSizeListArray.from_arrays(
        pa.array(np.ascontiguousarray(values, np.float32).reshape(-1)), type=VECTOR
    )


def quaternion(values: Float) -> pa.Array:
    """Pack (F, 4) as one fixed-size list a row, float32."""
    return pa.FixedSizeListArray.from_arrays(
        pa.array(np.ascontiguousarray(values, np.float32).reshape(-1)), type=QUATERNION
    )


def to_array(column: pa.ChunkedArray) -> Float:
    """Unpack a column of vectors or of lists of vectors to (F, n) or (F, J, n) float64.

    An empty column of lists comes back as (0, 0, n).
    """
    array = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    f = len(array)
    is_nested = pa.types.is_list(array.type)
    item = array.flatten() if is_nested else array
    n = item.type.list_size
    flat = np.asarray(item.flatten(), np.float64)
    return flat.reshape((f, -1, n) if is_nested and f else (0, 0, n) if is_nested else (f, n))


def to_numbers(column: pa.ChunkedArray) -> NDArray[Any]:
    """Unpack a column of plain values."""
    return np.asarray(column.to_numpy())


# Skeletons and poses -----------------------------------------------------------------------------------------------


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


def frame_rate_hz(rows: pa.Table) -> float:
    """Frame rate of one clip's rows, read from their times; 1 Hz for a single frame."""
    time_s = to_numbers(rows["time_s"])
    return float(np.round((len(time_s) - 1) / (time_s[-1] - time_s[0]), 6)) if len(time_s) > 1 else 1.0


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


# Beats -------------------------------------------------------------------------------------------------------------


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


def from_music_beat(song_id: str, grid: BeatGrid) -> pa.Table:
    """Pack the beats of a song, B rows."""
    b = len(grid.time_s)
    columns = [
        pa.array([song_id] * b, pa.string()),
        pa.array(np.arange(b), pa.int32()),
        pa.array(grid.time_s),
        pa.array(grid.bar_number, pa.int32()),
        pa.array(grid.beat_in_bar_number, pa.int32()),
        pa.array(grid.confidence, pa.float32()),
    ]
    return MUSIC_BEAT.check(pa.table(columns, schema=MUSIC_BEAT.arrow))


def to_music_beat(rows: pa.Table) -> BeatGrid:
    """Unpack the beats of a song."""
    return BeatGrid(
        to_numbers(rows["time_s"]).astype(np.float64),
        to_numbers(rows["bar_number"]).astype(np.int64),
        to_numbers(rows["beat_in_bar_number"]).astype(np.int64),
        to_numbers(rows["confidence"]).astype(np.float64),
    )


def from_music_tempo(song_id: str, candidates: Sequence[TempoCandidate]) -> pa.Table:
    """Pack the candidates for a song's metrical level, one row each."""
    rows = [
        {
            "song_id": song_id,
            "level_ratio": c.level_ratio,
            "tempo_bpm": c.tempo_bpm,
            "tempo_score": c.score,
            "is_chosen": c.is_chosen,
        }
        for c in candidates
    ]
    return from_rows(MUSIC_TEMPO, rows)


def from_music_loudness(song_id: str, time_s: Float, loudness_db: Float) -> pa.Table:
    """Pack a song's loudness curve."""
    columns = [
        pa.array([song_id] * len(time_s), pa.string()),
        pa.array(time_s),
        pa.array(loudness_db, pa.float32()),
    ]
    return MUSIC_LOUDNESS.check(pa.table(columns, schema=MUSIC_LOUDNESS.arrow))


# Motion graph ------------------------------------------------------------------------------------------------------


def from_motion_graph_node(
    graph: MotionGraph, clip_ids: Sequence[str], beat_index: Int, labels: Sequence[str], is_kept: NDArray[np.bool_]
) -> pa.Table:
    """Pack the nodes of a motion graph, N rows; ``clip_ids`` and ``labels`` are by clip index."""
    columns = [
        pa.array(np.arange(len(graph.time_s)), pa.int32()),
        pa.array([source_clip(clip_ids[c]) for c in graph.clip_index], pa.string()),
        pa.array([is_mirrored(clip_ids[c]) for c in graph.clip_index], pa.bool_()),
        pa.array(beat_index, pa.int32()),
        pa.array(graph.time_s),
        pa.array(graph.next_node, pa.int32()),
        pa.array([labels[c] for c in graph.clip_index], pa.string()),
        *(
            pa.array(np.zeros(len(graph.time_s)) if values is None else values, pa.float32())
            for values in (graph.accent, graph.speed, graph.peak_jerk, graph.usual_jerk)
        ),
        pa.array(is_kept),
    ]
    return MOTION_GRAPH_NODE.check(pa.table(columns, schema=MOTION_GRAPH_NODE.arrow))


def from_motion_graph_edge(graph: MotionGraph, clip_ids: Sequence[str], distance: Float) -> pa.Table:
    """Pack the transitions of a motion graph, E rows."""
    columns = [
        pa.array(graph.source, pa.int32()),
        pa.array(graph.target, pa.int32()),
        pa.array([source_clip(clip_ids[c]) for c in graph.clip_index[graph.source]], pa.string()),
        pa.array([source_clip(clip_ids[c]) for c in graph.clip_index[graph.target]], pa.string()),
        pa.array(distance, pa.float32()),
        pa.array(graph.weight, pa.float32()),
    ]
    return MOTION_GRAPH_EDGE.check(pa.table(columns, schema=MOTION_GRAPH_EDGE.arrow))


def to_motion_graph(node: pa.Table, edge: pa.Table) -> tuple[MotionGraph, tuple[str, ...]]:
    """Unpack the kept part of a motion graph, and its clips by clip index."""
    kept = to_numbers(node["is_kept"]).astype(bool)
    number = np.where(kept, np.cumsum(kept) - 1, -1)
    node = node.filter(pa.array(kept))
    clip_of = _names(node)
    clip_ids = tuple(dict.fromkeys(clip_of))
    index = {clip: i for i, clip in enumerate(clip_ids)}
    following = to_numbers(node["next_node_index"]).astype(np.int64)
    source = number[to_numbers(edge["source_node_index"]).astype(np.int64)]
    target = number[to_numbers(edge["target_node_index"]).astype(np.int64)]
    inside = (source >= 0) & (target >= 0)
    graph = MotionGraph(
        clip_index=np.array([index[c] for c in clip_of], np.int64),
        time_s=to_numbers(node["time_s"]).astype(np.float64),
        next_node=np.where(following >= 0, number[np.maximum(following, 0)], -1) if len(number) else following,
        source=source[inside],
        target=target[inside],
        weight=to_numbers(edge["edge_cost"]).astype(np.float64)[inside],
        accent=to_numbers(node["accent_score"]).astype(np.float64),
        peak_jerk=to_numbers(node["jerk_m_per_s3"]).astype(np.float64),
        usual_jerk=to_numbers(node["clip_jerk_m_per_s3"]).astype(np.float64),
        speed=to_numbers(node["speed_m_per_s"]).astype(np.float64),
    )
    return graph, clip_ids


# Dances ------------------------------------------------------------------------------------------------------------


def from_choreography(
    song_id: str,
    method: str,
    steps: Choreography,
    costs: Mapping[str, Float],
    pin_ids: Sequence[str | None] = (),
    states: Int | None = None,
) -> pa.Table:
    """Pack a choreography, S rows.

    ``costs`` are by column name, 0 where there are none; ``pin_ids`` by step, empty for no pins; ``states`` basic
    motions by step, -1 where the method has none.
    """
    s = len(steps.clip_id)
    columns = {
        "song_id": pa.array([song_id] * s, pa.string()),
        "method_name": pa.array([method] * s, pa.string()),
        "step_index": pa.array(np.arange(s), pa.int32()),
        "song_start_s": pa.array(steps.song_start_s),
        "song_end_s": pa.array(steps.song_end_s),
        "clip_id": pa.array([source_clip(name) for name in steps.clip_id], pa.string()),
        "is_mirrored": pa.array([is_mirrored(name) for name in steps.clip_id], pa.bool_()),
        "clip_start_s": pa.array(steps.clip_start_s),
        "clip_end_s": pa.array(steps.clip_end_s),
        "has_seam": pa.array(steps.has_seam),
        "blend_s": pa.array(steps.blend_s, pa.float32()),
        "warp_ratio": pa.array(steps.warp_ratio, pa.float32()),
        "pin_id": pa.array(pin_ids or [None] * s, pa.string()),
        "state_index": pa.array(np.full(s, -1) if states is None else states, pa.int32()),
        **{name: pa.array(costs.get(name, np.zeros(s)), pa.float32()) for name in _COST_COLUMNS},
    }
    return CHOREOGRAPHY.check(pa.table([columns[c] for c in CHOREOGRAPHY.arrow.names], schema=CHOREOGRAPHY.arrow))


def to_choreography(rows: pa.Table) -> Choreography:
    """Unpack a choreography."""
    seconds = {c: to_numbers(rows[c]).astype(np.float64) for c in _STEP_SECONDS}
    return Choreography(clip_id=tuple(_names(rows)), has_seam=to_numbers(rows["has_seam"]).astype(bool), **seconds)


def _names(rows: pa.Table) -> list[str]:
    """Names of the clips of rows that say whether they are mirrored."""
    pairs = zip(rows["clip_id"].to_pylist(), rows["is_mirrored"].to_pylist(), strict=True)
    return [mirrored(clip) if is_image else clip for clip, is_image in pairs]


_COST_COLUMNS = tuple(name for name in CHOREOGRAPHY.arrow.names if name.endswith("_cost"))
_STEP_SECONDS = ("song_start_s", "song_end_s", "clip_start_s", "clip_end_s", "blend_s")


def from_dance_pose(song_id: str, method: str, dance: Dance) -> pa.Table:
    """Pack the frames of a dance, F rows; the joints' order goes into the schema metadata."""
    f = len(dance.root_xyz_m)
    columns = [
        pa.array([song_id] * f, pa.string()),
        pa.array([method] * f, pa.string()),
        pa.array(np.arange(f), pa.int32()),
        pa.array(dance.time_s),
        vector(dance.root_xyz_m),
        vectors(dance.rotation_wxyz),
        vectors(dance.position_xyz_m),
    ]
    table = DANCE_POSE.check(pa.table(columns, schema=DANCE_POSE.arrow))
    return DANCE_POSE.with_metadata(table, {"joints": ",".join(JOINTS)})


def from_frame_lineage(song_id: str, method: str, dance: Dance, steps: Choreography) -> pa.Table:
    """Pack where every frame of a dance comes from, F rows."""
    line = dance.lineage
    f = len(line.step_index)
    alone = line.blend_step_index < 0
    names = np.array([source_clip(name) for name in steps.clip_id], object)
    mirrors = np.array([is_mirrored(name) for name in steps.clip_id], bool)
    columns = [
        pa.array([song_id] * f, pa.string()),
        pa.array([method] * f, pa.string()),
        pa.array(np.arange(f), pa.int32()),
        pa.array(dance.time_s),
        pa.array(names[line.step_index].tolist(), pa.string()),
        pa.array(mirrors[line.step_index]),
        pa.array(line.clip_time_s),
        pa.array(names[line.blend_step_index].tolist(), pa.string(), mask=alone),
        pa.array(mirrors[line.blend_step_index] & ~alone),
        pa.array(line.blend_time_s, pa.float64(), mask=alone),
        pa.array(np.where(alone, 0.0, line.blend_weight), pa.float32()),
        pa.array(steps.warp_ratio[line.step_index], pa.float32()),
    ]
    return FRAME_LINEAGE.check(pa.table(columns, schema=FRAME_LINEAGE.arrow))


def to_dance(pose: pa.Table, lineage: pa.Table, steps: Choreography) -> Dance:
    """Unpack a dance; the steps of its lineage, and of the partners at its seams, are found again by song time."""
    time_s = to_numbers(pose["time_s"])
    step = np.clip(np.searchsorted(steps.song_start_s, time_s + 1e-9, side="right") - 1, 0, len(steps.clip_id) - 1)
    blend_time_s = lineage["blend_time_s"].to_numpy()
    return Dance(
        frame_rate_hz(pose),
        to_array(pose["root_xyz_m"]),
        to_array(pose["rotation_wxyz"]),
        to_array(pose["position_xyz_m"]),
        Lineage(
            step,
            to_numbers(lineage["clip_time_s"]),
            np.where(np.isnan(blend_time_s), -1, _partner(steps, time_s)),
            blend_time_s,
            to_numbers(lineage["blend_weight_ratio"]).astype(np.float64),
        ),
    )


def _partner(steps: Choreography, time_s: Float) -> Int:
    """Find the step blended with at each moment: across the nearest seam; -1 without seams."""
    seam = np.flatnonzero(steps.has_seam)
    if not len(seam):
        return np.full(len(time_s), -1)
    at_s = steps.song_start_s[seam]
    nearest = np.searchsorted((at_s[1:] + at_s[:-1]) / 2, time_s)
    return np.where(time_s + 1e-9 >= at_s[nearest], seam[nearest] - 1, seam[nearest])


def from_dance_quality(song_id: str, method: str, measures: Iterable[Measure]) -> pa.Table:
    """Pack the measures of a dance, one row each."""
    return from_rows(
        DANCE_QUALITY,
        [
            {
                "song_id": song_id,
                "method_name": method,
                "metric_name": m.name,
                "value": m.value if np.isfinite(m.value) else None,
                "wanted": m.wanted,
                "is_passed": m.is_passed,
            }
            for m in measures
        ],
    )
