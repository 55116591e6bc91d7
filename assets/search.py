"""Motion search: the trained encoder, the embedding of every clip, the index, and labels for clips without one."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import dagster as dg
import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from assets.declare import code_version, table_asset
from assets.partitions import EVERY, SESSION
from assets.plots import search as search_plots
from assets.sources.sources import Studio
from assets.stamps import Earlier, Part, Parts, Progress, Stored, clip_versions, content_version, per_clip, repeatable
from assets.tables import pack
from assets.tables import search as search_tables
from assets.tables.motion import CanonicalClip, to_canonical_pose, to_canonical_poses
from kernels.runs import runs_of
from kernels.search.aligned import track
from kernels.search.encoder import Encoder, from_arrays
from kernels.search.measure import leave_one_out
from kernels.search.nearest import propose
from kernels.search.normalise import resample
from kernels.search.windows import windows
from kernels.types import Float
from schemas.search import LABEL_PROPOSAL, MOTION_EMBEDDING, MOTION_ENCODER, MOTION_INDEX
from schemas.settings import SearchSettings

if TYPE_CHECKING:  # JAX: loaded where something is trained, and nowhere else
    from kernels.search.encoder_fit import Fitted

_MOST_WINDOWS_A_CLIP = 4
"""Chosen by hand."""

_SHORTEST_S = 0.5
"""Seconds between frames that are never shown from which they are searched, where a clip has no longer ones. Chosen by
hand: a movement."""


@dataclass(frozen=True, eq=False)
class Index:
    """The search index: its rows, the vector of each, (N, 512), and the tracks of clips, (M, N_TRACK), both float32."""

    part: Part
    vector: NDArray[np.float32]
    track: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class _Example:
    """One window to learn from."""

    take: str
    label: str
    position_xyz_m: Float


@table_asset(
    MOTION_ENCODER,
    group="search",
    code_version="3",
    settings="search",
    keeps=True,
    ins={name: dg.AssetIn(partition_mapping=EVERY) for name in ("clip", "canonical_pose")},
)
def motion_encoder(
    clip: Stored, canonical_pose: Stored, studio: dg.ResourceParam[Studio], progress: dg.ResourceParam[Progress]
) -> Part:
    """Train the encoder on the catalogue; once made it is kept, so that what was embedded stays comparable."""
    from kernels.search.encoder_fit import fit  # JAX: loaded where something is trained, and nowhere else
    from kernels.search.train import Training

    settings = studio.settings().search
    examples = _examples(clip, canonical_pose, settings)
    progress.begin("training the encoder", 2 * settings.training_steps)
    with repeatable():
        fitted = fit(
            [e.position_xyz_m for e in examples],
            [e.label for e in examples],
            take=[e.take for e in examples],
            how=Training(steps=settings.training_steps, seed=settings.seed, has_travel=settings.has_travel),
            progress=progress.step,
        )
    made_from = {key: canonical_pose.stamp(key).content for key in canonical_pose.keys}
    provenance = {**_learnt_from(examples), "seed": settings.seed, "made_from": made_from, **_training(fitted)}
    table = search_tables.from_encoder(fitted.encoder.arrays(), json.dumps(provenance, sort_keys=True))
    shown: dict[str, dg.MetadataValue[Any]] = {"provenance": dg.MetadataValue.json(provenance)}
    if fitted.confusion:
        shown["confusion_of_held_out"] = dg.MetadataValue.md(search_plots.confusion(fitted.confusion))
    return Part("", table, metadata=shown)


def _learnt_from(examples: Sequence[_Example]) -> dict[str, object]:
    """Count what an encoder learnt from, for its provenance."""
    clips, labels = {e.take for e in examples}, {e.label for e in examples} - {""}
    return {"windows": len(examples), "clips": len(clips), "labels": sorted(labels)}


def _training(fitted: "Fitted") -> dict[str, object]:
    """Say how an encoder was trained, with what, and how well it does on what was held out."""
    said = fitted.validation
    return {
        "kind": fitted.kind,
        "steps": fitted.steps,
        "libraries": {name: version(name) for name in ("jax", "jaxlib", "equinox", "optax", "numpy")},
        "validation": {
            "first_ratio": said.first_ratio,
            "mean_precision_ratio": said.mean_precision_ratio,
            "queries": said.n_queries,
        }
        if said
        else None,
    }


def _examples(clip: Stored, canonical_pose: Stored, settings: SearchSettings) -> list[_Example]:
    """Take windows to learn from: evenly spread in long clips, and of too many an even share."""
    found = []
    for key in canonical_pose.keys:
        rows = {row["clip_id"]: row for row in pack.read_rows(clip.read(key)).to_pylist()}
        for moved in to_canonical_poses(canonical_pose.read(key)):
            if moved.clip_id not in rows:
                continue
            row = rows[moved.clip_id]
            is_said = settings.labels == "folders" or (settings.labels == "clips.csv" and row["is_labelled"])
            cut = _shown_windows(moved, settings)
            at = np.unique(np.linspace(0, len(cut) - 1, min(len(cut), _MOST_WINDOWS_A_CLIP)).round().astype(int))
            found += [
                _Example(
                    moved.clip_id,
                    row["label"] if is_said else "",
                    resample(moved.position_xyz_m, moved.frame_rate_hz, start_s, end_s).astype(np.float32),
                )
                for start_s, end_s in cut[at].tolist()
            ]
    if len(found) > settings.training_windows:
        chosen = np.random.default_rng(settings.seed).permutation(len(found))[: settings.training_windows]
        found = [found[i] for i in sorted(chosen.tolist())]
    return found


def _shown_windows(moved: CanonicalClip, settings: SearchSettings) -> Float:
    """Cut what may be shown of a clip into windows."""
    longest = max(settings.longest_whole_s, settings.window_s)
    rate_hz = moved.frame_rate_hz
    run = runs_of(~moved.is_fenced)
    length = run[:, 1] - run[:, 0]
    run = run[length >= min(_SHORTEST_S * rate_hz, length.max(initial=0))]
    cut = [
        first / rate_hz + windows((last - first) / rate_hz, window_s=settings.window_s, longest_whole_s=longest)
        for first, last in run.tolist()
    ]
    return np.concatenate([*cut, np.zeros((0, 2))])


@table_asset(
    MOTION_EMBEDDING,
    group="search",
    code_version="3",
    settings="search.window_s search.longest_whole_s",
    partitions=SESSION,
)
def motion_embedding(
    context: dg.AssetExecutionContext,
    canonical_pose: Stored,
    motion_encoder: pa.Table,
    studio: dg.ResourceParam[Studio],
    earlier: dg.ResourceParam[Earlier],
    progress: dg.ResourceParam[Progress],
) -> Parts:
    """Embed the windows of every clip; those of clips that did not change are carried over."""
    settings = studio.settings().search
    encoder = from_arrays(search_tables.to_encoder(motion_encoder))
    made_by = (
        code_version(context, MOTION_EMBEDDING.name),
        content_version(motion_encoder),
        repr((settings.window_s, settings.longest_whole_s)),
    )

    def session(key: str) -> Part:
        poses = pack.by_clip(canonical_pose.read(key))

        def one(clip_id: str) -> pa.Table:
            return _embedded(to_canonical_pose(poses[clip_id]), encoder, settings) if clip_id in poses else empty

        made_from = clip_versions(canonical_pose, key, *made_by)
        return per_clip(MOTION_EMBEDDING, key, made_from, one, earlier=earlier, progress=progress)

    empty = MOTION_EMBEDDING.empty()
    progress.begin("embedding clips", sum(len(canonical_pose.stamp(key).clips) for key in canonical_pose.keys))
    return Parts(session(key) for key in canonical_pose.keys)


def _embedded(moved: CanonicalClip, encoder: Encoder, settings: SearchSettings) -> pa.Table:
    cut = _shown_windows(moved, settings)
    vector = encoder.embed(moved.position_xyz_m, moved.frame_rate_hz, cut)
    followed = track(moved.position_xyz_m, moved.frame_rate_hz)
    return search_tables.from_motion_embedding(moved.clip_id, cut, vector, followed)


@table_asset(
    MOTION_INDEX,
    group="search",
    code_version="2",
    ins={name: dg.AssetIn(partition_mapping=EVERY) for name in ("clip", "motion_embedding")},
    io_manager="index",
)
def motion_index(clip: Stored, motion_embedding: Stored, progress: dg.ResourceParam[Progress]) -> Index:
    """Put the windows of all clips in one row, to be searched at once."""
    progress.begin("indexing", len(motion_embedding.keys))
    rows, vectors, tracks = search_tables.catalogue(
        (clip.read(key), motion_embedding.read(key)) for key in _each(motion_embedding.keys, progress)
    )
    start = search_tables.starts(rows["clip_id"])
    centre = search_tables.clip_vectors(vectors, start)
    labels = [rows["label"][i] for i in start.tolist()]
    is_labelled = np.array([rows["is_labelled"][i] for i in start.tolist()], bool)
    with repeatable():
        place = search_plots.places(centre)
    found = leave_one_out(centre[is_labelled], [name for name, said in zip(labels, is_labelled, strict=True) if said])
    table = search_tables.from_motion_index(rows, vectors, place, start)
    metadata = {
        "windows": len(vectors),
        "clips": len(start),
        "learnt_first_hit_has_label_ratio": found.first_ratio,
        "map": dg.MetadataValue.md(search_plots.catalogue_map(place, labels)),
        "confusion_of_learnt": dg.MetadataValue.md(search_plots.confusion(found)),
    }
    return Index(Part("", table, metadata=metadata), vectors, tracks)


@table_asset(
    LABEL_PROPOSAL,
    group="search",
    code_version="1",
    ins={name: dg.AssetIn(partition_mapping=EVERY) for name in ("clip", "motion_embedding")},
)
def label_proposal(clip: Stored, motion_embedding: Stored) -> Part:
    """Propose labels for the clips that clips.csv gives none, by their nearest labelled clips."""
    rows, vectors, _ = search_tables.catalogue(
        (clip.read(key), motion_embedding.read(key)) for key in motion_embedding.keys
    )
    start = search_tables.starts(rows["clip_id"])
    centre = search_tables.clip_vectors(vectors, start).astype(np.float64)
    is_labelled = np.array([rows["is_labelled"][i] for i in start.tolist()], bool)
    ids = [rows["clip_id"][i] for i in start.tolist()]
    known, unknown = np.flatnonzero(is_labelled), np.flatnonzero(~is_labelled)
    names, number = np.unique([rows["label"][start[i]] for i in known], return_inverse=True)
    distance = np.sqrt(np.maximum(2 - 2 * centre[unknown] @ centre[known].T, 0.0))
    usual = np.sqrt(np.maximum(2 - 2 * search_tables.likest(centre[known]), 0.0))
    table = search_tables.from_proposals(
        propose(distance, number) if len(known) else [],
        [ids[i] for i in unknown],
        [ids[i] for i in known],
        names.tolist(),
        far=float(np.percentile(usual, 95)) if len(usual) else 0.0,
    )
    counts = {"unlabelled_clips": len(unknown), "labelled_clips": len(known)}
    return Part("", table, metadata={**counts, "proposals": dg.MetadataValue.md(search_plots.proposals(table))})


def _each(keys: Sequence[str], progress: Progress) -> Iterator[str]:
    for key in keys:
        progress.step()
        yield key
