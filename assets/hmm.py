"""The model of the dancer: performances, basic motions, and what follows what and sounds with it, by counting."""

from collections.abc import Iterator, Sequence

import dagster as dg
import numpy as np
import pyarrow as pa

from assets.declare import table_asset, table_assets
from assets.partitions import EVERY
from assets.plots import hmm as hmm_plots
from assets.reading.hearing import SYMBOLS, hear
from assets.reading.motion_cuts import cut
from assets.sources import performances
from assets.sources.performances import Performance
from assets.sources.sources import Studio
from assets.stamps import Part, Progress, Stored, repeatable
from assets.tables import hmm as hmm_tables
from assets.tables import pack
from assets.tables.hmm import ClipMotions
from kernels.hmm import evidence as evidence_of
from kernels.hmm import states
from kernels.hmm.model import Performed, Smoothing, choose_smoothing, learn
from schemas.hmm import BASIC_MOTION, CHOREOGRAPHY_MODEL, MUSIC_EVIDENCE, PERFORMANCE
from schemas.settings import ChoreographyModelSettings

_EVERY = dg.AssetIn(partition_mapping=EVERY)
METHOD = "hmm"

MOST_CLUSTERED = 20_000
"""Motions that basic motions are made from where no performance says which: taken evenly from all. Chosen for time, by
hand."""


@table_asset(
    PERFORMANCE,
    group="catalog",
    code_version="1",
    only_for=METHOD,
    ins={"clip": _EVERY, "song": _EVERY},
    checks={"songs_found": "Every song that clips.csv says was danced to is in the studio."},
)
def performance(clip: Stored, song: Stored) -> Iterator[dg.Output[Part] | dg.AssetCheckResult]:
    """Pair clips with the songs they were danced to."""
    clips = [row for key in clip.keys for row in pack.read_rows(clip.read(key)).to_pylist()]
    songs = [row for key in song.keys for row in pack.read_rows(song.read(key)).to_pylist()]
    found, troubles = performances.pair(
        [performances.DancedClip(r["clip_id"], r["path"], r["performed_to"], r["performed_offset_s"]) for r in clips],
        [performances.NamedSong(r["song_id"], r["path"], r["kind"]) for r in songs],
    )
    yield dg.Output(Part("", hmm_tables.from_performance(found), metadata={"troubles": "; ".join(troubles) or "none"}))
    yield dg.AssetCheckResult(
        check_name="songs_found",
        asset_key=PERFORMANCE.name,
        passed=not troubles,
        severity=dg.AssetCheckSeverity.WARN,
        metadata={"troubles": "; ".join(troubles[:40]) or "none"},
    )


