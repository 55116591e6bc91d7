import numpy as np
import pytest

from kernels import rotation
from kernels.graph.distance import (
    PoseFeatures,
    check_metric,
    check_pair,
    concatenate,
    error_bound,
    paired_distance,
    pose_distance,
)


def by_hand(linear, quaternion=None, weight=()):
    linear = np.asarray(linear, float)
    quaternion = np.zeros((len(linear), 0, 4)) if quaternion is None else np.asarray(quaternion, float)
    return PoseFeatures("rotation" if len(weight) else "position", linear, quaternion, np.asarray(weight, float))


def test_linear_part_is_the_squared_euclidean_distance():
    poses = by_hand([[0.0, 0.0], [3.0, 4.0], [1.0, 0.0]])
    np.testing.assert_array_equal(pose_distance(poses, poses), [[0, 25, 1], [25, 0, 20], [1, 20, 0]])


@pytest.mark.parametrize("angle_rad", [0.0, 1e-8, 1e-3, 1.0, np.pi / 2, 3.0, np.pi])
def test_rotation_part_is_the_weighted_squared_angle(angle_rad):
    q = rotation.from_axis_angle(np.array([[0.0, 0.6, 0.8]] * 2), np.array([0.4, 0.4 + angle_rad]))[:, None]
    poses = by_hand(np.zeros((2, 0)), q, [0.25])
    np.testing.assert_allclose(pose_distance(poses, poses)[0, 1], 0.25 * angle_rad**2, rtol=1e-6, atol=1e-30)


@pytest.mark.parametrize("metric", ["position", "rotation"])
def test_agrees_with_the_formula_written_out(make_poses, metric):
    rows, columns = make_poses(5, metric, seed=1), make_poses(40, metric, seed=2)
    expected = np.square(rows.linear[:, None] - columns.linear[None]).sum(-1)
    angle = rotation.angle_between(columns.quaternion_wxyz[None], rows.quaternion_wxyz[:, None])
    expected += (rows.quaternion_weight * angle**2).sum(-1)
    np.testing.assert_allclose(pose_distance(rows, columns), expected, rtol=1e-12)


def test_the_sign_of_a_quaternion_does_not_matter(make_poses):
    poses = make_poses(6, "rotation")
    flipped = PoseFeatures("rotation", poses.linear, -poses.quaternion_wxyz, poses.quaternion_weight)
    np.testing.assert_array_equal(pose_distance(poses, flipped), pose_distance(poses, poses))


@pytest.mark.parametrize("metric", ["position", "rotation"])
def test_is_a_metric_under_the_root(make_poses, metric):
    poses = make_poses(30, metric)
    distance = pose_distance(poses, poses)
    np.testing.assert_array_equal(distance, distance.T)
    np.testing.assert_array_equal(np.diag(distance), 0)
    root = np.sqrt(distance)
    assert (root[:, None, :] <= root[:, :, None] + root[None, :, :] + 1e-12).all()


@pytest.mark.parametrize("metric", ["position", "rotation"])
def test_a_pair_has_the_same_bits_in_any_portion(make_poses, metric):
    poses = make_poses(1100, metric)
    whole = pose_distance(poses.take(slice(0, 70)), poses)
    for row in (0, 33, 69):
        one = pose_distance(poses.take(slice(row, row + 1)), poses.take(slice(1000, 1100)))
        np.testing.assert_array_equal(one[0], whole[row, 1000:])
    paired = paired_distance(poses.take(np.arange(70)), poses.take(np.arange(70) + 1000))
    np.testing.assert_array_equal(paired, whole[np.arange(70), np.arange(70) + 1000])


@pytest.mark.parametrize("metric", ["position", "rotation"])
@pytest.mark.parametrize(("n", "m"), [(0, 0), (0, 3), (3, 0), (1, 1)])
def test_small_and_empty(make_poses, metric, n, m):
    assert pose_distance(make_poses(n, metric), make_poses(m, metric)).shape == (n, m)


def test_concatenate_keeps_rows(make_poses):
    parts = [make_poses(3, "rotation", 1), make_poses(0, "rotation", 2), make_poses(2, "rotation", 3)]
    whole = concatenate(parts)
    assert len(whole) == 5
    np.testing.assert_array_equal(whole.take(slice(3, 5)).quaternion_wxyz, parts[2].quaternion_wxyz)


