"""A dance whose finished poses flip nowhere: chosen, looked at, and chosen again without what flips.

Whether a joint flips from one frame to the next is seen on the finished poses alone: pace, blends and locked feet have
a part in it. So the steps are assembled in memory; where a joint flips, what is shown there is avoided, and the method
chooses again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from assets.dancing.assembled import assemble_steps
from assets.dancing.avoided import AvoidedSpan, merged
from assets.dancing.chosen_steps import ChosenSteps
from assets.dancing.method import DanceOrder, Method
from assets.dancing.refusal import RefusalError
from assets.dancing.shown_moments import flip_sentences, shown_at
from assets.reading.clips import load_clips
from assets.stamps import Stored
from kernels.assembly.blend import Dance, sample
from kernels.assembly.one_frame_flips import OneFrameFlip, find_flips
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Clip
from schemas.keys import source_clip

MOST_ROUNDS = 3
"""A dance is chosen again at most so often. Chosen for time, by hand: most flips go in the first round."""


APART_S = 0.5
"""Moments of one clip that meet in a blend further apart are two, and not all between them. Chosen by hand."""

PHASES = 4
"""Offsets, in parts of a frame, at which a clip is looked through. Chosen by hand."""

SEEN_SETTINGS = ("dance.blend_shape", "dance.lock_feet", "dance.frame_rate_hz")
"""Settings that the finished poses depend on, besides those of the methods."""


@dataclass(frozen=True, eq=False)
class SeenSteps:
    """Steps, their poses as they will be, and the flips in them."""

    chosen: ChosenSteps
    dance: Dance
    flips: Sequence[OneFrameFlip]


def choose_without_flips(
    method: Method, inputs: Mapping[str, Stored], order: DanceOrder, *, frame_rate_hz: float | None = None
) -> ChosenSteps:
    """Choose steps, and choose again where their finished poses flip.

    Parameters
    ----------
    method : Method
    inputs : its tables by name; without ``canonical_pose`` nothing is looked at
    order : DanceOrder
    frame_rate_hz : float, > 0, of the finished poses; None or 0 for the setting's

    Returns
    -------
    ChosenSteps
        Of at most :data:`MOST_ROUNDS` more searches the one with the fewest flips, the earliest of those. The metadata
        also have ``searches_again``, ``avoided`` (what is not shown, in words) and ``flips_left`` (sentences).

    Raises
    ------
    RefusalError
        As the method raises it for the order as it is. Pins win: where they cannot be kept without what is avoided, it
        is shown, and the flip is said.
    """
    chosen = method.choose(inputs, order)
    if "canonical_pose" not in inputs:
        return chosen
    seen = best = _seen(chosen, inputs["canonical_pose"], order, frame_rate_hz)
    avoid = avoid_of_best = order.avoid
    n_rounds = 0
    while seen.flips and n_rounds < MOST_ROUNDS:
        again = _again(method, inputs, order, seen, avoid)
        if again is None:
            break
        chosen, avoid = again
        n_rounds += 1
        seen = _seen(chosen, inputs["canonical_pose"], order, frame_rate_hz)
        if len(seen.flips) < len(best.flips):
            best, avoid_of_best = seen, avoid
    said: dict[str, Any] = {
        "searches_again": n_rounds,
        "avoided": [str(span) for span in avoid_of_best],
        "flips_left": list(flip_sentences(best.flips, best.dance, best.chosen.steps)),
    }
    return replace(best.chosen, metadata={**best.chosen.metadata, **said}, avoided=avoid_of_best)


def _seen(chosen: ChosenSteps, canonical_pose: Stored, order: DanceOrder, frame_rate_hz: float | None) -> SeenSteps:
    """Look at the finished poses of steps; blends are as wide as they are stored."""
    steps = replace(chosen.steps, blend_s=chosen.steps.blend_s.astype(np.float32).astype(np.float64))
    dance = assemble_steps(steps, canonical_pose, order.settings.dance, frame_rate_hz=frame_rate_hz)
    return SeenSteps(chosen, dance, find_flips(dance.rotation_wxyz, CANONICAL.parent, dance.frame_rate_hz))


def _again(
    method: Method, inputs: Mapping[str, Stored], order: DanceOrder, seen: SeenSteps, avoid: tuple[AvoidedSpan, ...]
) -> tuple[ChosenSteps, tuple[AvoidedSpan, ...]] | None:
    """Choose without what flips; what a pin shows is shown again where there is no other way. None for no other way."""
    free = [flip for flip in seen.flips if not _is_pinned(flip, seen)]
    clips = load_clips(inputs["canonical_pose"], seen.chosen.steps)
    tried = {avoid}
    for flips in (seen.flips, free):
        wider = merged([*avoid, *spans_of(flips, seen), *spans_alike(flips, seen, clips)])
        if wider in tried:
            continue
        tried.add(wider)
        try:
            return method.choose(inputs, replace(order, avoid=wider)), wider
        except RefusalError:
            continue
    return None


def _is_pinned(flip: OneFrameFlip, seen: SeenSteps) -> bool:
    pins, line = seen.chosen.pin_ids, seen.dance.lineage
    if not len(pins):
        return False
    shown = {int(steps[k]) for steps in (line.step_index, line.blend_step_index) for k in (flip.frame - 1, flip.frame)}
    return any(pins[step] is not None for step in shown if step >= 0)


def spans_of(flips: Sequence[OneFrameFlip], seen: SeenSteps) -> list[AvoidedSpan]:
    """Find what is shown while joints flip: of one clip, or of both sides of a blend.

    Parameters
    ----------
    flips : of the steps seen
    seen : SeenSteps

    Returns
    -------
    list of AvoidedSpan, by flip, then clip
    """
    out = []
    for flip in flips:
        moments: dict[str, list[float]] = {}
        for frame in (flip.frame - 1, flip.frame):
            for name, time_s in shown_at(seen.dance, seen.chosen.steps, frame):
                moments.setdefault(source_clip(name), []).append(time_s)
        for clip_id, times_s in sorted(moments.items()):
            ordered = sorted(times_s)
            cuts = [0, *(i + 1 for i, gap in enumerate(np.diff(ordered)) if gap > APART_S), len(ordered)]
            out += [AvoidedSpan(clip_id, ordered[a], ordered[b - 1]) for a, b in pairwise(cuts)]
    return out


def spans_alike(flips: Sequence[OneFrameFlip], seen: SeenSteps, clips: Mapping[str, Clip]) -> list[AvoidedSpan]:
    """Find where else the clips that flip would: a foot that is put down too fast is so at every step.

    Parameters
    ----------
    flips : of the steps seen
    seen : SeenSteps
    clips : by the names of the steps

    Returns
    -------
    list of AvoidedSpan
        Of each clip, played alone and whole at the pace at which it flips, at :data:`PHASES` offsets of its frames.
    """
    rate_hz, line = seen.dance.frame_rate_hz, seen.dance.lineage
    steps = seen.chosen.steps
    shown = {int(k) for f in flips for k in (line.step_index[f.frame], line.blend_step_index[f.frame]) if k >= 0}
    paces = sorted({(steps.clip_id[k], round(1 / float(steps.warp_ratio[k]), 2)) for k in shown})
    out = []
    for name, pace in paces:
        step_s = pace / rate_hz
        for phase in range(PHASES):
            time_s = np.arange(phase * step_s / PHASES, clips[name].duration_s, step_s)
            _, turned = sample(clips[name], time_s)
            found = find_flips(turned, CANONICAL.parent, rate_hz)
            out += [AvoidedSpan(source_clip(name), float(time_s[f.frame - 1]), float(time_s[f.frame])) for f in found]
    return out
