"""Smoothness of seams: a seam that is none, plain cuts, one rough seam among smooth ones."""

from dataclasses import replace

import numpy as np

from kernels import rotation
from kernels.assembly import seam_quality
from kernels.assembly.seam_quality import UNSEEN_JERK_M_PER_S3, peak_ratios, seam_measures
from kernels.motion.velocity import jerk
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Clip


def values(measures):
    return {m.name: m.value for m in measures}


def passed(measures):
    return {m.name: m.is_passed for m in measures}


def test_seam_in_one_continuous_clip_is_as_smooth_as_the_clip(phrases, dance, clips):
    steps = phrases(("step", 0.25, 6, 0.5, 0.5), ("step", 3.25, 6, 0.5, 0.5))
    found = seam_measures(dance(steps), steps, clips, skeleton=CANONICAL)
    assert values(found)["seam_jerk_ratio"] < 1.05
    assert passed(found)["seam_jerk_ratio"]


def test_plain_cut_is_worse_than_a_blend(phrases, dance, clips):
    steps = phrases(("step", 0.25, 6, 0.5, 0.5), ("wave", 0.75, 6, 0.5, 0.5), blend_s=0.4)
    found = values(seam_measures(dance(steps), steps, clips, skeleton=CANONICAL))
    assert found["seam_jerk_plain_cut_ratio"] > 3 * found["seam_jerk_ratio"]


def test_one_rough_seam_is_not_hidden_by_smooth_ones(phrases, dance, clips):
    going_on = [("step", 0.25 + 2 * i, 4, 0.5, 0.5) for i in range(3)]
    steps = phrases(*going_on, ("wave", 0.75, 4, 0.5, 0.5), blend_s=0.05)
    found = seam_measures(dance(steps), steps, clips, skeleton=CANONICAL)
    assert values(found)["seam_jerk_median_ratio"] < 1.05
    assert values(found)["seam_jerk_ratio"] == values(found)["seam_jerk_worst_ratio"] > 1.5
    assert not passed(found)["seam_jerk_ratio"]


def test_one_rough_seam_in_many_is_told_and_passes(phrases, dance, clips):
    going_on = [("step", 0.25 + 0.25 * i, 1, 0.25, 0.25) for i in range(29)]
    steps = phrases(*going_on, ("wave", 0.75, 4, 0.5, 0.5), blend_s=0.05)
    found = values(seam_measures(dance(steps), steps, clips, skeleton=CANONICAL))
    assert found["seam_count"] == 29
    assert found["seam_jerk_worst_ratio"] > 1.5
    assert found["seam_jerk_ratio"] < found["seam_jerk_worst_ratio"]


def test_no_seam_is_no_trouble(phrases, dance, clips):
    steps = phrases(("step", 0.25, 6, 0.5, 0.5))
    found = seam_measures(dance(steps), steps, clips, skeleton=CANONICAL)
    assert values(found)["seam_count"] == 0
    assert passed(found)["seam_jerk_ratio"]


def test_clips_that_stand_still_may_move_a_little_at_their_seams(phrases, dance, clips):
    q = np.tile(rotation.IDENTITY, (300, 22, 1))
    still = Clip(CANONICAL, 30.0, np.tile(CANONICAL.offset_xyz_m[0], (300, 1)), q)
    bent = q.copy()
    bent[:, CANONICAL.joints.index("head")] = rotation.from_axis_angle(np.array([1.0, 0.0, 0.0]), 0.02)
    steps = phrases(("still", 0.5, 4, 0.5, 0.5), ("bent", 0.5, 4, 0.5, 0.5), blend_s=0.4)
    for second, is_seen in ((replace(still, rotation_wxyz=bent), False), (clips["wave"], True)):
        both = {"still": still, "bent": second}
        found = peak_ratios(dance(steps, both), steps, {"still": still, "bent": still}, skeleton=CANONICAL, reach_s=0.3)
        assert (found.max() > 1) == is_seen


def test_jerk_is_measured_against_a_least_that_nobody_sees(phrases, dance):
    """Between two clips that stand still the reference is the least, not the clips' own nothing."""
    q = np.tile(rotation.IDENTITY, (300, 22, 1))
    still = {"still": Clip(CANONICAL, 30.0, np.tile(CANONICAL.offset_xyz_m[0], (300, 1)), q)}
    steps = phrases(("still", 0.5, 4, 0.5, 0.5), ("still", 5.0, 4, 0.5, 0.5), blend_s=0.4)
    made = dance(steps, still)
    position = made.position_xyz_m.copy()
    position[120, 5, 0] += 0.001
    peak = jerk(position, 60.0).max()
    found = peak_ratios(replace(made, position_xyz_m=position), steps, still, skeleton=CANONICAL, reach_s=0.3)
    np.testing.assert_allclose(found, [peak / UNSEEN_JERK_M_PER_S3])


def test_only_what_lies_within_reach_of_a_seam_counts_and_at_least_a_frame_and_a_half(phrases, dance, clips):
    steps = phrases(("step", 0.25, 4, 0.5, 0.5), ("step", 2.25, 4, 0.5, 0.5), blend_s=0.4)
    made = dance(steps)
    position = made.position_xyz_m.copy()
    position[60, 5, 0] += 0.2  # a second before the seam
    jumped = replace(made, position_xyz_m=position)
    near, far, least = (
        peak_ratios(jumped, steps, clips, skeleton=CANONICAL, reach_s=reach_s)[0] for reach_s in (0.3, 1.1, 0.0)
    )
    assert far > 5 * near
    assert 0 < least <= near


def test_a_dance_of_three_frames_has_no_seams_to_judge(phrases, dance, clips):
    steps = phrases(("step", 0.25, 1, 0.02, 0.02), ("wave", 0.75, 1, 0.02, 0.02), blend_s=0.02)
    made = dance(steps)
    assert len(made.time_s) == 3
    assert len(peak_ratios(made, steps, clips, skeleton=CANONICAL, reach_s=0.1)) == 0


def test_a_blend_rougher_than_a_plain_cut_fails_however_smooth_unless_the_cut_is_hardly_one(
    phrases, dance, clips, monkeypatch
):
    steps = phrases(("step", 0.25, 4, 0.5, 0.5), ("wave", 0.75, 4, 0.5, 0.5))
    made = dance(steps)
    for blended, plain, is_passed in ((1.4, 1.45, True), (1.4, 1.35, False), (1.05, 1.04, True), (1.6, 9.0, False)):
        monkeypatch.setattr(
            seam_quality, "seam_ratios", lambda *_, b=blended, p=plain, **__: (np.array([b]), np.array([p]))
        )
        found = seam_measures(made, steps, clips, skeleton=CANONICAL)
        assert passed(found)["seam_jerk_ratio"] == is_passed
