"""What poses of suits are solved on, on the device in use; loads no Dagster, for the command works without a studio."""

from typing import Any, Literal

from kernels.calibration.records import PARENT
from kernels.calibration.springs import relax_springs
from kernels.calibration.tree_solver import BodyModel, PoseSolver, Solved, Stream, solve_tree
from pipelines.device_fallback import Devices, OnDevice


class PoseSolvers:
    """What poses of suits are solved on, by method, built when first asked for; OpenCL is loaded then.

    Parameters
    ----------
    devices : Devices
    """

    def __init__(self, devices: Devices) -> None:
        self._devices = devices
        self._made: dict[str, _Solver] = {}

    def __call__(self, method: str) -> PoseSolver:
        """Solver of a method on the device in use."""
        if method not in self._made:
            self._made[method] = _Solver(self._devices, method)
        return self._made[method]


class _Solver:
    """Poses of a suit by one method on the device in use; see :class:`kernels.calibration.tree_solver.PoseSolver`."""

    def __init__(self, devices: Devices, method: str) -> None:
        self._on: OnDevice[PoseSolver] = OnDevice(devices, lambda context: _solver(context, method))

    @property
    def name(self) -> str:
        return self._on.name

    def __call__(self, model: BodyModel, stream: Stream, *, iterations: int) -> Solved:
        return self._on.use(lambda solver: solver(model, stream, iterations=iterations))


def _solver(context: Any, method: str) -> PoseSolver:  # noqa: ANN401 - a cl.Context or None
    if context is None:
        return relax_springs if method == "springs" else solve_tree
    device = context.devices[0]
    precision: Literal["single", "double"] = "double" if device.double_fp_config else "single"
    if method == "springs":
        from kernels.opencl.spring_relaxation import SpringRelaxation

        return SpringRelaxation(context, parent=PARENT, precision=precision)
    from kernels.opencl.tree_gauss_newton import TreeGaussNewton

    return TreeGaussNewton(context, parent=PARENT, precision=precision)
