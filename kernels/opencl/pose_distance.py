"""Pose distances on an OpenCL device: the twin of :func:`kernels.graph.distance.pose_distance`."""

from __future__ import annotations

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from kernels.graph.distance import PoseFeatures, check_pair
from kernels.opencl.device import build, full_name, only_device

_ROWS = 8
_GROUP = (8, 8)
"""Rows a work-item owns, and work-items of a group. Chosen by hand; changes no bit."""

_LANES = (4, 8, 16)
"""Widths of vectors, by definition of OpenCL those of four and more."""

_TILE_BYTES = 64 * 2**20
"""Distances held at a time. Chosen for memory, by hand; changes no bit."""


class PoseDistance:
    """A :class:`kernels.graph.distance.PairDistance` on one device.

    Parameters
    ----------
    context : cl.Context of one device
        From :func:`kernels.opencl.choice.pick_device`; nothing is chosen here.

    Raises
    ------
    ValueError
        If the context has not exactly one device.

    Notes
    -----
    Needs neither local memory nor double precision. The vector width follows the device's preference, the work-group
    size the kernel's limit; neither changes a bit of the answer.
    """

    def __init__(self, context: cl.Context) -> None:
        self.context = context
        self._device = only_device(context)
        # twice the preferred width hides the latency of the loads; a GPU says 1 and gets the smallest
        most = max(2 * self._device.preferred_vector_width_float, _LANES[0])
        self._lanes = max(width for width in _LANES if width <= most)
        self._program = build(context, ["pose_distance.cl"], {"ROWS": _ROWS, "LANES": self._lanes})
        self._queue = cl.CommandQueue(context)
        kernel = cl.Kernel(self._program, "pose_distance")
        limit = kernel.get_work_group_info(cl.kernel_work_group_info.WORK_GROUP_SIZE, self._device)
        width, height = (
            min(wanted, most) for wanted, most in zip(_GROUP, self._device.max_work_item_sizes, strict=False)
        )
        while width * height > limit:
            width, height = (width, height // 2) if height > 1 else (width // 2, height)
        self._group = (width, height)

    @property
    def name(self) -> str:
        """Device and driver, for metadata: "AMD EPYC (Portable Computing Language 3.0)"."""
        return full_name(self._device)

    def __call__(self, rows: PoseFeatures, columns: PoseFeatures) -> NDArray[np.float32]:
        """Distances of every row to every column.

        Parameters
        ----------
        rows : PoseFeatures of n poses
        columns : PoseFeatures of m poses, made alike

        Returns
        -------
        (n, m) float32, square metres or square radians, >= 0
            Symmetric and zero on equal poses, to the bit. Empty when n or m is 0. Within
            :func:`kernels.graph.distance.error_bound` of the reference.

        Raises
        ------
        ValueError
            If the two were not made alike (metric, coordinates, weights).
        """
        check_pair(rows, columns)
        n, m = len(rows), len(columns)
        distance = np.zeros((n, m), np.float32)
        if n == 0 or m == 0:
            return distance
        most = min(_TILE_BYTES, self._device.max_mem_alloc_size) // 4
        width = min(_up(m, self._lanes), max(most // _ROWS // self._lanes * self._lanes, self._lanes))
        height = min(_up(n, _ROWS), max(most // width // _ROWS * _ROWS, _ROWS))
        weight = self._buffer(rows.quaternion_weight.astype(np.float32))
        for c in range(0, m, width):
            column = self._upload(columns.take(slice(c, c + width)), self._lanes)
            for r in range(0, n, height):
                row = self._upload(rows.take(slice(r, r + height)), _ROWS)
                self._tile(row, column, weight, rows, distance[r : r + height, c : c + width])
        return distance

    def _tile(
        self,
        row: tuple[cl.Buffer, cl.Buffer, int],
        column: tuple[cl.Buffer, cl.Buffer, int],
        weight: cl.Buffer,
        like: PoseFeatures,
        out: NDArray[np.float32],
    ) -> None:
        """Compute one tile into a view of the answer."""
        (row_linear, row_quaternion, height), (column_linear, column_quaternion, width) = row, column
        answer = cl.Buffer(self.context, cl.mem_flags.WRITE_ONLY, size=4 * height * width)
        size = (_up(width // self._lanes, self._group[0]), _up(height // _ROWS, self._group[1]))
        counts = (like.linear.shape[1], len(like.quaternion_weight), height, width)
        kernel = cl.Kernel(
            self._program, "pose_distance"
        )  # its own: arguments belong to the kernel, threads may share us
        kernel.set_args(
            *(np.int32(count) for count in counts),
            *(row_linear, column_linear, row_quaternion, column_quaternion, weight, answer),
        )
        cl.enqueue_nd_range_kernel(self._queue, kernel, size, self._group)
        whole = (
            out if out.shape == (height, width) and out.flags.c_contiguous else np.zeros((height, width), np.float32)
        )
        cl.enqueue_copy(self._queue, whole, answer)
        if whole is not out:
            out[...] = whole[: out.shape[0], : out.shape[1]]

    def _upload(self, poses: PoseFeatures, block: int) -> tuple[cl.Buffer, cl.Buffer, int]:
        """Coordinates first, poses last, padded to whole blocks."""
        n = len(poses)
        stride = _up(n, block)
        linear = np.zeros((poses.linear.shape[1], stride), np.float32)
        linear[:, :n] = poses.linear.T
        quaternion = np.zeros((4 * len(poses.quaternion_weight), stride), np.float32)
        quaternion[:, :n] = poses.quaternion_wxyz.reshape(n, len(quaternion)).T
        return self._buffer(linear), self._buffer(quaternion), stride

    def _buffer(self, array: NDArray[np.float32]) -> cl.Buffer:
        """Copy to the device; one unused number where there is nothing, for a buffer may not be empty."""
        content = array if array.size else np.zeros(1, np.float32)
        return cl.Buffer(self.context, cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR, hostbuf=content)


def _up(count: int, block: int) -> int:
    """Round up to whole blocks."""
    return -(-count // block) * block
