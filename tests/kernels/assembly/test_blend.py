"""Assembly: exact playing, seams that carry place and heading, lineage of every frame."""

from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.assembly.blend import assemble, sample, turn
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL
from kernels.synthetic.dancer import Figure, pose
from kernels.types import Clip


def dance(steps, clips, *, rate_hz=30.0):
    return assemble(steps, clips, skeleton=CANONICAL, frame_rate_hz=rate_hz, duration_s=float(steps.song_end_s[-1]))


def test_one_clip_at_its_own_pace_is_the_clip(clips, phrases):
    steps = phrases(("step", 0.0, 8, 0.5, 0.5))
    made = dance(steps, clips)
    source, _ = kinematics.place(clips["step"])
    n = len(made.root_xyz_m)
    assert n == 121
    shift = made.position_xyz_m[0, 0] - source[0, 0]
    np.testing.assert_allclose(made.position_xyz_m, source[:n] + shift, atol=1e-9)


def test_starts_at_the_origin_facing_z(clips, phrases):
    made = dance(phrases(("twist", 0.5, 4, 0.55, 0.55)), clips)
    np.testing.assert_allclose(made.root_xyz_m[0, [0, 2]], 0, atol=1e-12)
    assert float(rotation.heading_rad(made.rotation_wxyz[0, 0])) == pytest.approx(0, abs=1e-9)


def test_every_boundary_falls_on_its_song_time(clips, phrases):
    steps = phrases(("step", 0.25, 6, 0.5, 0.46), ("twist", 0.8, 6, 0.55, 0.52), ("wave", 0.75, 6, 0.5, 0.55))
    made = dance(steps, clips, rate_hz=100.0)
    for i in range(len(steps.clip_id)):
        frame = round(float(steps.song_start_s[i]) * 100)
        if abs(frame / 100 - steps.song_start_s[i]) < 1e-9:
            assert made.lineage.clip_time_s[frame] == pytest.approx(steps.clip_start_s[i], abs=1e-6)


def test_place_and_heading_go_on_over_a_seam(clips, phrases):
    steps = phrases(("step", 0.25, 6, 0.5, 0.5), ("twist", 0.8, 6, 0.55, 0.5), ("rock", 1.25, 6, 0.5, 0.5))
    made = dance(steps, clips, rate_hz=60.0)
    jump = np.linalg.norm(np.diff(made.root_xyz_m[:, [0, 2]], axis=0), axis=1)
    turn_rad = np.abs(np.angle(np.exp(1j * np.diff(rotation.heading_rad(made.rotation_wxyz[:, 0])))))
    for frame in (180, 360):
        assert jump[frame - 12 : frame + 12].max() < 2.0 / 60
        assert turn_rad[frame - 12 : frame + 12].max() < 4.0 / 60


def test_seam_inside_one_continuous_clip_leaves_no_trace(clips, phrases):
    whole = dance(phrases(("step", 0.25, 12, 0.5, 0.5)), clips)
    seamed = dance(phrases(("step", 0.25, 6, 0.5, 0.5), ("step", 3.25, 6, 0.5, 0.5)), clips)
    np.testing.assert_allclose(seamed.position_xyz_m, whole.position_xyz_m, atol=1e-6)


def test_lineage_never_leaves_a_clip(clips, phrases):
    # left 0.1 s before its end and entered 0.1 s after the other's start, with half a blend of 0.2 s
    end_s = clips["step"].duration_s
    steps = phrases(("step", end_s - 2.1, 4, 0.5, 0.4), ("wave", 0.1, 4, 0.5, 0.4), blend_s=0.4)
    made = dance(steps, clips, rate_hz=60.0)
    by_step = np.array([clips[clip].duration_s for clip in steps.clip_id])
    line, both = made.lineage, made.lineage.blend_step_index >= 0
    assert (line.clip_time_s >= 0).all()
    assert (line.clip_time_s <= by_step[line.step_index]).all()
    assert (line.blend_time_s[both] >= 0).all()
    assert (line.blend_time_s[both] <= by_step[line.blend_step_index[both]]).all()
    assert line.blend_time_s[both].min() == 0
    assert line.blend_time_s[both].max() == end_s


