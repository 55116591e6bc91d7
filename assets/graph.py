"""The motion graph: which beat of which clip may follow which."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import dagster as dg
import numpy as np
import polars as pl
import pyarrow as pa

from assets.declare import table_assets
from assets.graph_memory import Beats, KeptArrays, keep, near_pairs, nodes_of, recall
from assets.partitions import EVERY
from assets.plots.draw import markdown
from assets.plots.graph import motion_graph_picture
from assets.reading.clips import image_of
from assets.sources.sources import Studio
from assets.stamps import Part, Progress, Stored, version_of
from assets.tables import pack
from assets.tables.graph import from_motion_graph_edge, from_motion_graph_node
from assets.tables.motion import CanonicalClip, to_canonical_pose
from kernels import rotation
from kernels.graph.beat_features import BeatFeatures, beat_features
from kernels.graph.distance import PairDistance
from kernels.graph.nodes import is_same_row, stretch_around
from kernels.graph.prune import Pruned, keep_all, keep_endless, keep_strongest, remove_dead_ends
from kernels.graph.shortlist import Work, nearest_of
from kernels.graph.transitions import Transitions, blend_margin_s, connect
from kernels.motion.velocity import accents, jerk_around, speed_between
from kernels.skeleton.canonical import JOINTS
from kernels.types import Float, MotionGraph
from schemas.graph import MOTION_GRAPH_EDGE, MOTION_GRAPH_NODE
from schemas.keys import mirrored, source_clip
from schemas.settings import MotionGraphSettings

MEMORY_VERSION = "5"
"""Raised by hand when features, rules or the shortlist change meaning."""

PRUNE: dict[str, Callable[[MotionGraph], Pruned]] = {
    "reach": keep_endless,
    "dead_ends": remove_dead_ends,
    "component": keep_strongest,
    "none": keep_all,
}


@table_assets(
    "motion_graph",
    (MOTION_GRAPH_NODE, MOTION_GRAPH_EDGE),
    group="catalog",
    code_version="7",
    settings="motion_graph dance.blend_s",
    ins={
        name: dg.AssetIn(partition_mapping=EVERY) for name in ("clip", "canonical_pose", "motion_beat", "motion_turn")
    },
    checks={"goes_on": (MOTION_GRAPH_NODE, "A dance can go on for ever.")},
)
def motion_graph(
    clip: Stored,
    canonical_pose: Stored,
    motion_beat: Stored,
    motion_turn: Stored,
    studio: dg.ResourceParam[Studio],
    pair_distance: dg.ResourceParam[PairDistance],
    graph_memory: dg.ResourceParam[KeptArrays],
    progress: dg.ResourceParam[Progress],
) -> Iterator[dg.Output[Part] | dg.AssetCheckResult]:
    """Join the beats of all clips where one pose may follow another."""
    settings = studio.settings().motion_graph
    progress.begin("motion graph", len(motion_beat.keys))
    margin_s = blend_margin_s(studio.settings().dance.blend_s)
    rules = version_of(MEMORY_VERSION, settings.metric, str(settings.neighbours), repr(margin_s))
    earlier = recall(graph_memory, rules)
    known = earlier.clips if earlier else {}
    labels: dict[str, str] = {}
    beats: list[Beats] = []
    for key in motion_beat.keys:
        labels |= {row["clip_id"]: row["label"] for row in pack.read_rows(clip.read(key)).to_pylist()}
        beats += _session(key, labels, canonical_pose, (motion_beat, motion_turn), settings, known)
        progress.step()
    nodes = nodes_of(beats)
    features, listed, work = near_pairs(
        earlier,
        beats,
        nodes,
        _of_no_beat(settings),
        distance=pair_distance,
        n_nearest=settings.neighbours,
        min_margin_s=margin_s,
    )
    keep(graph_memory, rules, beats, features, listed)
    pairs = nearest_of(listed, nodes, n_nearest=settings.neighbours)
    found = connect(nodes, pairs, threshold=settings.threshold or None)
    graph = _as_moved(found.graph, beats)
    losses = {name: prune(graph) for name, prune in PRUNE.items()}
    ids = [_clip_of(b) for b in beats]
    node = _nodes(graph, beats, labels, losses[settings.prune])
    metadata = {
        **_metadata(found, losses, settings.prune),
        **_work(work, beats, known),
        "device": getattr(pair_distance, "name", "reference"),
        "labels": dg.MetadataValue.md(_by_label(node)),
    }
    yield dg.Output(Part("", node, metadata=metadata), MOTION_GRAPH_NODE.name)
    yield dg.Output(Part("", from_motion_graph_edge(graph, ids, found.distance)), MOTION_GRAPH_EDGE.name)
    yield dg.AssetCheckResult(
        check_name="goes_on",
        asset_key=MOTION_GRAPH_NODE.name,
        passed=found.is_endless,
        severity=dg.AssetCheckSeverity.WARN,
        metadata={"beats": len(nodes), "threshold_used": found.threshold_used},
    )


def _as_moved(graph: MotionGraph, beats: Sequence[Beats]) -> MotionGraph:
    """Give the nodes of a graph what was measured of their beats."""
    names = ("accent", "peak_jerk", "usual_jerk", "speed")
    return replace(graph, **{n: np.concatenate([*(getattr(b, n) for b in beats), np.zeros(0)]) for n in names})


def _nodes(graph: MotionGraph, beats: Sequence[Beats], labels: Mapping[str, str], kept: Pruned) -> pa.Table:
    index = np.concatenate([*(np.arange(len(b.time_s)) for b in beats), np.zeros(0, int)])
    ids = [_clip_of(b) for b in beats]
    seen = [labels[source_clip(clip)] for clip in ids]
    return from_motion_graph_node(graph, ids, index, seen, kept.is_kept, [b.clip_id == _clip_of(b) for b in beats])


_TURNS = "~turns"
"""Behind the name of a clip: the row of its turns, beside that of its beats."""


def _clip_of(beats: Beats) -> str:
    """Name the clip of a row of beats or turns."""
    return beats.clip_id.removesuffix(_TURNS)


def _work(work: Work, beats: Sequence[Beats], known: Mapping[str, Beats]) -> dict[str, object]:
    """Count what was computed, and not remembered."""
    return {
        "computed_clips": len(
            {
                source_clip(_clip_of(b))
                for b in beats
                if b.version != (known[b.clip_id].version if b.clip_id in known else "")
            }
        ),
        "computed_rows": work.computed_nodes,
        "rows_searched_again": work.refilled_rows,
        "computed_distances": work.distances,
    }


def _session(
    key: str,
    labels: Mapping[str, str],
    canonical_pose: Stored,
    rows: tuple[Stored, Stored],
    settings: MotionGraphSettings,
    known: Mapping[str, Beats],
) -> list[Beats]:
    """Take beats and turns of one session's clips with their features: remembered ones where nothing changed."""
    read = [pack.by_clip(stored.read(key)) for stored in rows[: 2 if settings.turns else 1]]
    if settings.turns:  # turns that are the beats would be shown again for nothing
        read[1] = {c: t for c, t in read[1].items() if not (c in read[0] and _is_same(read[0][c], t))}
    stamps = [stored.stamp(key).clips for stored in rows]
    versions = {
        clip: version_of(stored.content, *(stamp[clip].content for stamp in stamps))
        for clip, stored in canonical_pose.stamp(key).clips.items()
        # Not beats of an earlier build whose renewal failed.
        if clip in labels and all(clip in stamp for stamp in stamps) and any(clip in one for one in read)
    }
    images = {
        clip: [
            name + row
            for name in [clip, *([mirrored(clip)] if settings.mirror else [])]
            for row, one in zip(("", _TURNS), read, strict=False)
            if clip in one
        ]
        for clip in versions
    }
    changed = [
        clip
        for clip, version in versions.items()
        if any(name not in known or known[name].version != version for name in images[clip])
    ]
    poses = pack.by_clip(canonical_pose.read(key, clip_ids=changed)) if changed else {}
    found = []
    for clip_id in versions:
        if clip_id in poses:
            moved = to_canonical_pose(poses[clip_id])
            by_name = {clip_id: moved} | ({mirrored(clip_id): image_of(moved)} if settings.mirror else {})
            for name in images[clip_id]:
                clip, is_turn = name.removesuffix(_TURNS), name.endswith(_TURNS)
                time_s = pack.to_numbers(read[is_turn][clip_id]["time_s"])
                found.append(replace(_beats(by_name[clip], time_s, versions[clip_id], settings), clip_id=name))
        elif clip_id not in changed:
            found += [known[name] for name in images[clip_id]]
    return found


