"""The compiled kernels of the matching engine on one device, and starting them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from kernels.matching.score import SCALE_DENOMINATOR
from kernels.opencl.device import build, full_name, only_device

RUN = 4
"""Pairs of one clip that one work-item refines together, depth first. Measured on two cores of an AMD EPYC: bounds of
10 frames and 8 starts do 7.3 in place of 5.2 Gterm a CPU-second."""

SCALE_BITS = 24
"""Bits of a place below those of its scale. Chosen so that 128 scales and clips of 2^23 frames fit into 31."""

_LARGE_BYTES = 2**22
"""Size from which buffers are asked for in large pages. Chosen by hand: two of those of x86-64."""
_INDEX = ("match_index.cl",)
_SEARCH = ("match_score.cl", "match_refine.cl")


class MatchProgram:
    """Kernels for one device; vector width, segments taken together and work-group sizes follow the device.

    Parameters
    ----------
    context : cl.Context of one device
    lanes : 4, 8 or 16, or None for twice the device's preferred width
    together : int or None
        Segments one work-item takes together; None: 12 on a CPU, where few work-items with much to do are best, else 4.

    Raises
    ------
    ValueError
        If the context has not exactly one device.

    Notes
    -----
    None of the choices changes an answer. Two variants of the scores are built when first needed: four terms to a
    division, and one to a division (`is_safe`), for features whose sizes lie far apart.
    """

    def __init__(self, context: cl.Context, *, lanes: int | None = None, together: int | None = None) -> None:
        self.context = context
        self.device = only_device(context)
        self.is_cpu = bool(self.device.type & cl.device_type.CPU)
        most = max(2 * self.device.preferred_vector_width_float, 4)
        self.lanes = lanes or max(width for width in (4, 8, 16) if width <= most)
        self.together = together or (12 if self.is_cpu else 4)
        self.queue = cl.CommandQueue(context)
        self._built: dict[tuple[str, int, bool], cl.Program] = {}

    @property
    def name(self) -> str:
        """Device and driver, for metadata: "AMD EPYC (Portable Computing Language 3.0)"."""
        device = self.device
        return full_name(device)

    def run(
        self,
        name: str,
        size: tuple[int, ...],
        *arguments: Any,  # noqa: ANN401 (numbers and buffers, mixed)
        is_safe: bool = False,
        light: bool = False,
    ) -> None:
        """Start a kernel; the queue keeps the order.

        Parameters
        ----------
        name : str
        size : work-items wanted in each dimension; kernels leave those beyond alone
        arguments : int (passed as int32) or cl.Buffer
        is_safe : bool, the variant with one term to a division
        light : bool
            Work-items with little to do: on a CPU they go in groups too.
        """
        if min(size) == 0:
            return
        kernel = cl.Kernel(self._program(name, is_safe), name)
        kernel.set_args(*(np.int32(value) if isinstance(value, int) else value for value in arguments))
        limit = kernel.get_work_group_info(cl.kernel_work_group_info.WORK_GROUP_SIZE, self.device)
        width = 64 if light or not self.is_cpu else 1
        width = min(width, limit, self.device.max_work_item_sizes[0], 1 << max(size[0] - 1, 0).bit_length())
        group = (width, *(1 for _ in size[1:]))
        whole = (-(-size[0] // width) * width, *size[1:])
        cl.enqueue_nd_range_kernel(self.queue, kernel, whole, group)

    def buffer(self, content: NDArray[np.generic]) -> cl.Buffer:
        """Copy an array to the device; one unused number where it is empty, for a buffer may not be.

        Parameters
        ----------
        content : array of any shape and number type
            As many bytes as the kernel expects: nothing is converted.

        Raises
        ------
        cl.MemoryError
            If the device has not the memory.
        """
        array = np.ascontiguousarray(content) if content.size else np.zeros(1, content.dtype)
        return cl.Buffer(self.context, cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR, hostbuf=array)

    def room(self, n_bytes: int) -> cl.Buffer:
        """Make an unset buffer of at least 16 bytes.

        Parameters
        ----------
        n_bytes : int, >= 0

        Raises
        ------
        cl.MemoryError
            If the device has not the memory, or allows no buffer of this size.
        """
        if n_bytes > self.device.max_mem_alloc_size:
            raise cl.MemoryError(f"buffer: want at most {self.device.max_mem_alloc_size} bytes, got {n_bytes}")
        if self.is_cpu and n_bytes >= _LARGE_BYTES:
            # as an array of the host: NumPy asks for large pages, of which a table touches 500 times fewer
            own = cl.mem_flags.READ_WRITE | cl.mem_flags.USE_HOST_PTR
            return cl.Buffer(self.context, own, hostbuf=np.zeros(n_bytes, np.uint8))
        return cl.Buffer(self.context, cl.mem_flags.READ_WRITE, size=max(n_bytes, 16))

    def read(self, buffer: cl.Buffer, shape: tuple[int, ...], dtype: type[Any]) -> NDArray[Any]:
        """Wait for the queue and copy the front of a buffer to the host.

        Parameters
        ----------
        buffer : cl.Buffer of at least the bytes asked for
        shape, dtype : of what is read

        Returns
        -------
        array of that shape and type
            Nothing is waited for where it has no elements.
        """
        out = np.zeros(shape, dtype)
        if out.size:
            cl.enqueue_copy(self.queue, out, buffer)
        return out

    def write(self, buffer: cl.Buffer, content: NDArray[np.generic], *, offset_bytes: int = 0) -> None:
        """Copy an array into a buffer.

        Parameters
        ----------
        buffer : cl.Buffer
        content : array of any shape and number type
        offset_bytes : int, >= 0, where in the buffer it begins; it must end inside
        """
        cl.enqueue_copy(self.queue, buffer, np.ascontiguousarray(content), dst_offset=offset_bytes)

    def _program(self, name: str, is_safe: bool) -> cl.Program:
        files = _INDEX if name in ("sum_frames", "sum_blocks", "largest_of") else _SEARCH
        # groups are few, and narrow vectors waste less at a clip's end
        lanes = max(self.lanes // 2, 4) if name == "bound_together" else self.lanes
        key = (files[0], lanes, is_safe and files is _SEARCH)
        if key not in self._built:
            defined = {"LANES": lanes, "WIDTH": self.together, "RUN": RUN}
            defined |= {"SCALE_BITS": SCALE_BITS, "SCALE_DENOMINATOR": SCALE_DENOMINATOR} | (
                {"SAFE": 1} if key[2] else {}
            )
            # -w: a compiler talks of how vectors are passed between functions that are all inlined.
            self._built[key] = build(self.context, files, defined, flags=["-w", "-cl-mad-enable"])
        return self._built[key]
