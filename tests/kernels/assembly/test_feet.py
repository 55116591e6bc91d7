"""Planted feet: found through the lineage, held, and nothing else moved."""

from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.assembly.blend import Dance, Lineage, assemble
from kernels.assembly.feet import SAY, _within_reach, lock_feet, planted_feet
from kernels.assembly.foot_quality import foot_measures
from kernels.assembly.one_frame_flips import find_flips
from kernels.assembly.seam_quality import seam_measures
from kernels.assembly.stance import clip_contacts
from kernels.skeleton import grounding, kinematics
from kernels.skeleton.canonical import CANONICAL
from kernels.skeleton.contacts import FootContacts


@pytest.fixture
def hops(phrases):
    """Five phrases of different clips, sped up and slowed down."""
    return phrases(
        ("step", 1.0, 4, 0.5, 0.46),
        ("twist", 1.0, 4, 0.55, 0.5),
        ("wave", 2.0, 4, 0.5, 0.53),
        ("step", 2.5, 4, 0.5, 0.5),
    )


@pytest.fixture
def dance(hops, clips):
    return assemble(hops, clips, skeleton=CANONICAL, frame_rate_hz=60.0, duration_s=float(hops.song_end_s[-1]))


def slide(dance, steps, clips):
    found = {m.name: m.value for m in foot_measures(dance, steps, clips)}
    return found["foot_slide_cm_per_s"], found["source_foot_slide_cm_per_s"]


def test_contacts_come_from_the_clips(dance, hops, clips):
    planted = planted_feet(dance, hops, clips)
    position, _ = kinematics.place(clips["step"])
    own = clip_contacts(clips["step"], position)
    frame = 30
    at = round(dance.lineage.clip_time_s[frame] * clips["step"].frame_rate_hz)
    np.testing.assert_array_equal(planted.toes[frame], own.toes[at])
    np.testing.assert_array_equal(planted.ankle[frame], own.ankle[at])
    assert planted.foot.any()


def test_in_the_middle_of_a_blend_both_clips_must_stand(clips, phrases):
    hops = phrases(
        *((name, 1.0 + 0.13 * k, 2, 0.5, 0.5) for k, name in enumerate(["step", "rock", "wave", "step"] * 4))
    )
    dance = assemble(hops, clips, skeleton=CANONICAL, frame_rate_hz=60.0, duration_s=float(hops.song_end_s[-1]))
    planted, line = planted_feet(dance, hops, clips), dance.lineage
    own = {name: clip_contacts(clip, kinematics.place(clip)[0]).toes for name, clip in clips.items()}

    def stands(step_index, time_s):
        clip = hops.clip_id[step_index]
        return own[clip][round(time_s * clips[clip].frame_rate_hz)]

    n_differ = 0
    for i in np.flatnonzero(line.blend_weight > 0):
        first = stands(line.step_index[i], line.clip_time_s[i])
        second = stands(line.blend_step_index[i], line.blend_time_s[i])
        wanted = first & second if line.blend_weight[i] > SAY else first
        np.testing.assert_array_equal(planted.toes[i], wanted)
        n_differ += int((wanted != first).any())
    assert n_differ > 0


def test_locked_feet_slide_less(dance, hops, clips):
    planted = planted_feet(dance, hops, clips)
    before, source = slide(dance, hops, clips)
    after, _ = slide(lock_feet(dance, planted), hops, clips)
    assert before > 1.2 * source
    assert after < before / 3
    assert after < source + 0.5


def test_bones_keep_their_lengths_and_seams_stay_smooth(dance, hops, clips):
    locked = lock_feet(dance, planted_feet(dance, hops, clips))
    bone = np.linalg.norm(locked.position_xyz_m[:, 1:] - locked.position_xyz_m[:, CANONICAL.parent[1:]], axis=-1)
    np.testing.assert_allclose(
        bone, np.linalg.norm(CANONICAL.offset_xyz_m[1:], axis=-1)[None].repeat(len(bone), 0), atol=1e-9
    )
    np.testing.assert_allclose(np.linalg.norm(locked.rotation_wxyz, axis=-1), 1, atol=1e-9)
    rough, free = (
        {m.name: m.value for m in seam_measures(made, hops, clips, skeleton=CANONICAL)} for made in (locked, dance)
    )
    assert rough["seam_jerk_ratio"] < 1.1 * free["seam_jerk_ratio"]
    assert rough["seam_jerk_worst_ratio"] < 1.1 * free["seam_jerk_worst_ratio"]
    assert locked.lineage is dance.lineage


