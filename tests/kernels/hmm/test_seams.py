"""What seams cost: unlike poses, another stance, rough moments, no room."""

import numpy as np
import pytest

from kernels.hmm import seams
from kernels.hmm.seams import Ends, concatenate_ends, own_cost, rough_cost, seam_cost
from kernels.skeleton.canonical import JOINTS


def ends(n, **changed):
    """n motions alike: the same pose at both ends, calm, with room."""
    zero = np.zeros(n)
    made = {
        "start": np.zeros((n, 3)),
        "end": np.zeros((n, 3)),
        "start_limb": np.zeros((n, 4, 5, 3)),
        "end_limb": np.zeros((n, 4, 5, 3)),
        "end_accent": zero,
        "start_jerk": zero + 50.0,
        "end_jerk": zero + 50.0,
        "usual_jerk": zero + 100.0,
        "start_lack": zero,
        "end_lack": zero,
    }
    return Ends(**made | changed)


BOTH = np.array([0, 1])


def test_a_seam_between_equal_calm_poses_costs_the_least():
    np.testing.assert_allclose(seam_cost(ends(2), BOTH, BOTH), seams.SEAM)


def test_poses_and_stance_apart_cost_their_squares():
    apart = ends(2, start=np.array([[0.0, 0, 0], [0.04, 0, 0]]))
    found = seam_cost(apart, BOTH, BOTH) - seams.SEAM
    np.testing.assert_allclose(found, [[0, 0.0016 / seams.POOR_M2]] * 2, atol=1e-12)
    stepped = np.zeros((2, 4, 5, 3))
    stepped[1, 2, :, 0] = seams.STANCE_M
    found = seam_cost(ends(2, start_limb=stepped, usual_jerk=np.full(2, 1e6)), BOTH, BOTH) - seams.SEAM
    np.testing.assert_allclose(found, [[0, 0.5]] * 2, atol=1e-12)  # one of the two feet


def test_a_blend_that_moves_a_hand_far_is_rough_itself():
    far = np.zeros((2, 4, 5, 3))
    far[1, 0, :, 1] = 0.5
    found = seam_cost(ends(2, start_limb=far), BOTH, BOTH) - seams.SEAM
    np.testing.assert_allclose(
        found, [[0, seams.ROUGH * np.log2(seams.BLEND_JERK * 0.5 / 100.0 / seams.CALM) ** 2]] * 2
    )


def test_limbs_are_in_the_order_of_the_joints():
    assert list(seams.LIMBS) == [name for name in JOINTS if name in seams.LIMBS]


def test_a_kick_beside_the_calm_costs_squared_doublings():
    kick = ends(2, end_jerk=np.array([50.0, 400.0 * seams.CALM]))
    found = seam_cost(kick, BOTH, BOTH) - seams.SEAM
    np.testing.assert_allclose(found, [[0, 0], [4 * seams.ROUGH] * 2])
    np.testing.assert_allclose(own_cost(kick)[1], [0, 4 * seams.ROUGH])
    np.testing.assert_allclose(own_cost(kick)[0], 0)


def test_no_clip_is_wilder_than_the_median_one():
    wild = ends(3, usual_jerk=np.array([100.0, 100.0, 800.0]), end_jerk=np.array([50.0, 50.0, 400.0 * seams.CALM]))
    assert seam_cost(wild, np.array([2]), np.array([2]))[0, 0] == pytest.approx(seams.SEAM + 4 * seams.ROUGH)


def test_nothing_usual_is_no_reason():
    assert rough_cost(np.array([5.0]), np.array([0.0])).tolist() == [0.0]


def test_a_blend_past_the_end_of_a_clip_costs():
    lacking = ends(2, end_lack=np.array([0.0, 0.5]))
    np.testing.assert_allclose(seam_cost(lacking, BOTH, BOTH)[1], seams.SEAM + seams.ROOM / 2)


def test_none():
    none = np.zeros(0, np.int64)
    assert seam_cost(ends(0), none, none).shape == (0, 0)
    assert [len(cost) for cost in own_cost(ends(0))] == [0, 0]


def test_clips_are_stacked_in_order():
    both = concatenate_ends([ends(1), ends(2, end_jerk=np.array([1.0, 2.0]))])
    assert both.end_jerk.tolist() == [50.0, 1.0, 2.0]
    assert both.start.shape == (3, 3)


def test_limbs_are_followed_from_where_the_body_stands_and_faces():
    from kernels import rotation

    rng = np.random.default_rng(0)
    position = rng.normal(size=(31, len(JOINTS), 3))
    root = np.tile(rotation.from_heading(0.0), (31, 1))
    asked = {"frame_rate_hz": 30.0, "time_s": np.array([0.5])}
    found = seams.limb_paths(position, root, **asked)
    assert found.shape == (1, 4, 5, 3)
    hips = position[15, 0] * [1, 0, 1]
    np.testing.assert_allclose(found[0, 1, 1], position[12, JOINTS.index("rightHand")] - hips)
    turn = rotation.from_heading(1.0)
    moved = rotation.apply(turn, position) + np.array([3.0, 0.0, -2.0])
    again = seams.limb_paths(moved, rotation.mul(turn, root), **asked)
    np.testing.assert_allclose(again, found, atol=1e-12)
    held = seams.limb_paths(position[:1], root[:1], **asked)
    np.testing.assert_allclose(held[0, :, 0], held[0, :, 4])