@table_asset(
    BASIC_MOTION,
    group="catalog",
    code_version="1",
    settings="basic_motion choreography_model.subject",
    only_for=METHOD,
    ins={"clip": _EVERY, "canonical_pose": _EVERY},
)
def basic_motion(
    clip: Stored,
    canonical_pose: Stored,
    performance: pa.Table,
    studio: dg.ResourceParam[Studio],
    progress: dg.ResourceParam[Progress],
) -> Part:
    """Cluster the motions of all performances into kinds; of all clips where there is no performance."""
    settings = studio.settings()
    performed = {p.clip_id for p in _learned(performance, clip, settings.choreography_model)}
    progress.begin("basic motions", len(canonical_pose.keys))
    found = []
    with repeatable():
        for key in canonical_pose.keys:
            here = set(canonical_pose.stamp(key).clips)
            here = here & performed if performed else here
            poses = pack.by_clip(canonical_pose.read(key, clip_ids=here)) if here else {}
            found += [cut(rows, settings.basic_motion) for rows in poses.values()]
            progress.step()
        found = sorted((c for c in found if len(c.motions.start_s)), key=lambda c: c.clip_id)
        if not found:
            return Part("", BASIC_MOTION.empty(), metadata={"motions": 0})
        vectors = np.concatenate([c.vectors for c in found])
        some = vectors[:: max(-(-len(vectors) // MOST_CLUSTERED), 1)]
        kinds = states.cluster(some, n_states=settings.basic_motion.states, seed=settings.basic_motion.seed)
        nearest = states.squared_distances(vectors, kinds.centroid).argmin(axis=0)
    clip_ids = np.array([c.clip_id for c in found for _ in c.motions.start_s], object)[nearest].tolist()
    start_s = np.concatenate([c.motions.start_s for c in found])[nearest]
    end_s = np.concatenate([c.motions.end_s for c in found])[nearest]
    metadata = {
        "motions": len(vectors),
        "states": len(kinds.count),
        "made_from": "performances" if performed else "all clips: none was danced to a song of the studio",
        "centroids": dg.MetadataValue.md(hmm_plots.centroids(kinds, clip_ids)),
    }
    return Part("", hmm_tables.from_basic_motion(kinds, clip_ids, start_s, end_s), metadata=metadata)


@table_assets(
    "model",
    (CHOREOGRAPHY_MODEL, MUSIC_EVIDENCE),
    group="catalog",
    code_version="1",
    settings="choreography_model",
    only_for=METHOD,
    ins={name: _EVERY for name in ("clip", "key_pose", "percussion", "melody")},
    checks={"music_adds": (CHOREOGRAPHY_MODEL, "What sounds tells which motion is danced, beyond the motion before.")},
)
def model(
    clip: Stored,
    key_pose: Stored,
    basic_motion: pa.Table,
    performance: pa.Table,
    percussion: Stored,
    melody: Stored,
    studio: dg.ResourceParam[Studio],
    progress: dg.ResourceParam[Progress],
) -> Iterator[dg.Output[Part] | dg.AssetCheckResult]:
    """Count what follows what and what sounds with it, and measure whether the music tells anything."""
    settings = studio.settings().choreography_model
    progress.begin("model of the dancer", 1)
    motions = hmm_tables.all_motions(key_pose.read(key) for key in key_pose.keys)
    learned = [p for p in _learned(performance, clip, settings) if p.clip_id in motions]
    k = basic_motion.num_rows
    sequences = [_performed(p, motions[p.clip_id], percussion, melody, settings) for p in learned]
    # Nobody danced to a song of the studio: what follows what is known all the same.
    counted = sequences or [_unheard(m) for m in motions.values()]
    with repeatable():
        smoothing = _smoothing(counted, k, settings) if k else Smoothing(1.0, (1.0, 1.0))
        weight = (1.0, settings.melody_weight)
        found = evidence_of.measure(sequences, k, SYMBOLS, smoothing=smoothing, weight=weight)
    n_hits = [int(s.heard[0].sum()) for s in sequences]
    clip_ids = basic_motion["clip_id"].to_pylist()
    if k:
        made = learn(counted, k, SYMBOLS, smoothing=smoothing, weight=weight)
        table = hmm_tables.from_choreography_model(made, clip_ids)
        picture = dg.MetadataValue.md(hmm_plots.model(made, smoothing))
    else:
        table, picture = CHOREOGRAPHY_MODEL.empty(), dg.MetadataValue.md("no motion was found")
    facts = {
        "performances": len(learned),
        "motions_counted": sum(len(s.state) for s in counted),
        "transition_alpha": smoothing.transition_alpha,
        "drum_alpha": smoothing.emission_alpha[0],
        "melody_alpha": smoothing.emission_alpha[1],
    }
    shown = dg.MetadataValue.md(hmm_plots.evidence(found, [p.clip_id for p in learned]))
    progress.step()
    yield dg.Output(Part("", table, metadata=facts | {"model": picture}), CHOREOGRAPHY_MODEL.name)
    rows = hmm_tables.from_music_evidence(learned, found, n_hits)
    yield dg.Output(Part("", rows, metadata={"evidence": shown}), MUSIC_EVIDENCE.name)
    yield dg.AssetCheckResult(
        check_name="music_adds",
        asset_key=CHOREOGRAPHY_MODEL.name,
        passed=found.music_adds,
        severity=dg.AssetCheckSeverity.WARN,
        metadata={"gain_a_motion": found.gain, "chance": found.p, "motions": int(found.n_motions.sum())},
    )


def _learned(performance: pa.Table, clip: Stored, settings: ChoreographyModelSettings) -> list[Performance]:
    """Take the performances to learn from: those of the subject in the settings, else all."""
    every = hmm_tables.to_performances(performance)
    if not settings.subject:
        return every
    subject = {row["clip_id"]: row["subject"] for key in clip.keys for row in clip.read(key).to_pylist()}
    return [p for p in every if subject.get(p.clip_id) == settings.subject]


def _performed(
    one: Performance,
    motions: ClipMotions,
    percussion: Stored,
    melody: Stored,
    settings: ChoreographyModelSettings,
) -> Performed:
    """Put motions and music of a performance together."""
    edge_s = np.append(motions.start_s, motions.end_s[-1:]) + one.offset_s
    if one.song_id not in percussion.keys or one.song_id not in melody.keys:
        return _unheard(motions)
    heard = hear(percussion.read(one.song_id), melody.read(one.song_id), edge_s, symbols=settings.symbols)
    return Performed(motions.state, heard.to_learn())


def _unheard(motions: ClipMotions) -> Performed:
    return Performed(motions.state, tuple(np.zeros((len(motions.state), m)) for m in SYMBOLS))


def _smoothing(counted: Sequence[Performed], k: int, settings: ChoreographyModelSettings) -> Smoothing:
    if settings.smoothing > 0:
        return Smoothing(settings.smoothing, (settings.smoothing,) * len(SYMBOLS))
    return choose_smoothing(counted, k, SYMBOLS)
