"""Planted feet: found through the lineage, held, and nothing else moved."""

import numpy as np
import pytest

from kernels import rotation
from kernels.assembly.blend import Dance, Lineage, assemble
from kernels.assembly.feet import SAY, lock_feet, planted_feet
from kernels.assembly.foot_quality import foot_measures
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
