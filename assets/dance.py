"""From a choreography to a finished dance: poses, lineage, quality."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import dagster as dg
import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from assets.dancing.assembled import assemble_steps
from assets.dancing.shown_moments import flip_sentences, move_sentence
from assets.declare import table_asset, table_assets
from assets.partitions import DANCE, EVERY, lake_key
from assets.plots.dance import contact_sheet, dance_timeline, measure_table
from assets.plots.draw import picture
from assets.reading.clips import load_clips, load_fences, read_clips
from assets.sources.sources import Studio, request_of, request_version
from assets.stamps import Part, Progress, Stored
from assets.tables import matching as matching_tables
from assets.tables.choreography import (
    from_dance_pose,
    from_dance_quality,
    from_frame_lineage,
    to_choreography,
    to_dance,
)
from assets.tables.music import to_music_beat
from kernels.assembly import foot_quality, one_frame_flips, quality, seam_quality
from kernels.assembly.blend import Dance
from kernels.assembly.quality import Measure
from kernels.assembly.timing import cover
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Choreography, Clip
from schemas.choreography import DANCE_POSE, DANCE_QUALITY, FRAME_LINEAGE
from schemas.keys import source_clip

_EVERY_CLIP = dg.AssetIn(partition_mapping=EVERY)


@table_assets(
    "assembly",
    (DANCE_POSE, FRAME_LINEAGE),
    group="dance",
    code_version="4",
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
    steps = to_choreography(choreography)
    dance = assemble_steps(
        steps, canonical_pose, studio.settings().dance, frame_rate_hz=request_of(studio, key).frame_rate_hz
    )
    progress.step()
    asked = request_version(studio, key)
    pose = from_dance_pose(song_id, method, dance)
    sheet = dg.MetadataValue.md(picture(contact_sheet(dance, CANONICAL.parent.tolist()), "the dance"))
    yield dg.Output(Part(key, pose, asked, metadata={"sheet": sheet}), DANCE_POSE.name)
    yield dg.Output(Part(key, from_frame_lineage(song_id, method, dance, steps), asked), FRAME_LINEAGE.name)


@table_asset(
    DANCE_QUALITY,
    group="dance",
    code_version="5",
    partitions=DANCE,
    ins={"canonical_pose": _EVERY_CLIP, "clip": _EVERY_CLIP},
    checks={
        "flips": "No joint flips from one frame to the next, and none moves further than in the clips.",
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
    music_feature: pa.Table,
    canonical_pose: Stored,
    clip: Stored,
    progress: dg.ResourceParam[Progress],
) -> Iterator[dg.Output[Part] | dg.AssetCheckResult]:
    """Measure the finished dance: beats, warp, seams, feet, use of the catalogue."""
    progress.begin("judging the dance", 1)
    song_id, method = lake_key(context.partition_key).split("|")
    steps = to_choreography(choreography)
    dance = to_dance(dance_pose, frame_lineage, steps)
    beat_s = to_music_beat(music_beat).time_s
    grid_s, _ = cover(beat_s, float(steps.song_end_s[-1]))
    strength = matching_tables.strength_between(music_feature, grid_s)
    clips = load_clips(canonical_pose, steps)
    found = {
        "flips": _flips(dance, steps, clips, load_fences(canonical_pose, steps)),
        "beats": [*quality.lag_measures(dance, steps, beat_s), *quality.beat_measures(dance, beat_s)],
        "warp": quality.warp_measures(steps),
        "seams": seam_quality.seam_measures(dance, steps, clips, skeleton=CANONICAL),
        "feet": [
            *foot_quality.foot_measures(dance, steps, clips),
            *foot_quality.knee_measures(dance, steps, clips),
            *foot_quality.slip_measures(dance, steps, clips),
        ],
        "intensity": quality.intensity_measures(dance, strength, grid_s),
        "catalogue": quality.catalogue_measures(_of_sources(steps), _seconds(clip)),
    }
    progress.step()
    every = [measure for measures in found.values() for measure in measures]
    timeline = picture(dance_timeline(dance, steps, beat_s), "timeline")
    shown = dg.MetadataValue.md(f"{timeline}\n\n{measure_table(every)}")
    table = from_dance_quality(song_id, method, every)
    yield dg.Output(Part(f"{song_id}|{method}", table, metadata={"timeline": shown}))
    for name, measures in found.items():
        if name not in ("intensity", "catalogue"):
            yield _check(name, measures)


def _flips(
    dance: Dance, steps: Choreography, clips: Mapping[str, Clip], fenced: Mapping[str, NDArray[np.bool_]]
) -> list[Measure]:
    """Measure what no body does in a frame; what is not as wanted says when, and of which clip."""
    flips = one_frame_flips.find_flips(dance.rotation_wxyz, CANONICAL.parent, dance.frame_rate_hz)
    furthest = one_frame_flips.furthest_move(dance, steps, clips, skeleton=CANONICAL, fenced=fenced)
    counted, moved = one_frame_flips.flip_measure(flips), one_frame_flips.move_measure(furthest)
    told = () if moved.is_passed or furthest is None else (move_sentence(furthest, dance, steps),)
    return [replace(counted, reasons=flip_sentences(flips, dance, steps)), replace(moved, reasons=told)]


def _check(name: str, measures: list[Measure]) -> dg.AssetCheckResult:
    told = [reason for m in measures for reason in m.reasons]
    return dg.AssetCheckResult(
        check_name=name,
        asset_key=DANCE_QUALITY.name,
        passed=all(m.is_passed is not False for m in measures),
        severity=dg.AssetCheckSeverity.WARN,
        metadata={m.name: float(m.value) for m in measures if np.isfinite(m.value)}
        | ({"not_as_wanted": dg.MetadataValue.json(told)} if told else {}),
    )


def _of_sources(steps: Choreography) -> Choreography:
    """Take mirrored clips for the clips they are images of."""
    return replace(steps, clip_id=tuple(source_clip(name) for name in steps.clip_id))


def _seconds(clip: Stored) -> dict[str, float]:
    """Length of every clip that was read."""
    return dict(read_clips(clip).select("clip_id", "duration_s").iter_rows())