def test_error_bound_covers_rounding_to_float32(make_poses):
    poses = make_poses(200, "rotation")
    rounded = PoseFeatures(
        "rotation",
        poses.linear.astype(np.float32).astype(float),
        poses.quaternion_wxyz.astype(np.float32).astype(float),
        poses.quaternion_weight,
    )
    relative, absolute = error_bound(poses, np.dtype(np.float32))
    exact, off = np.sqrt(pose_distance(poses, poses)), np.sqrt(pose_distance(rounded, rounded))
    assert (np.abs(off - exact) <= relative * exact + absolute).all()
    assert error_bound(poses, np.dtype(np.float64)) == (0.0, 0.0)


def test_error_bound_shrinks_with_the_poses(make_poses):
    poses = make_poses(20)
    small = PoseFeatures("position", poses.linear / 10, poses.quaternion_wxyz, poses.quaternion_weight)
    bound = error_bound(poses, np.dtype(np.float32))[1]
    assert error_bound(small, np.dtype(np.float32))[1] == pytest.approx(bound / 10)


@pytest.mark.parametrize(
    ("linear", "quaternion", "weight", "message"),
    [
        (np.zeros(3), np.zeros((3, 0, 4)), np.zeros(0), "want .N, D."),
        (np.zeros((3, 1)), np.zeros((2, 0, 4)), np.zeros(0), "want .N, D."),
        (np.full((1, 1), np.nan), np.zeros((1, 0, 4)), np.zeros(0), "linear: not finite"),
        (np.zeros((1, 1)), np.zeros((1, 1, 4)), np.ones(1), "unit"),
        (np.zeros((1, 1)), np.array([[[1.0, 0, 0, 0]]]), -np.ones(1), "quaternion_weight: want >= 0"),
    ],
)
def test_poses_are_checked_at_birth(linear, quaternion, weight, message):
    with pytest.raises(ValueError, match=message):
        PoseFeatures("rotation", linear, quaternion, weight)


def test_poses_made_differently_are_refused(make_poses):
    with pytest.raises(ValueError, match="metric 'position', got 'rotation'"):
        check_pair(make_poses(1), make_poses(1, "rotation"))
    with pytest.raises(ValueError, match="want 2 coordinates"):
        pose_distance(by_hand(np.zeros((1, 2))), by_hand(np.zeros((1, 3))))
    one = np.array([[[1.0, 0.0, 0.0, 0.0]]])
    with pytest.raises(ValueError, match="quaternion_weight"):
        pose_distance(by_hand(np.zeros((1, 1)), one, [1.0]), by_hand(np.zeros((1, 1)), one, [0.5]))
    with pytest.raises(ValueError, match="want 2 poses"):
        paired_distance(make_poses(2), make_poses(3))
    with pytest.raises(ValueError, match="at least one"):
        concatenate([])
    with pytest.raises(ValueError, match="want one of position, rotation, got 'angle'"):
        check_metric("angle")
    with pytest.raises(ValueError, match="float32 or float64"):
        error_bound(make_poses(1), np.dtype(np.float16))


def test_error_bound_is_that_of_the_longest_pose_and_all_terms():
    unit = 2.0**-24
    turned = np.tile([1.0, 0.0, 0.0, 0.0], (3, 2, 1))
    poses = PoseFeatures(
        "rotation", np.array([[3.0, 4.0, 0.0], [0.0] * 3, [1.0, 0.0, 0.0]]), turned, np.array([0.5, 3.5])
    )
    relative, absolute = error_bound(poses, np.dtype(np.float32))
    assert relative == pytest.approx(unit * (3 + 2 + 16))
    assert absolute == pytest.approx(2 * (2 * unit * 5.0 + 6 * unit * 2.0))
    none = PoseFeatures("rotation", np.zeros((0, 3)), np.zeros((0, 2, 4)), np.array([0.5, 3.5]))
    assert error_bound(none, np.dtype(np.float32))[1] == pytest.approx(2 * 6 * unit * 2.0)
