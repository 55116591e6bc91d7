import numpy as np
import pyopencl as cl
import pytest

from kernels import rotation
from kernels.calibration.poses import gaps
from kernels.calibration.records import PARENT
from kernels.calibration.tree_solver import BodyModel, Stream, make_model, solve_tree
from kernels.opencl.device import list_devices
from kernels.opencl.tree_gauss_newton import TreeGaussNewton
from kernels.synthetic import suit

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


@pytest.fixture(scope="module")
def problem():
    """A true body, and noisy sensors with some entries hardly believed."""
    how = suit.Disturbance(outlier_ratio=0.0, dropped_ratio=0.0)
    made = suit.made_up(5, n_frames=300, disturbance=how)
    model = make_model(made.body.in_parent_sensor_m, made.body.in_child_sensor_m)
    weight = np.where(np.random.default_rng(0).random((300, 17)) < 0.1, 0.04, 1.0)
    return model, Stream(made.recording.position_xyz_m, made.recording.rotation_wxyz, weight)


def part(stream, frames):
    return Stream(stream.position_xyz_m[frames], stream.rotation_wxyz[frames], stream.weight[frames])


@pytest.mark.parametrize("n", [0, 1, 7, 8, 65, 300])
@pytest.mark.parametrize("iterations", [1, 2, 5])
def test_twin_of_the_reference(solver, problem, n, iterations):
    solve, precision = solver
    model, stream = problem
    stream = part(stream, slice(0, n))
    got, expected = solve(model, stream, iterations=iterations), solve_tree(model, stream, iterations=iterations)
    assert got.position_xyz_m.shape == (n, 17, 3)
    place, turn = (2e-5, 1e-4) if precision == "single" else (1e-9, 1e-9)
    np.testing.assert_allclose(got.position_xyz_m, expected.position_xyz_m, rtol=0, atol=place)
    np.testing.assert_allclose(
        rotation.to_matrix(got.rotation_wxyz), rotation.to_matrix(expected.rotation_wxyz), rtol=0, atol=turn
    )


def test_joints_are_closed(solver, problem):
    solve, precision = solver
    model, stream = problem
    far = Stream(stream.position_xyz_m + 50.0, stream.rotation_wxyz, stream.weight)  # an origin far off costs nothing
    for one in (stream, far):
        solved = solve(model, one, iterations=2)
        limit = 1e-6 if precision == "single" else 1e-12
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
    got = TreeGaussNewton(context, parent=chain)(model, stream, iterations=2)
    expected = solve_tree(model, stream, iterations=2)
    np.testing.assert_allclose(got.position_xyz_m, expected.position_xyz_m, atol=2e-5)


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
