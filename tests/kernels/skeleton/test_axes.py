import numpy as np
import pytest

from kernels import rotation
from kernels.skeleton import axes, kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.synthetic import dancer, rigs
from kernels.types import Skeleton

NAMES = {name: name for name in JOINTS}


@pytest.fixture(scope="module")
def step():
    return dancer.place(dancer.take("step", n_beats=4))


def turned(skeleton, quarter):
    return Skeleton(skeleton.joints, skeleton.parent, rotation.apply(quarter, skeleton.offset_xyz_m))


TO_Z_UP = rotation.from_axis_angle(np.array([1.0, 0, 0]), np.pi / 2)


@pytest.mark.parametrize(
    ("height", "unit_m"),
    [
        (1.75, 1.0),
        (1.1, 1.0),
        (175.0, 0.01),
        (1750.0, 0.001),
        (68.0, 0.0254),
        (31.0, 0.0254 / 0.45),
        (3.4, 0.5),
        (17, 0.1),
    ],
)
def test_unit_by_height(height, unit_m):
    assert axes.metres_per_unit(height) == pytest.approx(unit_m)


def test_no_height_no_unit():
    assert axes.metres_per_unit(0.0) == 1.0


def test_stature_by_the_legs():
    assert axes.stature(CANONICAL, NAMES) == pytest.approx(1.72)
    twisted = rigs.author(dancer.take("idle").clip, rigs.RigPlan(twisted=("leftLowerLeg", "rightFoot"))).skeleton
    assert axes.stature(twisted, NAMES) == pytest.approx(1.72)


def test_quarter_turn_to_y_up_and_back():
    vectors = np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_allclose(axes.vectors_to_y_up(np.array([1.0, 2, 3]), "Z"), [1, 3, -2])
    np.testing.assert_allclose(axes.vectors_from_y_up(axes.vectors_to_y_up(vectors, "Z"), "Z"), vectors)
    np.testing.assert_allclose(axes.vectors_to_y_up(vectors, "Y"), vectors)
    np.testing.assert_allclose(axes.vectors_from_y_up(vectors, "Y"), vectors)


def test_rotations_turn_with_the_vectors():
    rng = np.random.default_rng(1)
    q, v = rotation.normalize(rng.normal(size=(9, 4))), rng.normal(size=(9, 3))
    there = rotation.apply(axes.rotations_to_y_up(q, "Z"), axes.vectors_to_y_up(v, "Z"))
    np.testing.assert_allclose(there, axes.vectors_to_y_up(rotation.apply(q, v), "Z"), atol=1e-12)
    np.testing.assert_allclose(axes.rotations_from_y_up(axes.rotations_to_y_up(q, "Z"), "Z"), q)


def test_a_standing_dancer(step):
    world = axes.infer_world(CANONICAL, NAMES, step)
    assert world == axes.World(1.0, "Y", "replace")
    z_up = axes.infer_world(turned(CANONICAL, TO_Z_UP), NAMES, 100 * rotation.apply(TO_Z_UP, step))
    assert z_up.up_axis == "Z"


def test_motion_goes_before_the_rest_pose(step):
    lying = turned(CANONICAL, TO_Z_UP)
    assert axes.infer_world(lying, NAMES, step).up_axis == "Y"
    assert axes.infer_world(CANONICAL, NAMES, rotation.apply(TO_Z_UP, step)).up_axis == "Z"


def test_one_who_lies_all_the_time_goes_by_rest_pose_and_floor(step):
    on_back = rotation.apply(rotation.from_axis_angle(np.array([1.0, 0, 0]), np.pi / 2), step - [0, 0.9, 0])
    on_back = on_back + np.array([0, 0.1, 0])
    assert axes.infer_world(CANONICAL, NAMES, on_back + np.array([0, 0, 3.0])).up_axis == "Y"
    on_side = rotation.apply(rotation.from_axis_angle(np.array([0.0, 0, 1]), np.pi / 2), step - [0, 0.9, 0])
    assert axes.infer_world(CANONICAL, NAMES, on_side).up_axis == "Y"


def test_the_rule_of_the_roots_offset(step):
    sunk = step - CANONICAL.offset_xyz_m[0]
    assert axes.infer_world(CANONICAL, NAMES, sunk).root_offset_rule == "add"
    assert axes.infer_world(CANONICAL, NAMES, step + np.array([0, 0.3, 0])).root_offset_rule == "replace"
    aside = Skeleton(JOINTS, CANONICAL.parent, CANONICAL.offset_xyz_m + np.eye(22, 1) * [5.0, -0.94, 0])
    assert axes.infer_world(aside, NAMES, step).root_offset_rule == "replace"


def test_one_frame():
    rest = kinematics.rest_position(CANONICAL)[None]
    assert axes.infer_world(CANONICAL, NAMES, rest) == axes.World(1.0, "Y", "replace")


def test_no_body():
    chain = Skeleton(("a", "b"), np.array([-1, 0]), np.array([[0.0, 0, 0], [0, 170, 0]]))
    assert axes.infer_world(chain, None, kinematics.rest_position(chain)[None]) == axes.World(0.01, "Y", "replace")
