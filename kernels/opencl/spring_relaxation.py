"""The springs of [Kitsunai2007] on an OpenCL device: the twin of :func:`kernels.calibration.springs.relax_springs`."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from kernels.calibration.springs import JOINT_STIFFNESS, KEPT_SPEED, spring_body
from kernels.calibration.tree_solver import BodyModel, Solved, Stream, check_stream
from kernels.opencl.device import build, full_name, only_device, real_type

_GROUP = 16
"""Work-items of a group, one a frame. Chosen by hand; changes no bit."""


class SpringRelaxation:
    """A :class:`kernels.calibration.tree_solver.PoseSolver` on one device: the springs, one work-item a frame.

    Parameters
    ----------
    context : cl.Context of one device
        From :func:`kernels.opencl.choice.pick_device`; nothing is chosen here.
    parent : indices of the bones' parents, the root's -1
    precision : "single" or "double"
        In double precision the answer has the reference's bits.
    is_serial : bool
        One work-item goes through all frames: the same bits, for comparison.
    group : int, > 0
        Work-items of a work-group; changes no bit.

    Raises
    ------
    ValueError
        If the context has not exactly one device, or it cannot compute in the precision.
    """

    def __init__(
        self,
        context: cl.Context,
        *,
        parent: tuple[int, ...],
        precision: Literal["single", "double"] = "double",
        is_serial: bool = False,
        group: int = _GROUP,
    ) -> None:
        self.context = context
        self.parent = parent
        self.is_serial = is_serial
        self._group = group
        self._device = only_device(context)
        self._dtype = real_type(self._device, precision)
        options = {
            "REAL": "double" if precision == "double" else "float",
            "LANES": 1,
            "S": len(parent),
            "PARENTS": ",".join(str(k) for k in parent),
            "JOINT": JOINT_STIFFNESS,
            "KEPT": KEPT_SPEED,
        }
        self._program = build(context, ["components.cl", "spring_relaxation.cl"], options)
        self._queue = cl.CommandQueue(context)

    @property
    def name(self) -> str:
        """Device and driver, for metadata."""
        return full_name(self._device)

    def __call__(self, model: BodyModel, stream: Stream, *, iterations: int = 30) -> Solved:
        """Let the springs pull.

        Parameters
        ----------
        model : BodyModel
            On the tree this was made for.
        stream : Stream of F frames
        iterations : int, >= 1

        Returns
        -------
        Solved
            As the reference. Empty where F is 0.

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
        origin = stream.position_xyz_m[:, :1]
        springs = spring_body(model)
        body = np.concatenate(
            [
                springs.proximal_m,
                springs.sensor_m,
                springs.attachment_m,
                springs.turnability[:, None],
                springs.hold[:, None],
            ],
            axis=1,
        )
        flags = cl.mem_flags
        given = [
            cl.Buffer(self.context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=np.ascontiguousarray(a, self._dtype))
            for a in ((stream.position_xyz_m - origin).reshape(f, -1).T, stream.rotation_wxyz.reshape(f, -1).T, body)
        ]
        size = self._dtype.itemsize
        place = cl.Buffer(self.context, flags.WRITE_ONLY, size=size * 3 * n * f)
        answer = cl.Buffer(self.context, flags.WRITE_ONLY, size=size * 4 * n * f)
        # its own: threads may share us
        kernel = cl.Kernel(self._program, "spring_relaxation_serial" if self.is_serial else "spring_relaxation")
        kernel.set_args(np.int32(iterations), np.int32(f), *given, place, answer)
        items, group = ((1,), (1,)) if self.is_serial else ((-(-f // self._group) * self._group,), (self._group,))
        cl.enqueue_nd_range_kernel(self._queue, kernel, items, group)
        position = self._read(place, (3 * n, f)).reshape(f, n, 3) + origin
        return Solved(position, self._read(answer, (4 * n, f)).reshape(f, n, 4))

    def _read(self, buffer: cl.Buffer, shape: tuple[int, int]) -> NDArray[np.float64]:
        """Bring an answer back as (F, rows) float64."""
        rows = np.zeros(shape, self._dtype)
        cl.enqueue_copy(self._queue, rows, buffer)
        return np.ascontiguousarray(rows.T, np.float64)
