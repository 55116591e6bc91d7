"""From the model of the dancer and a song to steps: which basic motion when, and which recording of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import polars as pl
import pyarrow as pa

from assets.dancing import hmm_wishes, licences
from assets.dancing.asked import Direction
from assets.dancing.avoided import AvoidedSpan, fenced_spans, touched
from assets.dancing.chosen_steps import ChosenSteps, Markdown
from assets.dancing.method import DanceOrder, Method
from assets.dancing.recordings import choose_recordings, ends_of
from assets.dancing.refusal import RefusalError
from assets.dancing.wishes import Nodes
from assets.plots import hmm as hmm_plots
from assets.plots.dance import phrase_table
from assets.reading.clips import read_clips
from assets.reading.hearing import hear
from assets.reading.songs import PlayedSong, played_song
from assets.stamps import Stored, repeatable
from assets.tables import hmm as hmm_tables
from assets.tables.hmm import ClipMotions
from kernels.assembly.timing import blend_widths, trim
from kernels.hmm.decode import Chain, decode_varied
from kernels.hmm.durations import MotionGrid, motion_grid
from kernels.hmm.evidence import Evidence
from kernels.hmm.instances import Motions, motions_of_clips
from kernels.hmm.links import link
from kernels.hmm.model import Model
from kernels.hmm.places import MotionWish, Places, crowded_cost, keep_wishes, place, unkept_cost
from kernels.hmm.seams import Ends
from kernels.hmm.span_reach import SpanReach
from kernels.hmm.spans import log_lasting, shared_ratio, span_costs
from kernels.hmm.viterbi import Spans, best_spans, sample_spans
from kernels.matching.match_sequence import at_first_steps, to_choreography
from kernels.types import Float
from schemas.settings import Settings

LARGEST_POOL = 8_000
"""Motions a dance is chosen from: pinned clips first, then performances, then clips in order of their names. Chosen for
memory and time, by hand."""

UNSURE = 0.5
"""Where nobody danced to a song, motions cost so much more at random, in the mean, drawn by the seed: else the one
cheapest loop would be danced to every song. Chosen by hand: half a seam."""


@dataclass(frozen=True, eq=False)
class Dancer:
    """The model of a dancer, and the recorded motions it may use.

    Parameters
    ----------
    model : Model
    evidence : whether the music tells anything
    clip_ids : names of the clips that may be danced
    motions : Motions of those clips, all of a known kind
    nodes : clip, label and style of each motion, as pins name them
    """

    model: Model
    evidence: Evidence
    clip_ids: tuple[str, ...]
    motions: Motions
    nodes: Nodes


def load_dancer(
    choreography_model: pa.Table,
    music_evidence: pa.Table,
    key_pose: Stored,
    performed: set[str],
    clips: pl.DataFrame,
    *,
    asked: Direction,
    settings: Settings,
    canonical_pose: Stored,
    avoid: Sequence[AvoidedSpan] = (),
) -> Dancer:
    """Read the model, and the motions of all clips that may be danced, but for those that show what is to be avoided.

    Motions keep half a blend from what is fenced: blends show that much beyond their ends.

    Raises
    ------
    RefusalError
        If there is no motion to dance.
    """
    if not choreography_model.num_rows:
        raise RefusalError("no clip can be danced: none has a motion from braking to braking; add clips that move")
    every = hmm_tables.all_motions(key_pose.read(key) for key in key_pose.keys)
    subject = settings.choreography_model.subject
    own = clips.filter(pl.col("subject") == subject) if subject else clips
    free = licences.free_to_join(dict(own.select("clip_id", "licence").iter_rows()), asked.allow)
    usable = {clip: motions.known() for clip, motions in every.items() if clip in free}
    usable = {clip: _untouched(clip, motions, avoid, settings.dance.blend_s) for clip, motions in usable.items()}
    usable = {clip: motions for clip, motions in usable.items() if len(motions.state)}
    if not usable:
        why = (
            f"has a licence of {', '.join(asked.allow)}"
            if asked.allow
            else "is free to be changed and has a motion of known kind"
        )
        raise RefusalError(f"no clip may be danced: none {why}")
    model = hmm_tables.to_model(choreography_model, melody_weight=settings.choreography_model.melody_weight)
    facts = {row["clip_id"]: row for row in clips.iter_rows(named=True)}
    pinned = {
        clip
        for clip in usable
        for wish in asked.wishes
        if not wish.not_label
        and wish.is_kept_by(clip_id=clip, label=str(facts[clip]["label"]), style=str(facts[clip]["style"]))
    }
    clip_ids, _ = _pool(usable, pinned, performed)
    fences = fenced_spans(canonical_pose, set(clip_ids))
    usable = {clip: _untouched(clip, usable[clip], fences, settings.dance.blend_s) for clip in clip_ids}
    clip_ids, motions = _pool({c: of for c, of in usable.items() if len(of.state)}, pinned, performed)
    if not clip_ids:
        raise RefusalError("no clip may be danced: none has a motion half a blend away from what is never shown")
    of = motions.clip_index
    known = (np.array([str(facts[clip][name]) for clip in clip_ids])[of] for name in ("clip_id", "label", "style"))
    nodes = Nodes(*known)
    return Dancer(model, hmm_tables.to_evidence(music_evidence), clip_ids, motions, nodes)


def _untouched(clip: str, motions: ClipMotions, avoid: Sequence[AvoidedSpan], blend_s: float) -> ClipMotions:
    """Leave out the motions of a clip that show what is to be avoided."""
    kept = ~touched(avoid, [clip] * len(motions.state), motions.start_s, motions.end_s, blend_s=blend_s)
    return ClipMotions(motions.start_s[kept], motions.end_s[kept], motions.state[kept])


def _pool(usable: Mapping[str, ClipMotions], pinned: set[str], performed: set[str]) -> tuple[tuple[str, ...], Motions]:
    taken: list[str] = []
    n = 0
    for clip in sorted(usable, key=lambda c: (c not in pinned, c not in performed, c)):
        if n >= LARGEST_POOL:
            break
        taken.append(clip)
        n += len(usable[clip].state)
    taken.sort()
    each = [usable[clip] for clip in taken]
    return tuple(taken), motions_of_clips([c.state for c in each], [c.start_s for c in each], [c.end_s for c in each])


@dataclass(frozen=True, eq=False)
class HeardSong:
    """A song as the dancer hears it.

    Parameters
    ----------
    grid : MotionGrid of G intervals
    log_likelihood : (G, K) float64, of what sounds in each interval
    """

    grid: MotionGrid
    log_likelihood: Float


def by_hmm(
    dancer: Dancer,
    percussion: pa.Table,
    melody: pa.Table,
    song: PlayedSong,
    canonical_pose: Stored,
    settings: Settings,
    asked: Direction,
    *,
    temperature: float | None,
    seed: int,
) -> ChosenSteps:
    """Choose basic motions by the model and what the recordings let be joined, then the best recording of each.

    Raises
    ------
    RefusalError
        If the tempo of the song leaves no motion a length it can be danced in, or pins cannot be kept.
    """
    warmth = settings.hmm_path.temperature if temperature is None else temperature
    motions, weights = dancer.motions, settings.hmm_path
    music = listen(dancer, percussion, melody, song.grid_s, settings)
    grid = music.grid
    ends = ends_of(motions, dancer.clip_ids, canonical_pose, blend_s=settings.dance.blend_s)
    places = place(
        motions,
        grid.point_s,
        music.log_likelihood,
        longest=grid.longest,
        is_beat=grid.is_beat,
        accent=ends.end_accent,
        warp_weight=weights.warp_weight,
    )
    reach = SpanReach(places, parts=grid.parts)
    if not reach.is_danceable:
        raise RefusalError(_no_length(grid, motions.end_s - motions.start_s))
    pins = hmm_wishes.kept_or_refused(reach, dancer.nodes, song, asked)
    wishes = [MotionWish(pin.first * grid.parts, pin.last * grid.parts, pin.nodes) for pin in pins]
    wish_price = hmm_wishes.price(asked) / grid.parts
    wished = keep_wishes(places, wishes, price=wish_price) if wishes else places
    crowded = crowded_cost(grid.point_s, song.duration_s, blend_s=settings.dance.blend_s)
    lasting = log_lasting(wished, motions, grid.point_s, n_states=dancer.model.n_states)
    decoded = None if warmth > 0 else _decoded(dancer, wished, ends, crowded, settings, seed)
    spans = _drawn(dancer, music, lasting, warmth, seed) if decoded is None else decoded.spans(motions)
    chosen = choose_recordings(
        motions, ends, wished, spans, decoded, crowded, is_beat=grid.is_beat, grid_s=grid.point_s, settings=weights
    )
    edge_s = spans.edge_s(grid.point_s)
    steps, span_of = to_choreography(
        chosen.candidates,
        chosen.found,
        start_s=edge_s[:-1],
        end_s=edge_s[1:],
        beat_s=song.grid_s,
        clip_ids=dancer.clip_ids,
        blend_s=settings.dance.blend_s,
    )
    steps, kept = trim(steps, song.duration_s)
    span_of = span_of[kept]
    width = blend_widths(steps.song_start_s, steps.song_end_s, steps.has_seam, wanted_s=settings.dance.blend_s)
    steps = replace(steps, blend_s=width)
    model_cost, music_cost = span_costs(dancer.model, music.log_likelihood, spans)
    soft = wishes if asked.is_soft else []
    wish_cost = unkept_cost(soft, spans.start, spans.length, chosen.danced, price=wish_price)
    by_span = {**chosen.costs, "wish_cost": wish_cost, "model_cost": model_cost, "music_cost": music_cost}
    columns = {name: at_first_steps(values, span_of) for name, values in by_span.items()}
    alone = best_spans(dancer.model.log_initial, dancer.model.log_transition, music.log_likelihood, lasting)[0]
    metadata = {
        "cost_of_recordings": chosen.found.total_cost,
        "motions_danced": len(spans.state),
        "motions_shown_again": int((chosen.found.repetition_cost > 0).sum()),
        "seams": int(steps.has_seam.sum()),
        "clips": len(set(steps.clip_id)),
        "temperature": warmth,
        "basic_motions_danced": len(np.unique(spans.state)),
        "as_the_model_alone_ratio": shared_ratio(spans, alone, len(music.log_likelihood)),
        "music_adds": dancer.evidence.music_adds,
        "phrases": Markdown(phrase_table(steps)),
        "states": Markdown(hmm_plots.timeline(edge_s, spans.state, song.grid_s)),
    }
    spanned = zip(spans.start[span_of].tolist(), spans.length[span_of].tolist(), strict=True)
    served = [hmm_wishes.served(pins, grid.parts, start, length) for start, length in spanned]
    return ChosenSteps(steps, columns, metadata, served, states=spans.state[span_of])


def listen(dancer: Dancer, percussion: pa.Table, melody: pa.Table, beat_s: Float, settings: Settings) -> HeardSong:
    """Cut the beats as finely as the dancer's motions are short, and hear what sounds in each part."""
    grid = motion_grid(beat_s, dancer.motions.end_s - dancer.motions.start_s)
    heard = hear(percussion, melody, grid.inner_s, symbols=settings.choreography_model.symbols)
    return HeardSong(grid, heard.log_likelihood(dancer.model))


