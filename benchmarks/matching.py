"""Time the exact matching of a song against a catalogue: every way of searching, on the same data in one run.

    python benchmarks/matching.py [--segments S] [--clips C] [--device NAME] [--repeats R] [--quick] [--json]

300 segments of 3 s against 1000 clips of 4 to 6 s at 120 Hz, k = 10. A *term* is one frame of one candidate. Times are
CPU-seconds of the process, all threads, the least of the repeats (on a GPU, wall seconds). *Brute* is the tuned OpenCL
search of everything, timed on a part of the segments and scaled; *Numba* a search of everything in Numba; *zero-skip*
leaves out silent frames of each segment. *Query* is the pruned search with its index there, the whole call, its plan
picked before by trial; *index* is the upload and all tables of that plan; its
rate counts what summing every row from frames would interpolate, though large blocks are summed from small ones.

Clips: *energy*, mean joint speed of the real dances and labelled takes where there are some (in ODORI_TEST_DATA, else
beside the checkout), cut, stretched in time by up to a fifth and scaled to the number wanted, else of the made-up
dancer; *rough*, noise with a correlation time of 25 ms; *impulse*, minima of the energy, one frame each. Segments are
made up: pulses at some tempo over soft noise, noise, and impulses at beats. The answers of some segments are compared
with float64 over the whole catalogue, to the bit: score, clip, scale and start of all ranks.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import matching_peer
import pyopencl as cl
from scipy.ndimage import gaussian_filter1d

from assets.formats import bvh
from kernels.matching.blocks import rows
from kernels.matching.plan import BRUTE, BRUTE_SPARSE, Plan, built, bytes_a_frame
from kernels.matching.score import SCALE_NUMERATORS, reference_matches, start_count
from kernels.opencl.choice import pick_device
from kernels.opencl.match import ClipIndex, Matcher
from kernels.opencl.match_program import Program
from kernels.opencl.match_tables import Tables
from kernels.skeleton.kinematics import place
from kernels.synthetic import dancer
from kernels.types import Clip

RATE_HZ = 120
LENGTH = 3 * RATE_HZ
K = 10
Series = NDArray[np.float32]


def takes() -> list[Clip]:
    """Real dances and labelled takes, else made-up ones."""
    data = Path(os.environ.get("ODORI_TEST_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
    paths = sorted(path for name in ("bvh_dance", "bvh_labelled") for path in (data / name).glob("*.bvh"))
    if not paths:
        return [dancer.take(label, n_beats=40, frame_rate_hz=60.0).clip for label in dancer.MOVES]
    return [take.clip for take in (bvh.to_clip(bvh.read(path)) for path in paths) if take.clip.n_frames > 30]


def energy(clip: Clip) -> NDArray[np.float64]:
    """Mean joint speed at 120 Hz, smoothed over 25 ms, its 99th percentile 1."""
    position, _ = place(clip)
    speed = np.linalg.norm(np.diff(position, axis=0), axis=-1).mean(-1) * clip.frame_rate_hz
    time_s = (np.arange(len(speed)) + 0.5) / clip.frame_rate_hz
    series = np.interp(np.arange(0, time_s[-1], 1 / RATE_HZ), time_s, speed)
    series = gaussian_filter1d(series, 0.025 * RATE_HZ)
    return series / max(np.percentile(series, 99), 1e-9)


def cut(sources: list[NDArray[np.float64]], n: int, rng: np.random.Generator) -> list[Series]:
    """Clips of 4 to 6 s from random places of the sources joined, each stretched and scaled by its own amount."""
    joined = np.concatenate([sources[i] for i in rng.permutation(len(sources))])
    joined = np.tile(joined, 1 + 1000 // len(joined))
    clips = []
    for _ in range(n):
        length, stretch = int(rng.integers(4 * RATE_HZ, 6 * RATE_HZ + 1)), rng.uniform(0.8, 1.2)
        first = rng.uniform(0, len(joined) - length * stretch - 2)
        clip = np.interp(first + stretch * np.arange(length), np.arange(len(joined)), joined)
        clips.append((clip * rng.uniform(0.8, 1.25)).astype(np.float32))
    return clips


def rough(n: int, length: int, rng: np.random.Generator) -> Series:
    """Positive noise with a correlation time of 25 ms, its mean 1."""
    noise = np.abs(gaussian_filter1d(rng.normal(size=(n, length + 40)), 0.025 * RATE_HZ, axis=1)[:, 20:-20])
    return (noise / noise.mean(1, keepdims=True)).astype(np.float32)


def minima(series: Series) -> Series:
    """One where a series has a minimum, deeper ones larger, else 0."""
    inside = np.flatnonzero((series[1:-1] < series[:-2]) & (series[1:-1] <= series[2:])) + 1
    out = np.zeros_like(series)
    out[inside] = 1 / (1 + series[inside])
    return out


def music(n: int, rng: np.random.Generator, *, impulses: bool) -> list[Series]:
    """Segments of 3 s: accents at some tempo, as soft pulses over noise or as impulses."""
    segments = []
    for _ in range(n):
        beat = RATE_HZ * 60 / rng.uniform(80, 160) / rng.choice([1, 2])
        at = np.arange(rng.uniform(0, beat), LENGTH, beat).astype(int)
        series = np.zeros(LENGTH)
        series[at] = rng.uniform(0.3, 1, len(at))
        if not impulses:
            series = gaussian_filter1d(series, rng.uniform(0.04, 0.1) * RATE_HZ)
            series /= series.max()
            series += 0.3 * np.abs(gaussian_filter1d(rng.normal(size=LENGTH), 0.08 * RATE_HZ)) / 0.2
        segments.append((series / series.max()).astype(np.float32))
    return segments


def make(
    kind: str, n_segments: int, n_clips: int, sources: list[NDArray[np.float64]]
) -> tuple[list[Series], list[Series]]:
    """Segments and clips of one kind."""
    rng = np.random.default_rng(20)
    if kind == "rough":
        lengths = rng.integers(4 * RATE_HZ, 6 * RATE_HZ + 1, n_clips)
        clips = [clip[:length] for clip, length in zip(rough(n_clips, 6 * RATE_HZ, rng), lengths, strict=True)]
        return list(rough(n_segments, LENGTH, rng)), clips
    clips = cut(sources, n_clips, rng)
    if kind == "impulse":
        return music(n_segments, rng, impulses=True), [minima(clip) for clip in clips]
    return music(n_segments, rng, impulses=False), clips


def n_terms(segments: list[Series], clips: list[Series]) -> int:
    """Frames of all candidates."""
    per_length = {
        length: sum(start_count(length, len(clip), p) for clip in clips for p in SCALE_NUMERATORS)
        for length in {len(segment) for segment in segments}
    }
    return sum(len(segment) * per_length[len(segment)] for segment in segments)


def n_lerps(plan: Plan, clips: list[Series]) -> int:
    """Frames that the tables of a plan are sums of: what summing every row from frames would interpolate."""
    each = sum(len(rows(g, SCALE_NUMERATORS)) * g for g in built(plan))
    return each * sum(len(clip) for clip in clips)


def resident_mb() -> float:
    """Memory of this process that is really there; 0 where the system does not say."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


