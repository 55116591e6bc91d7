"""Stillness of planted feet: dragged, creeping and sunken dances."""

from dataclasses import fields, replace

import numpy as np
import pytest

from kernels.assembly.blend import Dance, Lineage, assemble
from kernels.assembly.feet import lock_feet, planted_feet
from kernels.assembly.foot_quality import foot_measures, knee_measures, seam_slips, slip_measures
from kernels.skeleton import grounding
from kernels.skeleton.canonical import CANONICAL
from kernels.synthetic.dancer import Figure, pose, take


def values(measures):
    return {m.name: m.value for m in measures}


def passed(measures):
    return {m.name: m.is_passed for m in measures}


def test_planted_feet_do_not_slide_and_a_dragged_dance_does(phrases, dance, clips):
    steps = phrases(("twist", 0.25, 8, 0.55, 0.55))
    made = dance(steps)
    found = foot_measures(made, steps, clips)
    assert values(found)["foot_slide_cm_per_s"] < 0.5
    assert values(found)["penetration_cm"] == 0
    drag = np.zeros(3)[None] + np.arange(len(made.time_s))[:, None] / 60 * np.array([0.2, 0.0, 0.0])
    dragged = type(made)(
        made.frame_rate_hz,
        made.root_xyz_m + drag,
        made.rotation_wxyz,
        made.position_xyz_m + drag[:, None],
        made.lineage,
    )
    found = foot_measures(dragged, steps, clips)
    assert values(found)["added_foot_slide_cm_per_s"] == pytest.approx(20, abs=1)
    assert not passed(found)["added_foot_slide_cm_per_s"]


@pytest.mark.parametrize("rate_hz", [24.0, 30.0, 60.0, 120.0, 240.0])
def test_the_slide_of_the_source_is_the_same_at_any_rate_of_recording(phrases, rate_hz):
    still = take("twist", frame_rate_hz=rate_hz).clip
    creep = np.arange(still.n_frames)[:, None] / rate_hz * np.array([0.05, 0.0, 0.0])
    steps = phrases(("twist", 0.5, 8, 0.5, 0.5))
    creeping = {"twist": replace(still, root_xyz_m=still.root_xyz_m + creep)}
    made = assemble(steps, creeping, skeleton=CANONICAL, frame_rate_hz=30.0, duration_s=float(steps.song_end_s[-1]))
    found = values(foot_measures(made, steps, creeping))
    assert found["source_foot_slide_cm_per_s"] == pytest.approx(5.0, abs=0.5)


def test_the_slide_of_the_source_is_that_of_the_frames_danced(phrases):
    still = take("twist", interval_s=0.5, frame_rate_hz=120.0).clip
    creep = np.maximum(np.arange(still.n_frames) / 120.0 - 4.0, 0.0)[:, None] * np.array([0.1, 0.0, 0.0])
    slid = {"twist": replace(still, root_xyz_m=still.root_xyz_m + creep)}
    for start_s, cm_per_s in ((0.5, 0.0), (4.5, 10.0)):
        steps = phrases(("twist", start_s, 4, 0.5, 0.5))
        made = assemble(steps, slid, skeleton=CANONICAL, frame_rate_hz=30.0, duration_s=2.0)
        found = values(foot_measures(made, steps, slid))
        assert found["source_foot_slide_cm_per_s"] == pytest.approx(cm_per_s, abs=0.6)


def test_sunken_feet_are_seen(phrases, dance, clips):
    steps = phrases(("twist", 0.25, 4, 0.55, 0.55))
    made = dance(steps)
    down = np.array([0.0, -0.05, 0.0])
    sunk = type(made)(
        made.frame_rate_hz, made.root_xyz_m + down, made.rotation_wxyz, made.position_xyz_m + down, made.lineage
    )
    found = foot_measures(sunk, steps, clips)
    assert values(found)["penetration_cm"] == pytest.approx(3.0, abs=0.2)
    assert not passed(found)["penetration_cm"]


def test_knees_of_a_clip_alone_do_not_pop_and_a_leg_pulled_straight_for_a_frame_does(phrases, dance, clips):
    steps = phrases(("step", 0.25, 8, 0.5, 0.5))
    made = dance(steps)
    assert values(knee_measures(made, steps, clips))["knee_pop_ratio"] == pytest.approx(1, abs=0.05)
    position = made.position_xyz_m.copy()
    position[60, grounding.KNEES] += [0.0, 0.0, 0.08]
    found = knee_measures(replace(made, position_xyz_m=position), steps, clips)
    assert values(found)["knee_pop_ratio"] > 3
    assert not passed(found)["knee_pop_ratio"]


