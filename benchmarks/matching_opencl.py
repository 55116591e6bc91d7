"""Every way of searching on an OpenCL device, timed."""

from __future__ import annotations

import time
from collections.abc import Callable

import matching_peer
import numpy as np
import pyopencl as cl
from matching_data import KINDS, LENGTH, Clock, K, Series, make, n_terms, resident_mb
from numpy.typing import NDArray

from kernels.matching.blocks import rows
from kernels.matching.plan import BRUTE, BRUTE_SPARSE, Plan, built, bytes_a_frame
from kernels.matching.score import SCALE_NUMERATORS, Match
from kernels.opencl.choice import pick_device
from kernels.opencl.match import Matcher
from kernels.opencl.match_program import MatchProgram
from kernels.opencl.match_tables import Tables

Answer = Callable[[list[Series]], list[list[Match]]]


def measured(
    sources: list[NDArray[np.float64]],
    *,
    device: str | None,
    n_segments: int,
    n_clips: int,
    repeats: int,
    check: Callable[[Answer, list[Series], list[Series]], int],
    growth: list[int],
) -> dict:
    """Figures of all kinds; `check` counts the ranks that differ from float64."""
    program = MatchProgram(cl.Context([pick_device(device)]))
    clock = Clock(is_cpu=program.is_cpu, repeats=repeats)
    figures: dict = {"device": program.name, "segments": n_segments, "clips": n_clips}
    segments, clips = make("energy", 48, n_clips, sources)
    ours, theirs = measure_brute(program, segments, clips, clock)
    figures |= {"brute_gterm_per_cpu_s": ours, "numba_gterm_per_cpu_s": theirs, "brute_over_numba_ratio": ours / theirs}
    wrong = 0
    for kind in KINDS:
        segments, clips = make(kind, n_segments, n_clips, sources)
        figures[kind] = measure_kind(program, segments, clips, clock, min(48, n_segments))
        matcher = Matcher(program=program)
        index = matcher.index(clips)
        wrong += check(lambda some, m=matcher, i=index: m.matches(some, i, k=K), segments, clips)
    figures["exact_mismatch_count"] = wrong
    if growth:
        figures["growth"] = measure_growth(program, sources, clock, growth)
    return figures


def n_lerps(plan: Plan, clips: list[Series]) -> int:
    """Frames that the tables of a plan are sums of: what summing every row from frames would interpolate."""
    each = sum(len(rows(g, SCALE_NUMERATORS)) * g for g in built(plan))
    return each * sum(len(clip) for clip in clips)


def measure_kind(
    program: MatchProgram, segments: list[Series], clips: list[Series], clock: Clock, n_brute: int
) -> dict:
    """Every way of searching one kind of data."""
    part = segments[:n_brute]
    share = n_terms(segments, clips) / n_terms(part, clips)

    def timed(plan: Plan, some: list[Series], repeats: int | None = None) -> float:
        matcher = Matcher(program=program, plan=plan)
        index = matcher.index(clips)
        matcher.matches(some, index, k=K)
        return clock(lambda: matcher.matches(some, index, k=K), repeats=repeats)

    tuner = Matcher(program=program)
    index = tuner.index(clips)
    tuner.matches(segments[:8], index, k=K)  # compiles
    tuner = Matcher(program=program)
    index = tuner.index(clips)
    start = clock.now()
    tuner.matches(segments, index, k=K)
    first_s = clock.now() - start
    plan = tuner.last_plan
    if plan is None:
        raise SystemExit("no plan was picked")
    query_s = timed(plan, segments)
    start_wall = time.perf_counter()
    Matcher(program=program, plan=plan).matches(segments, index, k=K)
    wall_s = time.perf_counter() - start_wall
    index_s = clock(lambda: Tables(program, clips, numerators=SCALE_NUMERATORS).build(plan))
    brute_s = timed(BRUTE, part, 2) * share
    zero_skip_s = timed(BRUTE_SPARSE, part, 2) * share
    return {
        "plan": str(plan),
        "query_cpu_s": query_s,
        "query_wall_s": wall_s,
        "index_cpu_s": index_s,
        "index_glerp_per_cpu_s": n_lerps(plan, clips) / 1e9 / index_s,
        "first_query_with_trials_cpu_s": first_s,
        "brute_cpu_s": brute_s,
        "zero_skip_cpu_s": zero_skip_s,
        "query_gterm_per_cpu_s": n_terms(segments, clips) / 1e9 / query_s,
        "query_speedup_ratio": brute_s / query_s,
        "with_index_speedup_ratio": brute_s / (query_s + index_s),
        "query_over_zero_skip_ratio": zero_skip_s / query_s,
    }


def measure_brute(
    program: MatchProgram, segments: list[Series], clips: list[Series], clock: Clock
) -> tuple[float, float]:
    """Terms a second (10^9) of the tuned search of everything, and of Numba's."""
    matcher = Matcher(program=program, plan=BRUTE)
    index = matcher.index(clips)
    laid = np.zeros((len(clips), max(map(len, clips)) + LENGTH), np.float32)
    for row, clip in zip(laid, clips, strict=True):
        row[: len(clip)] = clip
    stacked = np.stack(segments)
    lengths, numerators = np.array([len(clip) for clip in clips]), np.array(SCALE_NUMERATORS)

    def numba() -> object:
        return matching_peer.largest(stacked, stacked**2, laid, lengths, numerators)

    numba()
    matcher.matches(segments, index, k=K)
    # turn by turn, for the machine may be shared
    ours, theirs = [], []
    for _ in range(clock.repeats):
        ours.append(clock(lambda: matcher.matches(segments, index, k=K), repeats=1))
        theirs.append(clock(numba, repeats=1))
    terms = n_terms(segments, clips) / 1e9
    return terms / min(ours), terms / min(theirs)


def measure_growth(
    program: MatchProgram, sources: list[NDArray[np.float64]], clock: Clock, counts: list[int]
) -> list[dict]:
    """Query, index and memory of growing catalogues, 32 segments."""
    figures = []
    segments, clips = make("energy", 32, max(counts), sources)
    plan = Plan((25, 8), (10, 8), (10, 5))
    for n in counts:
        before_mb = resident_mb()
        tables = Tables(program, clips[:n], numerators=SCALE_NUMERATORS)
        tables.build(plan)
        measured_mb, allocated_mb = resident_mb() - before_mb, tables.n_bytes / 1e6
        del tables
        index_s = clock(lambda n=n: Tables(program, clips[:n], numerators=SCALE_NUMERATORS).build(plan), repeats=1)
        matcher = Matcher(program=program, plan=plan)
        index = matcher.index(clips[:n])
        matcher.matches(segments, index, k=K)
        query_s = clock(lambda m=matcher, i=index: m.matches(segments, i, k=K))
        frames = sum(len(clip) for clip in clips[:n])
        figures.append(
            {
                "clips": n,
                "query_cpu_s": query_s,
                "index_cpu_s": index_s,
                "memory_formula_mb": (frames * bytes_a_frame(plan, SCALE_NUMERATORS) + 8 * len(segments) * n) / 1e6,
                "memory_allocated_mb": allocated_mb,
                "memory_measured_mb": measured_mb,
            }
        )
    return figures
