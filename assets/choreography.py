"""What is danced when: the methods, each writing the same table."""

import dagster as dg
import pyarrow as pa

from assets import tables
from assets.declare import table_asset
from assets.direction import Song as SongBeats
from assets.graph_path import by_graph, catalogue, direction_of, read_clips
from assets.lineage import Part, Progress, Stored, repeatable
from assets.partitions import DANCE, EVERY, base_method, lake_key
from assets.sequence import by_matching, load_matches
from assets.sources import Studio, request_version
from kernels.assembly.timing import cover
from schemas.choreography import CHOREOGRAPHY

_EVERY_CLIP = dg.AssetIn(partition_mapping=EVERY)


@table_asset(
    CHOREOGRAPHY,
    group="dance",
    code_version="2",
    settings="path match_path dance.blend_s",
    sources="request",
    partitions=DANCE,
    ins={name: _EVERY_CLIP for name in ("clip", "canonical_pose", "motion_feature", "motion_beat")},
    methods={
        "motion_graph_node": "graph",
        "motion_graph_edge": "graph",
        "clip": "graph",
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
    clip: Stored,
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
    asked = direction_of(studio, key)
    if base_method(method) == "graph":
        graph, clip_ids = tables.to_motion_graph(motion_graph_node.read(), motion_graph_edge.read())
        clips = read_clips([clip.read(session) for session in clip.keys])
        known = catalogue(graph, clip_ids, clips, asked.allow)
        danced = by_graph(known, SongBeats(beat_s, grid, duration_s), settings, asked)
    elif asked.wishes or asked.allow:
        raise dg.Failure(
            f"{song_id}: pins and licences are kept by the graph method alone; dance it with --method graph",
            allow_retries=False,
        )
    else:
        found = load_matches(song_id, match, music_segment, music_feature, motion_feature, motion_beat)
        with repeatable():
            danced = by_matching(found, canonical_pose, beat_s, settings)
    progress.step()
    rows = tables.from_choreography(song_id, method, danced.steps, danced.costs, danced.pin_ids)
    return Part(key, rows, request_version(studio, key), metadata=danced.metadata)
