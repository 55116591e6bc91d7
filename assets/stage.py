"""From a finished dance to its stage: motion, song, where every frame comes from, under which terms it may be used."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import dagster as dg
import numpy as np
import polars as pl
import pyarrow as pa
import pyarrow.compute as pc

from assets.dancing import licences
from assets.dancing.characters import Cast, CharacterError, character_of, character_version, dress, read_clip, read_file
from assets.declare import table_asset
from assets.formats import audio, midi
from assets.formats.audio import Audio
from assets.formats.usd_character import is_file
from assets.partitions import DANCE, EVERY, lake_key
from assets.reading.clips import read_clips
from assets.sources.sources import Studio
from assets.stamps import Progress, Stored
from assets.tables import pack
from assets.tables.choreography import to_choreography
from kernels.music.preview import render_preview
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Choreography, Clip
from kernels.warp import EASY_WARP
from schemas.choreography import CHOREOGRAPHY, USD_ANIMATION
from schemas.keys import source_clip

_EVERY_CLIP = dg.AssetIn(partition_mapping=EVERY)


@dataclass(frozen=True, eq=False)
class Stage:
    """A dance ready to be written: its motion, its song, what it was made from, how good it is.

    ``lineage`` has a value a frame by the names of :data:`schemas.stage_contract.LINEAGE`; ``cast`` is the character it
    is danced by, None for odori's own body; ``asked`` the version of that wish.
    """

    song_id: str
    method: str
    clip: Clip
    sound: Audio
    provenance: Mapping[str, Any]
    quality: Mapping[str, Any]
    lineage: Mapping[str, Any]
    cast: Cast | None = None
    asked: str = ""


@table_asset(
    USD_ANIMATION,
    group="dance",
    code_version="5",
    sources="character",
    partitions=DANCE,
    ins={name: _EVERY_CLIP for name in ("clip", "skeleton", "pose")},
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
    skeleton: Stored,
    pose: Stored,
    studio: dg.ResourceParam[Studio],
    progress: dg.ResourceParam[Progress],
) -> Stage:
    """Write the dance as USD, alone and packed with its song."""
    progress.begin("writing the stage", 1)
    key = lake_key(context.partition_key)
    song_id, method = key.split("|")
    played = pack.read_rows(song).to_pylist()[0]
    steps = to_choreography(choreography)
    moved = Clip(
        CANONICAL,
        pack.frame_rate_hz(dance_pose),
        pack.to_array(dance_pose["root_xyz_m"]),
        pack.to_array(dance_pose["rotation_wxyz"]),
    )
    provenance = _provenance(played, method, steps, clip)
    refuse_changed(frame_lineage, {row["clip_id"]: row["licence"] for row in provenance["clips"]})
    cast = _cast(character_of(studio, key), studio, skeleton, pose)
    if cast is not None:
        moved, provenance["character"] = dress(moved, cast)
    stage = Stage(
        song_id,
        method,
        moved,
        _sound(played, studio),
        provenance,
        _quality(dance_quality),
        lineage_of(frame_lineage, choreography),
        cast,
        character_version(studio, key),
    )
    progress.step()
    return stage


def refuse_changed(frames: pa.Table, licence_of: Mapping[str, str]) -> None:
    """Raise dg.Failure where a clip that may not be changed is blended with another: a promise to its author.

    Methods of dancing keep such clips out of their seams; this is the last look before anything leaves the studio.
    """
    whole = {clip for clip, name in licence_of.items() if not licences.may_be_joined(name)}
    blended = frames.filter(pc.is_valid(frames["blend_clip_id"]))
    touched = sorted(whole & {*blended["clip_id"].to_pylist(), *blended["blend_clip_id"].to_pylist()})
    if touched:
        raise dg.Failure(
            f"want clips whose licence forbids changes left whole, got {', '.join(touched)} in a blend; leave them out "
            "with 'allow' in the brief",
            allow_retries=False,
        )


def _cast(text: str, studio: Studio, skeleton: Stored, pose: Stored) -> Cast | None:
    """Find the character of a dance; None for odori's own mannequin."""
    try:
        if not text:
            return None
        return read_file(studio, text) if is_file(text) else read_clip(text, skeleton, pose)
    except CharacterError as error:
        raise dg.Failure(f"character: {error}", allow_retries=False) from error


def _sound(song: Mapping[str, Any], studio: Studio) -> Audio:
    """Decode the song; a MIDI file is played by a plain synthesiser, so that there is something to dance to."""
    place, limit_s = studio.file(song["path"]), studio.settings().limits.longest_song_s
    if song["kind"] == "midi":
        sound = render_preview(midi.read(place, limit_s=limit_s).notes)
        return Audio(sound.reshape(len(sound), -1), 44100)
    return audio.read(place, limit_s=limit_s)


def _provenance(song: Mapping[str, Any], method: str, steps: Choreography, clip: Stored) -> dict[str, Any]:
    danced = read_clips(clip, {source_clip(name) for name in steps.clip_id})
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
        for i in np.flatnonzero((warp < EASY_WARP[0] - 1e-6) | (warp > EASY_WARP[1] + 1e-6))
    ]


def _quality(table: pa.Table) -> dict[str, Any]:
    return {
        row["metric_name"]: {name: row[name] for name in ("value", "wanted", "is_passed", "reasons")}
        for row in table.to_pylist()
    }


def lineage_of(frames: pa.Table, choreography: pa.Table) -> dict[str, Any]:
    """Gather what the stage says of each frame, by the names of :data:`schemas.stage_contract.LINEAGE`.

    Parameters
    ----------
    frames : rows of ``frame_lineage``, F
    choreography : rows of ``choreography`` of the same dance, S >= 1

    Returns
    -------
    dict of F values each
    """
    time_s = pack.to_numbers(frames["time_s"])
    start_s = pack.to_numbers(choreography["song_start_s"])
    step = np.clip(np.searchsorted(start_s, time_s + 1e-9, side="right") - 1, 0, len(start_s) - 1)
    told = [json.dumps(told_step(row), sort_keys=True) for row in choreography.to_pylist()]
    return {
        "odori:clip": frames["clip_id"].to_pylist(),
        "odori:clipTime": pack.to_numbers(frames["clip_time_s"]),
        "odori:mirrored": frames["is_mirrored"].to_pylist(),
        "odori:blendClip": [partner or "" for partner in frames["blend_clip_id"].to_pylist()],
        "odori:blendTime": np.nan_to_num(frames["blend_time_s"].to_numpy().astype(np.float64)),
        "odori:blendMirrored": frames["is_blend_mirrored"].to_pylist(),
        "odori:blendWeight": pack.to_numbers(frames["blend_weight_ratio"]),
        "odori:warp": pack.to_numbers(frames["warp_ratio"]),
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
