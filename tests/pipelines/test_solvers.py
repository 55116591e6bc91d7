import numpy as np
import pyopencl as cl
import pytest

from kernels.calibration.tree_solver import Stream, make_model
from kernels.opencl.device import list_devices
from kernels.synthetic import suit_performer
from pipelines.device_fallback import Devices
from pipelines.solvers import PoseSolvers

METHODS = ("gauss_newton", "springs")


@pytest.fixture
def problem():
    how = suit_performer.Disturbance(outlier_ratio=0.0, dropped_ratio=0.0)
    made = suit_performer.made_up(5, n_frames=60, disturbance=how)
    model = make_model(made.body.in_parent_sensor_m, made.body.in_child_sensor_m)
    return model, Stream(made.recording.position_xyz_m, made.recording.rotation_wxyz, np.ones((60, 17)))


@pytest.mark.parametrize("method", METHODS)
def test_solvers_are_built_once_and_go_without_a_device(problem, method):
    solvers = PoseSolvers(Devices("reference"))
    assert solvers(method) is solvers(method)
    assert solvers(method).name == "reference"
    assert solvers(method)(*problem, iterations=3).position_xyz_m.shape == (60, 17, 3)


@pytest.mark.opencl
@pytest.mark.skipif(not list_devices(), reason="no OpenCL device here")
@pytest.mark.parametrize("method", METHODS)
def test_a_device_that_fails_gives_way_to_the_same_poses(problem, method, monkeypatch):
    wanted = PoseSolvers(Devices("reference"))(method)(*problem, iterations=3)
    if all(device.double_fp_config for device in list_devices()):
        on_device = PoseSolvers(Devices())(method)(*problem, iterations=3)
        np.testing.assert_array_equal(on_device.rotation_wxyz, wanted.rotation_wxyz)
        np.testing.assert_array_equal(on_device.position_xyz_m, wanted.position_xyz_m)

    def refuse(*arguments, **more):
        raise cl.MemoryError("no room")

    for place in ("tree_gauss_newton.TreeGaussNewton", "spring_relaxation.SpringRelaxation"):
        monkeypatch.setattr(f"kernels.opencl.{place}.__call__", refuse)
    said = []
    solver = PoseSolvers(Devices(say=said.append))(method)
    got = solver(*problem, iterations=3)
    np.testing.assert_array_equal(got.rotation_wxyz, wanted.rotation_wxyz)
    assert solver.name == "reference"
    assert len(said) == len(list_devices())
