import numpy as np
import pyopencl as cl
import pytest

from kernels.matching.plan import Plan
from kernels.matching.score import SCALE_NUMERATORS, start_count, sums
from kernels.opencl.device import list_devices
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


@pytest.mark.parametrize("fold", [1, 2, 4, 8])
def test_tables_bound_the_sums_of_blocks(program, clips, fold):
    tables = Tables(program, clips, numerators=(50,))
    tables.build(Plan((10, fold), (10, fold), (5,)))
    scaled = np.ldexp(clips[1], -tables.exponent).astype(np.float64)
    padded = np.append(scaled, np.zeros(40))
    expected = np.array([max(padded[n + j : n + j + 10].sum() for j in range(fold)) for n in range(60)])
    stride, first = int(tables.stride[1]), int(tables.first[1])
    table = program.read(tables.folded(10, fold), (tables.n_frames,), np.float32)[first : first + stride]
    got = table.reshape(fold, -1).T.ravel()[:60]
    assert (got >= expected).all()
    np.testing.assert_allclose(got, expected, rtol=2e-5)


def test_memory_is_what_the_formula_says(program, clips):
    tables = Tables(program, clips, numerators=SCALE_NUMERATORS)
    bare = tables.n_bytes
    tables.build(Plan((25, 8), (10, 8), (5,)))
    assert tables.n_bytes - bare >= 4 * tables.n_frames * (17 + 43 + 65)
    before = tables.n_bytes
    tables.build(Plan((25, 8), (10, 8), (5,)))
    assert tables.n_bytes == before


def test_memory_is_that_of_the_buffers(program, clips):
    plan = Plan((25, 8), (10, 8), (5,))
    tables = Tables(program, clips, numerators=SCALE_NUMERATORS)
    held = [tables.frame, tables.clip_first, tables.clip_stride, tables.clip_frames]
    assert tables.n_bytes == sum(buffer.size for buffer in held)
    tables.build(plan)
    held += [tables.folded(*entry) for entry in plan.folded] + [tables.dense(g) for g in plan.dense]
    assert tables.n_bytes == sum(buffer.size for buffer in held)
