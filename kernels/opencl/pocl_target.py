"""Telling one release of PoCL which processor it compiles for, where its LLVM does not know the processor.

PoCL 3.0-rc2, which ``pocl-binary-distribution`` brings, asks LLVM 14 for the processor's name. LLVM 14 answers
``generic`` for processors made after it, and then refuses that name itself: nothing compiles. The record of the device
holds two C strings side by side, the target's triplet and the processor's name, and reads the second at every build.
Pointed at a name LLVM 14 knows, every kernel compiles. See docs/decisions/0024-opencl-devices.md.
"""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Collection
from itertools import pairwise
from typing import BinaryIO

import pyopencl as cl

RELEASE = "OpenCL 3.0 PoCL 3.0-rc2  Linux, Release, RELOC, LLVM 14.0.6, SLEEF, DISTRO, POCL_DEBUG"
"""Version string of the one platform whose record is laid out as here."""

TRIPLET, UNKNOWN = b"x86_64-unknown-linux-gnu", b"generic"

# Flags of /proc/cpuinfo that each level of x86-64 asks for (System V psABI); LLVM 14 knows all of these names.
_V2 = frozenset({"cx16", "lahf_lm", "popcnt", "pni", "sse4_1", "sse4_2", "ssse3"})
_V3 = _V2 | {"avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe", "xsave"}
_V4 = _V3 | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}
_LEVELS = ((b"x86-64-v4", _V4), (b"x86-64-v3", _V3), (b"x86-64-v2", _V2))

_RECORD_BYTES = 1024
"""What is read of a device's record. Measured on PoCL 3.0-rc2: the two strings lie 632 bytes into it, and it is
longer."""
_POINTER_BYTES = struct.calcsize("P")
_names: list[ctypes.Array[ctypes.c_char]] = []
"""Names that records point at: they must outlive every build."""


def known_name(flags: Collection[str]) -> bytes:
    """Name the highest level of x86-64 that a processor has.

    Parameters
    ----------
    flags : the words of the line ``flags`` of ``/proc/cpuinfo``; may be empty

    Returns
    -------
    bytes
        ``x86-64-v4`` (with AVX-512), ``x86-64-v3`` (AVX2, FMA), ``x86-64-v2`` or ``x86-64``.
    """
    return next((name for name, wanted in _LEVELS if wanted <= set(flags)), b"x86-64")


def name_target(device: cl.Device) -> str:
    """Give a device of PoCL 3.0-rc2 a processor's name that its LLVM knows, where it has none.

    Parameters
    ----------
    device : cl.Device, before its first build

    Returns
    -------
    str
        The name the device compiles for now; empty where nothing was changed: the platform is not exactly
        :data:`RELEASE`, the memory cannot be read as a file (no ``/proc``), there is no triplet in the record, or the
        name beside it is not exactly ``generic``.

    Notes
    -----
    Memory is read and written through ``/proc/self/mem``: there a bad address is an error, not a crash.
    """
    if device.platform.version.strip() != RELEASE:
        return ""
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as file:  # noqa: PTH123 - kernels know no paths
            line = next((line for line in file if line.startswith("flags")), "")
        with open("/proc/self/mem", "r+b", buffering=0) as memory:  # noqa: PTH123
            place = find_name(memory, int(device.int_ptr))
            if not place:
                return ""
            name = known_name(line.partition(":")[2].split())
            _names.append(ctypes.create_string_buffer(name))
            memory.seek(place)
            memory.write(struct.pack("P", ctypes.addressof(_names[-1])))
    except OSError:
        return ""
    return name.decode()


def find_name(memory: BinaryIO, record: int) -> int:
    """Find where the record of a device points at the name ``generic``.

    Parameters
    ----------
    memory : a file of this process's memory
    record : int, address of the record

    Returns
    -------
    int
        Address of the pointer; 0 where the record has no triplet with exactly ``generic`` beside it, or cannot be read.
    """
    held = _read(memory, record, _RECORD_BYTES)
    pointers = [p for (p,) in struct.iter_unpack("P", held[: len(held) // _POINTER_BYTES * _POINTER_BYTES])]
    for index, (triplet, name) in enumerate(pairwise(pointers)):
        if _is(memory, triplet, TRIPLET) and _is(memory, name, UNKNOWN):
            return record + (index + 1) * _POINTER_BYTES
    return 0


def _is(memory: BinaryIO, address: int, text: bytes) -> bool:
    """Whether exactly this C string lies at an address."""
    return _read(memory, address, len(text) + 1) == text + b"\0"


def _read(memory: BinaryIO, address: int, n_bytes: int) -> bytes:
    """Read some memory; nothing where there is none."""
    try:
        memory.seek(address)
        return memory.read(n_bytes)
    except (OSError, ValueError, OverflowError):
        return b""
