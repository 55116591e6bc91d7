"""Stillness of planted feet: dragged, creeping and sunken dances."""

from dataclasses import replace

import numpy as np
import pytest

from kernels.assembly.blend import assemble
from kernels.assembly.feet import lock_feet, planted_feet
from kernels.assembly.foot_quality import foot_measures, knee_measures, seam_slips, slip_measures
from kernels.skeleton import grounding
from kernels.skeleton.canonical import CANONICAL
from kernels.synthetic.dancer import take


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