def test_halfway_on_the_seam(clips, phrases):
    steps = phrases(("step", 0.25, 6, 0.5, 0.5), ("wave", 0.75, 6, 0.5, 0.5))
    made = dance(steps, clips)
    line = made.lineage
    seam = 90
    assert line.step_index[seam - 1] == 5
    assert line.step_index[seam] == 6
    assert line.blend_weight[seam] == pytest.approx(0.5)
    assert line.blend_step_index[seam] == 5
    assert line.blend_step_index[seam - 1] == 6
    both = np.flatnonzero(line.blend_step_index >= 0)
    assert both.tolist() == list(range(86, 95))
    assert (line.blend_weight[both] > 0).all()
    assert (np.delete(line.blend_weight, both) == 0).all()
    assert np.isnan(np.delete(line.blend_time_s, both)).all()


def test_lineage_names_the_times_that_are_shown(clips, phrases):
    steps = phrases(("step", 0.25, 4, 0.5, 0.45), ("wave", 0.75, 4, 0.5, 0.55))
    made = dance(steps, clips)
    alone = np.flatnonzero(made.lineage.blend_step_index < 0)
    for frame in alone[::7]:
        clip = clips[steps.clip_id[made.lineage.step_index[frame]]]
        _, q = sample(clip, made.lineage.clip_time_s[frame : frame + 1])
        shown = made.rotation_wxyz[frame, 1:]
        assert rotation.angle_between(shown, q[0, 1:]).max() < 1e-6


def test_blend_of_different_poses_is_between_them(clips, phrases):
    steps = phrases(("step", 0.25, 6, 0.5, 0.5), ("wave", 0.75, 6, 0.5, 0.5))
    made = dance(steps, clips)
    cut = dance(phrases(("step", 0.25, 6, 0.5, 0.5), ("wave", 0.75, 6, 0.5, 0.5), blend_s=0.0), clips)
    speed = np.linalg.norm(np.diff(made.position_xyz_m, axis=0), axis=-1).max(axis=1)
    cut_speed = np.linalg.norm(np.diff(cut.position_xyz_m, axis=0), axis=-1).max(axis=1)
    assert speed[80:100].max() < 0.5 * cut_speed[80:100].max()


def test_frames_cover_the_song_at_any_rate(clips, phrases):
    steps = phrases(("step", 0.25, 6, 0.5, 0.5))
    for rate_hz, n in ((24.0, 73), (30.0, 91), (59.94, 180), (120.0, 361)):
        made = dance(steps, clips, rate_hz=rate_hz)
        assert len(made.root_xyz_m) == n
        assert np.linalg.norm(made.rotation_wxyz, axis=-1) == pytest.approx(1.0)


def test_faster_output_is_the_same_motion(clips, phrases):
    steps = phrases(("step", 0.25, 6, 0.5, 0.47), ("rock", 0.75, 6, 0.5, 0.53))
    slow, fast = dance(steps, clips, rate_hz=30.0), dance(steps, clips, rate_hz=60.0)
    np.testing.assert_allclose(slow.position_xyz_m, fast.position_xyz_m[::2][: len(slow.position_xyz_m)], atol=1e-9)


def test_sample_between_frames_of_a_smooth_motion(clips):
    fine = clips["rock"]
    coarse = Clip(CANONICAL, 30.0, fine.root_xyz_m[::2], fine.rotation_wxyz[::2])
    t = np.arange(20, 300) / 60
    a, b = sample(fine, t), sample(coarse, t)
    assert np.abs(a[0] - b[0]).max() < 2e-3
    assert rotation.angle_between(a[1], b[1]).max() < 0.02


