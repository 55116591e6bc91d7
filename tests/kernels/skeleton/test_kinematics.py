import numpy as np
import pytest

from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Clip, Skeleton

CHAIN = Skeleton(("root", "elbow", "tip"), np.array([-1, 0, 1]), np.array([[9.0, 9, 9], [1, 0, 0], [1, 0, 0]]))
QUARTER = rotation.from_axis_angle(np.array([0.0, 0, 1]), np.pi / 2)


@pytest.fixture
def some():
    rng = np.random.default_rng(0)
    return rng.normal(size=(7, 3)), rotation.normalize(rng.normal(size=(7, 22, 4)))


def test_an_arm_that_bends_twice():
    local = np.array([[rotation.IDENTITY, QUARTER, QUARTER]])
    position, orientation = kinematics.forward(CHAIN, np.array([[0.0, 5, 0]]), local)
    np.testing.assert_allclose(position[0], [[0, 5, 0], [1, 5, 0], [1, 6, 0]], atol=1e-12)
    assert rotation.angle_between(orientation[0, 2], rotation.IDENTITY) == pytest.approx(np.pi)


def test_translation_stands_in_place_of_offsets():
    moved = np.array([[[0.0, 0, 0], [0, 2, 0], [3, 0, 0]]])
    position, _ = kinematics.forward(
        CHAIN, np.zeros((1, 3)), np.tile(rotation.IDENTITY, (1, 3, 1)), translation_xyz_m=moved
    )
    np.testing.assert_allclose(position[0], [[0, 0, 0], [0, 2, 0], [3, 2, 0]])
    clip = Clip(CHAIN, 30.0, np.zeros((1, 3)), np.tile(rotation.IDENTITY, (1, 3, 1)), moved)
    np.testing.assert_allclose(kinematics.place(clip)[0], position)


def test_to_local_undoes_forward(some):
    root, local = some
    _, orientation = kinematics.forward(CANONICAL, root, local)
    again = kinematics.to_local(CANONICAL, orientation)
    assert rotation.angle_between(again, local).max() < 1e-6
    assert (again[0, :, 0] >= 0).all()
    assert (np.sum(again[1:] * again[:-1], axis=-1) >= 0).all()


def test_hang_agrees_with_forward(some):
    root, local = some
    position, orientation = kinematics.forward(CANONICAL, root, local)
    np.testing.assert_allclose(kinematics.hang(CANONICAL, root, orientation), position, atol=1e-12)


def test_bones_keep_their_length(some):
    root, local = some
    position, _ = kinematics.forward(CANONICAL, root, local)
    length = np.linalg.norm(position[:, 1:] - position[:, CANONICAL.parent[1:]], axis=-1)
    np.testing.assert_allclose(length, np.tile(np.linalg.norm(CANONICAL.offset_xyz_m[1:], axis=-1), (7, 1)), atol=1e-12)


def test_rest_is_the_pose_without_rotation():
    rest = kinematics.rest_position(CANONICAL)
    still = np.tile(rotation.IDENTITY, (1, 22, 1))
    np.testing.assert_allclose(kinematics.forward(CANONICAL, CANONICAL.offset_xyz_m[:1], still)[0][0], rest, atol=1e-12)


def test_no_frame_and_wrong_shapes():
    position, orientation = kinematics.forward(CHAIN, np.zeros((0, 3)), np.zeros((0, 3, 4)))
    assert position.shape == (0, 3, 3)
    assert orientation.shape == (0, 3, 4)
    with pytest.raises(ValueError, match=r"want \(F, 3\) and \(F, 3, 4\)"):
        kinematics.forward(CHAIN, np.zeros((2, 3)), np.zeros((2, 4, 4)))


def test_some_joints_are_where_all_would_be_with_those_above_them(some):
    root, local = some
    position, orientation = kinematics.forward(CANONICAL, root, local)
    knee = CANONICAL.joints.index("leftLowerLeg")
    few_position, few_orientation = kinematics.forward_some(CANONICAL, root, local, [knee])
    assert few_position.shape == (7, 22, 3)
    assert few_orientation.shape == (7, 22, 4)
    needed = [0, CANONICAL.joints.index("leftUpperLeg"), knee]
    np.testing.assert_allclose(few_position[:, needed], position[:, needed], atol=1e-12)
    np.testing.assert_allclose(few_orientation[:, needed], orientation[:, needed], atol=1e-12)
    others = np.setdiff1d(np.arange(22), needed)
    assert not few_position[:, others].any()
    assert not few_orientation[:, others].any()
