"""The rest pose of a rig in any unit and axes, and a dance on its joints."""

import numpy as np
import pytest

from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.body_fit import fit
from kernels.skeleton.body_measure import measure
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.naming import map_joints
from kernels.skeleton.retarget import retarget
from kernels.skeleton.rig_joints import (
    UNEVEN,
    RestPose,
    box_around,
    local_matrices,
    rest_pose,
    resting_clip,
    rig_moves,
    similarity,
    upright,
)
from kernels.synthetic.dancer import take
from kernels.types import Clip

QUARTER = np.array([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])
"""A quarter turn about Z: X goes to Y."""


def matrix_of(turn, scale=1.0, move=(0.0, 0.0, 0.0)):
    """(4, 4), rows times matrix."""
    found = np.eye(4)
    found[:3, :3] = scale * rotation.to_matrix(np.asarray(turn)).T
    found[3, :3] = move
    return found


@pytest.fixture
def chain():
    """A root that turns and doubles, a child that turns and triples, a grandchild; and a second root."""
    parent = np.array([-1, 0, 1, -1])
    move = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 5.0, 0.0]])
    turn = np.array([QUARTER, QUARTER, rotation.IDENTITY, rotation.IDENTITY])
    return RestPose(parent, move, turn, np.array([2.0, 3.0, 1.0, 7.0]))