def _drawn(dancer: Dancer, music: HeardSong, lasting: Float, warmth: float, seed: int) -> Spans:
    """Draw a dance from the model, given the music."""
    model, rng = dancer.model, np.random.default_rng(seed)
    log_music = music.log_likelihood
    return sample_spans(model.log_initial, model.log_transition, log_music, lasting, temperature=warmth, rng=rng)


def _decoded(dancer: Dancer, places: Places, ends: Ends, crowded: Float, settings: Settings, seed: int) -> Chain:
    """Find the cheapest dance in recordings."""
    model, motions, weights = dancer.model, dancer.motions, settings.hmm_path
    price = np.zeros(len(motions.state))
    if not len(dancer.evidence.n_motions):
        price = np.random.default_rng(seed).exponential(UNSURE, len(price))
    against_usual = model.log_transition + model.entropy_rate
    return decode_varied(
        motions,
        link(motions, ends, against_usual, seam_weight=weights.seam_weight),
        places,
        model.log_initial,
        against_usual,
        price=price,
        crowded=crowded,
        repetition_weight=weights.repetition_weight,
    )


def _no_length(grid: MotionGrid, length_s: Float) -> str:
    return (
        f"no motions of known kinds cover its beats: a beat lasts {grid.beat_interval_s:.2f} s and motions "
        f"{length_s.min():.2f} to {length_s.max():.2f} s; add clips near that tempo, or set beats.octave in the song's "
        "brief"
    )