def test_sample_holds_beyond_the_ends_and_takes_short_clips(clips):
    clip = clips["step"]
    root, _ = sample(clip, np.array([-1.0, 99.0]))
    np.testing.assert_allclose(root, clip.root_xyz_m[[0, -1]], atol=1e-12)
    one = Clip(CANONICAL, 30.0, clip.root_xyz_m[:1], clip.rotation_wxyz[:1])
    np.testing.assert_allclose(sample(one, np.array([0.0, 0.3]))[0], clip.root_xyz_m[[0, 0]])
    assert sample(clip, np.zeros(0))[1].shape == (0, 22, 4)


def test_turning_a_motion_turns_its_world(clips):
    clip = clips["twist"]
    root, q = turn(clip.root_xyz_m, clip.rotation_wxyz, 0.7)
    turned, _ = kinematics.forward(CANONICAL, root, q)
    source, _ = kinematics.place(clip)
    np.testing.assert_allclose(turned, rotation.apply(rotation.from_heading(0.7), source), atol=1e-12)


def test_refusals(clips, phrases):
    steps = phrases(("step", 0.25, 2, 0.5, 0.5))
    with pytest.raises(ValueError, match="step missing"):
        assemble(steps, {}, skeleton=CANONICAL, frame_rate_hz=30.0, duration_s=1.0)
    with pytest.raises(ValueError, match="want > 0"):
        assemble(steps, clips, skeleton=CANONICAL, frame_rate_hz=0.0, duration_s=1.0)


@pytest.fixture
def crouching(clips):
    """A body that stands with its knees bent, 0.2 m lower, and one that stands upright; both on the floor."""

    def stand(lower_m):
        n = 150
        foot = np.zeros((2, n, 3))
        foot[..., 0], foot[..., 1] = np.array([[0.1], [-0.1]]), 0.08
        zero, arms = np.zeros(n), np.full((2, n), 0.3)
        hips = np.tile([0.0, 0.91 - lower_m, 0.0], (n, 1))
        return pose(Figure(hips, zero, zero, zero, zero, foot, 0 * arms, arms, 0 * arms, arms), 30.0)

    return {"upright": stand(0.0), "low": stand(0.2)}


@pytest.mark.parametrize("shape", ["slerp", "linear_slerp", "inertial"])
def test_the_lower_foot_keeps_its_height_through_a_blend(crouching, phrases, shape):
    steps = phrases(("upright", 0.5, 4, 0.5, 0.5), ("low", 0.5, 4, 0.5, 0.5), blend_s=0.4)
    made = assemble(steps, crouching, skeleton=CANONICAL, frame_rate_hz=60.0, duration_s=4.0, shape=shape)
    feet = [k for k, name in enumerate(CANONICAL.joints) if name.endswith(("Foot", "Toes"))]
    lowest_m = made.position_xyz_m[:, feet, 1].min(axis=1)
    assert np.ptp(made.root_xyz_m[:, 1]) > 0.19
    np.testing.assert_allclose(lowest_m, lowest_m[0], atol=1e-6)


def test_of_clips_at_different_heights_the_lower_foot_passes_from_one_to_the_other(crouching, phrases):
    raised = replace(crouching["low"], root_xyz_m=crouching["low"].root_xyz_m + np.array([0.0, 0.1, 0.0]))
    steps = phrases(("upright", 0.5, 4, 0.5, 0.5), ("raised", 0.5, 4, 0.5, 0.5), blend_s=0.4)
    both = {"upright": crouching["upright"], "raised": raised}
    made = assemble(steps, both, skeleton=CANONICAL, frame_rate_hz=60.0, duration_s=4.0)
    feet = [k for k, name in enumerate(CANONICAL.joints) if name.endswith(("Foot", "Toes"))]
    rise_m = made.position_xyz_m[:, feet, 1].min(axis=1) - made.position_xyz_m[0, feet, 1].min()
    assert rise_m[120] == pytest.approx(0.05, abs=1e-6)
    assert rise_m[-1] == pytest.approx(0.1, abs=1e-6)
    assert (np.diff(rise_m) >= -1e-9).all()