def test_a_dragged_foot_is_held():
    """A standing body pushed sideways at 10 cm/s: the planted feet stay behind, as far as creep allows."""
    n, rate = 120, 60.0
    rest = np.tile([1.0, 0.0, 0.0, 0.0], (n, 22, 1))
    root = np.tile(CANONICAL.offset_xyz_m[0], (n, 1))
    root[:, 0] += 0.1 * np.arange(n) / rate
    position, _ = kinematics.forward(CANONICAL, root, rest)
    none = np.zeros(n, int)
    pushed = Dance(
        rate, root, rest, position, Lineage(none, np.arange(n) / rate, none - 1, np.full(n, np.nan), np.zeros(n))
    )
    stands = np.zeros((n, 2), bool)
    stands[30:60] = True
    planted = FootContacts(stands, stands, 0.0, grounding.ANKLE_HEIGHT_M, grounding.TOES_HEIGHT_M)
    held = lock_feet(pushed, planted)
    feet = held.position_xyz_m[30:60][:, grounding.ANKLES]
    assert np.ptp(feet[..., 0], axis=0).max() < 0.012
    assert np.ptp(pushed.position_xyz_m[30:60][:, grounding.ANKLES][..., 0], axis=0).min() > 0.045
    nothing = FootContacts(
        np.zeros_like(stands), np.zeros_like(stands), 0.0, grounding.ANKLE_HEIGHT_M, grounding.TOES_HEIGHT_M
    )
    np.testing.assert_allclose(lock_feet(pushed, nothing).position_xyz_m, position, atol=1e-3)


def held_apart(width_m, *, bend_rad=0.3):
    """Two stances side by side, the second wider, mixed over 0.4 s: what a seam does to planted feet; rate 60."""
    n, rate = 180, 60.0
    bend = rotation.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.array([-bend_rad, 2 * bend_rad, -bend_rad]))
    q = np.tile(rotation.IDENTITY, (22, 1))
    for side in range(2):
        for k, joints in enumerate((grounding.THIGHS, grounding.KNEES, grounding.ANKLES)):
            q[joints[side]] = bend[k]
    position, orientation = kinematics.forward(CANONICAL, CANONICAL.offset_xyz_m[:1], q[None])
    wide = np.zeros((1, 2, 3))
    wide[0, 0, 0], wide[0, 1, 0] = width_m / 2, -width_m / 2
    spread = kinematics.to_local(CANONICAL, grounding.bend_legs(position, orientation, wide, limit_rad=1.0))[0]
    share = np.clip((np.arange(n) / rate - 1.3) / 0.4, 0, 1)
    mixed = rotation.slerp(np.tile(q, (n, 1, 1)), np.tile(spread, (n, 1, 1)), (share**2 * (3 - 2 * share))[:, None])
    root = np.tile(CANONICAL.offset_xyz_m[:1], (n, 1))
    position, _ = kinematics.forward(CANONICAL, root, mixed)
    step = (np.arange(n) >= 90).astype(int)
    weight = np.minimum(share, 1 - share)
    lineage = Lineage(step, np.arange(n) / rate, np.where(weight > 0, 1 - step, -1), np.full(n, np.nan), weight)
    stands = np.ones((n, 2), bool)
    planted = FootContacts(stands, stands, 0.0, grounding.ANKLE_HEIGHT_M, grounding.TOES_HEIGHT_M)
    return Dance(rate, root, mixed, position, lineage), planted


@pytest.mark.parametrize("bend_rad", [0.05, 0.3])
def test_stances_of_other_widths_hold_their_feet_and_their_knees(bend_rad):
    mixed, planted = held_apart(0.1, bend_rad=bend_rad)
    held = lock_feet(mixed, planted)
    feet = held.position_xyz_m[:, grounding.ANKLES]
    blend = slice(78, 103)
    assert np.ptp(mixed.position_xyz_m[blend][:, grounding.ANKLES][..., 0], axis=0).min() > 0.045
    assert np.ptp(feet[blend][..., 0], axis=0).max() < 0.006
    assert np.abs(np.diff(feet[..., 0], axis=0)).max() * 60 < 0.02
    knee = held.position_xyz_m[:, grounding.KNEES] - held.position_xyz_m[:, grounding.THIGHS]
    shin = held.position_xyz_m[:, grounding.ANKLES] - held.position_xyz_m[:, grounding.KNEES]
    angle = np.arccos((knee * shin).sum(-1) / np.linalg.norm(knee, axis=-1) / np.linalg.norm(shin, axis=-1))
    np.testing.assert_allclose(angle, 2 * bend_rad, atol=0.1)