def test_a_foot_planted_through_a_seam_stays_where_it_is(phrases, dance, clips):
    steps = phrases(("twist", 0.25, 4, 0.55, 0.55), ("wave", 0.75, 4, 0.5, 0.5), blend_s=0.4)
    made = dance(steps)
    planted = planted_feet(made, steps, clips)
    before = seam_slips(made, steps, planted)
    after = seam_slips(lock_feet(made, planted), steps, planted)
    assert len(before) == len(after) > 0
    assert np.median(after) < 0.3 * np.median(before)
    assert after.max() < 0.003
    assert np.median(before) > 0.005
    assert len(seam_slips(made, phrases(("twist", 0.25, 8, 0.55, 0.55)), planted)) == 0


def test_feet_that_slip_through_seams_are_seen(phrases, dance, clips):
    steps = phrases(("twist", 0.25, 4, 0.55, 0.55), ("wave", 0.75, 4, 0.5, 0.5), blend_s=0.4)
    made = dance(steps)
    locked = lock_feet(made, planted_feet(made, steps, clips))
    assert values(slip_measures(locked, steps, clips))["seam_planted_count"] >= 2
    assert passed(slip_measures(locked, steps, clips))["seam_foot_slip_cm"]
    shift = np.linspace(0, 1, len(made.time_s))[:, None] * np.array([0.5, 0.0, 0.0])
    dragged = replace(locked, position_xyz_m=locked.position_xyz_m + shift[:, None])
    found = slip_measures(dragged, steps, clips)
    assert values(found)["seam_foot_slip_cm"] == pytest.approx(50 * 24 / (len(made.time_s) - 1), abs=0.3)
    assert not passed(found)["seam_foot_slip_cm"]


def test_without_seams_nothing_slips(phrases, dance, clips):
    steps = phrases(("twist", 0.25, 4, 0.55, 0.55))
    found = slip_measures(dance(steps), steps, clips)
    assert set(values(found).values()) == {0.0}
    assert passed(found)["seam_foot_slip_cm"]


@pytest.fixture
def standing():
    """A body that stands still on the floor with its knees bent: five seconds at 60 frames a second."""
    n = 300
    foot = np.zeros((2, n, 3))
    foot[..., 0], foot[..., 1] = np.array([[0.1], [-0.1]]), 0.08
    zero, arms = np.zeros(n), np.full((2, n), 0.3)
    hips = np.tile([0.0, 0.8, 0.0], (n, 1))
    return {"still": pose(Figure(hips, zero, zero, zero, zero, foot, 0 * arms, arms, 0 * arms, arms), 60.0)}


@pytest.mark.parametrize(("cm_per_s", "is_unseen"), [(0.4, True), (0.6, False)])
def test_a_slide_that_nobody_sees_passes_though_the_clip_has_none(phrases, dance, standing, cm_per_s, is_unseen):
    steps = phrases(("still", 0.5, 8, 0.5, 0.5))
    made = dance(steps, standing)
    creep = 0.01 * cm_per_s * made.time_s[:, None, None] * np.array([1.0, 0.0, 0.0])
    found = foot_measures(replace(made, position_xyz_m=made.position_xyz_m + creep), steps, standing)
    assert values(found)["source_foot_slide_cm_per_s"] == pytest.approx(0, abs=1e-6)
    assert values(found)["added_foot_slide_cm_per_s"] == pytest.approx(cm_per_s, abs=0.01)
    assert passed(found)["added_foot_slide_cm_per_s"] == is_unseen


@pytest.mark.parametrize(("added_ratio", "is_passed"), [(0.08, True), (0.15, False)])
def test_a_clip_that_slides_may_be_danced_a_tenth_worse(phrases, dance, standing, added_ratio, is_passed):
    still = standing["still"]
    way = np.arange(still.n_frames)[:, None] / 60.0 * np.array([0.1, 0.0, 0.0])
    sliding = {"still": replace(still, root_xyz_m=still.root_xyz_m + way)}
    steps = phrases(("still", 0.5, 8, 0.5, 0.5))
    made = dance(steps, sliding)
    more = added_ratio * 0.1 * made.time_s[:, None, None] * np.array([1.0, 0.0, 0.0])
    found = foot_measures(replace(made, position_xyz_m=made.position_xyz_m + more), steps, sliding)
    assert values(found)["source_foot_slide_cm_per_s"] == pytest.approx(10.0, abs=0.1)
    assert passed(found)["added_foot_slide_cm_per_s"] == is_passed


