import numpy as np
import pytest

from kernels import rotation
from kernels.skeleton import grounding, kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.contacts import FootContacts, find_contacts, foot_slide
from kernels.skeleton.grounding import ANKLES, TOES
from kernels.synthetic import dancer

RATE = 30.0


@pytest.fixture(scope="module")
def step():
    """World positions and orientations of a dancer, and the contacts of the feet."""
    clip = dancer.take("step", n_beats=8).clip
    position, orientation = kinematics.place(clip)
    contacts = find_contacts(position[:, ANKLES], position[:, TOES], frame_rate_hz=RATE)
    return clip, position, orientation, contacts


def feet(position):
    return {"source_ankle_xyz_m": position[:, ANKLES], "source_toes_xyz_m": position[:, TOES]}


def test_a_motion_on_its_own_feet_needs_nothing(step):
    _, position, orientation, contacts = step
    shift = grounding.plant_root(position, contacts=contacts, frame_rate_hz=RATE, **feet(position))
    assert np.abs(shift).max() < 1e-6
    turned = grounding.plant_legs(position, orientation, contacts=contacts, frame_rate_hz=RATE, **feet(position))
    assert rotation.angle_between(turned, orientation).max() < 1e-4


def test_the_root_takes_back_what_it_was_shaken(step):
    _, position, _, contacts = step
    shake = 0.03 * np.stack(
        [np.sin(np.arange(len(position)) / 5), 0 * np.arange(len(position)) + 1, 0 * np.arange(len(position))], 1
    )
    shift = grounding.plant_root(position + shake[:, None], contacts=contacts, frame_rate_hz=RATE, **feet(position))
    mended = position + (shake + shift)[:, None]
    slide = [
        foot_slide(p[:, ANKLES], p[:, TOES], contacts, frame_rate_hz=RATE)
        for p in (position, position + shake[:, None], mended)
    ]
    assert slide[2] - slide[0] < 0.05 * (slide[1] - slide[0])
    np.testing.assert_allclose(mended[..., 1], position[..., 1], atol=1e-4)


def test_without_contacts_nothing_moves_sideways(step):
    _, position, orientation, contacts = step
    never = np.zeros_like(contacts.foot)
    none = FootContacts(never, never, contacts.floor_m, contacts.ankle_height_m, contacts.toes_height_m)
    shift = grounding.plant_root(position, contacts=none, frame_rate_hz=RATE, **feet(position))
    np.testing.assert_allclose(shift[:, [0, 2]], 0, atol=1e-9)
    turned = grounding.plant_legs(position, orientation, contacts=none, frame_rate_hz=RATE, **feet(position))
    np.testing.assert_array_equal(turned, orientation)


def test_a_floor_at_another_height_comes_to_zero(step):
    _, position, _, _ = step
    high = position + np.array([0.0, 0.7, 0.0])
    contacts = find_contacts(high[:, ANKLES], high[:, TOES], frame_rate_hz=RATE)
    shift = grounding.plant_root(high, contacts=contacts, frame_rate_hz=RATE, **feet(high))
    np.testing.assert_allclose(shift[:, 1], -0.7, atol=1e-4)


def test_legs_reach_a_little_and_never_beyond_the_limit(step):
    _, position, orientation, contacts = step
    give = grounding.GroundingGive(leg_limit_rad=np.radians(2.0))
    for size_m in (0.004, 0.2):
        wobble = size_m * np.sin(np.arange(len(position)) / 4)[:, None] * np.array([1.0, 0.0, 0.0])
        shaken = position + wobble[:, None]
        turned = grounding.plant_legs(
            shaken, orientation, contacts=contacts, frame_rate_hz=RATE, give=give, **feet(position)
        )
        angle = rotation.angle_between(turned, orientation)
        assert angle.max() <= np.radians(2.0) + 1e-9
        assert angle[:, [k for k, name in enumerate(JOINTS) if "Leg" not in name]].max() < 1e-9
        mended = kinematics.hang(CANONICAL, shaken[:, 0], turned)
        slide = [foot_slide(p[:, ANKLES], p[:, TOES], contacts, frame_rate_hz=RATE) for p in (position, shaken, mended)]
        assert slide[2] < slide[1]
        if size_m < 0.01:
            assert slide[2] - slide[0] < 0.1 * (slide[1] - slide[0])


def test_straight_legs_do_not_break():
    clip = dancer.take("idle", n_beats=4).clip
    still = np.tile(rotation.IDENTITY, (20, 22, 1))
    position = kinematics.hang(CANONICAL, np.tile(CANONICAL.offset_xyz_m[0], (20, 1)), still)
    contacts = find_contacts(position[:, ANKLES], position[:, TOES], frame_rate_hz=RATE)
    for lift in (0.05, -0.05):
        raised = position + np.array([0.0, lift, 0.0])
        turned = grounding.plant_legs(raised, still, contacts=contacts, frame_rate_hz=RATE, **feet(position))
        assert np.isfinite(turned).all()
        assert rotation.angle_between(turned, still).max() <= np.radians(2.5) + 1e-9
    assert clip.n_frames > 0


def test_toes_stay_above_the_floor_and_feet_in_the_air_are_left_alone(step):
    _, position, orientation, _ = step
    np.testing.assert_allclose(grounding.lift_toes(position, orientation), orientation, atol=1e-12)
    pointed = orientation.copy()
    down = rotation.from_axis_angle(np.array([1.0, 0, 0]), 0.7)
    for k in (*ANKLES, *TOES):
        pointed[:, k] = rotation.mul(orientation[:, k], down)
    low = kinematics.hang(CANONICAL, position[:, 0], pointed)
    assert low[:, TOES, 1].min() < -0.02
    lifted = kinematics.hang(CANONICAL, position[:, 0], grounding.lift_toes(low, pointed))
    assert lifted[:, TOES, 1].min() > 0.0099
    np.testing.assert_allclose(lifted[:, ANKLES], low[:, ANKLES], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(lifted[:, TOES] - lifted[:, ANKLES], axis=-1), np.hypot(0.06, 0.13))