def test_a_foot_comes_home_when_it_is_lifted():
    mixed, planted = held_apart(0.1)
    lifted = planted.ankle.copy()
    lifted[40:70] = lifted[140:170] = False
    free = lock_feet(mixed, FootContacts(lifted, lifted, 0.0, planted.ankle_height_m, planted.toes_height_m))
    away = np.abs(free.position_xyz_m - mixed.position_xyz_m)[:, grounding.ANKLES, 0].max(axis=1)
    assert away[120] > 0.015
    assert away[[0, 179]].max() < 0.4 * away[120]


def test_a_foot_that_swings_through_the_floor_is_raised():
    mixed, planted = held_apart(0.0)
    sunk = mixed.root_xyz_m.copy()
    sunk[140:144, 1] -= np.array([0.05, 0.1, 0.1, 0.05])
    position, _ = kinematics.forward(CANONICAL, sunk, mixed.rotation_wxyz)
    low = Dance(mixed.frame_rate_hz, sunk, mixed.rotation_wxyz, position, mixed.lineage)
    held = lock_feet(low, planted).position_xyz_m[:, grounding.TOES, 1]
    assert position[:, grounding.TOES, 1].min() < -0.03
    assert held.min() > -1e-6
    np.testing.assert_allclose(held[:139], position[:139, grounding.TOES, 1], atol=2e-3)


def knee_angles(position):
    knee = position[:, grounding.KNEES] - position[:, grounding.THIGHS]
    shin = position[:, grounding.ANKLES] - position[:, grounding.KNEES]
    return np.arccos((knee * shin).sum(-1) / np.linalg.norm(knee, axis=-1) / np.linalg.norm(shin, axis=-1))


@pytest.mark.parametrize("bend_rad", [0.1, 0.3])
def test_hips_sink_with_feet_held_apart_so_that_knees_keep_their_bend(bend_rad):
    mixed, planted = held_apart(0.2, bend_rad=bend_rad)
    held = lock_feet(mixed, planted)
    off = np.abs(knee_angles(held.position_xyz_m) - knee_angles(mixed.position_xyz_m))
    assert off.max() < 0.01
    assert np.abs(held.root_xyz_m[:, 1] - mixed.root_xyz_m[:, 1]).max() > 0.004


def turned_in_place(angle_rad, *, is_blend, facing_rad=0.0):
    """A standing body that turns about the vertical within 0.4 s, on flat planted feet; rate 60."""
    mixed, planted = held_apart(0.0)
    share = np.clip((mixed.time_s - 1.3) / 0.4, 0, 1)
    local = mixed.rotation_wxyz.copy()
    local[:, 0] = rotation.mul(rotation.from_heading(facing_rad + angle_rad * share**2 * (3 - 2 * share)), local[:, 0])
    position, _ = kinematics.forward(CANONICAL, mixed.root_xyz_m, local)
    lineage = mixed.lineage if is_blend else replace(mixed.lineage, blend_weight=np.zeros(len(local)))
    return replace(mixed, rotation_wxyz=local, position_xyz_m=position, lineage=lineage), planted


def foot_turn_rad(position):
    """How far the feet turn from the first of the frames around the blend to the last, left and right."""
    foot = position[:, grounding.TOES] - position[:, grounding.ANKLES]
    heading = np.unwrap(np.arctan2(foot[..., 0], foot[..., 2]), axis=0)
    return heading[103] - heading[77]


def test_flat_feet_do_not_turn_through_a_blend_but_do_as_their_clip_does():
    through, planted = turned_in_place(0.2, is_blend=True)
    np.testing.assert_allclose(foot_turn_rad(through.position_xyz_m), 0.2, atol=0.01)
    assert np.abs(foot_turn_rad(lock_feet(through, planted).position_xyz_m)).max() < 0.02
    within, _ = turned_in_place(0.2, is_blend=False)
    np.testing.assert_allclose(foot_turn_rad(lock_feet(within, planted).position_xyz_m), 0.2, atol=0.01)


def test_feet_that_turn_past_the_back_do_not_go_all_the_way_round():
    through, planted = turned_in_place(0.2, is_blend=True, facing_rad=np.pi - 0.1)
    held = lock_feet(through, planted)
    assert np.abs(foot_turn_rad(held.position_xyz_m)).max() < 0.02
    assert np.abs(held.position_xyz_m - through.position_xyz_m)[:, grounding.TOES].max() < 0.05


