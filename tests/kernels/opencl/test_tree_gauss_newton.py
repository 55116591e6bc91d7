from dataclasses import replace

import numpy as np
import pyopencl as cl
import pytest

from kernels import rotation
from kernels.calibration.cleaning import clean
from kernels.calibration.poses import gaps, to_stream
from kernels.calibration.records import PARENT
from kernels.calibration.tree_solver import BodyModel, Stream, make_model, solve_tree
from kernels.opencl.device import list_devices
from kernels.opencl.tree_gauss_newton import TreeGaussNewton
from kernels.synthetic import suit_performer

DEVICES = list_devices()

pytestmark = [pytest.mark.opencl, pytest.mark.skipif(not DEVICES, reason="no OpenCL device here")]


@pytest.fixture(scope="module", params=range(len(DEVICES)), ids=[device.name.strip() for device in DEVICES])
def context(request):
    return cl.Context([DEVICES[request.param]])


@pytest.fixture(scope="module", params=["single", "double"])
def solver(request, context):
    if request.param == "double" and not context.devices[0].double_fp_config:
        pytest.skip("no double precision here")
    return TreeGaussNewton(context, parent=PARENT, precision=request.param), request.param


@pytest.fixture(scope="module", params=[0.0, 1000.0], ids=["near", "far"])
def problem(request):
    """A true body, and noisy sensors with gaps and outliers filled and hardly believed, about an origin near or far."""
    made = suit_performer.made_up(5, n_frames=300)
    model = make_model(made.body.in_parent_sensor_m, made.body.in_child_sensor_m)
    stream = to_stream(clean(made.recording))
    assert 0 < np.mean(stream.weight < 1) < 0.1
    return model, replace(stream, position_xyz_m=stream.position_xyz_m + request.param * np.array([1.0, -2.0, 0.5]))


def part(stream, frames):
    return Stream(stream.position_xyz_m[frames], stream.rotation_wxyz[frames], stream.weight[frames])


def assert_twins(got, expected, precision):
    """In double precision the same bits; in single as near as sums over 17 bones of a body of 2 m may come."""
    assert got.position_xyz_m.shape == expected.position_xyz_m.shape
    if precision == "double":
        assert np.array_equal(got.position_xyz_m, expected.position_xyz_m)
        assert np.array_equal(got.rotation_wxyz, expected.rotation_wxyz)
        return
    place, turn = 17 * 2 * 2.0**-23, 17 * 4 * 2.0**-23
    np.testing.assert_allclose(got.position_xyz_m, expected.position_xyz_m, rtol=0, atol=place)
    np.testing.assert_allclose(
        rotation.to_matrix(got.rotation_wxyz), rotation.to_matrix(expected.rotation_wxyz), rtol=0, atol=turn
    )


@pytest.mark.parametrize("n", [0, 1, 7, 8, 65, 300])
@pytest.mark.parametrize("iterations", [1, 2, 5])
def test_twin_of_the_reference(solver, problem, n, iterations):
    solve, precision = solver
    model, stream = problem
    stream = part(stream, slice(0, n))
    got, expected = solve(model, stream, iterations=iterations), solve_tree(model, stream, iterations=iterations)
    assert got.position_xyz_m.shape == (n, 17, 3)
    assert_twins(got, expected, precision)


@pytest.mark.parametrize(("lanes", "group"), [(1, 1), (1, 64), (2, 3), (4, 16), (8, 1), (16, 5)])
def test_lanes_and_groups_change_no_bit(context, solver, problem, lanes, group):
    usual, precision = solver
    model, stream = problem
    other = TreeGaussNewton(context, parent=PARENT, precision=precision, lanes=lanes, group=group)
    got, expected = other(model, stream), usual(model, stream)
    np.testing.assert_array_equal(got.position_xyz_m, expected.position_xyz_m)
    np.testing.assert_array_equal(got.rotation_wxyz, expected.rotation_wxyz)


def test_joints_are_closed(solver, problem):
    solve, precision = solver
    model, stream = problem
    solved = solve(model, stream, iterations=2)
    far = np.abs(stream.position_xyz_m).max()  # metres, all that rounding depends on in double precision
    limit = 1e-6 if precision == "single" else 4 * far * 2.0**-52
    assert gaps(model, solved.position_xyz_m, solved.rotation_wxyz).max() <= limit


def test_a_frame_has_the_same_bits_in_any_portion(solver, problem):
    solve, _ = solver
    model, stream = problem
    whole = solve(model, stream, iterations=2)
    some = solve(model, part(stream, slice(13, 50)), iterations=2)
    np.testing.assert_array_equal(some.position_xyz_m, whole.position_xyz_m[13:50])
    np.testing.assert_array_equal(some.rotation_wxyz, whole.rotation_wxyz[13:50])


def test_other_trees_are_solved_too(context):
    chain = (-1, 0, 1)
    model = BodyModel(
        chain,
        np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0.0]]),
        np.array([[0, 0, 0], [0, 0.2, 0], [0, 0.3, 0.0]]),
        np.full(3, 0.005),
        np.full(3, 0.02),
    )
    rng = np.random.default_rng(0)
    stream = Stream(rng.normal(0, 0.2, (9, 3, 3)), rotation.exp(rng.normal(0, 0.2, (9, 3, 3))), np.ones((9, 3)))
    expected = solve_tree(model, stream, iterations=2)
    for precision in ("single", "double") if context.devices[0].double_fp_config else ("single",):
        got = TreeGaussNewton(context, parent=chain, precision=precision)(model, stream, iterations=2)
        assert_twins(got, expected, precision)


def test_refuses_as_the_reference(solver, problem):
    solve, _ = solver
    model, stream = problem
    wrong = Stream(stream.position_xyz_m, stream.rotation_wxyz, 0 * stream.weight)
    messages = []
    for function in (solve, solve_tree):
        with pytest.raises(ValueError, match="weight: want > 0") as caught:
            function(model, wrong, iterations=2)
        messages.append(str(caught.value))
    assert messages[0] == messages[1]
    other = BodyModel((-1, 0), np.zeros((2, 3)), np.zeros((2, 3)), np.ones(2), np.ones(2))
    with pytest.raises(ValueError, match="model: want the tree"):
        solve(other, Stream(np.zeros((1, 2, 3)), np.tile(rotation.IDENTITY, (1, 2, 1)), np.ones((1, 2))), iterations=1)


def test_names_its_device(solver):
    assert any(device.name.strip() in solver[0].name for device in DEVICES)


def test_a_context_of_no_single_device_is_refused():
    context = type("Context", (), {"devices": [DEVICES[0], DEVICES[0]]})()
    with pytest.raises(ValueError, match="want one device, got 2"):
        TreeGaussNewton(context, parent=PARENT)
