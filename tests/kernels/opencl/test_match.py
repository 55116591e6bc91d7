from dataclasses import replace

import numpy as np
import pyopencl as cl
import pytest

from kernels.matching.plan import BRUTE, BRUTE_SPARSE, PLANS, Plan
from kernels.matching.score import merge_matches, reference_matches
from kernels.opencl import match as module
from kernels.opencl.device import list_devices
from kernels.opencl.match import Matcher
from kernels.opencl.match_program import MatchProgram

DEVICES = list_devices()
pytestmark = [pytest.mark.opencl, pytest.mark.skipif(not DEVICES, reason="no OpenCL device here")]
PRUNED = PLANS[0]


@pytest.fixture(scope="module", params=range(len(DEVICES)), ids=[device.name.strip() for device in DEVICES])
def program(request):
    return MatchProgram(cl.Context([DEVICES[request.param]]))


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
    "mixed": lambda rng, n: [smooth, sparse][rng.integers(2)](rng, n),
}


def make(kind, seed, n_segments=5, n_clips=17):
    rng = np.random.default_rng(seed)
    segments = [KINDS[kind](rng, rng.integers(1, 110)).astype(np.float32) for _ in range(n_segments)]
    clips = [KINDS[kind](rng, rng.integers(0, 170)).astype(np.float32) for _ in range(n_clips)]
    clips[5] = clips[2].copy()
    clips[7] = np.zeros(60, np.float32)
    segments[1] = np.zeros(30, np.float32)
    return segments, clips


@pytest.mark.parametrize("kind", KINDS)
def test_every_plan_answers_as_float64_to_the_bit(program, kind):
    segments, clips = make(kind, 1)
    expected = reference_matches(segments, clips, k=3)
    for plan in (*PLANS, Plan((50, 8), (25, 1), (10, 5)), None):
        for by_level in (False, True):
            assert Matcher(program=program, plan=plan, by_level=by_level).matches(segments, clips, k=3) == expected


@pytest.mark.parametrize("seed", range(4))
def test_shapes_at_random(program, seed):
    rng = np.random.default_rng(seed)
    segments, clips = make("mixed", seed, int(rng.integers(2, 30)), int(rng.integers(9, 40)))
    k = int(rng.integers(1, 50))
    expected = reference_matches(segments, clips, k=k)
    assert Matcher(program=program, by_level=bool(seed % 2)).matches(segments, clips, k=k) == expected


@pytest.mark.parametrize("plan", [PRUNED, BRUTE])
def test_constant_features_tie_by_the_rule(program, plan):
    segments, clips = [np.ones(40), np.ones(1), np.zeros(7)], [np.ones(n) for n in (60, 35, 60, 1, 40)]
    assert Matcher(program=program, plan=plan).matches(segments, clips, k=9) == reference_matches(segments, clips, k=9)


@pytest.mark.parametrize("size", [1e-30, 1e-7, 1e-3, 1e4, 1e8])
def test_features_of_very_different_sizes(program, size):
    rng = np.random.default_rng(0)
    segments, clips = [size * rng.random(50), rng.random(50)], [rng.random(80) for _ in range(6)]
    expected = reference_matches(segments, clips, k=3)
    assert Matcher(program=program, plan=PRUNED).matches(segments, clips, k=3) == expected


@pytest.mark.slow  # compiles everything anew
@pytest.mark.parametrize(("lanes", "together"), [(4, 3), (8, 1), (16, 16)])
def test_width_of_vectors_and_bundles_changes_nothing(program, lanes, together):
    segments, clips = make("smooth", 3)
    expected = reference_matches(segments, clips, k=4)
    other = MatchProgram(program.context, lanes=lanes, together=together)
    assert Matcher(program=other, plan=PRUNED).matches(segments, clips, k=4) == expected
    assert Matcher(program=other, plan=BRUTE).matches(segments, clips, k=4) == expected


@pytest.mark.parametrize("plan", [plan for plan in PLANS if plan not in (BRUTE, BRUTE_SPARSE)], ids=str)
def test_more_groups_wait_than_there_is_room_for(program, plan):
    rng = np.random.default_rng(8)
    segments = [rng.random(n).astype(np.float32) for n in (40, 12, 40, 7, 33, 1)]
    # constant clips: every group passes every bound, and ties go by the rule
    clips = [np.ones(1500, np.float32), rng.random(900).astype(np.float32), np.full(30, 0.5, np.float32)]
    expected = reference_matches(segments, clips, k=2)
    assert Matcher(program=program, plan=plan).matches(segments, clips, k=2) == expected


