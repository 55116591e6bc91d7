"""Poses by Gauss-Newton on an OpenCL device: the twin of :func:`kernels.calibration.tree_solver.solve_tree`."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from kernels.calibration.tree_solver import BodyModel, Solved, Stream, body_rows, check_stream
from kernels.opencl.device import build, full_name, only_device, real_type

_GROUP = 64
"""Work-items of a group where the device is no CPU. Chosen by hand; changes no bit."""


class TreeGaussNewton:
    """A :class:`kernels.calibration.tree_solver.PoseSolver` on one device.

    Parameters
    ----------
    context : cl.Context of one device
        From :func:`kernels.opencl.choice.pick_device`; nothing is chosen here.
    parent : indices of the bones' parents, the root's -1
    precision : "single" or "double"
        In double precision the answer has the reference's bits.
    lanes : 1, 2, 4, 8 or 16 frames a work-item owns, or None for what suits the device
    group : int, > 0, work-items of a work-group, or None for what suits the device
        Neither changes a bit.

    Raises
    ------
    ValueError
        If the context has not exactly one device, or it cannot compute in the precision.

    Notes
    -----
    As in the reference, positions are taken from each frame's pelvis sensor, here before they become float32.
    """

    def __init__(
        self,
        context: cl.Context,
        *,
        parent: tuple[int, ...],
        precision: Literal["single", "double"] = "single",
        lanes: Literal[1, 2, 4, 8, 16] | None = None,
        group: int | None = None,
    ) -> None:
        self.context = context
        self.parent = parent
        self._device = only_device(context)
        self._dtype = real_type(self._device, precision)
        is_cpu = bool(self._device.type & cl.device_type.CPU)
        self._lanes = lanes or ((4 if precision == "double" else 8) if is_cpu else 1)
        self._group = group or (1 if is_cpu else _GROUP)
        options = {
            "REAL": "double" if precision == "double" else "float",
            "LANES": self._lanes,
            "S": len(parent),
            "PARENTS": ",".join(str(k) for k in parent),
        }
        self._program = build(context, ["components.cl", "tree_gauss_newton.cl"], options)
        self._queue = cl.CommandQueue(context)

    @property
    def name(self) -> str:
        """Device and driver, for metadata."""
        return full_name(self._device)

    def __call__(self, model: BodyModel, stream: Stream, *, iterations: int = 2) -> Solved:
        """Fit a jointed body to its sensors, frame by frame.

        Parameters
        ----------
        model : BodyModel
            On the tree this was made for.
        stream : Stream of F frames
        iterations : int, >= 1

        Returns
        -------
        Solved
            Closed at the joints to rounding, 1e-6 m in single precision. Empty where F is 0.

        Raises
        ------
        ValueError
            As the reference, or if the model is of another tree.
        """
        check_stream(model, stream, iterations)
        if model.parent != self.parent:
            raise ValueError(f"model: want the tree {self.parent}, got {model.parent}; make another solver")
        f, n = stream.weight.shape
        if f == 0:
            return Solved(np.zeros((0, n, 3)), np.zeros((0, n, 4)))
        stride = -(-f // self._lanes) * self._lanes
        origin = stream.position_xyz_m[:, :1].copy()
        body = body_rows(model).astype(self._dtype)
        flags = cl.mem_flags
        given = [
            cl.Buffer(self.context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=array)
            for array in (
                self._rows(stream.position_xyz_m - origin, stride),
                self._rows(stream.rotation_wxyz, stride),
                self._rows(stream.weight[..., None], stride),
                body,
            )
        ]
        size = self._dtype.itemsize
        place = cl.Buffer(self.context, flags.WRITE_ONLY, size=size * 3 * n * stride)
        answer = cl.Buffer(self.context, flags.WRITE_ONLY, size=size * 4 * n * stride)
        kernel = cl.Kernel(self._program, "tree_gauss_newton")  # its own: threads may share us
        kernel.set_args(np.int32(iterations), np.int32(stride), *given, place, answer)
        items = -(-(stride // self._lanes) // self._group) * self._group
        cl.enqueue_nd_range_kernel(self._queue, kernel, (items,), (self._group,))
        position = self._read(place, (3 * n, stride), f).reshape(f, n, 3) + origin
        return Solved(position, self._read(answer, (4 * n, stride), f).reshape(f, n, 4))

    def _rows(self, series: NDArray[np.float64], stride: int) -> NDArray[np.floating]:
        """Turn (F, S, C) into (S C, stride): frame last, the last frame repeated."""
        f = len(series)
        rows = np.zeros((series.shape[1] * series.shape[2], stride), self._dtype)
        rows[:, :f] = series.reshape(f, -1).T
        rows[:, f:] = rows[:, f - 1 : f]
        return rows

    def _read(self, buffer: cl.Buffer, shape: tuple[int, int], f: int) -> NDArray[np.float64]:
        """Bring an answer back as (F, rows) float64."""
        rows = np.zeros(shape, self._dtype)
        cl.enqueue_copy(self._queue, rows, buffer)
        return np.ascontiguousarray(rows[:, :f].T, np.float64)
