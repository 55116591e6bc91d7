import numpy as np
import pyopencl as cl
import pytest

from kernels.matching.plan import BRUTE_SPARSE
from kernels.matching.score import SCALE_NUMERATORS, start_count, sums
from kernels.opencl.device import list_devices
from kernels.opencl.match_program import MatchProgram
from kernels.opencl.match_stages import Stages
from kernels.opencl.match_tables import Tables
from kernels.opencl.match_tuning import pick_plan, worth_trying

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


def test_sparse_plans_are_tried_only_on_silence(segments):
    lengths = np.full(2, 40)
    assert not any(plan.is_sparse for plan in worth_trying(segments, lengths))
    assert BRUTE_SPARSE in worth_trying(np.where(segments > 0.9, segments, 0), lengths)


def test_a_plan_of_those_is_picked(program, clips, segments):
    arguments = {"n_frames": np.full(2, 40), "clips": clips, "numerators": SCALE_NUMERATORS, "k": 2, "by_level": False}
    assert pick_plan(program, segments, **arguments) in worth_trying(segments, np.full(2, 40))
