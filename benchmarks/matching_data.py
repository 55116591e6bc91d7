"""Features that the matching benchmark searches, and its clock."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from assets.formats import bvh
from kernels.matching.score import SCALE_NUMERATORS, start_count
from kernels.skeleton.kinematics import place
from kernels.synthetic import dancer
from kernels.types import Clip

RATE_HZ = 120
LENGTH = 3 * RATE_HZ
K = 10
KINDS = ("energy", "rough", "impulse")
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
