"""Motions, performances, the model and what songs let it hear, to Arrow tables and back; see :mod:`assets.tables`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa

from assets.sources.performances import Performance
from assets.tables.pack import by_clip, from_rows, to_array, to_numbers, vectors
from kernels.hmm.evidence import Evidence
from kernels.hmm.model import Model
from kernels.hmm.states import States
from kernels.motion.key_poses import KeyPoses, to_poses, to_vectors
from kernels.music.drums_and_melody import CONTOUR, FIRST_KEY, N_KEYS, Contour, Hits
from kernels.types import Float, Int
from schemas.hmm import BASIC_MOTION, CHOREOGRAPHY_MODEL, KEY_POSE, MUSIC_EVIDENCE, PERFORMANCE
from schemas.music import MELODY, PERCUSSION


def from_key_pose(clip_id: str, found: KeyPoses, state: Int, distance: Float) -> pa.Table:
    """Pack the motions of a clip, N rows."""
    n = len(found.start_s)
    columns = [
        pa.array([clip_id] * n, pa.string()),
        pa.array(np.arange(n), pa.int32()),
        pa.array(found.start_s),
        pa.array(found.peak_s),
        pa.array(found.end_s),
        pa.array(state, pa.int32()),
        pa.array(distance, pa.float32()),
    ]
    return KEY_POSE.check(pa.table(columns, schema=KEY_POSE.arrow))


@dataclass(frozen=True, eq=False)
class ClipMotions:
    """Motions of one clip, (N,) each: seconds of the clip, and basic motion (-1 for none)."""

    start_s: Float
    end_s: Float
    state: Int

    def known(self) -> ClipMotions:
        """Take the motions that belong to a basic motion."""
        kept = self.state >= 0
        return ClipMotions(self.start_s[kept], self.end_s[kept], self.state[kept])


def to_motions(table: pa.Table) -> dict[str, ClipMotions]:
    """Unpack the motions of every clip, in the table's order."""
    return {
        clip: ClipMotions(
            to_numbers(rows["start_s"]).astype(np.float64),
            to_numbers(rows["end_s"]).astype(np.float64),
            to_numbers(rows["state_index"]).astype(np.int64),
        )
        for clip, rows in by_clip(table).items()
    }


def from_performance(found: Sequence[Performance]) -> pa.Table:
    """Pack performances, one row each."""
    return from_rows(PERFORMANCE, [vars(one) for one in found])


def to_performances(table: pa.Table) -> list[Performance]:
    """Unpack performances."""
    return [Performance(**row) for row in table.to_pylist()]


def from_basic_motion(states: States, clip_ids: Sequence[str], start_s: Float, end_s: Float) -> pa.Table:
    """Pack basic motions, K rows; clip and seconds of the motion nearest to each."""
    k = len(states.count)
    columns = [
        pa.array(np.arange(k), pa.int32()),
        pa.array(clip_ids, pa.string()),
        pa.array(start_s),
        pa.array(end_s),
        pa.array(states.count, pa.int32()),
        pa.array(states.reach),
        vectors(to_poses(states.centroid).reshape(k, -1, 3)),
    ]
    return BASIC_MOTION.check(pa.table(columns, schema=BASIC_MOTION.arrow))


def to_states(table: pa.Table) -> States:
    """Unpack basic motions."""
    k = table.num_rows
    return States(
        to_vectors(to_array(table["pose_xyz_m"]).reshape(k, 3, -1, 3)) if k else np.zeros((0, 0)),
        to_numbers(table["reach_m"]).astype(np.float64),
        to_numbers(table["motion_count"]).astype(np.int64),
    )


def from_choreography_model(model: Model, examples: Sequence[str]) -> pa.Table:
    """Pack a model, one row a probability; ``examples`` are the clips that show each state."""
    k = model.n_states
    parts = [
        ("initial", np.arange(k), np.full(k, -1), np.exp(model.log_initial)),
        ("transition", *_pairs(k, np.arange(k)), np.exp(model.log_transition).reshape(-1)),
        ("emission", *_pairs(k, np.arange(N_KEYS) + FIRST_KEY), np.exp(model.log_emission[0]).reshape(-1)),
        ("melody", *_pairs(k, np.arange(len(CONTOUR))), np.exp(model.log_emission[1]).reshape(-1)),
    ]
    state = np.concatenate([p[1] for p in parts]).astype(np.int64)
    columns = [
        pa.array([p[0] for p in parts for _ in range(len(p[1]))], pa.string()),
        pa.array(state, pa.int32()),
        pa.array(np.concatenate([p[2] for p in parts]), pa.int32()),
        pa.array(np.concatenate([p[3] for p in parts])),
        pa.array([examples[s] for s in state.tolist()], pa.string()),
    ]
    return CHOREOGRAPHY_MODEL.check(pa.table(columns, schema=CHOREOGRAPHY_MODEL.arrow))