def _is_same(beats: pa.Table, turns: pa.Table) -> bool:
    return is_same_row(*(pack.to_numbers(rows["time_s"]) for rows in (beats, turns)))


def _beats(moved: CanonicalClip, beat_s: Float, version: str, settings: MotionGraphSettings) -> Beats:
    """Take the beats of one clip with their features."""
    time_s = np.minimum(beat_s, moved.duration_s)
    features = beat_features(
        moved.rotation_wxyz,
        moved.position_xyz_m,
        frame_rate_hz=moved.frame_rate_hz,
        time_s=time_s,
        metric=settings.metric,  # type: ignore[arg-type]
    )
    peak, usual = jerk_around(moved.position_xyz_m, moved.frame_rate_hz, time_s=time_s)
    accent = accents(moved.position_xyz_m, moved.frame_rate_hz, time_s=time_s)
    speed = speed_between(moved.position_xyz_m, moved.frame_rate_hz, time_s=time_s)
    usual_at = np.full(len(time_s), usual)
    start_s, end_s = stretch_around(time_s, moved.is_fenced, moved.frame_rate_hz)
    return Beats(moved.clip_id, version, time_s, start_s, end_s, features, accent, peak, usual_at, speed)


def _of_no_beat(settings: MotionGraphSettings) -> BeatFeatures:
    """Features of no beat, where no clip has one."""
    return beat_features(
        np.tile(rotation.IDENTITY, (1, len(JOINTS), 1)),
        np.zeros((1, len(JOINTS), 3)),
        frame_rate_hz=1.0,
        time_s=np.zeros(0),
        metric=settings.metric,  # type: ignore[arg-type]
    )


