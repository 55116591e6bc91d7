"""From a finished dance to its stage: motion, song, where every frame comes from, under which terms it may be used."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import dagster as dg
import numpy as np
import polars as pl
import pyarrow as pa

from assets import licences, tables
from assets.declare import table_asset
from assets.formats import audio, midi
from assets.formats.audio import Audio
from assets.lineage import Progress, Stored
from assets.partitions import DANCE, EVERY, lake_key
from assets.sources import Studio
from kernels.music.preview import render_preview
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Choreography, Clip
from schemas.choreography import CHOREOGRAPHY, USD_ANIMATION
from schemas.keys import source_clip

_EVERY_CLIP = dg.AssetIn(partition_mapping=EVERY)


@dataclass(frozen=True, eq=False)
class Stage:
    """A dance ready to be written: its motion, its song, what it was made from, how good it is.

    ``lineage`` has a value a frame by the names of :data:`schemas.usd.LINEAGE`.
    """

    song_id: str
    method: str
    clip: Clip
    sound: Audio
    provenance: Mapping[str, Any]
    quality: Mapping[str, Any]
    lineage: Mapping[str, Any]


@table_asset(
    USD_ANIMATION,
    group="dance",
    code_version="2",
    partitions=DANCE,
    ins={"clip": _EVERY_CLIP},
    io_manager="stage",
)
def usd_animation(
    context: dg.AssetExecutionContext,
    dance_pose: pa.Table,
    frame_lineage: pa.Table,
    choreography: pa.Table,
    dance_quality: pa.Table,
    song: pa.Table,
    clip: Stored,
    studio: dg.ResourceParam[Studio],
    progress: dg.ResourceParam[Progress],
) -> Stage:
    """Write the dance as USD, alone and packed with its song."""
    progress.begin("writing the stage", 1)
    song_id, method = lake_key(context.partition_key).split("|")
    played = next(row for row in song.to_pylist() if row["state"] == "read")
    steps = tables.to_choreography(choreography)
    moved = Clip(
        CANONICAL,
        tables.frame_rate_hz(dance_pose),
        tables.to_array(dance_pose["root_xyz_m"]),
        tables.to_array(dance_pose["rotation_wxyz"]),
    )
    stage = Stage(
        song_id,
        method,
        moved,
        _sound(played, studio),
        _provenance(played, method, steps, clip),
        _quality(dance_quality),
        lineage_of(frame_lineage, choreography),
    )
    progress.step()
    return stage


def _sound(song: Mapping[str, Any], studio: Studio) -> Audio:
    """Decode the song; a MIDI file is played by a plain synthesiser, so that there is something to dance to."""
    place, limit_s = studio.file(song["path"]), studio.settings().limits.longest_song_s
    if song["kind"] == "midi":
        sound = render_preview(midi.read(place, limit_s=limit_s).notes)
        return Audio(sound.reshape(len(sound), -1), 44100)
    return audio.read(place, limit_s=limit_s)


def _provenance(song: Mapping[str, Any], method: str, steps: Choreography, clip: Stored) -> dict[str, Any]:
    danced = pl.concat(
        [read_rows(clip.read(key, clip_ids={source_clip(name) for name in steps.clip_id})) for key in clip.keys]
    )
    return {
        "method": method,
        "song": {"path": song["path"], "sha256": song["source_sha256"]},
        "outside_warp": outside_warp(steps),
        "licence": licences.report(dict(danced.select("clip_id", "licence").iter_rows())),
        "clips": danced.select(
            "clip_id", "session", "label", "style", "path", pl.col("source_sha256").alias("sha256"), "licence"
        ).to_dicts(),
    }


def outside_warp(steps: Choreography) -> list[dict[str, Any]]:
    """List the steps that leave 0.90 to 1.10 of their clips' own pace."""
    warp = steps.warp_ratio
    return [
        {
            "song_start_s": round(float(steps.song_start_s[i]), 4),
            "clip_id": source_clip(steps.clip_id[i]),
            "warp_ratio": round(float(warp[i]), 4),
        }
        for i in np.flatnonzero((warp < 0.90 - 1e-6) | (warp > 1.10 + 1e-6))
    ]


def read_rows(clip: pa.Table) -> pl.DataFrame:
    """Take the clips that were read."""
    return pl.DataFrame(clip).filter(pl.col("state") == "read")


def _quality(table: pa.Table) -> dict[str, Any]:
    return {
        row["metric_name"]: {"value": row["value"], "wanted": row["wanted"], "is_passed": row["is_passed"]}
        for row in table.to_pylist()
    }


def lineage_of(frames: pa.Table, choreography: pa.Table) -> dict[str, Any]:
    """Gather what the stage says of each frame, by the names of :data:`schemas.usd.LINEAGE`.

    Parameters
    ----------
    frames : rows of ``frame_lineage``, F
    choreography : rows of ``choreography`` of the same dance, S >= 1

    Returns
    -------
    dict of F values each
    """
    time_s = tables.to_numbers(frames["time_s"])
    start_s = tables.to_numbers(choreography["song_start_s"])
    step = np.clip(np.searchsorted(start_s, time_s + 1e-9, side="right") - 1, 0, len(start_s) - 1)
    told = [json.dumps(told_step(row), sort_keys=True) for row in choreography.to_pylist()]
    return {
        "odori:clip": frames["clip_id"].to_pylist(),
        "odori:clipTime": tables.to_numbers(frames["clip_time_s"]),
        "odori:blendClip": [partner or "" for partner in frames["blend_clip_id"].to_pylist()],
        "odori:blendTime": np.nan_to_num(frames["blend_time_s"].to_numpy().astype(np.float64)),
        "odori:blendWeight": tables.to_numbers(frames["blend_weight_ratio"]),
        "odori:warp": tables.to_numbers(frames["warp_ratio"]),
        "odori:step": [told[i] for i in step.tolist()],
    }


def told_step(row: Mapping[str, Any]) -> dict[str, Any]:
    """Say of one row of ``choreography`` what it dances and why: its place, pin and costs, without the costs of 0."""
    costs = {name.removesuffix("_cost"): round(row[name], 4) for name in COSTS if row[name]}
    also = {"is_mirrored": True} if row.get("is_mirrored") else {}
    return {
        "step_index": row["step_index"],
        "song_start_s": round(row["song_start_s"], 4),
        "song_end_s": round(row["song_end_s"], 4),
        "clip_id": row["clip_id"],
        "clip_start_s": round(row["clip_start_s"], 4),
        "clip_end_s": round(row["clip_end_s"], 4),
        "has_seam": row["has_seam"],
        "blend_s": round(row["blend_s"], 4),
        "warp_ratio": round(row["warp_ratio"], 4),
        "pin": row["pin_id"],
        "costs": costs,
        **also,
    }


COSTS = tuple(name for name in CHOREOGRAPHY.arrow.names if name.endswith("_cost"))
