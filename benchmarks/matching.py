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

``--device reference`` times the search in NumPy, 100 segments unless told otherwise. Brute force is then the reference,
every candidate in float64, on one segment and a dozen clips of each kind; it leaves out silent frames of music itself,
so it stands for zero-skipping too.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import matching_peer
from matching_data import K, Series, energy, takes

from kernels.matching.score import SCALE_NUMERATORS, Match, reference_matches

Answer = Callable[[list[Series]], list[list[Match]]]


def mismatches(answer: Answer, segments: list[Series], clips: list[Series], *, n: int) -> int:
    """Count the ranks of n segments that differ from float64 in anything."""
    chosen = [segments[i] for i in np.linspace(0, len(segments) - 1, n).astype(int)]
    answers = answer(chosen)
    laid = np.zeros((len(clips), max(map(len, clips)) + 1))
    for row, clip in zip(laid, clips, strict=True):
        row[: len(clip)] = clip
    lengths, numerators = np.array([len(clip) for clip in clips]), np.array(SCALE_NUMERATORS)
    wrong = 0
    for segment, found in zip(chosen, answers, strict=True):
        score, scale, start = matching_peer.exact_best(segment.astype(np.float64), laid, lengths, numerators)
        order = np.lexsort((np.arange(len(score)), -score))[:K]
        expected = [(i, scale[i], start[i], score[i]) for i in order if score[i] >= 0]
        got = [(m.clip_index, m.scale_index, m.start_frame_index, m.score) for m in found]
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


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--segments", type=int, default=None, help="300; 100 on the reference")
    parser.add_argument("--clips", type=int, default=1000)
    parser.add_argument("--device", default=None, help="a device's name or index, or reference")
    parser.add_argument("--repeats", type=int, default=None, help="3; 2 on the reference")
    parser.add_argument("--quick", action="store_true", help="no growth, fewer repeats")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    is_reference = options.device == "reference"
    check_peer()
    sources = [energy(clip) for clip in takes()]
    sizes = {
        "n_segments": options.segments or (100 if is_reference else 300),
        "n_clips": options.clips,
        "repeats": 1 if options.quick else options.repeats or (2 if is_reference else 3),
        "check": partial(mismatches, n=2 if options.quick else 6),
        "growth": [] if options.quick else [250, 500, 1000, 2000, 4000],
    }
    if is_reference:
        from matching_reference import measured

        figures = measured(sources, **sizes)
    else:
        from matching_opencl import measured as measured_on

        figures = measured_on(sources, device=options.device, **sizes)
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