def test_scales_turns_and_places_add_up_from_the_roots(chain):
    np.testing.assert_array_equal(chain.total_scale, [2, 6, 6, 7])
    np.testing.assert_allclose(rotation.apply(chain.turned_wxyz, np.array([1.0, 0.0, 0.0]))[1], [-1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(chain.position, [[1, 0, 0], [1, 2, 0], [-5, 2, 0], [0, 5, 0]], atol=1e-12)


def test_a_rest_pose_is_read_from_matrices_local_or_not(chain):
    local = np.array(
        [matrix_of(q, s, t) for q, s, t in zip(chain.rotation_wxyz, chain.scale, chain.translation, strict=True)]
    )
    whole = local.copy()
    for k, p in enumerate(chain.parent):
        whole[k] = local[k] @ whole[p] if p >= 0 else local[k]
    np.testing.assert_allclose(local_matrices(whole, chain.parent), local, atol=1e-12)
    found = rest_pose(local, chain.parent)
    np.testing.assert_allclose(found.scale, chain.scale)
    np.testing.assert_allclose(found.translation, chain.translation)
    assert rotation.angle_between(found.rotation_wxyz, chain.rotation_wxyz).max() < 1e-9
    np.testing.assert_allclose(found.position, whole[:, 3, :3], atol=1e-12)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_rest_pose_is_finite(value):
    local = np.tile(np.eye(4), (2, 1, 1))
    local[1, 3, 0] = value
    with pytest.raises(ValueError, match="want a finite rest pose"):
        rest_pose(local, np.array([-1, 0]))


def test_a_rest_pose_that_shears_names_its_joint():
    local = np.tile(np.eye(4), (2, 1, 1))
    local[1, 0, 1] = 0.5
    with pytest.raises(ValueError, match="want the rest transform of joint 1 to turn, move and scale evenly"):
        rest_pose(local, np.array([-1, 0]))


def test_a_similarity_is_a_scale_and_a_turn():
    scale, turn = similarity(matrix_of(QUARTER, 0.01)[:3, :3], "it")
    assert scale == pytest.approx(0.01)
    assert rotation.angle_between(turn, QUARTER) < 1e-9


@pytest.mark.parametrize(
    "matrix",
    [
        np.diag([1.0, 1.0, -1.0]),
        np.zeros((3, 3)),
        np.array([[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        np.diag([1.0, 1.0, 1.0 + 2 * UNEVEN]),
    ],
    ids=["mirror", "flat", "shear", "uneven"],
)
def test_what_does_more_is_refused(matrix):
    with pytest.raises(ValueError, match="want it to turn, move and scale evenly, got a shear, a mirror or uneven"):
        similarity(matrix, "it")


def test_scales_may_be_uneven_by_less_than_a_hundredth():
    assert similarity(np.diag([1.0, 1.0, 1.0 + UNEVEN / 2]), "it")[0] == pytest.approx(1 + UNEVEN / 6)


def test_several_roots_hang_from_one_at_the_origin():
    place = np.array([[0.0, 1.0, 0.0], [0.0, 3.0, 0.0], [4.0, 0.0, 0.0]])
    one = upright(["a", "b", "c"], np.array([-1, 0, 0]), place)
    assert one.joints == ("a", "b", "c")
    assert one.parent.tolist() == [-1, 0, 0]
    np.testing.assert_array_equal(one.offset_xyz_m, [[0, 1, 0], [0, 2, 0], [4, -1, 0]])
    two = upright(["a", "b", "c"], np.array([-1, 0, -1]), place)
    assert two.joints == ("(no joint)", "a", "b", "c")
    assert two.parent.tolist() == [-1, 0, 1, 0]
    np.testing.assert_array_equal(kinematics.rest_position(two), [[0, 0, 0], *place])


def test_a_resting_clip_stands_at_rest():
    still = resting_clip(CANONICAL)
    assert still.n_frames == 1
    np.testing.assert_allclose(kinematics.place(still)[0][0], kinematics.rest_position(CANONICAL))


@pytest.mark.parametrize("has_second_root", [False, True])
def test_a_dance_on_a_turned_rig_in_inches_stands_where_the_figure_does(has_second_root):
    made = take("step", n_beats=4, interval_s=0.5).clip
    moved = retarget(made, map_joints(made.skeleton))
    dance = Clip(CANONICAL, made.frame_rate_hz, moved.root_xyz_m, moved.rotation_wxyz)
    scale, turn, shift = 0.0254, QUARTER, np.array([0.0, 0.3, 0.0])
    rest_m = kinematics.rest_position(CANONICAL)
    parent, names = CANONICAL.parent.copy(), list(JOINTS)
    if has_second_root:
        parent, names, rest_m = np.append(parent, -1), [*names, "prop"], np.append(rest_m, [[1.0, 0.0, 0.0]], axis=0)
    there = rotation.apply(rotation.inv(turn), rest_m - shift) / scale
    own = there - np.where((parent >= 0)[:, None], there[parent], 0.0)
    rest = RestPose(parent, own, np.tile(rotation.IDENTITY, (len(names), 1)), np.ones(len(names)))
    body = upright(names, parent, rest_m)
    character = measure(resting_clip(body), map_joints(body), floor_m=0.0)
    fitted = fit(dance, character.figure)
    found = rig_moves(fitted, character, rest, scale=scale, turn_wxyz=turn, shift_xyz_m=shift)
    assert found.rotation_wxyz.shape == (dance.n_frames, len(names), 4)
    # Placed by their own local samples, joints stand in the world where they are said to, and where the figure's do.
    place, world = found.translation.copy(), found.rotation_wxyz.copy()
    for k, p in enumerate(parent.tolist()):
        if p >= 0:
            place[:, k] = place[:, p] + rotation.apply(world[:, p], found.translation[:, k])
            world[:, k] = rotation.mul(world[:, p], found.rotation_wxyz[:, k])
    np.testing.assert_allclose(scale * rotation.apply(turn, place) + shift, found.position_xyz_m, atol=1e-9)
    limbs = [k for k, name in enumerate(JOINTS) if name.endswith(("Arm", "Hand", "Leg", "Foot"))]
    np.testing.assert_allclose(found.position_xyz_m[:, limbs], kinematics.place(fitted)[0][:, limbs], atol=1e-3)
    hips = JOINTS.index("hips")
    still = np.delete(found.translation, hips, axis=1)
    np.testing.assert_array_equal(still, np.broadcast_to(np.delete(own, hips, axis=0), still.shape))
    assert np.ptp(found.translation[:, hips], axis=0).max() > 1


def test_a_box_turned_is_held_by_a_wider_one():
    low, high = np.array([-1.0, -1.0, 0.0]), np.array([1.0, 1.0, 2.0])
    eighth = np.array([np.cos(np.pi / 8), 0.0, 0.0, np.sin(np.pi / 8)])
    found = box_around(low, high, matrix_of(eighth, 2.0, (0.0, 0.0, 1.0)))
    half = np.sqrt(2) / 2
    np.testing.assert_allclose(found, [[-half, -half, -0.5], [half, half, 0.5]], atol=1e-12)


def test_a_root_stands_as_it_is_turned_whatever_the_last_joint_does():
    half = rotation.from_axis_angle(np.array([1.0, 0.0, 0.0]), 1.0)
    pose = RestPose(np.array([-1, 0]), np.zeros((2, 3)), np.array([QUARTER, half]), np.ones(2))
    np.testing.assert_allclose(pose.turned_wxyz, [QUARTER, rotation.mul(QUARTER, half)], atol=1e-12)
