import numpy as np
import pyopencl as cl
import pytest

from kernels.opencl.device import list_devices
from kernels.opencl.match_program import MatchProgram

DEVICES = list_devices()
pytestmark = [pytest.mark.opencl, pytest.mark.skipif(not DEVICES, reason="no OpenCL device here")]


@pytest.fixture(scope="module")
def program():
    return MatchProgram(cl.Context([DEVICES[0]]))


def test_copies_there_and_back(program):
    numbers = np.arange(5, dtype=np.int32)
    np.testing.assert_array_equal(program.read(program.buffer(numbers), (5,), np.int32), numbers)
    room = program.room(20)
    program.write(room, numbers)
    np.testing.assert_array_equal(program.read(room, (5,), np.int32), numbers)


def test_too_large_a_buffer_is_out_of_memory(program):
    with pytest.raises(cl.MemoryError, match="want at most"):
        program.room(2**62)


def test_names_its_device_and_refuses_two(program):
    assert DEVICES[0].name.strip() in program.name
    with pytest.raises(ValueError, match="want one device, got 2"):
        MatchProgram(type("Context", (), {"devices": [DEVICES[0]] * 2})())
