"""The mannequin stands on the floor, is closed, symmetric, and follows the skeleton's size."""

import numpy as np
import pytest
import trimesh

from assets.formats.mesh import body
from kernels.skeleton.canonical import BODY_HEIGHT_M, CANONICAL, JOINTS
from kernels.skeleton.kinematics import rest_position
from kernels.types import Skeleton
from schemas.stage_contract import SIDES


@pytest.fixture(scope="module")
def mannequin():
    return body(CANONICAL)


def scaled(skeleton, factor):
    return Skeleton(skeleton.joints, skeleton.parent, skeleton.offset_xyz_m * factor)


def chain(names, offsets):
    return Skeleton(tuple(names), np.arange(-1, len(names) - 1), np.array(offsets, np.float64))


def test_body_is_as_tall_as_the_canonical_body_and_stands_on_the_floor(mannequin):
    low, high = mannequin.point_xyz_m.min(0), mannequin.point_xyz_m.max(0)
    assert low[1] == pytest.approx(0.0, abs=1e-9)
    assert high[1] == pytest.approx(BODY_HEIGHT_M, abs=0.01)
    assert high[0] - low[0] == pytest.approx(BODY_HEIGHT_M, abs=0.05)


@pytest.mark.parametrize("foot", ["leftFoot", "leftToes", "rightFoot", "rightToes"])
def test_soles_are_flat_on_the_floor(mannequin, foot):
    height = mannequin.point_xyz_m[mannequin.joint_index == JOINTS.index(foot), 1]
    assert np.sum(np.abs(height) < 1e-9) >= 4


def test_every_joint_carries_a_closed_part_near_it(mannequin):
    rest = rest_position(CANONICAL)
    for k, joint in enumerate(JOINTS):
        faces = mannequin.triangle[mannequin.joint_index[mannequin.triangle[:, 0]] == k]
        part = trimesh.Trimesh(mannequin.point_xyz_m, faces, process=True)
        part.merge_vertices(merge_norm=True)
        assert part.is_watertight, joint
        assert part.volume > 1e-4, joint
        assert np.linalg.norm(part.bounds.mean(0) - rest[k]) < 0.3, joint


def test_body_weighs_like_one(mannequin):
    whole = trimesh.Trimesh(mannequin.point_xyz_m, mannequin.triangle, process=False)
    assert 0.05 < whole.volume < 0.09  # cubic metres: a person of 1.72 m displaces about 70 litres


def test_normals_are_unit_and_point_outwards(mannequin):
    np.testing.assert_allclose(np.linalg.norm(mannequin.normal_xyz, axis=-1), 1, atol=1e-9)
    corner = mannequin.point_xyz_m[mannequin.triangle]
    face = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert (np.sum(face * mannequin.normal_xyz[mannequin.triangle].mean(1), axis=-1) > 0).all()


def test_the_face_looks_along_z(mannequin):
    head = mannequin.point_xyz_m[mannequin.joint_index == JOINTS.index("head")]
    assert head[:, 2].max() > -head[:, 2].min() + 0.02


def test_no_triangle_hangs_between_two_joints(mannequin):
    joint = mannequin.joint_index[mannequin.triangle]
    assert (joint == joint[:, :1]).all()


def test_left_is_left_and_mirrors_right(mannequin):
    side_x = [mannequin.point_xyz_m[mannequin.triangle[mannequin.side_index == k], 0] for k in range(3)]
    assert SIDES == ("middle", "left", "right")
    assert side_x[1].min() > 0 > side_x[2].max()
    for left, right in (("leftHand", "rightHand"), ("leftFoot", "rightFoot"), ("leftUpperArm", "rightUpperArm")):
        a = mannequin.point_xyz_m[mannequin.joint_index == JOINTS.index(left)]
        b = mannequin.point_xyz_m[mannequin.joint_index == JOINTS.index(right)]
        np.testing.assert_allclose(a.min(0), [-b[:, 0].max(), *b.min(0)[1:]], atol=1e-9)
        np.testing.assert_allclose(a.max(0), [-b[:, 0].min(), *b.max(0)[1:]], atol=1e-9)


def test_body_grows_with_the_skeleton(mannequin):
    np.testing.assert_allclose(body(scaled(CANONICAL, 1.7)).point_xyz_m, 1.7 * mannequin.point_xyz_m, atol=1e-9)


def test_equal_skeletons_give_equal_bytes(mannequin):
    again = body(scaled(CANONICAL, 1.0))
    for name in ("point_xyz_m", "normal_xyz", "triangle", "joint_index", "side_index"):
        assert getattr(again, name).tobytes() == getattr(mannequin, name).tobytes()


def test_unknown_names_get_plain_limbs_with_sides_by_place():
    skeleton = Skeleton(
        ("a", "b", "c", "d"),
        np.array([-1, 0, 0, 1]),
        np.array([[0, 1, 0], [0.3, 0, 0], [-0.3, 0, 0], [0.3, 0, 0.0]]),
    )
    shape = body(skeleton)
    assert set(shape.joint_index) == {0, 1}  # ends carry nothing
    assert shape.point_xyz_m[:, 0].max() == pytest.approx(0.6, abs=0.05)
    assert set(shape.side_index[shape.joint_index[shape.triangle[:, 0]] == 1]) == {SIDES.index("left")}


def test_names_tell_the_side_before_the_place_does():
    shape = body(chain(["Hips", "RightUpLeg", "RightLeg"], [[0, 1, 0], [0.1, 0, 0], [0, -0.4, 0]]))
    assert set(shape.side_index[shape.joint_index[shape.triangle[:, 0]] == 1]) == {SIDES.index("right")}


@pytest.mark.parametrize(
    "skeleton",
    [
        chain(["only"], [[0, 1, 0]]),
        chain(["one", "two"], [[0, 1, 0], [0, 0, 0]]),
        chain(["leftFoot", "leftToes"], [[0, 0.1, 0], [0, -0.1, 0]]),
        chain(["head"], [[0, 0, 0]]),
    ],
    ids=["one joint", "no length", "foot straight down", "head alone"],
)
def test_odd_skeletons_still_get_something_to_look_at(skeleton):
    shape = body(skeleton)
    assert len(shape.triangle) > 0
    assert np.isfinite(shape.point_xyz_m).all()
    np.testing.assert_allclose(np.linalg.norm(shape.normal_xyz, axis=-1), 1, atol=1e-9)