class Clock:
    """CPU-seconds where the device is the CPU, else wall seconds; the least of some repeats."""

    def __init__(self, *, is_cpu: bool, repeats: int) -> None:
        self.now: Callable[[], float] = time.process_time if is_cpu else time.perf_counter
        self.repeats = repeats

    def __call__(self, work: Callable[[], object], *, repeats: int | None = None) -> float:
        """Time some work."""
        spent = []
        for _ in range(repeats or self.repeats):
            start = self.now()
            work()
            spent.append(self.now() - start)
        return min(spent)


def mismatches(matcher: Matcher, index: ClipIndex, segments: list[Series], clips: list[Series], n: int) -> int:
    """Count the ranks of n segments that differ from float64 in anything."""
    chosen = [segments[i] for i in np.linspace(0, len(segments) - 1, n).astype(int)]
    answers = matcher.matches(chosen, index, k=K)
    laid = np.zeros((len(clips), max(map(len, clips)) + 1))
    for row, clip in zip(laid, clips, strict=True):
        row[: len(clip)] = clip
    lengths, numerators = np.array([len(clip) for clip in clips]), np.array(SCALE_NUMERATORS)
    wrong = 0
    for segment, answer in zip(chosen, answers, strict=True):
        score, scale, start = matching_peer.exact_best(segment.astype(np.float64), laid, lengths, numerators)
        order = np.lexsort((np.arange(len(score)), -score))[:K]
        expected = [(i, scale[i], start[i], score[i]) for i in order if score[i] >= 0]
        got = [(m.clip_index, m.scale_index, m.start_frame_index, m.score) for m in answer]
        wrong += sum(a != b for a, b in zip(got, expected, strict=False)) + abs(len(got) - len(expected))
    return wrong


