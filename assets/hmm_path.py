"""From the model of the dancer and a song to steps: which basic motion when, and which recording of it."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import dagster as dg
import numpy as np
import polars as pl
import pyarrow as pa

from assets import hmm_plots, hmm_tables, licences, plots
from assets.danced import Danced
from assets.hearing import hear
from assets.hmm_tables import ClipMotions
from assets.lineage import Stored
from assets.sequence import Piece, joints_of
from kernels.assembly.timing import blend_widths, trim
from kernels.hmm import durations, instances
from kernels.hmm.evidence import Evidence
from kernels.hmm.instances import Motions
from kernels.hmm.model import Model
from kernels.hmm.viterbi import InfeasibleSpansError, Spans, best_spans, sample_spans
from kernels.matching.path import Candidates, Chosen, continues, to_choreography
from kernels.types import Choreography, Float, Int
from schemas.settings import Settings

LARGEST_POOL = 20_000
"""Motions a dance is chosen from; performances first, then clips in order of their names."""

LONGEST_SPAN = 8
SEAM_COST, UNCONNECTED_COST = 0.25, 1.0
"""Of any seam, however alike the poses, and added where they are beyond the thresholds."""


@dataclass(frozen=True, eq=False)
class Dancer:
    """What is known of the dancer.

    Parameters
    ----------
    model : Model
    evidence : whether the music tells anything
    clip_ids : names of the clips that may be danced
    motions : Motions of those clips
    """

    model: Model
    evidence: Evidence
    clip_ids: tuple[str, ...]
    motions: Motions


def load_dancer(
    choreography_model: pa.Table,
    music_evidence: pa.Table,
    key_pose: Stored,
    performed: set[str],
    clips: pl.DataFrame,
    *,
    allow: Sequence[str],
    settings: Settings,
) -> Dancer:
    """Read the model, and the motions of all clips that may be danced.

    Raises
    ------
    dg.Failure
        If there is no motion to dance.
    """
    if not choreography_model.num_rows:
        raise dg.Failure(
            "no clip can be danced: none has a motion from braking to braking; add clips that move", allow_retries=False
        )
    every = hmm_tables.all_motions(key_pose.read(key) for key in key_pose.keys)
    subject = settings.choreography_model.subject
    own = clips.filter(pl.col("subject") == subject) if subject else clips
    free = licences.free_to_join(dict(own.select("clip_id", "licence").iter_rows()), allow)
    usable = {clip: motions for clip, motions in every.items() if clip in free}
    if not any((m.state >= 0).any() for m in usable.values()):
        why = (
            f"has a licence of {', '.join(allow)}" if allow else "is free to be changed and has a motion of known kind"
        )
        raise dg.Failure(f"no clip may be danced: none {why}", allow_retries=False)
    model = hmm_tables.to_model(choreography_model, melody_weight=settings.choreography_model.melody_weight)
    clip_ids, motions = _pool(usable, performed)
    return Dancer(model, hmm_tables.to_evidence(music_evidence), clip_ids, motions)


def _pool(usable: Mapping[str, ClipMotions], performed: set[str]) -> tuple[tuple[str, ...], Motions]:
    taken: list[str] = []
    n = 0
    for clip in sorted(usable, key=lambda c: (c not in performed, c)):
        if n >= LARGEST_POOL:
            break
        taken.append(clip)
        n += len(usable[clip].state)
    taken.sort()
    return tuple(taken), Motions(
        np.repeat(np.arange(len(taken)), [len(usable[c].state) for c in taken]),
        np.concatenate([usable[c].state for c in taken]),
        np.concatenate([usable[c].start_s for c in taken]),
        np.concatenate([usable[c].end_s for c in taken]),
    )


@dataclass(frozen=True, eq=False)
class StatePath:
    """Basic motions of a dance, (S,) each: spans of the grid, and what each costs by the model and by the music."""

    spans: Spans
    grid_s: Float
    model_cost: Float
    music_cost: Float


def by_hmm(
    dancer: Dancer,
    percussion: pa.Table,
    melody: pa.Table,
    beat_s: Float,
    duration_s: float,
    canonical_pose: Stored,
    settings: Settings,
    *,
    temperature: float | None,
    seed: int,
) -> Danced:
    """Choose basic motions by the model, then a recording of each.

    Raises
    ------
    dg.Failure
        If the tempo of the song leaves no motion a length it can be danced in.
    """
    warmth = settings.hmm_path.temperature if temperature is None else temperature
    if not len(dancer.evidence.n_motions) and temperature is None:
        # Nothing links music and motion: the one most probable loop would be danced to every song.
        warmth = max(warmth, 1.0)
    found = choose_states(dancer, percussion, melody, beat_s, settings, temperature=warmth, seed=seed)
    steps, span_of, by_span, facts = _recordings(dancer, found, beat_s, duration_s, canonical_pose, settings)
    is_first = np.append(True, np.diff(span_of) > 0)
    columns = {name: np.where(is_first, values[span_of], 0.0) for name, values in by_span.items()}
    state = found.spans.state
    metadata = facts | {
        "seams": int(steps.has_seam.sum()),
        "clips": len(set(steps.clip_id)),
        "temperature": warmth,
        "basic_motions_danced": len(np.unique(state)),
        "music_adds": dancer.evidence.music_adds,
        "phrases": dg.MetadataValue.md(plots.phrase_table(steps)),
        "states": dg.MetadataValue.md(hmm_plots.timeline(found.grid_s[found.spans.start], state, beat_s)),
    }
    return Danced(steps, columns, metadata, states=state[span_of])


def choose_states(
    dancer: Dancer,
    percussion: pa.Table,
    melody: pa.Table,
    beat_s: Float,
    settings: Settings,
    *,
    temperature: float,
    seed: int,
) -> StatePath:
    """Find the most probable basic motions of a song, or draw some."""
    lengths = dancer.motions.end_s - dancer.motions.start_s
    known = dancer.motions.state >= 0
    parts = durations.parts_per_beat(float(np.median(np.diff(beat_s))), lengths[known])
    grid_s = durations.subdivide(beat_s, parts)
    n_intervals = len(grid_s) - 1
    step_s = float(np.median(np.diff(grid_s)))
    longest = int(np.clip(np.floor(lengths[known].max() * durations.MOST_WARP / step_s), 1, LONGEST_SPAN))
    beyond_s = grid_s[-1] + step_s * (1 + np.arange(longest - 1))
    grid_s = np.append(grid_s, beyond_s)
    of_state = [lengths[dancer.motions.state == k] for k in range(dancer.model.n_states)]
    log_duration = durations.log_durations(grid_s, of_state, longest=longest)
    heard = hear(percussion, melody, grid_s[: n_intervals + 1], symbols=settings.choreography_model.symbols)
    model, log_music = dancer.model, heard.log_likelihood(dancer.model)
    chain = model.log_initial, model.log_transition, log_music, log_duration
    try:
        spans = (
            sample_spans(*chain, temperature=temperature, rng=np.random.default_rng(seed))
            if temperature > 0
            else best_spans(*chain)[0]
        )
    except InfeasibleSpansError as error:
        raise dg.Failure(_no_length(error, grid_s, lengths[known], parts), allow_retries=False) from error
    before = np.append(0, spans.state[:-1])
    log_model = np.where(spans.start == 0, model.log_initial[spans.state], model.log_transition[before, spans.state])
    log_model = log_model + log_duration[spans.start, spans.length - 1, spans.state]
    running = np.concatenate([np.zeros((1, model.n_states)), np.cumsum(log_music, axis=0)])
    end = np.minimum(spans.start + spans.length, n_intervals)
    log_heard = running[end, spans.state] - running[spans.start, spans.state]
    return StatePath(spans, grid_s, -log_model, -log_heard)


def _no_length(error: InfeasibleSpansError, grid_s: Float, lengths: Float, parts: int) -> str:
    step_s = float(np.median(np.diff(grid_s))) * parts
    return (
        f"no motion of a known kind fits the beats from {grid_s[error.interval]:.2f} s on: a beat lasts {step_s:.2f} s "
        f"and motions {lengths.min():.2f} to {lengths.max():.2f} s; add clips near that tempo, or set beats.octave in "
        "the song's brief"
    )


def _recordings(
    dancer: Dancer,
    found: StatePath,
    beat_s: Float,
    duration_s: float,
    canonical_pose: Stored,
    settings: Settings,
) -> tuple[Choreography, Int, dict[str, Float], dict[str, object]]:
    """Choose a recording of each basic motion; the steps, the span of each, costs by span, and facts."""
    spans, motions = found.spans, dancer.motions
    edge_s = np.append(found.grid_s[spans.start], found.grid_s[spans.start[-1] + spans.length[-1]])
    short = instances.shortlist(motions, spans.state, np.diff(edge_s))
    pieces = [
        [
            Piece(
                dancer.clip_ids[motions.clip_index[m]], float(motions.start_s[m]), float(motions.end_s[m]), 0, 0, 0, 0
            )
            for m in here.tolist()
        ]
        for here in short
    ]
    weights = settings.hmm_path
    pace = [
        weights.warp_weight * instances.warp_cost(span, motions.end_s[m] - motions.start_s[m])
        for span, m in zip(np.diff(edge_s), short, strict=True)
    ]
    candidates = [
        Candidates(motions.clip_index[m], motions.start_s[m], motions.end_s[m], c)
        for m, c in zip(short, pace, strict=True)
    ]
    limits, joints = joints_of(
        pieces, edge_s, canonical_pose, blend_s=settings.dance.blend_s, seam_weight=weights.seam_weight
    )
    goes_on = [continues(a, b) for a, b in itertools.pairwise(candidates)]
    seam = [
        np.where(on, 0.0, SEAM_COST * weights.seam_weight + j.cost + UNCONNECTED_COST * ~j.is_connected)
        for on, j in zip(goes_on, joints, strict=True)
    ]
    choice, repetition, total = instances.choose(short, pace, seam, repetition_weight=weights.repetition_weight)
    pairs = list(itertools.pairwise(choice))
    has_seam = np.array([False, *(not on[a, b] for on, (a, b) in zip(goes_on, pairs, strict=True))], bool)
    seam_cost = np.array([0.0, *(s[a, b] for s, (a, b) in zip(seam, pairs, strict=True))])
    joined = np.array(
        [True, *(bool(on[a, b] or j.is_connected[a, b]) for on, j, (a, b) in zip(goes_on, joints, pairs, strict=True))]
    )
    chosen = Chosen(choice, has_seam, joined, seam_cost, repetition, total)
    steps, span_of = to_choreography(
        candidates,
        chosen,
        start_s=edge_s[:-1],
        end_s=edge_s[1:],
        beat_s=beat_s,
        clip_ids=dancer.clip_ids,
        blend_s=settings.dance.blend_s,
    )
    steps, kept = trim(steps, duration_s)
    width = blend_widths(steps.song_start_s, steps.song_end_s, steps.has_seam, wanted_s=settings.dance.blend_s)
    by_span = {
        "transition_cost": seam_cost,
        "warp_cost": np.array([c[i] for c, i in zip(pace, choice, strict=True)]),
        "repetition_cost": repetition,
        "model_cost": found.model_cost,
        "music_cost": found.music_cost,
    }
    facts: dict[str, object] = {
        "cost_of_recordings": total,
        "motions_danced": len(spans.state),
        "motions_shown_again": int((repetition > 0).sum()),
        "seams_beyond_thresholds": int((~joined).sum()),
        "threshold_pose_rad": limits.pose_rad,
        "threshold_speed_rad_per_s": limits.speed_rad_per_s,
    }
    return replace(steps, blend_s=width), span_of[kept], by_span, facts
