import numpy as np
import pyopencl as cl
import pytest

from kernels.matching.plan import PLANS
from kernels.matching.score import SCALE_NUMERATORS, similarity, start_count, sums
from kernels.opencl.device import list_devices
from kernels.opencl.match_program import MatchProgram
from kernels.opencl.match_stages import SCALE_BITS, Stages, runs, wants_safe
from kernels.opencl.match_tables import Tables

DEVICES = list_devices()
pytestmark = [pytest.mark.opencl, pytest.mark.skipif(not DEVICES, reason="no OpenCL device here")]


@pytest.fixture(scope="module")
def program():
    return MatchProgram(cl.Context([DEVICES[0]]))


@pytest.fixture
def clips():
    rng = np.random.default_rng(0)
    return [rng.random(n).astype(np.float32) for n in (90, 60, 100)]


@pytest.fixture
def segments():
    return np.random.default_rng(1).random((2, 40)).astype(np.float32).astype(np.float64)


def stages_of(program, clips, segments, plan, by_level=False):
    tables = Tables(program, clips, numerators=SCALE_NUMERATORS)
    tables.build(plan)
    lengths = np.full(len(segments), segments.shape[1])
    return Stages(tables, segments, n_frames=lengths, plan=plan, is_safe=False, by_level=by_level)


def best_of(segment, clip):
    counts = [(p, start_count(len(segment), len(clip), p)) for p in SCALE_NUMERATORS]
    return max(sums(segment, clip, numerator=p, starts=np.arange(n))[0].max() for p, n in counts if n)


@pytest.mark.parametrize("plan", PLANS, ids=str)
def test_bounds_reach_scores_and_scores_are_right(program, clips, segments, plan):
    stages = stages_of(program, clips, segments, plan)
    value, _ = stages.largest()
    exponent = stages.tables.exponent
    for s, segment in enumerate(segments):
        for c, clip in enumerate(clips):
            best = np.ldexp(best_of(segment, clip), -exponent)
            assert value[s, c] + stages.margin[s] >= best
            if stages.is_exact:
                assert value[s, c] <= best + stages.margin[s]


@pytest.mark.parametrize("by_level", [False, True])
def test_best_and_emitted_candidates(program, clips, segments, by_level):
    stages = stages_of(program, clips, segments, PLANS[0], by_level)
    pairs = np.array([[0, 0], [1, 2]], np.int32)
    best = stages.best(pairs, np.full(2, -1, np.float32))
    for (s, c), score in zip(pairs, best, strict=True):
        assert score == pytest.approx(np.ldexp(best_of(segments[s], clips[c]), -stages.tables.exponent), rel=1e-5)
    emitted = stages.emit(pairs, best, most=1000)
    assert set(emitted.pair.tolist()) == {0, 1}
    assert stages.emit(pairs, np.full(2, -1, np.float32), most=3) is None


def test_answers_stay_where_groups_outgrow_their_room(program, clips, segments, monkeypatch):
    pairs = np.array([[0, 0], [1, 2], [1, 0]], np.int32)
    none = np.full(3, -1, np.float32)
    expected = stages_of(program, clips, segments, PLANS[0]).best(pairs, none)
    monkeypatch.setattr("kernels.opencl.match_stages._LEVEL_BYTES", 16)  # two groups
    stages = stages_of(program, clips, segments, PLANS[0], by_level=True)
    np.testing.assert_array_equal(stages.best(pairs, none), expected)
    assert stages.emit(pairs, none, most=10**6) is None
    one = stages.emit(pairs[:1], expected[:1], most=1)
    assert set(one.pair.tolist()) == {0}
    assert len(one.pair) >= 1


def test_nothing_is_listed_for_no_pairs(program, clips, segments):
    for by_level in (False, True):
        stages = stages_of(program, clips, segments, PLANS[0], by_level)
        none = np.zeros((0, 2), np.int32), np.zeros(0, np.float32)
        assert stages.best(*none).shape == (0,)
        assert len(stages.emit(*none, most=1).pair) == 0


def test_places_and_sizes(program, clips):
    tables = Tables(program, clips, numerators=SCALE_NUMERATORS)
    assert SCALE_BITS == 24
    assert [wants_safe(tables, size) for size in (1.0, 1e-4, 1e4, 1e-12)] == [False, True, True, None]
    assert similarity(np.ones(1), np.ones(1)) == 0.5


def test_runs_end_with_their_clip_and_at_their_longest():
    assert runs(np.array([0, 0, 0, 2, 2, 2, 2, 2, 3]), longest=4).tolist() == [0, 3, 7, 8, 9]
    assert runs(np.array([5, 5, 5]), longest=1).tolist() == [0, 1, 2, 3]
    assert runs(np.zeros(0, np.int32), longest=4).tolist() == [0]
