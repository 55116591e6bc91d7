from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pyopencl as cl
import pytest

from kernels.graph.distance import PoseFeatures, error_bound, pose_distance
from kernels.opencl import pose_distance as module
from kernels.opencl.device import list_devices
from kernels.opencl.pose_distance import PoseDistance

DEVICES = list_devices()
METRICS = ["position", "rotation"]

pytestmark = [pytest.mark.opencl, pytest.mark.skipif(not DEVICES, reason="no OpenCL device here")]


@pytest.fixture(scope="module", params=range(len(DEVICES)), ids=[device.name.strip() for device in DEVICES])
def twin(request):
    return PoseDistance(cl.Context([DEVICES[request.param]]))


@pytest.fixture
def make_poses():
    def make(n, metric, seed=0, scale=0.1):
        rng = np.random.default_rng(seed)
        if metric == "position":
            return PoseFeatures(metric, rng.normal(scale=scale, size=(n, 7)), np.zeros((n, 0, 4)), np.zeros(0))
        q = rng.normal(size=(n, 3, 4))
        q /= np.linalg.norm(q, axis=-1, keepdims=True)
        return PoseFeatures(metric, rng.normal(scale=scale, size=(n, 5)), q, np.array([0.5, 0.3, 0.2]))

    return make


def assert_twins(twin, rows, columns):
    got, expected = twin(rows, columns), pose_distance(rows, columns)
    assert got.dtype == np.float32
    assert got.shape == expected.shape
    both = PoseFeatures(
        rows.metric,
        np.concatenate([rows.linear, columns.linear]),
        np.concatenate([rows.quaternion_wxyz, columns.quaternion_wxyz]),
        rows.quaternion_weight,
    )
    relative, absolute = error_bound(both, np.dtype(np.float32))
    root = np.sqrt(expected)
    np.testing.assert_array_less(np.abs(np.sqrt(got) - root), relative * root + absolute + 1e-300)


@pytest.mark.parametrize("metric", METRICS)
@pytest.mark.parametrize(("n", "m"), [(0, 0), (0, 5), (5, 0), (1, 1), (1, 7), (7, 1), (13, 131), (64, 128), (65, 1025)])
def test_twin_of_the_reference(twin, make_poses, metric, n, m):
    assert_twins(twin, make_poses(n, metric, 1), make_poses(m, metric, 2))


@pytest.mark.parametrize("metric", METRICS)
def test_symmetric_and_zero_on_itself_to_the_bit(twin, make_poses, metric):
    poses = make_poses(67, metric)
    distance = twin(poses, poses)
    np.testing.assert_array_equal(distance, distance.T)
    np.testing.assert_array_equal(np.diag(distance), 0)


@pytest.mark.parametrize("metric", METRICS)
def test_a_pair_has_the_same_bits_in_any_portion(twin, make_poses, metric, monkeypatch):
    poses = make_poses(150, metric)
    whole = twin(poses, poses)
    np.testing.assert_array_equal(twin(poses.take(slice(3, 50)), poses.take(slice(60, 61))), whole[3:50, 60:61])
    monkeypatch.setattr(module, "_TILE_BYTES", 4 * 8 * 40)  # several tiles each way
    np.testing.assert_array_equal(twin(poses, poses), whole)


@pytest.mark.parametrize("metric", METRICS)
def test_the_vector_width_does_not_change_a_bit(twin, make_poses, metric, monkeypatch):
    poses = make_poses(37, metric)
    whole = twin(poses, poses)
    for lanes in (4, 8, 16):
        monkeypatch.setattr(module, "_LANES", (lanes,))
        np.testing.assert_array_equal(PoseDistance(twin.context)(poses, poses), whole)


def test_right_at_small_and_large_angles(twin):
    angle = np.concatenate([np.geomspace(1e-4, 1, 50), np.linspace(1, np.pi, 50)])
    q = np.stack([np.cos(angle / 2), np.sin(angle / 2), 0 * angle, 0 * angle], -1)[:, None]
    poses = PoseFeatures("rotation", np.zeros((100, 0)), q, np.ones(1))
    still = PoseFeatures("rotation", np.zeros((1, 0)), np.array([[[1.0, 0, 0, 0]]]), np.ones(1))
    np.testing.assert_allclose(np.sqrt(twin(still, poses)[0]), angle, atol=8 * 2**-24, rtol=8 * 2**-24)
    flipped = PoseFeatures("rotation", np.zeros((100, 0)), -q, np.ones(1))
    np.testing.assert_array_equal(twin(still, flipped), twin(still, poses))


def test_far_and_near_poses(twin, make_poses):
    for scale in (1e-6, 1e3):
        assert_twins(twin, make_poses(9, "position", 1, scale), make_poses(10, "position", 2, scale))


def test_poses_made_differently_are_refused_as_by_the_reference(twin, make_poses):
    for rows, columns in [
        (make_poses(2, "position"), make_poses(2, "rotation")),
        (make_poses(0, "position"), PoseFeatures("position", np.zeros((0, 6)), np.zeros((0, 0, 4)), np.zeros(0))),
    ]:
        messages = []
        for function in (twin, pose_distance):
            with pytest.raises(ValueError, match="columns: want") as caught:
                function(rows, columns)
            messages.append(str(caught.value))
        assert messages[0] == messages[1]


def test_names_its_device(twin):
    assert any(device.name.strip() in twin.name for device in DEVICES)


def test_threads_may_share_it(twin, make_poses):
    sets = [make_poses(40 + i, "position", i) for i in range(8)]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda poses: twin(poses, poses), sets))
    for poses, distance in zip(sets, together, strict=True):
        np.testing.assert_array_equal(distance, twin(poses, poses))


def test_a_context_of_no_single_device_is_refused():
    context = type("Context", (), {"devices": [DEVICES[0], DEVICES[0]]})()
    with pytest.raises(ValueError, match="want one device, got 2"):
        PoseDistance(context)