def check_peer() -> None:
    """Compare the float64 search used here with the reference."""
    rng = np.random.default_rng(1)
    clips, segment = [rng.random(90).astype(np.float32) for _ in range(5)], rng.random(40).astype(np.float32)
    laid = np.zeros((5, 91))
    laid[:, :90] = clips
    score, scale, start = matching_peer.exact_best(
        segment.astype(np.float64), laid, np.full(5, 90), np.array(SCALE_NUMERATORS)
    )
    for match in reference_matches([segment], clips, k=5)[0]:
        i = match.clip_index
        if (match.score, match.scale_index, match.start_frame_index) != (score[i], scale[i], start[i]):
            raise SystemExit("the float64 search of this benchmark differs from the reference")


def measure_kind(program: Program, segments: list[Series], clips: list[Series], clock: Clock, n_brute: int) -> dict:
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
        "query_speedup_ratio": brute_s / query_s,
        "with_index_speedup_ratio": brute_s / (query_s + index_s),
        "query_over_zero_skip_ratio": zero_skip_s / query_s,
    }


def measure_brute(program: Program, segments: list[Series], clips: list[Series], clock: Clock) -> tuple[float, float]:
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


def measure_growth(program: Program, sources: list[NDArray[np.float64]], clock: Clock, counts: list[int]) -> list[dict]:
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


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--segments", type=int, default=300)
    parser.add_argument("--clips", type=int, default=1000)
    parser.add_argument("--device", default=None)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--quick", action="store_true", help="no growth, fewer repeats")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    repeats = 1 if options.quick else options.repeats
    program = Program(cl.Context([pick_device(options.device)]))
    clock = Clock(is_cpu=program.is_cpu, repeats=repeats)
    check_peer()
    sources = [energy(clip) for clip in takes()]
    figures: dict = {"device": program.name, "segments": options.segments, "clips": options.clips}
    segments, clips = make("energy", 48, options.clips, sources)
    ours, theirs = measure_brute(program, segments, clips, clock)
    figures |= {"brute_gterm_per_cpu_s": ours, "numba_gterm_per_cpu_s": theirs, "brute_over_numba_ratio": ours / theirs}
    wrong = 0
    for kind in ("energy", "rough", "impulse"):
        segments, clips = make(kind, options.segments, options.clips, sources)
        figures[kind] = measure_kind(program, segments, clips, clock, min(48, options.segments))
        matcher = Matcher(program=program)
        wrong += mismatches(matcher, matcher.index(clips), segments, clips, 2 if options.quick else 6)
    figures["exact_mismatch_count"] = wrong
    if not options.quick:
        figures["growth"] = measure_growth(program, sources, clock, [250, 500, 1000, 2000, 4000])
    if options.json:
        print(json.dumps(figures))
        return
    show(figures)


def show(figures: dict) -> None:
    """Print the figures as tables."""
    for name, value in figures.items():
        if not isinstance(value, dict | list):
            print(f"{name:28}{value:>12.4g}" if isinstance(value, int | float) else f"{name:28}{value:>12}")
    kinds = {name: value for name, value in figures.items() if isinstance(value, dict)}
    print("\n" + " " * 34 + "".join(f"{kind:>26}" for kind in kinds))
    for name in next(iter(kinds.values())):
        cells = [kind[name] for kind in kinds.values()]
        print(f"{name:34}" + "".join(f"{c:>26.3f}" if isinstance(c, float) else f"{c:>26}" for c in cells))
    if "growth" in figures:
        print("\n" + "".join(f"{name:>22}" for name in figures["growth"][0]))
        for row in figures["growth"]:
            print("".join(f"{value:>22.4g}" for value in row.values()))
        per_clip = figures["growth"][-1]["query_cpu_s"] / figures["growth"][-1]["clips"]
        per_clip_mb = figures["growth"][-1]["memory_formula_mb"] / figures["growth"][-1]["clips"]
        print(
            f"extrapolated to 50000 such clips, 32 segments (not run): {per_clip * 50000:.1f} CPU-s a query, tables of "
            f"{per_clip_mb * 50:.1f} GB, taken chunk by chunk"
        )


if __name__ == "__main__":
    main()
