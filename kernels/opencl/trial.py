"""Trying a device: whether it builds and runs a small kernel, and computes right."""

from __future__ import annotations

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from kernels.opencl.device import build

VERSION = "1"
"""Raised by hand when the trial asks for more: what was remembered of it counts no longer."""

_N = 1024
"""Values of a trial. Chosen by hand: some work-groups of any device."""

# Chosen above the few roundings an answer may be off: by definition of OpenCL mad and a division of 2.5 ulp are
# allowed, and the fused product has one.
_RTOL = 32 * 2.0**-24

Floats = NDArray[np.float32]


def inputs() -> tuple[Floats, Floats, Floats]:
    """Make the numbers a device is tried on.

    Returns
    -------
    a, b : (1024,) float32, in (0, 1), no two alike
    weight : (4,) float32, summing to 1
    """
    a = (np.arange(1, _N + 1) * 0.6180339887498949 % 1.0).astype(np.float32)
    return a, np.ascontiguousarray(a[::-1]), np.array([0.5, 0.25, 0.125, 0.125], np.float32)


def expected(a: Floats, b: Floats, weight: Floats) -> tuple[NDArray[np.float64], ...]:
    """Compute what a device must answer, in float64.

    Parameters
    ----------
    a, b : (n,) float32
    weight : (4,) float32

    Returns
    -------
    sum, fused, root : (n,) float64
    counted : (2,) float64, how many a are below b, and the largest a
    """
    x, y = a.astype(np.float64), b.astype(np.float64)
    square = (a * a).astype(np.float64)  # rounded, as the kernel rounds it
    total = weight.astype(np.float64).sum() * (x + y) * x / (x + y + 1)
    return total, x * y - square, np.sqrt(np.minimum(x, y)), np.array([np.count_nonzero(a < b), x.max()])


def fault(device: cl.Device) -> str:
    """Say why a device is of no use.

    Parameters
    ----------
    device : cl.Device

    Returns
    -------
    str
        One line: the compiler's first words, the driver's error, or what was computed wrong. Empty where it is usable.
    """
    try:
        got = _run(device)
    except cl.Error as error:
        return first_line(error)
    except MemoryError:
        return "has not the memory for a trial of a few kilobytes"
    wanted = expected(*inputs())
    for name, is_, should in zip(("sum", "fused product", "root", "count"), got, wanted, strict=True):
        off = np.abs(is_ - should) > _RTOL * np.maximum(np.abs(should), 2.0**-12)
        if not np.isfinite(is_).all() or off.any():
            worst = int(np.argmax(np.where(np.isfinite(is_), np.abs(is_ - should), np.inf)))
            return f"computes wrong: the trial's {name} is {is_[worst]:.9g}, {should[worst]:.9g} is right"
    return ""


def first_line(error: Exception) -> str:
    """Choose one line of a driver's error to show: the compiler's first, else the error's own.

    Parameters
    ----------
    error : Exception, of OpenCL or another
    """
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    told = [line for line in lines if not line.startswith(("Build on <", "(options:", "Device "))]
    of_compiler = [line for line in told if "error" in line.lower() and "BUILD_PROGRAM_FAILURE" not in line]
    return (of_compiler or told or [type(error).__name__])[0]


def _run(device: cl.Device) -> tuple[NDArray[np.float64], ...]:
    a, b, weight = inputs()
    context = cl.Context([device])
    queue = cl.CommandQueue(context)
    kernel = cl.Kernel(build(context, ["trial.cl"], {}, flags=["-w", "-cl-mad-enable"]), "trial")
    flags = cl.mem_flags
    given = [cl.Buffer(context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=array) for array in (a, b, weight)]
    real = [np.zeros(_N, np.float32) for _ in range(3)]
    whole = [np.zeros(1, np.int32) for _ in range(2)]
    answers = [cl.Buffer(context, flags.READ_WRITE | flags.COPY_HOST_PTR, hostbuf=array) for array in (*real, *whole)]
    kernel.set_args(np.int32(_N), *given, *answers)
    cl.enqueue_nd_range_kernel(queue, kernel, (_N // 4,), None)
    for array, answer in zip((*real, *whole), answers, strict=True):
        cl.enqueue_copy(queue, array, answer)
    counted = np.array([whole[0][0], whole[1].view(np.float32)[0]], np.float64)
    return *(array.astype(np.float64) for array in real), counted
