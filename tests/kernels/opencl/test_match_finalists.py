import numpy as np
import pyopencl as cl
import pytest

from kernels.matching.plan import BRUTE, BRUTE_SPARSE, PLANS
from kernels.matching.score import SCALE_NUMERATORS, start_count, sums
from kernels.opencl.device import list_devices
from kernels.opencl.match_finalists import candidates, finalists
from kernels.opencl.match_program import MatchProgram
from kernels.opencl.match_stages import Stages
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


@pytest.mark.parametrize("plan", [BRUTE, BRUTE_SPARSE, PLANS[0]], ids=str)
def test_the_best_clip_is_a_finalist(program, clips, segments, plan):
    stages = stages_of(program, clips, segments, plan)
    pairs, score = finalists(stages, k=1, floor=np.full(2, -1, np.float32))
    for s, segment in enumerate(segments):
        best = int(np.argmax([best_of(segment, clip) for clip in clips]))
        assert [s, best] in pairs.tolist()
    emitted = list(candidates(stages, pairs, score))
    assert sum(len(some) for some, _ in emitted) == len(pairs)


def test_a_floor_out_of_reach_leaves_nothing(program, clips, segments):
    stages = stages_of(program, clips, segments, PLANS[0])
    pairs, _ = finalists(stages, k=1, floor=np.full(2, 1e6, np.float32))
    assert len(pairs) == 0


@pytest.mark.parametrize("plan", [BRUTE, PLANS[0]], ids=str)
def test_every_finalist_has_the_best_score_of_its_own_pair(program, clips, segments, plan):
    stages = stages_of(program, clips, segments, plan)
    pairs, score = finalists(stages, k=3, floor=np.full(2, -1, np.float32))
    assert sorted(map(tuple, pairs.tolist())) == [(s, c) for s in range(2) for c in range(3)]
    expected = [np.ldexp(best_of(segments[s], clips[c]), -stages.tables.exponent) for s, c in pairs.tolist()]
    np.testing.assert_allclose(score, expected, rtol=1e-5)