def test_turns_of_refinement_change_nothing(program):
    # bounds that tell nothing, and more clips than the first turns take
    rng = np.random.default_rng(9)
    segments = [rng.random(20).astype(np.float32)]
    clips = [rng.random(36).astype(np.float32) for _ in range(80)]
    expected = reference_matches(segments, clips, k=1)
    assert Matcher(program=program, plan=PRUNED).matches(segments, clips, k=1) == expected


def test_streams_chunks_and_an_index_answer_alike(program):
    segments, clips = make("smooth", 4, n_clips=30)
    expected = reference_matches(segments, clips, k=5)
    small = Matcher(program=program, memory_bytes=300_000)
    assert small.matches(segments, iter(clips), k=5) == expected
    index = small.index(clips)
    assert len(index.chunks) > 2
    assert not index.is_resident
    large = Matcher(program=program, plan=PRUNED)
    kept = large.index(iter(clips))
    assert kept.is_resident
    assert len(kept) == len(clips)
    for matcher, clip_index in ((small, index), (large, kept), (large, kept)):
        assert matcher.matches(segments, clip_index, k=5) == expected
    assert [chunk.tables for chunk in index.chunks] == [None] * len(index.chunks)
    assert sum(chunk.tables.n_bytes for chunk in kept.chunks) > 0
    assert large.matches(segments[::-1], kept, k=2) == reference_matches(segments[::-1], clips, k=2)


def test_parts_of_a_catalogue_share_a_song(program):
    segments, clips = make("rough", 5, n_clips=20)
    whole = reference_matches(segments, clips, k=4)
    matcher = Matcher(program=program, plan=PRUNED)
    first = matcher.matches(segments, clips[:10], k=4)
    floors = [found[-1].score if len(found) == 4 else -1 for found in first]
    second = matcher.matches(segments, clips[10:], k=4, floors=floors)
    second = [[replace(m, clip_index=m.clip_index + 10) for m in found] for found in second]
    assert merge_matches([first, second], k=4) == whole
    with pytest.raises(ValueError, match="floors: want one a segment"):
        matcher.matches(segments, clips, k=4, floors=[0.0])


def test_a_device_out_of_memory_gets_half(program, monkeypatch):
    segments, clips = make("smooth", 6)
    sizes = []

    class Small(module.Tables):
        def __init__(self, program, clips, *, numerators):
            sizes.append(len(clips))
            if len(clips) > 4:
                raise cl.MemoryError("no room")
            super().__init__(program, clips, numerators=numerators)

    monkeypatch.setattr(module, "Tables", Small)
    matcher = Matcher(program=program, plan=PRUNED)
    assert matcher.matches(segments, clips, k=3) == reference_matches(segments, clips, k=3)
    assert max(sizes) > 4 >= min(sizes)

    def refuse(*_args, **_kwargs):
        raise cl.MemoryError("no room")

    monkeypatch.setattr(module, "Tables", refuse)
    with pytest.raises(MemoryError, match="want memory for one clip"):
        matcher.matches(segments, clips, k=3)


def test_bad_input_is_refused_by_name(program):
    matcher, good = Matcher(program=program), [np.ones(9)]
    bad = np.array([1.0, np.nan])
    with pytest.raises(ValueError, match=r"segment 1: .*not finite"):
        matcher.matches([*good, bad], good, k=1)
    with pytest.raises(ValueError, match=r"clip 1: .*not finite"):
        matcher.matches(good, [*good, bad], k=1)
    with pytest.raises(ValueError, match=r"clip 0: .*negative"):
        matcher.index([-good[0]])
    with pytest.raises(ValueError, match="k: want"):
        matcher.matches(good, good, k=0)
    with pytest.raises(ValueError, match="clips: want an index for the scales"):
        matcher.matches(good, matcher.index(good), k=1, scales=(1.0,))
    with pytest.raises(ValueError, match="memory_bytes: want > 0"):
        Matcher(program=program, memory_bytes=0)


def test_nothing_to_search(program):
    matcher = Matcher(program=program)
    assert matcher.matches([], [np.ones(5)], k=1) == []
    assert matcher.matches([np.ones(5)], [], k=1) == [[]]
    assert matcher.matches([np.ones(5)], [np.ones(3)], k=1) == [[]]