@pytest.mark.parametrize(("forward_m", "is_unseen"), [(0.002, True), (0.006, False)])
def test_knees_at_rest_may_waver_a_little(phrases, dance, standing, forward_m, is_unseen):
    """To and fro three times a second: by half a degree or so nobody sees it, by two it pops."""
    steps = phrases(("still", 0.5, 8, 0.5, 0.5))
    made = dance(steps, standing)
    position = made.position_xyz_m.copy()
    position[:, grounding.KNEES, 2] += forward_m * np.sin(2 * np.pi * 3 * made.time_s)[:, None]
    found = knee_measures(replace(made, position_xyz_m=position), steps, standing)
    assert passed(found)["knee_pop_ratio"] == is_unseen
    assert 0.1 < values(found)["knee_pop_ratio"] < 5


def test_a_dance_too_short_has_no_knees_to_judge(phrases, dance, clips):
    steps = phrases(("step", 0.25, 2, 0.5, 0.5))
    made = dance(steps)
    line = made.lineage
    two = Lineage(*(getattr(line, f.name)[:2] for f in fields(Lineage)))
    short = Dance(60.0, made.root_xyz_m[:2], made.rotation_wxyz[:2], made.position_xyz_m[:2], two)
    (found,) = knee_measures(short, steps, clips)
    assert (found.value, found.is_passed) == (0.0, True)


def test_only_feet_that_stand_from_one_end_of_a_blend_to_the_other_can_slip(phrases, dance, standing):
    steps = phrases(("still", 0.5, 4, 0.5, 0.5), ("still", 1.5, 4, 0.5, 0.5), blend_s=0.4)
    made = dance(steps, standing)
    planted = planted_feet(made, steps, standing)
    assert len(seam_slips(made, steps, planted)) == 4
    lifted = planted.ankle.copy()
    lifted[120, 0] = False
    assert len(seam_slips(made, steps, replace(planted, ankle=lifted))) == 3
    # outside the blend a foot may be lifted, up and down is no slip, and a seam without a blend has none
    before = planted.ankle.copy()
    before[100] = False
    assert len(seam_slips(made, steps, replace(planted, ankle=before))) == 4
    rising = made.position_xyz_m + np.linspace(0, 1, len(made.time_s))[:, None, None] * np.array([0.0, 1.0, 0.0])
    np.testing.assert_allclose(seam_slips(replace(made, position_xyz_m=rising), steps, planted), 0, atol=1e-9)
    assert len(seam_slips(made, replace(steps, blend_s=np.zeros(8)), planted)) == 0
    assert len(seam_slips(made, replace(steps, blend_s=np.where(steps.has_seam, 0.01, 0.0)), planted)) == 0


def test_slips_are_judged_by_an_actual_foot_the_worst_of_up_to_twenty(phrases, dance, standing):
    steps = phrases(("still", 0.5, 4, 0.5, 0.5), ("still", 1.5, 4, 0.5, 0.5), blend_s=0.4)
    made = dance(steps, standing)
    position = made.position_xyz_m.copy()
    position[120:, grounding.TOES[0], 0] += 0.02
    found = slip_measures(replace(made, position_xyz_m=position), steps, standing)
    assert values(found)["seam_planted_count"] == 4
    assert values(found)["seam_foot_slip_cm"] == values(found)["seam_foot_slip_worst_cm"] == pytest.approx(2.0)
    assert not passed(found)["seam_foot_slip_cm"]


def test_depth_is_the_deepest_point_of_either_foot(phrases, dance, standing):
    steps = phrases(("still", 0.5, 4, 0.5, 0.5))
    made = dance(steps, standing)
    for joint in (grounding.ANKLES[0], grounding.TOES[1]):
        for depth_m, is_passed in ((0.009, True), (0.011, False)):
            position = made.position_xyz_m.copy()
            position[30, joint, 1] = -depth_m
            found = foot_measures(replace(made, position_xyz_m=position), steps, standing)
            assert values(found)["penetration_cm"] == pytest.approx(100 * depth_m)
            assert passed(found)["penetration_cm"] == is_passed