def _pairs(k: int, target: Int) -> tuple[Int, Int]:
    return np.repeat(np.arange(k), len(target)), np.tile(target, k)


def to_model(table: pa.Table, *, melody_weight: float) -> Model:
    """Unpack a model."""
    name = np.array(table["parameter_name"].to_pylist(), object)
    with np.errstate(divide="ignore"):
        log_p = np.log(to_numbers(table["probability"]).astype(np.float64))
    k = int((name == "initial").sum())
    initial, transition, emission, melody = (
        log_p[name == part] for part in ("initial", "transition", "emission", "melody")
    )
    streams = (emission.reshape(k, N_KEYS), melody.reshape(k, len(CONTOUR)))
    return Model(initial, transition.reshape(k, k), streams, (1.0, melody_weight))


def from_music_evidence(performances: Sequence[Performance], found: Evidence, n_hits: Sequence[int]) -> pa.Table:
    """Pack how much music helps to predict motions, one row a performance of which something could be held out."""
    rows = [
        {
            "clip_id": one.clip_id,
            "song_id": one.song_id,
            "motion_count": int(found.n_motions[i]),
            "hit_count": n_hits[i],
            "music_log_probability": float(found.with_music[i]),
            "bigram_log_probability": float(found.bigram[i]),
            "shuffled_log_probability": float(found.shuffled[i]),
            "chance_probability": found.p,
        }
        for i, one in enumerate(performances)
        if found.n_motions[i]
    ]
    return from_rows(MUSIC_EVIDENCE, rows)


def to_evidence(table: pa.Table) -> Evidence:
    """Unpack how much music helps to predict motions."""
    columns = ("music_log_probability", "bigram_log_probability", "shuffled_log_probability")
    music, bigram, shuffled = (to_numbers(table[c]).astype(np.float64) for c in columns)
    p = float(table["chance_probability"][0].as_py()) if table.num_rows else 1.0
    return Evidence(music, bigram, shuffled, to_numbers(table["motion_count"]).astype(np.int64), p)


def from_percussion(song_id: str, hits: Hits, *, heard_as: str) -> pa.Table:
    """Pack the percussion of a song, one row a stroke."""
    n = len(hits.time_s)
    columns = [
        pa.array([song_id] * n, pa.string()),
        pa.array(np.arange(n), pa.int32()),
        pa.array(hits.time_s),
        pa.array(hits.key_number, pa.int32()),
        pa.array(hits.velocity, pa.int32()),
        pa.array([heard_as] * n, pa.string()),
    ]
    return PERCUSSION.check(pa.table(columns, schema=PERCUSSION.arrow))


def to_percussion(table: pa.Table) -> tuple[Hits, bool]:
    """Unpack the percussion of a song, and whether only bands were heard."""
    hits = Hits(
        to_numbers(table["time_s"]).astype(np.float64),
        to_numbers(table["key_number"]).astype(np.int64),
        to_numbers(table["velocity"]).astype(np.int64),
    )
    return hits, bool(table.num_rows) and table["heard_as"][0].as_py() == "bands"


def from_melody(song_id: str, found: Contour) -> pa.Table:
    """Pack how the melody of a song goes, one row a step."""
    n = len(found.time_s)
    columns = [
        pa.array([song_id] * n, pa.string()),
        pa.array(np.arange(n), pa.int32()),
        pa.array(found.time_s),
        pa.array(found.symbol, pa.int32()),
    ]
    return MELODY.check(pa.table(columns, schema=MELODY.arrow))


def to_melody(table: pa.Table) -> Contour:
    """Unpack how the melody of a song goes."""
    return Contour(to_numbers(table["time_s"]).astype(np.float64), to_numbers(table["contour_index"]).astype(np.int64))


def all_motions(tables: Iterable[pa.Table]) -> Mapping[str, ClipMotions]:
    """Gather the motions of the clips of all sessions, in order of clip."""
    found: dict[str, ClipMotions] = {}
    for table in tables:
        found |= to_motions(table)
    return dict(sorted(found.items()))
