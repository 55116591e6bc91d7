"""How a following clip stands at a seam: on its planted feet."""

import numpy as np
import pytest

from kernels import rotation
from kernels.assembly.stance import clip_contacts, meet, planted_share
from kernels.skeleton import grounding, kinematics
from kernels.skeleton.canonical import CANONICAL
from kernels.skeleton.contacts import FootContacts

FEET = grounding.ANKLES + grounding.TOES


@pytest.fixture
def standing():
    """A body at rest, (22, 3)."""
    return kinematics.rest_position(CANONICAL)


def moved(position, angle_rad, shift):
    return rotation.apply(rotation.from_heading(angle_rad), position) + shift


@pytest.mark.parametrize("angle_rad", [-0.2, 0.0, 0.15])
def test_feet_turned_and_moved_under_a_body_come_back(standing, angle_rad):
    other = standing.copy()
    other[FEET] = rotation.apply(rotation.from_heading(-angle_rad), standing[FEET] - [0.03, 0.0, -0.02])
    angle, shift = meet(standing, other, np.ones((2, 2)), heading_rad=0.0)
    apart = np.linalg.norm(moved(other, angle, shift)[FEET] - standing[FEET], axis=-1)
    assert apart.max() < 0.3 * np.linalg.norm(other[FEET] - standing[FEET], axis=-1).max()
    assert abs(angle - angle_rad) < 0.3 * abs(angle_rad) + 0.01


def test_nothing_planted_moves_nothing(standing):
    angle, shift = meet(standing, standing + np.array([0.1, 0.0, 0.1]), np.zeros((2, 2)), heading_rad=1.0)
    assert angle == 0
    np.testing.assert_array_equal(shift, 0)


def test_the_same_stance_stays(standing):
    angle, shift = meet(standing, standing, np.ones((2, 2)), heading_rad=0.4)
    assert angle == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(shift, 0, atol=1e-12)


def test_the_foot_that_bears_the_weight_decides(standing):
    """A body over its left foot: a stance 10 cm wider is given to the right one."""
    lean = standing.copy()
    lean[[k for k in range(22) if k not in FEET], 0] += standing[grounding.ANKLES[0], 0]
    wide = lean.copy()
    wide[[grounding.ANKLES[1], grounding.TOES[1]], 0] -= 0.1
    angle, shift = meet(lean, wide, np.ones((2, 2)), heading_rad=0.0)
    apart = np.linalg.norm(moved(wide, angle, shift)[grounding.ANKLES] - lean[grounding.ANKLES], axis=-1)
    assert apart[0] < 0.02
    assert apart[1] > 0.08


def test_it_does_not_matter_where_the_two_stand(standing):
    other = standing.copy()
    other[FEET] = moved(standing[FEET], 0.1, [0.02, 0.0, 0.01])
    angle, shift = meet(standing, other, np.ones((2, 2)), heading_rad=0.0)
    here, there = moved(standing, 1.1, [3.0, 0.0, -2.0]), moved(other, 1.1, [3.0, 0.0, -2.0])
    again, far = meet(here, there, np.ones((2, 2)), heading_rad=1.1)
    assert again == pytest.approx(angle, abs=1e-12)
    np.testing.assert_allclose(
        moved(there, again, far), moved(moved(other, angle, shift), 1.1, [3.0, 0.0, -2.0]), atol=1e-9
    )


def test_share_of_a_stretch():
    stands = np.zeros((10, 2), bool)
    stands[4:, 0] = True
    found = planted_share(FootContacts(stands, ~stands, 0.0, 0.0, 0.0), 0.2, 0.5, 10.0)
    np.testing.assert_allclose(found, [[0.5, 0.0], [0.5, 1.0]])
    np.testing.assert_allclose(planted_share(FootContacts(stands, stands, 0.0, 0.0, 0.0), 9.0, 9.5, 10.0)[0], [1, 0])


def test_a_standing_clip_stands(clips):
    clip = clips["twist"]
    position, _ = kinematics.place(clip)
    found = clip_contacts(clip, position)
    assert found.ankle_height_m == grounding.ANKLE_HEIGHT_M
    assert found.foot.mean() > 0.9


def test_a_body_beside_its_feet_still_rests_a_little_on_the_further_one(standing):
    """Hips half a metre to the left of both feet: the right one counts a twentieth, not nothing and not less."""
    lean = standing.copy()
    lean[[k for k in range(22) if k not in FEET], 0] += 0.5
    wide = lean.copy()
    wide[[grounding.ANKLES[1], grounding.TOES[1]], 2] += 0.1
    right = np.zeros((2, 2))
    right[:, 1] = 1.0
    angle, shift = meet(lean, wide, right, heading_rad=0.0)
    assert np.linalg.norm(moved(wide, angle, shift) - wide, axis=-1).max() > 0.01


def test_a_faint_memory_of_root_and_heading_keeps_a_body_facing_where_it_faced(standing):
    """One planted point alone could be met by any turn: the body does not turn."""
    other = standing.copy()
    other[FEET] += [0.04, 0.0, 0.0]
    one = np.zeros((2, 2))
    one[1, 0] = 1.0
    angle, shift = meet(standing, other, one, heading_rad=0.0)
    assert abs(angle) < 0.3
    toe = grounding.TOES[0]
    assert np.linalg.norm(moved(other, angle, shift)[toe] - standing[toe]) < 0.02
    assert shift[1] == 0


def test_points_count_as_surely_as_they_are_planted(standing):
    """The left foot wants to go one way and the right the other: the surer one has its way."""
    other = standing.copy()
    other[[grounding.ANKLES[0], grounding.TOES[0]], 2] += 0.1
    other[[grounding.ANKLES[1], grounding.TOES[1]], 2] -= 0.1
    for surer in (0, 1):
        planted = np.full((2, 2), 0.05)
        planted[:, surer] = 1.0
        angle, shift = meet(standing, other, planted, heading_rad=0.0)
        off = np.linalg.norm((moved(other, angle, shift) - standing)[grounding.ANKLES], axis=-1)
        assert off[surer] < off[1 - surer]


def test_a_stretch_of_one_instant_is_its_nearest_frame():
    stands = np.zeros((10, 2), bool)
    stands[4] = True
    contacts = FootContacts(stands, stands, 0.0, 0.0, 0.0)
    np.testing.assert_array_equal(planted_share(contacts, 0.42, 0.42, 10.0), np.ones((2, 2)))
    np.testing.assert_array_equal(planted_share(contacts, 0.46, 0.46, 10.0), np.zeros((2, 2)))
    np.testing.assert_array_equal(planted_share(contacts, -5.0, -4.0, 10.0), np.zeros((2, 2)))
    np.testing.assert_allclose(planted_share(contacts, 0.3, 0.5, 10.0), np.full((2, 2), 1 / 3))
