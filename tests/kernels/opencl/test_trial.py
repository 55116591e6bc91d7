import numpy as np
import pyopencl as cl
import pytest

from kernels.opencl import trial
from kernels.opencl.device import list_devices
from kernels.opencl.trial import expected, fault, first_line, inputs

pytestmark = pytest.mark.opencl
DEVICES = list_devices()


def test_what_a_device_must_answer_is_plain_arithmetic():
    total, fused, root, counted = expected(
        np.array([1.0, 4.0], np.float32), np.array([3.0, 4.0], np.float32), np.array([0.5, 0.25, 0.125, 0.125], "f4")
    )
    np.testing.assert_allclose(total, [4 * 1 / 5, 8 * 4 / 9])
    np.testing.assert_allclose(fused, [2, 0])
    np.testing.assert_allclose(root, [1, 2])
    assert counted.tolist() == [1, 4]


def test_the_numbers_tell_devices_apart_that_do_not_fuse():
    a, b, weight = inputs()
    assert len(np.unique(a)) == len(a)
    unfused = (a * b - a * a).astype(np.float64)
    exact = expected(a, b, weight)[1]
    assert (np.abs(unfused - exact) > trial._RTOL * np.maximum(np.abs(exact), 2.0**-12)).any()


@pytest.mark.parametrize("device", DEVICES, ids=lambda d: d.platform.version[:30])
def test_a_real_device_passes(device):
    assert fault(device) == ""


@pytest.mark.parametrize("answer", range(4))
@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1.001])
def test_one_wrong_number_is_found(monkeypatch, answer, wrong):
    answers = [a.copy() for a in expected(*inputs())]
    answers[answer][1] *= wrong
    monkeypatch.setattr(trial, "_run", lambda device: answers)
    assert fault(None).startswith("computes wrong: the trial's ")
    assert ("sum", "fused product", "root", "count")[answer] in fault(None)


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (cl.MemoryError("clCreateBuffer failed: OUT_OF_HOST_MEMORY"), "clCreateBuffer failed: OUT_OF_HOST_MEMORY"),
        (MemoryError(), "has not the memory for a trial of a few kilobytes"),
    ],
)
def test_a_driver_that_refuses_is_told_in_its_words(monkeypatch, error, line):
    def refuse(device):
        raise error

    monkeypatch.setattr(trial, "_run", refuse)
    assert fault(None) == line


@pytest.mark.skipif(not DEVICES, reason="no OpenCL device here")
def test_the_compilers_first_line_is_the_one_told():
    with pytest.raises(cl.RuntimeError) as refused:
        cl.Program(cl.Context([DEVICES[0]]), "__kernel void f(__global nonsense *a) {}").build()
    line = first_line(refused.value)
    assert "error:" in line
    assert "nonsense" in line
    assert "\n" not in line


@pytest.mark.parametrize(("error", "line"), [(ValueError(), "ValueError"), (ValueError("a\nb"), "a")])
def test_other_errors_are_told_by_their_first_line(error, line):
    assert first_line(error) == line