def test_feet_on_their_heels_turn_freely_through_a_blend():
    through, planted = turned_in_place(0.2, is_blend=True)
    heels = replace(planted, toes=np.zeros_like(planted.toes))
    np.testing.assert_allclose(foot_turn_rad(lock_feet(through, heels).position_xyz_m), 0.2, atol=0.02)


@pytest.mark.parametrize("is_blend", [True, False])
def test_planted_feet_pass_through_a_blend_at_the_heights_before_and_after_it(is_blend):
    mixed, planted = held_apart(0.0)
    root = mixed.root_xyz_m.copy()
    root[:, 1] += 0.03 * np.sin(np.pi * np.clip((mixed.time_s - 1.3) / 0.4, 0, 1)) ** 2
    position, _ = kinematics.forward(CANONICAL, root, mixed.rotation_wxyz)
    weight = mixed.lineage.blend_weight
    weight = np.where((mixed.time_s > 1.3) & (mixed.time_s < 1.7), np.maximum(weight, 1e-3), 0.0) * is_blend
    lifted = replace(
        mixed, root_xyz_m=root, position_xyz_m=position, lineage=replace(mixed.lineage, blend_weight=weight)
    )
    height = lock_feet(lifted, planted).position_xyz_m[:, grounding.TOES, 1]
    rise = height[90] - height[60]
    assert (np.abs(rise) < 0.012).all() if is_blend else (rise > 0.028).all()


def test_a_leg_gives_no_more_than_half_of_what_it_has_left_to_stretch():
    mixed, _ = held_apart(0.0, bend_rad=0.4)
    position = mixed.position_xyz_m[:1]
    hip, ankle = position[:, grounding.THIGHS], position[:, grounding.ANKLES]
    left_m = grounding.LEG_M - np.linalg.norm(ankle - hip, axis=-1)
    down = np.array([0.0, -1.0, 0.0])
    for move_m in (0.005, 0.05, 0.5):
        given = ankle + _within_reach(position, np.full((1, 2, 1), move_m) * down, 0.5)
        longer_m = np.linalg.norm(given - hip, axis=-1) - np.linalg.norm(ankle - hip, axis=-1)
        assert (longer_m < 0.5 * left_m).all()
        assert (longer_m > 0).all()
    # A small move is made nearly whole, one that shortens the leg wholly.
    near = _within_reach(position, np.full((1, 2, 1), 0.001) * down, 0.5)
    np.testing.assert_allclose(near[..., 1], -0.001, atol=1e-4)
    np.testing.assert_allclose(_within_reach(position, np.full((1, 2, 1), -0.1) * down, 0.5)[..., 1], 0.1, atol=1e-9)


@pytest.mark.parametrize("bend_rad", [0.05, 0.2])
def test_a_knee_does_not_pop_where_one_planted_foot_is_pulled_far(bend_rad):
    mixed, planted = held_apart(0.5, bend_rad=bend_rad)
    one = planted.ankle.copy()
    one[:, 1] = False
    held = lock_feet(mixed, replace(planted, ankle=one, toes=one))
    change = np.diff(knee_angles(held.position_xyz_m), n=2, axis=0)
    assert np.abs(change).max() < 0.015


@pytest.mark.parametrize("rate_hz", [30.0, 60.0])
def test_locked_feet_and_toes_turn_in_a_frame_hardly_more_than_they_did(hops, clips, rate_hz):
    """In the world and against the parent; a foot that is let go does not catch up at once."""
    made = assemble(hops, clips, skeleton=CANONICAL, frame_rate_hz=rate_hz, duration_s=float(hops.song_end_s[-1]))
    locked = lock_feet(made, planted_feet(made, hops, clips))
    joints = [*grounding.ANKLES, *grounding.TOES]

    def turns(dance):
        _, orientation = kinematics.forward(CANONICAL, dance.root_xyz_m, dance.rotation_wxyz)
        return np.stack(
            [rotation.angle_between(q[:-1, joints], q[1:, joints]) for q in (dance.rotation_wxyz, orientation)]
        )

    assert np.degrees((turns(locked) - turns(made)).max()) < 300 / rate_hz  # 10 degrees at 30 a second
    assert find_flips(locked.rotation_wxyz, CANONICAL.parent, rate_hz) == []
    assert np.abs(locked.position_xyz_m - made.position_xyz_m).max() > 0.02  # the feet were moved
