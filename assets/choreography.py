"""What is danced when: the methods, each writing the same table."""

from dataclasses import replace
from typing import Literal

import dagster as dg
import numpy as np
import pyarrow as pa

from assets import plots, tables
from assets.declare import table_asset
from assets.lineage import Part, Progress, Stored, repeatable
from assets.partitions import DANCE, EVERY, lake_key
from assets.sequence import Danced, by_matching, load_matches
from assets.sources import Studio
from kernels.assembly.timing import blend_widths, cover, trim
from kernels.graph.costs import PathCosts
from kernels.graph.path import InfeasiblePathError, Path, find_path, to_choreography
from kernels.types import Choreography, Float, Int, MotionGraph
from schemas.choreography import CHOREOGRAPHY
from schemas.settings import DanceSettings, PathSettings, Settings

_EVERY_CLIP = dg.AssetIn(partition_mapping=EVERY)


@table_asset(
    CHOREOGRAPHY,
    group="dance",
    code_version="2",
    settings="path match_path dance",
    partitions=DANCE,
    ins={name: _EVERY_CLIP for name in ("canonical_pose", "motion_feature", "motion_beat")},
    methods={
        "motion_graph_node": "graph",
        "motion_graph_edge": "graph",
        "[path]": "graph",
        "match": "matching",
        "music_segment": "matching",
        "music_feature": "matching",
        "motion_feature": "matching",
        "motion_beat": "matching",
        "canonical_pose": "matching",
        "[match_path]": "matching",
    },
)
def choreography(
    context: dg.AssetExecutionContext,
    motion_graph_node: Stored,
    motion_graph_edge: Stored,
    match: Stored,
    music_segment: Stored,
    music_feature: Stored,
    motion_feature: Stored,
    motion_beat: Stored,
    canonical_pose: Stored,
    music_beat: pa.Table,
    song: pa.Table,
    studio: dg.ResourceParam[Studio],
    progress: dg.ResourceParam[Progress],
) -> Part:
    """Choose what is danced when: a way through the motion graph, or a sequence of matches."""
    progress.begin("choosing the steps", 1)
    key = lake_key(context.partition_key)
    song_id, method = key.split("|")
    grid = tables.to_music_beat(music_beat)
    if len(grid.time_s) < 2:
        reason = "; ".join(filter(None, song["reason"].to_pylist())) or "it has no beats"
        raise dg.Failure(f"{song_id}: cannot be danced: {reason}", allow_retries=False)
    duration_s = float(max(song["duration_s"].to_pylist()))
    beat_s, _ = cover(grid.time_s, duration_s)
    settings = studio.settings()
    if method == "graph":
        graph, clip_ids = tables.to_motion_graph(motion_graph_node.read(), motion_graph_edge.read())
        danced = by_graph(graph, clip_ids, beat_s, duration_s, settings)
    else:
        found = load_matches(song_id, match, music_segment, music_feature, motion_feature, motion_beat)
        with repeatable():
            danced = by_matching(found, canonical_pose, beat_s, settings)
    progress.step()
    costs = {name: danced.costs.get(name, np.zeros(len(danced.steps.clip_id))) for name in COST_COLUMNS}
    return Part(key, tables.from_choreography(song_id, method, danced.steps, costs), metadata=danced.metadata)


COST_COLUMNS = tuple(name for name in CHOREOGRAPHY.arrow.names if name.endswith("_cost"))


def by_graph(
    graph: MotionGraph, clip_ids: tuple[str, ...], beat_s: Float, duration_s: float, settings: Settings
) -> Danced:
    """Find the best way through the motion graph for a song."""
    path, begins = search(graph, beat_s, settings.path)
    steps, kept = chosen_steps(path, graph, beat_s, clip_ids, duration_s, settings.dance)
    costs = {
        "transition_cost": path.transition_cost[kept],
        "warp_cost": path.warp_cost[kept],
        "stride_cost": path.stride_cost[kept],
        "beat_cost": path.beat_cost[kept],
        "repetition_cost": path.repetition_cost[kept],
    }
    metadata = {
        "cost": path.total_cost,
        "seams": int(steps.has_seam.sum()),
        "clips": len(set(steps.clip_id)),
        "steps_outside_warp_bounds": int(path.is_outside[kept].sum()),
        "begins_at": begins,
        "phrases": dg.MetadataValue.md(plots.phrase_table(steps)),
    }
    return Danced(steps, costs, metadata)


def search(graph: MotionGraph, beat_s: Float, settings: PathSettings) -> tuple[Path, str]:
    """Find the path from the first beat of a clip, or where none leads to the end at a good pace, from any beat."""
    usual = PathCosts()
    costs = replace(
        usual,
        transition=usual.transition * settings.transition_weight,
        warp=usual.warp * settings.warp_weight,
        usage=usual.usage * settings.repetition_weight,
        missed_beat=usual.missed_beat * settings.beat_weight,
        jump_back=usual.jump_back * settings.repetition_weight,
    )
    # Any beat within the hard bounds comes before a first beat played at a pace of last resort.
    first: tuple[Literal["first", "any"], str] = ("first", "the first beat of a clip")
    anywhere: tuple[Literal["first", "any"], str] = ("any", "any beat")
    for strict, (starts, begins) in ((True, first), (True, anywhere), (False, first), (False, anywhere)):
        try:
            return find_path(graph, beat_s, costs=costs, starts=starts, strict=strict), begins
        except InfeasiblePathError as error:
            if error.reason == "no_nodes":
                raise dg.Failure(f"no clip can be danced: {error}", allow_retries=False) from error
            nothing = str(error)
    raise dg.Failure(nothing, allow_retries=False)


def chosen_steps(
    path: Path, graph: MotionGraph, beat_s: Float, clip_ids: tuple[str, ...], duration_s: float, settings: DanceSettings
) -> tuple[Choreography, Int]:
    """Cut the path to the song and give its seams their blends; the steps, and which of the path's they are."""
    steps = to_choreography(path, graph, beat_s=beat_s, clip_ids=clip_ids, blend_s=settings.blend_s)
    steps, kept = trim(steps, duration_s)
    width = blend_widths(steps.song_start_s, steps.song_end_s, steps.has_seam, wanted_s=settings.blend_s)
    return replace(steps, blend_s=width), kept
