"""Picking a plan by trying some on a sample."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kernels.matching.plan import BRUTE, PLANS, Plan, bytes_a_frame
from kernels.opencl.match_finalists import finalists
from kernels.opencl.match_program import MatchProgram
from kernels.opencl.match_stages import Stages, wants_safe
from kernels.opencl.match_tables import Tables

_SEGMENTS = 128
_CLIPS = 80
"""Of a trial. Tuned on the benchmark: 8 segments and 48 clips picked plans that took twice as long, and few segments
with many clips flatter brute force."""

_SPARSE = 0.5
"""Share of frames with music below which sparse plans are tried. Chosen by hand; changes no answer."""

_TURNS = 3
_HOPELESS = 1.5
_AS_GOOD = 1.05
"""Turns of a trial; times the least so far from which a plan gets no further turn; and up to which it is as good.
Chosen by hand."""

_SURE_S = 0.1
"""A trial so long needs no further turn. Chosen by hand."""


def worth_trying(segments: NDArray[np.float64], n_frames: NDArray[np.int64]) -> list[Plan]:
    """Plans that may be the best for segments: sparse ones only where there is silence to leave out.

    Parameters
    ----------
    segments : (S, L) float64, filled up with zeros
    n_frames : (S,) int64

    Returns
    -------
    list of Plan, never empty
    """
    share = np.count_nonzero(segments) / n_frames.sum()
    if share < _SPARSE:
        return [plan for plan in PLANS if plan != BRUTE]
    return [plan for plan in PLANS if not plan.is_sparse and plan != BRUTE]


def pick_plan(
    program: MatchProgram,
    segments: NDArray[np.float64],
    *,
    n_frames: NDArray[np.int64],
    clips: Sequence[NDArray[np.floating]],
    numerators: tuple[int, ...],
    k: int,
    by_level: bool,
) -> Plan:
    """Time the plans on a few segments and clips.

    Parameters
    ----------
    program : MatchProgram
    segments : (S, L) float64, S >= 1
        Filled up with zeros.
    n_frames : (S,) int64
    clips : sequence of (T,) float, at least one
    numerators : the scales times 50
    k : int
    by_level : bool

    Returns
    -------
    Plan
        The fastest, or one with less memory that is within a twentieth of it. Only the time of a search depends on
        it, never the answer.
    """
    plans = worth_trying(segments, n_frames)
    some = np.unique(np.linspace(0, len(segments) - 1, _SEGMENTS).astype(int))
    few = [clips[i] for i in np.unique(np.linspace(0, len(clips) - 1, _CLIPS).astype(int))]
    tables = Tables(program, few, numerators=numerators)
    is_safe = any(wants_safe(tables, float(segments[i].max())) is not False for i in some)
    k_sample = max(round(k * len(few) / len(clips)), 1)
    floor = np.full(len(some), -1, np.float32)
    tried: list[Stages] = []
    warm: list[Stages] = []
    for plan in plans:
        tables.build(plan)
        for made, chosen in ((tried, some), (warm, some[:2])):
            made.append(
                Stages(
                    tables, segments[chosen], n_frames=n_frames[chosen], plan=plan, is_safe=is_safe, by_level=by_level
                )
            )
    for stages in warm:  # compiles
        finalists(stages, k=k_sample, floor=floor[:2])
    # turn by turn, for what else the machine does comes and goes; some drivers still compile in the first turn, for
    # larger sizes. On a CPU the time of this process alone counts, others may want the machine too
    now = time.process_time if program.is_cpu else time.perf_counter
    spent = np.full(len(plans), np.inf)
    for turn in range(_TURNS):
        for i, stages in enumerate(tried):
            if turn > 1 and spent[i] > _HOPELESS * spent.min():
                continue
            start = now()
            finalists(stages, k=k_sample, floor=floor)
            spent[i] = min(spent[i], now() - start)
        if turn > 0 and spent.min() > _SURE_S:
            break
    # as good as the fastest: the one with the least memory, whose index is the sooner built
    good = [plan for plan, seconds in zip(plans, spent, strict=True) if seconds <= _AS_GOOD * spent.min()]
    return min(good, key=lambda plan: bytes_a_frame(plan, numerators))
