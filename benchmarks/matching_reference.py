"""The pruned search in NumPy, timed beside the reference it is the twin of."""

from __future__ import annotations

import time
from collections.abc import Callable

import matching_peer
import numpy as np
from matching_data import KINDS, LENGTH, Clock, K, Series, make, n_terms, resident_mb
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from kernels.matching.bounds import SumTables
from kernels.matching.numpy_search import NumpyMatcher, bytes_a_frame
from kernels.matching.refinement import PAIRS, STAGES
from kernels.matching.score import SCALE_NUMERATORS, Match, reference_matches

_BRUTE_CLIPS = 12
Answer = Callable[[list[Series]], list[list[Match]]]


def measured(
    sources: list[NDArray[np.float64]],
    *,
    n_segments: int,
    n_clips: int,
    repeats: int,
    check: Callable[[Answer, list[Series], list[Series]], int],
    growth: list[int],
) -> dict:
    """Figures of all kinds; `check` counts the ranks that differ from float64."""
    clock = Clock(is_cpu=True, repeats=repeats)
    matcher = NumpyMatcher()
    figures: dict = {"device": matcher.name, "segments": n_segments, "clips": n_clips}
    segments, clips = make("energy", 4, n_clips, sources)
    ours, theirs = brute_rate(segments, clips, clock), numba_rate(segments, clips, clock)
    figures |= {"brute_gterm_per_cpu_s": ours, "numba_gterm_per_cpu_s": theirs, "brute_over_numba_ratio": ours / theirs}
    wrong = 0
    for kind in KINDS:
        segments, clips = make(kind, n_segments, n_clips, sources)
        figures[kind] = measure_kind(segments, clips, clock)
        index = matcher.index(clips)
        wrong += check(lambda some, i=index: matcher.matches(some, i, k=K), segments, clips)
    figures["exact_mismatch_count"] = wrong
    if growth:
        figures["growth"] = measure_growth(sources, clock, growth)
    return figures


def measure_kind(segments: list[Series], clips: list[Series], clock: Clock) -> dict:
    """Time the search of one kind of data."""
    matcher = NumpyMatcher()
    index = matcher.index(clips)
    matcher.matches(segments[:2], index, k=K)  # sums blocks
    query_s = clock(lambda: matcher.matches(segments, index, k=K))
    start_wall = time.perf_counter()
    matcher.matches(segments, index, k=K)
    wall_s = time.perf_counter() - start_wall
    index_s = clock(lambda: build(clips))
    terms = n_terms(segments, clips) / 1e9
    brute_s = terms / brute_rate(segments, clips, clock)
    return {
        "query_cpu_s": query_s,
        "query_wall_s": wall_s,
        "index_cpu_s": index_s,
        "brute_cpu_s": brute_s,
        "query_gterm_per_cpu_s": terms / query_s,
        "query_speedup_ratio": brute_s / query_s,
        "with_index_speedup_ratio": brute_s / (query_s + index_s),
        "query_over_zero_skip_ratio": brute_s / query_s,
    }


def build(clips: list[Series]) -> SumTables:
    """All block sums of a catalogue."""
    tables = SumTables(clips, numerators=SCALE_NUMERATORS)
    with threadpool_limits(limits=1, user_api="blas"):
        for block, fold in (PAIRS, *STAGES):
            tables.table(block, fold)
    return tables


def brute_rate(segments: list[Series], clips: list[Series], clock: Clock) -> float:
    """Terms a second (10^9) of the reference, one segment and a few clips."""
    few = [clips[i] for i in np.linspace(0, len(clips) - 1, min(_BRUTE_CLIPS, len(clips))).astype(int)]
    return n_terms(segments[:1], few) / 1e9 / clock(lambda: reference_matches(segments[:1], few, k=K))


def numba_rate(segments: list[Series], clips: list[Series], clock: Clock) -> float:
    """Terms a second (10^9) of Numba's search of everything, four segments."""
    laid = np.zeros((len(clips), max(map(len, clips)) + LENGTH), np.float32)
    for row, clip in zip(laid, clips, strict=True):
        row[: len(clip)] = clip
    stacked = np.stack(segments[:4])
    lengths, numerators = np.array([len(clip) for clip in clips]), np.array(SCALE_NUMERATORS)

    def numba() -> object:
        return matching_peer.largest(stacked, stacked**2, laid, lengths, numerators)

    numba()
    return n_terms(segments[:4], clips) / 1e9 / clock(numba)


def measure_growth(sources: list[NDArray[np.float64]], clock: Clock, counts: list[int]) -> list[dict]:
    """Query, index and memory of growing catalogues, 32 segments."""
    figures = []
    segments, clips = make("energy", 32, max(counts), sources)
    for n in counts:
        before_mb = resident_mb()
        tables = build(clips[:n])
        measured_mb = resident_mb() - before_mb
        del tables
        index_s = clock(lambda n=n: build(clips[:n]), repeats=1)
        matcher = NumpyMatcher()
        index = matcher.index(clips[:n])
        matcher.matches(segments[:1], index, k=K)
        query_s = clock(lambda m=matcher, i=index: m.matches(segments, i, k=K))
        frames = sum(len(clip) for clip in clips[:n])
        figures.append(
            {
                "clips": n,
                "query_cpu_s": query_s,
                "index_cpu_s": index_s,
                "memory_formula_mb": (frames * bytes_a_frame(SCALE_NUMERATORS) + 40 * len(segments) * n) / 1e6,
                "memory_measured_mb": measured_mb,
            }
        )
    return figures
