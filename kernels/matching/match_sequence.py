"""One sequence through the matches of a song: the last two steps of the method, in one program.

Every segment of the song has candidates, each with costs of its own (how well it matches, how its intensity agrees, how
far it leaves its pace) and costs towards the segment before (the seam). The sum is smallest for one sequence, found by
the Viterbi recursion. What is shown twice costs as well; as that is no sum over neighbours, the exact sequence without
it is improved until nothing is gained.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.types import Choreography, Float, Int

Mask = NDArray[np.bool_]

CONTINUES_S = 0.5 / 120
"""A piece that starts within half a frame of where the one before ended, in the same clip, goes on without a seam. Half
a value of a feature, by definition."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """Pieces of clips that one segment may be danced with, (N,) each, N >= 1.

    Parameters
    ----------
    clip_index : int64
    start_s, end_s : float64, seconds of the clip under the segment's start and end, end > start
    cost : float64, >= 0, the sum of a candidate's own costs
    """

    clip_index: Int
    start_s: Float
    end_s: Float
    cost: Float


@dataclass(frozen=True, eq=False)
class Chosen:
    """The sequence chosen, (S,) each.

    Parameters
    ----------
    choice : int64, candidate of each segment
    has_seam : whether it does not go on where the one before ended; False first
    is_connected : whether its seam is within the thresholds; True where there is none
    seam_cost, repetition_cost : float64, >= 0
    total_cost : float
    """

    choice: Int
    has_seam: Mask
    is_connected: Mask
    seam_cost: Float
    repetition_cost: Float
    total_cost: float


@dataclass(frozen=True, eq=False)
class Joint:
    """What lies between the candidates of two neighbouring segments, (N, M) each.

    Parameters
    ----------
    cost : float64, >= 0, of the seam
    is_connected : whether the poses are within the thresholds
    """

    cost: Float
    is_connected: Mask


def continues(before: Candidates, after: Candidates) -> Mask:
    """Whether each candidate after goes on where each before ended, (N, M) bool.

    Parameters
    ----------
    before, after : Candidates of N and M pieces, of neighbouring segments

    Returns
    -------
    (N, M) bool
    """
    same = before.clip_index[:, None] == after.clip_index[None]
    return np.asarray(same & (np.abs(after.start_s[None] - before.end_s[:, None]) <= CONTINUES_S))


def viterbi(own: Sequence[Float], between: Sequence[Float]) -> Int:
    """Find the choice of one candidate a segment whose costs sum to least.

    Parameters
    ----------
    own : S arrays (N_i,), S >= 1
    between : S - 1 arrays (N_i, N_i+1)

    Returns
    -------
    (S,) int64; of equal sums the one whose last candidate comes first, then the one before it, and so on
    """
    total, back = np.asarray(own[0], np.float64), []
    for cost, joint in zip(own[1:], between, strict=True):
        reached = total[:, None] + joint
        best = np.argmin(reached, axis=0)
        back.append(best)
        total = reached[best, np.arange(len(best))] + cost
    choice = [int(np.argmin(total))]
    for best in reversed(back):
        choice.append(int(best[choice[-1]]))
    return np.array(choice[::-1], np.int64)


def overlaps(candidates: Candidates, clip_index: int, start_s: float, end_s: float) -> Float:
    """Share of a piece of a clip that each candidate shows too, (N,) float64, 0 to 1.

    Parameters
    ----------
    candidates : Candidates of N pieces
    clip_index : int
    start_s, end_s : float, seconds of that clip, end > start

    Returns
    -------
    (N,) float64, 0 to 1; 0 for pieces of other clips
    """
    common = np.minimum(candidates.end_s, end_s) - np.maximum(candidates.start_s, start_s)
    shown = np.clip(common / max(end_s - start_s, 1e-9), 0.0, 1.0)
    return np.where(candidates.clip_index == clip_index, shown, 0.0)


def choose(
    segments: Sequence[Candidates],
    joints: Sequence[Joint],
    *,
    repetition_weight: float = 1.0,
    unconnected_cost: float | None = None,
    rounds: int = 8,
) -> Chosen:
    """Choose one candidate a segment.

    A piece that shows again more than half of what the piece before it showed is no connection, however alike the
    poses: else a catalogue in which little connects would be danced by one step over and over.

    Parameters
    ----------
    segments : S >= 1 Candidates
    joints : S - 1 Joint
    repetition_weight : float, >= 0
        Cost of a piece that was shown whole before; of a part, so much less.
    unconnected_cost : float, or None
        Added to a seam outside the thresholds. None: more than everything else can come to, so that as few seams as
        possible lie outside, none where there is a sequence without: connectivity binds.
    rounds : int, >= 0
        How often the whole sequence is gone through for repetition.

    Returns
    -------
    Chosen
        Where nothing connects, the nearest poses are taken and ``is_connected`` says so.

    Raises
    ------
    ValueError
        If there is no segment, a segment has no candidate, or shapes do not fit.
    """
    if not segments or any(len(c.cost) == 0 for c in segments):
        raise ValueError("segments: want at least one, each with a candidate; fill the ones that found no match")
    if len(joints) != len(segments) - 1:
        raise ValueError(f"joints: want {len(segments) - 1}, got {len(joints)}")
    own = [c.cost for c in segments]
    goes_on = [continues(a, b) for a, b in itertools.pairwise(segments)]
    free = [np.where(on, 0.0, joint.cost) for joint, on in zip(joints, goes_on, strict=True)]
    again = [_shows_again(a, b) for a, b in itertools.pairwise(segments)]
    open_ = [~((joint.is_connected & ~same) | on) for joint, on, same in zip(joints, goes_on, again, strict=True)]
    if unconnected_cost is None:
        unconnected_cost = 1.0 + sum(float(c.max()) for c in (*own, *free)) + repetition_weight * len(own) ** 2
    between = [cost + unconnected_cost * out for cost, out in zip(free, open_, strict=True)]
    choice = _spread(segments, own, between, viterbi(own, between), repetition_weight, rounds)
    pairs = list(itertools.pairwise(choice))
    repeated = repetition_weight * _repetition(segments, choice)
    seam = np.array([0.0, *(cost[i, j] for cost, (i, j) in zip(free, pairs, strict=True))])
    return Chosen(
        choice,
        np.array([False, *(not on[i, j] for on, (i, j) in zip(goes_on, pairs, strict=True))], bool),
        np.array([True, *(not out[i, j] for out, (i, j) in zip(open_, pairs, strict=True))], bool),
        seam,
        repeated,
        float(sum(c[i] for c, i in zip(own, choice, strict=True)) + seam.sum() + repeated.sum()),
    )


def _shows_again(before: Candidates, after: Candidates) -> Mask:
    """Whether each candidate after shows more than half of each before once more, (N, M) bool."""
    shown = [
        overlaps(after, int(c), float(a), float(b))
        for c, a, b in zip(before.clip_index, before.start_s, before.end_s, strict=True)
    ]
    return np.asarray(np.stack(shown) > 0.5)


def _repetition(segments: Sequence[Candidates], choice: Int) -> Float:
    """How much of each chosen piece earlier ones show, each of them counted, (S,)."""
    out = np.zeros(len(choice))
    for i, at in enumerate(choice):
        piece = segments[i]
        for j in range(i):
            shown = segments[j]
            if shown.clip_index[choice[j]] == piece.clip_index[at]:
                at_j = choice[j : j + 1]
                one = Candidates(shown.clip_index[at_j], shown.start_s[at_j], shown.end_s[at_j], shown.cost[at_j])
                where = int(piece.clip_index[at]), float(piece.start_s[at]), float(piece.end_s[at])
                out[i] += float(overlaps(one, *where)[0])
    return out


def _spread(
    segments: Sequence[Candidates],
    own: Sequence[Float],
    between: Sequence[Float],
    choice: Int,
    weight: float,
    rounds: int,
) -> Int:
    """Lessen repetition: price what the others show, search anew, and change single choices while that gains."""

    def total(of: Int) -> float:
        seams = sum(cost[of[i], of[i + 1]] for i, cost in enumerate(between))
        return float(sum(c[i] for c, i in zip(own, of, strict=True)) + seams) + weight * float(
            _repetition(segments, of).sum()
        )

    def shown_by_others(of: Int, i: int) -> Float:
        out = np.zeros(len(own[i]))
        for j, other in enumerate(segments):
            if j != i:
                at = of[j]
                out += overlaps(
                    segments[i], int(other.clip_index[at]), float(other.start_s[at]), float(other.end_s[at])
                )
        return out

    best, best_cost = choice, total(choice)
    if weight == 0 or best_cost == 0:
        return best
    priced = [np.zeros(len(c)) for c in own]
    now = choice
    for _ in range(rounds):
        # Prices rise where a sequence repeats and stay up, so that the next one does not fall back into it.
        priced = [p + 0.5 * weight * shown_by_others(now, i) for i, p in enumerate(priced)]
        now = viterbi([c + p for c, p in zip(own, priced, strict=True)], between)
        if total(now) < best_cost - 1e-9:
            best, best_cost = now, total(now)
    for _ in range(rounds):
        changed = False
        for i in range(len(own)):
            price = own[i] + weight * shown_by_others(best, i)
            price = price + (between[i - 1][best[i - 1]] if i else 0.0)
            price = price + (between[i][:, best[i + 1]] if i + 1 < len(own) else 0.0)
            to = int(np.argmin(price))
            if price[to] < price[best[i]] - 1e-9:
                trial = best.copy()
                trial[i] = to
                if total(trial) < best_cost - 1e-9:
                    best, best_cost, changed = trial, total(trial), True
        if not changed:
            break
    return best


def to_choreography(
    segments: Sequence[Candidates],
    found: Chosen,
    *,
    start_s: Float,
    end_s: Float,
    beat_s: Float,
    clip_ids: tuple[str, ...],
    blend_s: float,
) -> tuple[Choreography, Int]:
    """Write a sequence as the record that the assembler reads.

    Parameters
    ----------
    segments, found : as chosen
    start_s, end_s : (S,) float, seconds of the song, contiguous
    beat_s : (B,) float, seconds, increasing
        A segment is one step a beat, all at one pace: the clock joins the paces of neighbouring steps smoothly, and
        over steps as long as a segment that would move the body's stops off the beats they were matched to.
    clip_ids : name of each clip index
    blend_s : float, seconds of song, >= 0

    Returns
    -------
    Choreography
    (S',) int64
        Segment of each step.
    """
    clips: list[str] = []
    song: list[Float] = []
    clip_s: list[Float] = []
    seams: list[Mask] = []
    of: list[Int] = []
    for i, at in enumerate(found.choice):
        piece = segments[i]
        inside = beat_s[(beat_s > start_s[i] + 0.1) & (beat_s < end_s[i] - 0.1)]
        edge = np.concatenate([[start_s[i]], inside, [end_s[i]]])
        pace = (piece.end_s[at] - piece.start_s[at]) / (end_s[i] - start_s[i])
        here = piece.start_s[at] + pace * (edge - start_s[i])
        here[-1] = piece.end_s[at]
        if clip_s and not found.has_seam[i]:
            here[0] = clip_s[-1][1, -1]
        n = len(edge) - 1
        clips += [clip_ids[int(piece.clip_index[at])]] * n
        song.append(np.stack([edge[:-1], edge[1:]]))
        clip_s.append(np.stack([here[:-1], here[1:]]))
        seams.append(np.arange(n) < int(found.has_seam[i]))
        of.append(np.full(n, i))
    song_s, in_clip_s, seam = np.concatenate(song, axis=1), np.concatenate(clip_s, axis=1), np.concatenate(seams)
    steps = Choreography(
        tuple(clips), song_s[0], song_s[1], in_clip_s[0], in_clip_s[1], seam, np.where(seam, blend_s, 0.0)
    )
    return steps, np.concatenate(of)


def at_first_steps(value: Float, span_of: Int) -> Float:
    """Give what a span costs to the first of its steps.

    Parameters
    ----------
    value : (S,) float, of each span
    span_of : (S',) int64, ascending, S' >= 1; span of each step

    Returns
    -------
    (S',) float64; 0 for the other steps
    """
    is_first = np.append(True, np.diff(span_of) > 0)
    return np.where(is_first, value[span_of], 0.0)