def choose(inputs: Mapping[str, Stored], order: DanceOrder) -> ChosenSteps:
    """Dance a song by the stored model of the dancer; see :class:`assets.dancing.method.Method`.

    Parameters
    ----------
    inputs : the tables of :data:`METHOD`, by name
    order : DanceOrder

    Raises
    ------
    RefusalError
        As :func:`load_dancer` and :func:`by_hmm`.
    """
    dancer = load_dancer(
        inputs["choreography_model"].read(),
        inputs["music_evidence"].read(),
        inputs["key_pose"],
        {performed.clip_id for performed in hmm_tables.to_performances(inputs["performance"].read())},
        read_clips(inputs["clip"]),
        asked=order.direction,
        settings=order.settings,
        canonical_pose=inputs["canonical_pose"],
        avoid=order.avoid,
    )
    with repeatable():
        return by_hmm(
            dancer,
            inputs["percussion"].read(order.song_id),
            inputs["melody"].read(order.song_id),
            played_song(order.beats, order.duration_s),
            inputs["canonical_pose"],
            order.settings,
            order.direction,
            temperature=order.temperature,
            seed=order.seed,
        )


METHOD = Method(
    name="hmm",
    version="7",
    inputs=(
        *("clip", "canonical_pose", "key_pose", "performance"),
        *("choreography_model", "music_evidence", "percussion", "melody"),
    ),
    settings=("hmm_path", "choreography_model", "dance.blend_s"),
    choose=choose,
    draws=True,
    learns=True,
)