def test_the_first_phrase_is_played_from_the_first_frame_and_the_last_to_the_end(clips, phrases):
    """No blend before the first step: what lies before it in the clip is not shown, and nothing stands still."""
    steps = phrases(("step", 1.0, 4, 0.5, 0.5), ("wave", 0.75, 4, 0.5, 0.5))
    made = dance(steps, clips)
    assert made.lineage.clip_time_s[0] == 1.0
    assert made.lineage.step_index[-1] == 7
    assert made.lineage.clip_time_s[-1] == pytest.approx(2.75)
    assert (made.lineage.blend_step_index[[0, -1]] == -1).all()


def test_clips_of_two_and_three_frames_are_joined_by_lines(clips):
    for n in (2, 3):
        short = Clip(CANONICAL, 10.0, clips["step"].root_xyz_m[:n] * 1.0, clips["step"].rotation_wxyz[:n])
        root, _ = sample(short, np.array([0.05]))
        np.testing.assert_allclose(root[0], short.root_xyz_m[:2].mean(axis=0), atol=1e-12)
    four = Clip(CANONICAL, 10.0, np.array([0.0, 0.0, 1.0, 1.0])[:, None] * np.ones(3), clips["step"].rotation_wxyz[:4])
    assert sample(four, np.array([0.05]))[0][0, 0] != 0.0


def test_a_rotation_whose_sign_turns_over_within_a_clip_is_the_same_motion(clips):
    clip = clips["wave"]
    sign = np.where(np.arange(clip.n_frames) % 2, -1.0, 1.0)[:, None, None]
    flipped = replace(clip, rotation_wxyz=clip.rotation_wxyz * sign)
    t = np.linspace(0.1, 3.0, 40)
    assert rotation.angle_between(sample(flipped, t)[1], sample(clip, t)[1]).max() < 1e-6


def test_every_length_and_rate_must_be_above_nothing(clips, phrases):
    steps = phrases(("step", 0.25, 2, 0.5, 0.5))
    with pytest.raises(ValueError, match="duration_s: want > 0"):
        assemble(steps, clips, skeleton=CANONICAL, frame_rate_hz=30.0, duration_s=0.0)
    with pytest.raises(ValueError, match="at least one"):
        assemble(phrases(), clips, skeleton=CANONICAL, frame_rate_hz=30.0, duration_s=1.0)


def upright(*, feet_behind_m=0.0, feet_up_m=0.0):
    """A body that stands still, its feet behind its hips or in the air."""
    n = 150
    foot = np.zeros((2, n, 3))
    foot[..., 0], foot[..., 1], foot[..., 2] = np.array([[0.1], [-0.1]]), 0.08 + feet_up_m, -feet_behind_m
    zero, arms = np.zeros(n), np.full((2, n), 0.3)
    hips = np.tile([0.0, 0.85, 0.0], (n, 1))
    return pose(Figure(hips, zero, zero, zero, zero, foot, 0 * arms, arms, 0 * arms, arms), 30.0)


@pytest.mark.parametrize(("feet_up_m", "stays"), [(0.0, "feet"), (0.25, "root")])
def test_a_clip_stands_on_feet_planted_on_both_sides_of_a_seam_else_by_its_root(phrases, feet_up_m, stays):
    both = {"over": upright(), "before": upright(feet_behind_m=0.1, feet_up_m=feet_up_m)}
    steps = phrases(("over", 0.5, 4, 0.5, 0.5), ("before", 0.5, 4, 0.5, 0.5), blend_s=0.4)
    made = assemble(steps, both, skeleton=CANONICAL, frame_rate_hz=60.0, duration_s=4.0)
    feet = [CANONICAL.joints.index(f"{side}Foot") for side in ("left", "right")]
    moved_m = np.linalg.norm((made.position_xyz_m[-1] - made.position_xyz_m[0])[:, [0, 2]], axis=1)
    if stays == "feet":
        assert moved_m[feet].max() < 0.01
        assert moved_m[0] == pytest.approx(0.1, abs=0.01)
    else:
        assert moved_m[0] < 1e-6
        np.testing.assert_allclose(moved_m[feet], 0.1, atol=1e-3)
