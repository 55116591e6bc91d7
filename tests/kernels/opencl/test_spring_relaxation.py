from dataclasses import replace

import numpy as np
import pyopencl as cl
import pytest

from kernels.calibration.cleaning import clean
from kernels.calibration.poses import to_stream
from kernels.calibration.records import PARENT
from kernels.calibration.springs import relax_springs
from kernels.calibration.tree_solver import BodyModel, Stream, make_model
from kernels.opencl.device import list_devices
from kernels.opencl.spring_relaxation import SpringRelaxation
from kernels.synthetic import suit_performer

DEVICES = list_devices()

pytestmark = [pytest.mark.opencl, pytest.mark.skipif(not DEVICES, reason="no OpenCL device here")]


@pytest.fixture(scope="module", params=range(len(DEVICES)), ids=[device.name.strip() for device in DEVICES])
def context(request):
    return cl.Context([DEVICES[request.param]])


@pytest.fixture(scope="module", params=["single", "double"])
def precision(request, context):
    if request.param == "double" and not context.devices[0].double_fp_config:
        pytest.skip("no double precision here")
    return request.param


@pytest.fixture(scope="module", params=[0.0, 1000.0], ids=["near", "far"])
def problem(request):
    """A true body, and noisy sensors with gaps and outliers filled, about an origin near or far."""
    made = suit_performer.made_up(5, n_frames=200)
    model = make_model(made.body.in_parent_sensor_m, made.body.in_child_sensor_m)
    stream = to_stream(clean(made.recording))
    return model, replace(stream, position_xyz_m=stream.position_xyz_m + request.param * np.array([1.0, -2.0, 0.5]))


@pytest.mark.parametrize("n", [0, 1, 17, 200])
@pytest.mark.parametrize("iterations", [1, 30])
def test_twin_of_the_reference(context, precision, problem, n, iterations):
    model, stream = problem
    stream = Stream(stream.position_xyz_m[:n], stream.rotation_wxyz[:n], stream.weight[:n])
    got = SpringRelaxation(context, parent=PARENT, precision=precision)(model, stream, iterations=iterations)
    expected = relax_springs(model, stream, iterations=iterations)
    if precision == "double":
        assert np.array_equal(got.position_xyz_m, expected.position_xyz_m)
        assert np.array_equal(got.rotation_wxyz, expected.rotation_wxyz)
        return
    # a rounding of a body of 2 m, and of a turn, each time anything is moved
    place, turn = 2 * (iterations + 4) * 2.0**-23, 4 * (iterations + 4) * 2.0**-23
    np.testing.assert_allclose(got.position_xyz_m, expected.position_xyz_m, rtol=0, atol=place)
    np.testing.assert_allclose(got.rotation_wxyz, expected.rotation_wxyz, rtol=0, atol=turn)


@pytest.mark.parametrize("group", [1, 3, 64])
def test_groups_change_no_bit(context, precision, problem, group):
    model, stream = problem
    one, other = (
        SpringRelaxation(context, parent=PARENT, precision=precision, **how)(model, stream)
        for how in ({}, {"group": group})
    )
    np.testing.assert_array_equal(other.position_xyz_m, one.position_xyz_m)
    np.testing.assert_array_equal(other.rotation_wxyz, one.rotation_wxyz)


def test_serial_and_parallel_agree_bit_for_bit(context, precision, problem):
    model, stream = problem
    one, all_ = (
        SpringRelaxation(context, parent=PARENT, precision=precision, is_serial=is_serial)(model, stream)
        for is_serial in (True, False)
    )
    np.testing.assert_array_equal(one.position_xyz_m, all_.position_xyz_m)
    np.testing.assert_array_equal(one.rotation_wxyz, all_.rotation_wxyz)


def test_refuses_as_the_reference(context, problem):
    model, stream = problem
    solve = SpringRelaxation(context, parent=PARENT, precision="single")
    for function in (solve, relax_springs):
        with pytest.raises(ValueError, match="iterations: want at least 1, got 0"):
            function(model, stream, iterations=0)
    other = BodyModel((-1,), np.zeros((1, 3)), np.zeros((1, 3)), np.ones(1), np.ones(1))
    with pytest.raises(ValueError, match="model: want the tree"):
        solve(other, Stream(np.zeros((1, 1, 3)), np.ones((1, 1, 4)) / 2, np.ones((1, 1))))


def test_names_its_device(context):
    assert context.devices[0].name.strip() in SpringRelaxation(context, parent=PARENT, precision="single").name


def test_a_context_of_no_single_device_is_refused():
    wrong = type("Context", (), {"devices": []})()
    with pytest.raises(ValueError, match="want one device, got 0"):
        SpringRelaxation(wrong, parent=PARENT)
