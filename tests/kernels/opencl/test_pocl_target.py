"""The guard of the one change we make to another's memory, and the change itself on the real release."""

import io
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from kernels.opencl.device import list_devices
from kernels.opencl.pocl_target import RELEASE, TRIPLET, UNKNOWN, find_name, known_name, name_target

pytestmark = pytest.mark.opencl

_V2 = ["cx16", "lahf_lm", "popcnt", "pni", "sse4_1", "sse4_2", "ssse3"]
_V3 = [*_V2, "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe", "xsave"]
_V4 = [*_V3, "avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"]


@pytest.mark.parametrize(
    ("flags", "name"),
    [
        ([], b"x86-64"),
        (_V2, b"x86-64-v2"),
        (_V3[:-1], b"x86-64-v2"),
        (_V3, b"x86-64-v3"),
        (_V4[:-1], b"x86-64-v3"),
        ([*_V4, "avx512_bf16"], b"x86-64-v4"),
    ],
)
def test_the_name_is_that_of_the_highest_level_all_of_whose_flags_are_there(flags, name):
    assert known_name(flags) == name


RECORD, FIRST, SECOND = 64, 2048, 2112


def memory(*, triplet=TRIPLET, name=UNKNOWN, at=5, pointers=(FIRST, SECOND)):
    """Lay out a record at 64 whose pointers 5 and 6 point at two strings."""
    held = bytearray(4096)
    struct.pack_into("PP", held, RECORD + at * struct.calcsize("P"), *pointers)
    for place, text in ((FIRST, triplet), (SECOND, name)):
        held[place : place + len(text) + 1] = text + b"\0"
    return io.BytesIO(bytes(held))


def test_the_pointer_beside_the_triplet_is_found():
    assert find_name(memory(), RECORD) == RECORD + 6 * struct.calcsize("P")


@pytest.mark.parametrize(
    "other",
    [
        {"name": b"znver3"},
        {"name": b"generic-rv64"},
        {"name": b"gener"},
        {"triplet": b"aarch64-unknown-linux-gnu"},
        {"triplet": TRIPLET + b"x32"},
        {"pointers": (SECOND, FIRST)},
        {"pointers": (FIRST, 0)},
        {"pointers": (FIRST, 2**63)},
        {"at": 500},
    ],
    ids=str,
)
def test_anything_else_is_left_alone(other):
    assert find_name(memory(**other), RECORD) == 0


def test_a_record_that_cannot_be_read_is_no_record():
    with Path("/proc/self/mem").open("rb", buffering=0) as own:
        assert find_name(own, 8) == 0
        assert find_name(own, 2**64 - 8) == 0


class Stub:
    def __init__(self, version, int_ptr):
        self.platform = type("Platform", (), {"version": version})
        self.int_ptr = int_ptr


@pytest.mark.parametrize("version", [RELEASE.replace("rc2", "rc3"), RELEASE + ", SPIR", "OpenCL 3.0 CUDA 12.4"])
def test_another_release_is_not_even_looked_at(version):
    class Untouchable(Stub):
        @property
        def int_ptr(self):
            raise AssertionError("the record was read")

        @int_ptr.setter
        def int_ptr(self, value):
            pass

    assert name_target(Untouchable(version, 0)) == ""


def test_a_bad_address_is_no_crash():
    assert name_target(Stub(RELEASE, 8)) == ""


BUNDLED = [d for d in list_devices() if d.platform.version.strip() == RELEASE]

# As on a processor that LLVM 14 does not know: the record says "generic".
SPOIL = """
import ctypes, struct
import pyopencl as cl
from kernels.opencl import pocl_target
device = next(d for p in cl.get_platforms() if p.version.strip() == pocl_target.RELEASE for d in p.get_devices())
unknown = ctypes.create_string_buffer(b"generic")
with open("/proc/self/mem", "r+b", buffering=0) as memory:
    held = pocl_target._read(memory, device.int_ptr, 1024)
    pointers = [p for (p,) in struct.iter_unpack("P", held)]
    at = next(i for i, p in enumerate(pointers) if pocl_target._is(memory, p, pocl_target.TRIPLET)) + 1
    memory.seek(device.int_ptr + 8 * at)
    memory.write(struct.pack("P", ctypes.addressof(unknown)))
from kernels.opencl.trial import fault
"""


def run(code):
    done = subprocess.run([sys.executable, "-c", SPOIL + code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip().splitlines()


@pytest.mark.skipif(not BUNDLED, reason="pip's PoCL is not here")
class TestOnTheRealRelease:
    def test_with_an_unknown_processor_nothing_compiles(self):
        assert run("print(fault(device))") == ["error: unknown target CPU 'generic'"]

    def test_with_a_known_name_everything_compiles_and_is_right(self):
        lines = run("""
from kernels.opencl.device import build, list_devices
named = [d for d in list_devices() if d == device]
print(len(named), repr(fault(device)), repr(pocl_target.name_target(device)))
context = cl.Context([device])
from kernels.opencl.match_program import SCALE_BITS, SCALE_DENOMINATOR
scales = {"SCALE_BITS": SCALE_BITS, "SCALE_DENOMINATOR": SCALE_DENOMINATOR}
for files, defined in (
    (["pose_distance.cl"], {"ROWS": 8, "LANES": 8}),
    (["match_score.cl", "match_refine.cl"], {"LANES": 8, "WIDTH": 12, "RUN": 4, **scales}),
    (["match_index.cl"], {"LANES": 8, "WIDTH": 12, "RUN": 4, **scales}),
):
    print(len(build(context, files, defined, flags=["-w"]).all_kernels()) > 0)
""")
        assert lines == ["1 '' ''", "True", "True", "True"]

    def test_a_known_processor_is_left_as_it_is(self):
        assert all(name_target(device) == "" for device in BUNDLED)
