"""From a choreography to a finished dance: poses, lineage, quality, and the stage."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import dagster as dg
import numpy as np
import polars as pl
import pyarrow as pa

from assets import plots, tables
from assets.declare import table_asset, table_assets
from assets.formats import audio, midi
from assets.formats.audio import Audio
from assets.lineage import Part, Progress, Stored
from assets.partitions import DANCE, EVERY, lake_key
from assets.sources import Studio, request_of, request_version
from kernels.assembly import foot_quality, quality, seam_quality
from kernels.assembly.blend import assemble
from kernels.assembly.feet import lock_feet, planted_feet
from kernels.assembly.quality import Measure
from kernels.music.preview import render_preview
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Choreography, Clip
from schemas.choreography import DANCE_POSE, DANCE_QUALITY, FRAME_LINEAGE, USD_ANIMATION

_EVERY_CLIP = dg.AssetIn(partition_mapping=EVERY)


def load_clips(canonical_pose: Stored, steps: Choreography) -> dict[str, Clip]:
    """Read the canonical clips a choreography dances, and no others."""
    wanted = set(steps.clip_id)
    found: dict[str, Clip] = {}
    for key in canonical_pose.keys:
        here = wanted & set(canonical_pose.stamp(key).clips)
        if here:
            for moved in tables.to_canonical_poses(canonical_pose.read(key, clip_ids=here)):
                found[moved.clip_id] = Clip(CANONICAL, moved.frame_rate_hz, moved.root_xyz_m, moved.rotation_wxyz)
    return found


@table_assets(
    "assembly",
    (DANCE_POSE, FRAME_LINEAGE),
    group="dance",
    code_version="1",
    settings="dance",
    sources="request",
    partitions=DANCE,
    ins={"canonical_pose": _EVERY_CLIP},
)
def assembly(
    context: dg.AssetExecutionContext,
    choreography: pa.Table,
    canonical_pose: Stored,
    studio: dg.ResourceParam[Studio],
    progress: dg.ResourceParam[Progress],
) -> Iterator[dg.Output[Part]]:
    """Warp, join and sample the clips of a choreography; every frame keeps where it came from."""
    progress.begin("assembling the dance", 1)
    key = lake_key(context.partition_key)
    song_id, method = key.split("|")
    steps = tables.to_choreography(choreography)
    clips, settings = load_clips(canonical_pose, steps), studio.settings().dance
    dance = assemble(
        steps,
        clips,
        skeleton=CANONICAL,
        frame_rate_hz=request_of(studio, key).frame_rate_hz or settings.frame_rate_hz,
        duration_s=float(steps.song_end_s[-1]),
        shape=settings.blend_shape,
    )
    if settings.lock_feet:
        dance = lock_feet(dance, planted_feet(dance, steps, clips))
    progress.step()
    asked = request_version(studio, key)
    pose = tables.from_dance_pose(song_id, method, dance)
    sheet = dg.MetadataValue.md(plots.picture(plots.contact_sheet(dance, CANONICAL.parent.tolist()), "the dance"))
    yield dg.Output(Part(key, pose, asked, metadata={"sheet": sheet}), DANCE_POSE.name)
    yield dg.Output(Part(key, tables.from_frame_lineage(song_id, method, dance, steps), asked), FRAME_LINEAGE.name)


@table_asset(
    DANCE_QUALITY,
    group="dance",
    code_version="2",
    partitions=DANCE,
    ins={"canonical_pose": _EVERY_CLIP, "clip": _EVERY_CLIP},
    checks={
        "beats": "Beats on time, and better than chance to an independent observer.",
        "warp": "Clips near their own pace.",
        "seams": "Seams no rougher than the clips themselves.",
        "feet": "Feet that stay where they stand, and on the floor.",
    },
)
def dance_quality(
    context: dg.AssetExecutionContext,
    choreography: pa.Table,
    dance_pose: pa.Table,
    frame_lineage: pa.Table,
    music_beat: pa.Table,
    canonical_pose: Stored,
    clip: Stored,
    progress: dg.ResourceParam[Progress],
) -> Iterator[dg.Output[Part] | dg.AssetCheckResult]:
    """Measure the finished dance: beats, warp, seams, feet, use of the catalogue."""
    progress.begin("judging the dance", 1)
    song_id, method = lake_key(context.partition_key).split("|")
    steps = tables.to_choreography(choreography)
    dance = tables.to_dance(dance_pose, frame_lineage, steps)
    beat_s = tables.to_music_beat(music_beat).time_s
    clips = load_clips(canonical_pose, steps)
    found = {
        "beats": [*quality.lag_measures(dance, steps, beat_s), *quality.beat_measures(dance, beat_s)],
        "warp": quality.warp_measures(steps),
        "seams": seam_quality.seam_measures(dance, steps, clips, skeleton=CANONICAL),
        "feet": foot_quality.foot_measures(dance, steps, clips),
        "catalogue": quality.catalogue_measures(steps, _seconds(clip)),
    }
    progress.step()
    every = [measure for measures in found.values() for measure in measures]
    timeline = plots.picture(plots.dance_timeline(dance, steps, beat_s), "timeline")
    picture = dg.MetadataValue.md(f"{timeline}\n\n{plots.measures(every)}")
    table = tables.from_dance_quality(song_id, method, every)
    yield dg.Output(Part(f"{song_id}|{method}", table, metadata={"timeline": picture}))
    for name, measures in found.items():
        if name != "catalogue":
            yield _check(name, measures)


def _check(name: str, measures: list[Measure]) -> dg.AssetCheckResult:
    return dg.AssetCheckResult(
        check_name=name,
        asset_key=DANCE_QUALITY.name,
        passed=all(m.is_passed is not False for m in measures),
        severity=dg.AssetCheckSeverity.WARN,
        metadata={m.name: float(m.value) for m in measures if np.isfinite(m.value)},
    )


def _seconds(clip: Stored) -> dict[str, float]:
    """Length of every clip that was read."""
    rows = pl.concat([_rows(clip.read(key)) for key in clip.keys])
    return dict(rows.select("clip_id", "duration_s").iter_rows())


def _rows(clip: pa.Table) -> pl.DataFrame:
    """Take the clips that were read."""
    return pl.DataFrame(clip).filter(pl.col("state") == "read")


@dataclass(frozen=True, eq=False)
class Stage:
    """A dance ready to be written: its motion, its song, what it was made from, how good it is."""

    song_id: str
    method: str
    clip: Clip
    sound: Audio
    provenance: Mapping[str, Any]
    quality: Mapping[str, Any]


@table_asset(
    USD_ANIMATION,
    group="dance",
    code_version="1",
    partitions=DANCE,
    ins={"clip": _EVERY_CLIP},
    io_manager="stage",
)
def usd_animation(
    context: dg.AssetExecutionContext,
    dance_pose: pa.Table,
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
    danced = pl.concat([_rows(clip.read(key, clip_ids=set(steps.clip_id))) for key in clip.keys])
    return {
        "method": method,
        "song": {"path": song["path"], "sha256": song["source_sha256"]},
        "clips": danced.select("clip_id", "path", pl.col("source_sha256").alias("sha256"), "licence").to_dicts(),
    }


def _quality(table: pa.Table) -> dict[str, Any]:
    return {
        row["metric_name"]: {"value": row["value"], "wanted": row["wanted"], "is_passed": row["is_passed"]}
        for row in table.to_pylist()
    }