def _by_label(node: pa.Table) -> str:
    """Count what each label has in the graph: clips, beats, and how many of them a dance can use."""
    counted = (
        pl.DataFrame(node.select(["label", "clip_id", "is_kept"]))
        .group_by("label")
        .agg(
            pl.col("clip_id").n_unique().alias("clips"),
            pl.col("clip_id").filter("is_kept").n_unique().alias("clips danced"),
            pl.len().alias("beats"),
            pl.col("is_kept").sum().alias("beats danced"),
        )
        .sort("label")
    )
    return markdown(counted.columns, counted.rows())


def _metadata(found: Transitions, losses: dict[str, Pruned], chosen: str) -> dict[str, object]:
    degree = np.bincount(found.graph.source, minlength=len(found.graph.time_s)).astype(np.float64)
    picture = motion_graph_picture(found.graph.weight, found.threshold_used, degree)
    loss = markdown(
        ("pruning", "beats lost", "clips lost", "seconds lost", "of", "used"),
        [
            (
                name,
                p.n_nodes_lost,
                p.n_clips_lost,
                f"{p.lost_s:.1f}",
                f"{p.total_s:.1f}",
                "yes" if name == chosen else "",
            )
            for name, p in losses.items()
            if name != "none"
        ],
    )
    return {
        "transitions": len(found.graph.source),
        "threshold_asked": found.threshold_asked,
        "threshold_used": found.threshold_used,
        "removed_for_missing_frames": found.n_margin_removed,
        "removed_for_jumps_in_recordings": found.n_jerk_removed,
        "catalogue_loss": dg.MetadataValue.md(f"{picture}\n\n{loss}"),
    }