@pytest.mark.parametrize("n", [1, 2, 3])
def test_few_frames(step, n):
    _, position, orientation, _ = step
    position, orientation = position[:n], orientation[:n]
    contacts = find_contacts(position[:, ANKLES], position[:, TOES], frame_rate_hz=RATE)
    shift = grounding.plant_root(position, contacts=contacts, frame_rate_hz=RATE, **feet(position))
    assert np.abs(shift).max() < 1e-6
    turned = grounding.plant_legs(position, orientation, contacts=contacts, frame_rate_hz=RATE, **feet(position))
    assert rotation.angle_between(turned, orientation).max() < 1e-4


def crouched(knee_rad=0.8):
    """World positions and orientations of one frame with bent knees, feet level."""
    local = np.tile(rotation.IDENTITY, (1, 22, 1))
    for side in ("left", "right"):
        for part, angle in (("UpperLeg", -knee_rad / 2), ("LowerLeg", knee_rad), ("Foot", -knee_rad / 2)):
            local[:, JOINTS.index(side + part)] = rotation.from_axis_angle(np.array([1.0, 0, 0]), angle)
    return kinematics.forward(CANONICAL, np.array([[0.0, 0.9, 0.0]]), local)


@pytest.mark.parametrize("shift", [(0.0, 0.05, 0.0), (0.0, -0.02, 0.0), (0.04, 0.0, 0.0), (0.0, 0.0, -0.06)])
def test_ankles_move_as_far_as_they_are_asked_to_and_feet_keep_their_turn(shift):
    position, orientation = crouched()
    both = np.array([[shift, np.zeros(3)]])
    bent = grounding.bend_legs(position, orientation, both, limit_rad=1.0)
    moved = kinematics.hang(CANONICAL, position[:, 0], bent)
    np.testing.assert_allclose(moved[:, ANKLES] - position[:, ANKLES], both, atol=1e-9)
    np.testing.assert_allclose(bent[:, ANKLES], orientation[:, ANKLES])


def test_legs_give_way_up_to_the_limit_and_an_ankle_comes_nearer_for_it():
    position, orientation = crouched()
    shift = np.array([[[0.0, 0.2, 0.0], [0.0, 0.2, 0.0]]])
    bent = grounding.bend_legs(position, orientation, shift, limit_rad=0.05)
    turned = rotation.angle_between(bent, orientation)
    assert turned.max() == pytest.approx(0.05, rel=0.2)
    assert turned.max() <= 0.05 + 1e-9
    risen = kinematics.hang(CANONICAL, position[:, 0], bent)[:, ANKLES, 1] - position[:, ANKLES, 1]
    assert (risen > 0.005).all()


def test_an_ankle_out_of_reach_comes_as_near_as_the_straight_leg_goes():
    position, orientation = crouched()
    far = np.array([[[0.0, -0.5, 0.0]] * 2])
    moved = kinematics.hang(CANONICAL, position[:, 0], grounding.bend_legs(position, orientation, far, limit_rad=9.0))
    hip, ankle = moved[:, grounding.THIGHS], moved[:, ANKLES]
    np.testing.assert_allclose(np.linalg.norm(ankle - hip, axis=-1), grounding.LEG_M, atol=1e-6)


def test_a_leg_comes_back_to_its_source_within_the_time_to_fade():
    shift = np.zeros((21, 3))
    shift[10] = [0.0, 0.04, 0.0]
    planted = np.arange(21) == 10
    faded = grounding._fade(shift, planted, 5)[:, 1] / 0.04
    np.testing.assert_allclose(faded, faded[::-1])
    assert (faded[[4, 5]] == 0).all()
    assert faded[10] == 1
    assert (np.diff(faded[5:11]) > 0).all()
    assert not grounding._fade(np.zeros((4, 3)), np.zeros(4, bool), 5).any()


def test_where_nothing_is_planted_the_lower_foot_is_taken_to_the_floor(step):
    _, position, _, contacts = step
    high = position[:1].repeat(40, axis=0) + np.array([0.0, 0.3, 0.0])
    high[:, TOES[1], 1] += 0.1
    never = np.zeros((40, 2), bool)
    none = FootContacts(never, never, 0.0, contacts.ankle_height_m, contacts.toes_height_m)
    source = {"source_ankle_xyz_m": high[:, ANKLES], "source_toes_xyz_m": high[:, TOES]}
    sunk = high - np.array([0.0, 0.05, 0.0])  # the canonical body stands 5 cm lower than the source
    shift = grounding.plant_root(sunk, contacts=none, frame_rate_hz=RATE, **source)
    wanted = grounding.TOES_HEIGHT_M - contacts.toes_height_m + 0.05
    np.testing.assert_allclose(shift[:, 1], wanted, atol=1e-3)


def test_an_ankle_that_may_not_come_all_the_way_goes_the_way_it_should(step):
    """Far to the side: within the limit it goes there, and neither up nor down."""
    _, position, orientation, _ = step
    bent = position[5:6].copy()
    sideways = np.tile([0.3, 0.0, 0.0], (1, 2, 1))
    turned = grounding.bend_legs(bent, orientation[5:6], sideways, limit_rad=np.radians(4.0))
    moved = kinematics.hang(CANONICAL, bent[:, 0], turned)[0, ANKLES] - bent[0, ANKLES]
    assert (moved[:, 0] > 0.02).all()
    assert (np.abs(moved[:, 1:]) < 0.05 * moved[:, :1]).all()
