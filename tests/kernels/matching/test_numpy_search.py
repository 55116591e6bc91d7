import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from kernels.matching.numpy_search import NumpyMatcher
from kernels.matching.score import SCALES, merge_matches, reference_matches


def smooth(rng, n):
    return np.abs(np.convolve(rng.normal(size=n + 20), np.hanning(21), "valid"))


def sparse(rng, n):
    return np.where(rng.random(n) < 0.1, rng.random(n), 0)


KINDS = {
    "smooth": smooth,
    "rough": lambda rng, n: rng.random(n),
    "sparse": sparse,
    "impulse": lambda rng, n: (rng.random(n) < 0.04).astype(float),
    "wide": lambda rng, n: rng.random(n) ** 20,
    "steps": lambda rng, n: np.repeat(rng.integers(0, 3, n // 7 + 1), 7)[:n].astype(float),
    "whole": lambda rng, n: rng.integers(0, 4, n),
    "constant": lambda rng, n: np.full(n, float(rng.integers(0, 3))),
    "sizes": lambda rng, n: rng.random(n) * 10.0 ** rng.integers(-12, 12),
    "mixed": lambda rng, n: [smooth, sparse][rng.integers(2)](rng, n),
}


def make(kind, seed, n_segments=5, n_clips=17):
    rng = np.random.default_rng(seed)
    segments = [KINDS[kind](rng, int(rng.integers(1, 70))) for _ in range(n_segments)]
    clips = [KINDS[kind](rng, int(rng.integers(0, 110))) for _ in range(n_clips)]
    clips[5] = clips[2].copy()
    clips[7] = np.zeros(60)
    segments[1] = np.zeros(30)
    return segments, clips


def test_a_segment_cut_from_a_clip_is_found():
    rng = np.random.default_rng(3)
    clips = [smooth(rng, 200) for _ in range(4)]
    ((best, second),) = NumpyMatcher().matches([clips[2][31:131]], clips, k=2)
    assert (best.clip_index, best.scale_index, best.start_frame_index, best.rank_number) == (2, 5, 31, 1)
    assert best.score == pytest.approx(clips[2][31:131].sum() / 2)
    assert best.music_ratio == pytest.approx(1)
    assert best.mutual_ratio == pytest.approx(1)
    assert second.score < best.score


def test_constant_features_tie_by_the_rule():
    segments, clips = [np.ones(40), np.ones(1), np.zeros(7)], [np.ones(n) for n in (60, 35, 60, 1, 40)]
    found = NumpyMatcher().matches(segments, clips, k=9)
    assert [(m.clip_index, m.scale_index, m.start_frame_index) for m in found[1]] == [(n, 0, 0) for n in range(5)]
    assert found == reference_matches(segments, clips, k=9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(2))
def test_answers_as_the_reference_to_the_bit(kind, seed):
    rng = np.random.default_rng(seed)
    segments, clips = make(kind, seed, int(rng.integers(2, 9)), int(rng.integers(9, 30)))
    if seed == 1:
        segments, clips = ([series.astype(np.float32) for series in group] for group in (segments, clips))
    expected = reference_matches(segments, clips, k=40)
    for k in (1, 4, 40):
        assert NumpyMatcher().matches(segments, clips, k=k) == [found[:k] for found in expected]


@pytest.mark.parametrize("scales", [(1.0,), (0.5, 1.0, 2.0), (0.02, 4.0), SCALES[::5]])
def test_any_scales(scales):
    segments, clips = make("mixed", 7)
    expected = reference_matches(segments, clips, k=3, scales=scales)
    assert NumpyMatcher().matches(segments, clips, k=3, scales=scales) == expected


@pytest.mark.parametrize("size", [1e-310, 1e-200, 1e-30, 1e-7, 1e-3, 1e4, 1e8, 1e100, 1e150])
def test_features_of_very_different_sizes(size):
    rng = np.random.default_rng(0)
    segments, clips = [size * rng.random(50), rng.random(50)], [rng.random(80) for _ in range(6)]
    assert NumpyMatcher().matches(segments, clips, k=3) == reference_matches(segments, clips, k=3)
    assert NumpyMatcher().matches(clips, segments, k=3) == reference_matches(clips, segments, k=3)


def test_nearly_equal_clips_are_told_apart():
    rng = np.random.default_rng(1)
    clip, segment = smooth(rng, 150), smooth(rng, 70)
    clips = [clip * (1 + 1e-15 * n) for n in rng.permutation(30)]
    assert NumpyMatcher().matches([segment], clips, k=7) == reference_matches([segment], clips, k=7)


def test_the_order_of_clips_is_that_of_the_answer():
    segments, clips = make("smooth", 4)
    clips[5] = clips[5] * 1.01  # no two alike
    order = np.random.default_rng(0).permutation(len(clips))
    straight = NumpyMatcher().matches(segments[2:], clips, k=3)
    turned = NumpyMatcher().matches(segments[2:], [clips[index] for index in order], k=3)
    assert [[replace(m, clip_index=int(order[m.clip_index])) for m in found] for found in turned] == straight


def test_segments_do_not_depend_on_each_other():
    segments, clips = make("mixed", 5, n_segments=9)
    together = NumpyMatcher().matches(segments, clips, k=3)
    for index, segment in enumerate(segments):
        (alone,) = NumpyMatcher().matches([segment], clips, k=3)
        assert [replace(m, segment_index=index) for m in alone] == together[index]


def test_streams_chunks_and_an_index_answer_alike():
    segments, clips = make("smooth", 4, n_clips=30)
    expected = reference_matches(segments, clips, k=5)
    small, large = NumpyMatcher(memory_bytes=300_000), NumpyMatcher()
    one_by_one = NumpyMatcher(memory_bytes=1)
    assert small.matches(segments, iter(clips), k=5) == expected
    assert one_by_one.matches(segments, clips, k=5) == expected
    index, kept = small.index(clips), large.index(iter(clips))
    assert len(one_by_one.index(clips).chunks) == len(clips)
    assert len(index.chunks) > 2
    assert not index.is_resident
    assert kept.is_resident
    assert len(kept) == len(index) == len(clips)
    for matcher, clip_index in ((small, index), (large, kept), (large, kept)):
        assert matcher.matches(segments, clip_index, k=5) == expected
    assert all(chunk.tables is None for chunk in index.chunks)
    assert kept.chunks[0].tables is not None
    assert large.matches(segments[::-1], kept, k=2) == reference_matches(segments[::-1], clips, k=2)


def test_parts_of_a_catalogue_share_a_song():
    segments, clips = make("rough", 5, n_clips=20)
    whole = reference_matches(segments, clips, k=4)
    matcher = NumpyMatcher()
    first = matcher.matches(segments, clips[:10], k=4)
    floors = [found[-1].score if len(found) == 4 else -1 for found in first]
    second = matcher.matches(segments, clips[10:], k=4, floors=floors)
    assert matcher.matches(segments, clips, k=4, floors=[1e9] * 5) == [[]] * 5  # the worse ones are left out
    second = [[replace(m, clip_index=m.clip_index + 10) for m in found] for found in second]
    assert merge_matches([first, second], k=4) == whole
    with pytest.raises(ValueError, match="floors: want one a segment"):
        matcher.matches(segments, clips, k=4, floors=[0.0])


def test_nothing_to_search():
    matcher = NumpyMatcher()
    assert matcher.matches([], [np.ones(5)], k=1) == []
    assert matcher.matches([np.ones(5)], [], k=1) == [[]]
    assert matcher.matches([np.ones(5)], matcher.index([]), k=1) == [[]]
    assert matcher.matches([np.ones(5)], [np.ones(3), np.zeros(0), np.zeros(3)], k=1) == [[]]
    assert matcher.matches([np.zeros(5)], [np.zeros(9)], k=2) == reference_matches([np.zeros(5)], [np.zeros(9)], k=2)


def test_clips_of_one_frame_and_segments_of_one():
    segments, clips = [np.array([2.0]), np.array([0.5])], [np.array([1.0]), np.array([3.0]), np.array([1.0, 3.0])]
    found = NumpyMatcher().matches(segments, clips, k=3)
    assert found == reference_matches(segments, clips, k=3)
    assert [m.clip_index for m in found[0]] == [1, 2, 0]


def test_bad_input_is_refused_by_name():
    matcher, good = NumpyMatcher(), [np.ones(9)]
    bad = np.array([1.0, np.nan])
    with pytest.raises(ValueError, match=r"segment 1: .*not finite"):
        matcher.matches([*good, bad], good, k=1)
    with pytest.raises(ValueError, match="segment 0: want"):
        matcher.matches([np.zeros(0)], good, k=1)
    with pytest.raises(ValueError, match=r"clip 1: .*not finite"):
        matcher.matches(good, [*good, bad], k=1)
    with pytest.raises(ValueError, match=r"clip 0: .*negative"):
        matcher.index([-good[0]])
    with pytest.raises(ValueError, match="k: want"):
        matcher.matches(good, good, k=0)
    with pytest.raises(ValueError, match="scales: want"):
        matcher.index(good, scales=(1.0, 0.9))
    with pytest.raises(ValueError, match="clips: want an index for the scales"):
        matcher.matches(good, matcher.index(good), k=1, scales=(1.0,))
    with pytest.raises(ValueError, match="memory_bytes: want > 0"):
        NumpyMatcher(memory_bytes=0)


def test_it_needs_no_opencl():
    code = "import kernels.matching.numpy_search, sys; sys.exit(any('opencl' in name for name in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    assert NumpyMatcher().name == "reference"


@pytest.mark.opencl
@pytest.mark.parametrize("kind", ["smooth", "rough", "impulse"])
def test_answers_as_the_search_on_a_device(kind):
    from kernels.opencl.device import list_devices
    from kernels.opencl.match import Matcher

    if not list_devices():
        pytest.skip("no OpenCL device here")
    rng = np.random.default_rng(8)
    segments = [KINDS[kind](rng, 120).astype(np.float32) for _ in range(12)]
    clips = [KINDS[kind](rng, int(n)).astype(np.float32) for n in rng.integers(150, 260, 60)]
    assert NumpyMatcher().matches(segments, clips, k=5) == Matcher().matches(segments, clips, k=5)
