"""Where pieces of clips join: what their ends cost."""

import numpy as np
import pytest

from kernels.matching.piece_joints import MARGIN_COST, clip_directions, joints_of
from kernels.matching.price import MatchPiece
from kernels.skeleton.canonical import CANONICAL
from kernels.skeleton.naming import map_joints
from kernels.skeleton.retarget import retarget
from kernels.synthetic.dancer import take


@pytest.fixture(scope="module")
def stepping():
    moved = retarget(take("step", n_beats=8).clip, map_joints(CANONICAL))
    return clip_directions(moved.position_xyz_m, moved.rotation_wxyz[:, 0], 30.0)


def test_directions_are_unit_vectors_at_120_hz_and_a_whole_take_is_usable(stepping):
    direction, (first_s, last_s) = stepping
    np.testing.assert_allclose(np.linalg.norm(direction, axis=-1), 1.0, atol=1e-6)
    assert direction.shape[1:] == (21, 3)
    assert len(direction) == pytest.approx(120 * (last_s - first_s) + 1, abs=5)


def joint(stepping, before, after, blend_s):
    pieces = [[MatchPiece("s", *before, 1, 0.0, 0.0, 0.0)], [MatchPiece("s", *after, 1, 0.0, 0.0, 0.0)]]
    spans = np.array([0.0, 1.0, 2.0])
    _, (one,) = joints_of(pieces, spans, [("s", *stepping)], blend_s=blend_s, seam_weight=0.5)
    return one


def test_a_clip_that_goes_on_joins_itself_at_no_price(stepping):
    one = joint(stepping, (0.5, 1.5), (1.5, 2.5), 0.4)
    assert one.cost[0, 0] == pytest.approx(0.0, abs=1e-9)
    assert one.is_connected[0, 0]


def test_a_blend_without_any_room_costs_the_margin(stepping):
    end_s = stepping[1][1]
    roomless, free = (joint(stepping, (end_s - 1.0, end_s), (1.0, 2.0), blend_s) for blend_s in (0.4, 0.0))
    assert roomless.cost[0, 0] - free.cost[0, 0] == pytest.approx(MARGIN_COST)


@pytest.mark.parametrize(("pace", "room_s", "lacks"), [(0.5, 0.15, 0.0), (2.0, 0.3, 0.25), (1.0, 0.15, 0.25)])
def test_room_for_a_blend_is_counted_at_the_clips_own_pace(stepping, pace, room_s, lacks):
    end_s = stepping[1][1] - room_s
    with_blend, free = (
        joint(stepping, (end_s - pace, end_s), (1.0, 1.0 + pace), blend_s).cost[0, 0] for blend_s in (0.4, 0.0)
    )
    assert with_blend - free == pytest.approx(MARGIN_COST * lacks)


def test_of_one_span_there_is_no_joint(stepping):
    _, joints = joints_of(
        [[MatchPiece("s", 0.0, 1.0, 1, 0.0, 0.0, 0.0)]],
        np.array([0.0, 1.0]),
        [("s", *stepping)],
        blend_s=0.4,
        seam_weight=0.5,
    )
    assert joints == []
