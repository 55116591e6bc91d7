"""What is danced when: the methods, each writing the same table."""

import dagster as dg
import pyarrow as pa

from assets.dancing import licences
from assets.dancing.by_graph import by_graph, catalogue, direction_of, heard_song, poses_of, read_clips
from assets.dancing.by_hmm import by_hmm, load_dancer
from assets.dancing.by_matching import by_matching, load_matches
from assets.declare import table_asset
from assets.partitions import DANCE, EVERY, base_method, lake_key
from assets.sources.sources import Studio, request_of, request_version
from assets.stamps import Part, Progress, Stored, repeatable
from assets.tables import pack as tables
from assets.tables.hmm import to_performances
from kernels.assembly.timing import cover
from schemas.choreography import CHOREOGRAPHY

_EVERY_CLIP = dg.AssetIn(partition_mapping=EVERY)


@table_asset(
    CHOREOGRAPHY,
    group="dance",
    code_version="5",
    settings="path match_path hmm_path choreography_model dance.blend_s",
    sources="request",
    partitions=DANCE,
    ins={name: _EVERY_CLIP for name in ("clip", "canonical_pose", "motion_feature", "motion_beat", "key_pose")},
    methods={
        "motion_graph_node": "graph",
        "motion_graph_edge": "graph",
        "[path]": "graph",
        "match": "matching",
        "music_segment": "matching",
        "music_repeat": "graph",
        "music_feature": "graph,matching",
        "motion_feature": "matching",
        "motion_beat": "matching",
        "canonical_pose": "graph,matching,hmm",
        "[match_path]": "matching",
        "key_pose": "hmm",
        "performance": "hmm",
        "choreography_model": "hmm",
        "music_evidence": "hmm",
        "percussion": "hmm",
        "melody": "hmm",
        "[hmm_path]": "hmm",
        "[choreography_model]": "hmm",
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
    music_repeat: Stored,
    motion_feature: Stored,
    motion_beat: Stored,
    canonical_pose: Stored,
    key_pose: Stored,
    performance: Stored,
    choreography_model: Stored,
    music_evidence: Stored,
    percussion: Stored,
    melody: Stored,
    music_beat: pa.Table,
    song: pa.Table,
    studio: dg.ResourceParam[Studio],
    progress: dg.ResourceParam[Progress],
) -> Part:
    """Choose what is danced when: a way through the motion graph, a sequence of matches, or what the model says."""
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
        known = catalogue(graph, clip_ids, clips, asked.allow, poses=poses_of(canonical_pose, settings))
        feature, repeat = music_feature.read(song_id), music_repeat.read(song_id)
        danced = by_graph(known, heard_song(grid, duration_s, feature=feature, repeat=repeat), settings, asked)
    elif method == "matching" and asked.wishes:
        raise dg.Failure(
            f"{song_id}: pins are kept by the methods graph and hmm; dance it with --method graph or --method hmm",
            allow_retries=False,
        )
    elif method == "hmm":
        dancer = load_dancer(
            choreography_model.read(),
            music_evidence.read(),
            key_pose,
            {p.clip_id for p in to_performances(performance.read())},
            read_clips([clip.read(session) for session in clip.keys]),
            asked=asked,
            settings=settings,
        )
        drums, tune = percussion.read(song_id), melody.read(song_id)
        request = request_of(studio, key)
        with repeatable():
            danced = by_hmm(
                dancer,
                drums,
                tune,
                heard_song(grid, duration_s),
                canonical_pose,
                settings,
                asked,
                temperature=request.temperature,
                seed=request.seed,
            )
    else:
        licence_of = dict(read_clips([clip.read(s) for s in clip.keys]).select("clip_id", "licence").iter_rows())
        free = licences.free_to_join(licence_of, asked.allow)
        if licence_of and not free:
            why = f"has a licence of {', '.join(asked.allow)}" if asked.allow else "may be changed"
            raise dg.Failure(f"no clip may be danced: none {why}", allow_retries=False)
        found = load_matches(song_id, match, music_segment, music_feature, motion_feature, motion_beat, may_dance=free)
        with repeatable():
            danced = by_matching(found, canonical_pose, beat_s, settings)
    progress.step()
    rows = tables.from_choreography(song_id, method, danced.steps, danced.costs, danced.pin_ids, danced.states)
    return Part(key, rows, request_version(studio, key), metadata=danced.metadata)
