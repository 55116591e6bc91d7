"""Choreographies, dances, their lineage and quality as tables, and back: one ``from_x``/``to_x`` pair a table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pyarrow as pa

from assets.tables.pack import clip_names, frame_rate_hz, from_rows, to_array, to_numbers, vector, vectors
from kernels.assembly.blend import Dance, Lineage
from kernels.assembly.quality import Measure
from kernels.skeleton.canonical import JOINTS
from kernels.types import Choreography, Float, Int
from schemas.choreography import CHOREOGRAPHY, DANCE_POSE, DANCE_QUALITY, FRAME_LINEAGE
from schemas.keys import is_mirrored, source_clip

_COST_COLUMNS = tuple(name for name in CHOREOGRAPHY.arrow.names if name.endswith("_cost"))
_STEP_SECONDS = ("song_start_s", "song_end_s", "clip_start_s", "clip_end_s", "blend_s")


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
    return Choreography(clip_id=tuple(clip_names(rows)), has_seam=to_numbers(rows["has_seam"]).astype(bool), **seconds)


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
                "reasons": list(m.reasons),
            }
            for m in measures
        ],
    )
