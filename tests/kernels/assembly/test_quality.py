"""Measures of a dance: closed forms, chance, and negative and positive controls."""

from dataclasses import replace

import mir_eval
import numpy as np
import pytest

from kernels.assembly import quality
from kernels.assembly.blend import assemble
from kernels.skeleton.canonical import CANONICAL
from kernels.synthetic.dancer import take


def values(measures):
    return {m.name: m.value for m in measures}


def passed(measures):
    return {m.name: m.is_passed for m in measures}


def test_f_measure_agrees_with_mir_eval():
    rng = np.random.default_rng(0)
    for _ in range(50):
        a, b = np.sort(rng.uniform(0, 10, 20)), np.sort(rng.uniform(0, 10, 17))
        assert quality.f_measure(a, b) == pytest.approx(
            mir_eval.beat.f_measure(b, a, f_measure_threshold=0.07), abs=1e-9
        )


def test_f_measure_of_nothing_is_nothing():
    assert quality.f_measure(np.zeros(0), np.array([1.0])) == 0
    assert quality.f_measure(np.array([1.0]), np.zeros(0)) == 0


def test_alignment_of_known_offsets():
    music = np.arange(1.0, 9.0)
    assert quality.beat_alignment(music, music) == 1.0
    assert quality.beat_alignment(music + 0.05, music) == pytest.approx(np.exp(-0.5))
    assert quality.beat_alignment(np.array([4.0]), np.array([4.0])) == 1.0
    assert quality.beat_alignment(np.zeros(0), music) == 0


def test_alignment_by_chance_is_a_quarter_at_half_second_beats():
    rng = np.random.default_rng(1)
    music = np.arange(0, 40, 0.5)
    found = [quality.beat_alignment(music + rng.uniform(0, 0.5), music) for _ in range(2000)]
    assert np.mean(found) == pytest.approx(0.251, abs=0.01)


def test_block_shift_keeps_count_and_blocks_and_destroys_phase():
    rng = np.random.default_rng(2)
    beats = np.arange(0.25, 30, 0.5)
    shifted = quality.block_shifted(beats, 30.0, rng=rng)
    np.testing.assert_array_equal(np.bincount((beats // 4).astype(int)), np.bincount((shifted // 4).astype(int)))
    assert (np.diff(shifted) >= 0).all()
    phases = [np.angle(np.exp(2j * np.pi * (shifted[k] - beats[k]) / 0.5)) for k in range(0, 56, 8)]
    assert np.std(phases) > 0.3


def test_dance_on_the_beat_beats_chance_and_off_the_beat_does_not(phrases, dance):
    made = dance(phrases(("wave", 0.25, 14, 0.5, 0.5)))
    on = quality.beat_measures(made, np.arange(0, 7, 0.5), n_shifts=400)
    off = quality.beat_measures(made, np.arange(0.25, 7, 0.5), n_shifts=400)
    assert values(on)["beat_f_ratio"] > 0.9
    assert values(on)["beat_p_probability"] < 0.01
    assert passed(on)["beat_p_probability"]
    assert values(off)["beat_p_probability"] > 0.5
    assert values(off)["beat_alignment_corrected_ratio"] < 0
    assert not passed(off)["beat_p_probability"]


def test_beat_measures_repeat_to_the_bit_and_take_no_beats(phrases, dance):
    made = dance(phrases(("wave", 0.25, 6, 0.5, 0.5)))
    assert quality.beat_measures(made, np.arange(3.0)) == quality.beat_measures(made, np.arange(3.0))
    assert values(quality.beat_measures(made, np.zeros(0)))["beat_f_ratio"] == 0


def test_lag_is_measured_on_the_frames(phrases, dance):
    steps = phrases(("step", 0.25, 6, 0.5, 0.47), ("rock", 0.75, 6, 0.5, 0.53))
    made = dance(steps)
    music = np.append(steps.song_start_s, steps.song_end_s[-1])
    (lag,) = quality.lag_measures(made, steps, music)
    assert lag.value < 1.0
    assert lag.is_passed
    late = type(made)(made.frame_rate_hz, made.root_xyz_m, made.rotation_wxyz, made.position_xyz_m, made.lineage)
    object.__setattr__(late.lineage, "clip_time_s", late.lineage.clip_time_s - 0.05)
    (lag,) = quality.lag_measures(late, steps, music)
    assert lag.value > 30
    assert not lag.is_passed


def test_warp_counts_steps_in_and_out_of_bounds(phrases):
    steps = phrases(("a", 0.0, 18, 0.5, 0.5), ("b", 0.0, 2, 0.5, 0.65))
    found = quality.warp_measures(steps)
    assert values(found)["warp_easy_ratio"] == pytest.approx(0.9)
    assert values(found)["warp_most_ratio"] == pytest.approx(1.3)
    assert passed(found) == {"warp_easy_ratio": False, "warp_least_ratio": True, "warp_most_ratio": False}


def test_catalogue_use_and_repetition(phrases):
    steps = phrases(("a", 0.0, 3, 0.5, 0.5), ("b", 1.0, 2, 0.5, 0.5), ("a", 0.0, 3, 0.5, 0.5))
    found = values(quality.catalogue_measures(steps, {"a": 4.0, "b": 4.0, "c": 8.0}))
    assert found == {"clip_count": 2.0, "coverage_ratio": pytest.approx(2.5 / 16), "longest_repeat_steps": 3.0}
    once = values(quality.catalogue_measures(phrases(("a", 0.0, 5, 0.5, 0.5)), {"a": 4.0}))
    assert once["longest_repeat_steps"] == 0


def test_coverage_counts_a_stretch_once_and_no_more_than_the_catalogue_has(phrases):
    def coverage(*parts, **catalogue_s):
        return values(quality.catalogue_measures(phrases(*parts), catalogue_s))["coverage_ratio"]

    once = ("a", 1.0, 4, 0.5, 0.5)
    assert coverage(once, a=8.0) == pytest.approx(0.25)
    assert coverage(once, ("a", 2.0, 4, 0.5, 0.5), once, a=8.0) == pytest.approx(3 / 8)
    assert coverage(("a", 4.0, 2, 0.5, 0.5), ("a", 0.0, 2, 0.5, 0.5), a=8.0, b=8.0) == pytest.approx(2 / 16)
    assert coverage(("a", 0.0, 4, 0.5, 0.5), a=1.5) == 1.0
    assert coverage(once, b=4.0) == 0
    assert coverage(once) == 0


def test_repeat_of_a_loop_does_not_overlap_itself(phrases):
    parts = [("a", 0.0, 2, 0.5, 0.5)] * 4
    assert values(quality.catalogue_measures(phrases(*parts), {"a": 1.0}))["longest_repeat_steps"] == 4


def test_a_still_dance_has_no_beats(clips, phrases, dance):
    still = {"idle": take("idle").clip}
    steps = phrases(("idle", 0.25, 6, 0.5, 0.5))
    made = assemble(steps, still, skeleton=CANONICAL, frame_rate_hz=30.0, duration_s=3.0)
    assert values(quality.beat_measures(made, np.arange(0, 3, 0.5)))["beat_p_probability"] > 0.01


def test_movement_that_follows_the_music_correlates_by_rank(clips):
    position = np.zeros((301, 2, 3))
    speed = np.repeat([0.1, 0.5, 0.2, 0.9, 0.4, 0.6, 0.3, 0.8, 0.05, 0.7], 30)
    position[1:, :, 0] = np.cumsum(speed)[:, None] / 30
    made = type("Moved", (), {"position_xyz_m": position, "frame_rate_hz": 30.0, "time_s": np.arange(301) / 30})()
    music = np.array([1, 5, 2, 10, 4, 6, 3, 9, 0, 7.0]) ** 3
    grid_s = np.arange(11.0)
    assert values(quality.intensity_measures(made, music, grid_s))["intensity_rank_correlation_ratio"] > 0.99
    assert values(quality.intensity_measures(made, -music, grid_s))["intensity_rank_correlation_ratio"] < -0.99
    assert values(quality.intensity_measures(made, np.ones(10), grid_s))["intensity_rank_correlation_ratio"] == 0
    assert values(quality.intensity_measures(made, music[:2], grid_s[:3]))["intensity_rank_correlation_ratio"] == 0


def test_a_p_value_counts_the_dance_itself_so_that_it_is_never_nothing(phrases, dance):
    made = dance(phrases(("wave", 0.25, 14, 0.5, 0.5)))
    found = values(quality.beat_measures(made, np.arange(0, 7, 0.5), n_shifts=19))
    assert found["beat_p_probability"] == found["beat_f_p_probability"] == 1 / 20


def test_a_shift_as_good_as_the_dance_counts_against_it(phrases, dance):
    """Without beats of the music every shift is as good: no dance is above chance."""
    made = dance(phrases(("wave", 0.25, 6, 0.5, 0.5)))
    found = quality.beat_measures(made, np.array([-1.0, 99.0]), n_shifts=9)
    assert values(found)["beat_p_probability"] == values(found)["beat_f_p_probability"] == 1
    assert values(found)["beat_alignment_corrected_ratio"] == 0
    assert not passed(found)["beat_alignment_corrected_ratio"]


def test_music_beats_outside_the_dance_are_not_missed(phrases, dance):
    made = dance(phrases(("wave", 0.25, 8, 0.5, 0.5)))
    inside = np.arange(0, 4.01, 0.5)
    more = np.concatenate([[-0.5], inside, [4.5, 5.0]])
    assert quality.beat_measures(made, more, n_shifts=9) == quality.beat_measures(made, inside, n_shifts=9)


def test_a_beat_is_met_once_and_only_within_the_tolerance():
    music = np.array([1.0, 2.0])
    assert quality.f_measure(np.array([1.07, 2.071]), music) == 0.5
    assert quality.f_measure(np.array([0.95, 1.05]), np.array([1.0])) == pytest.approx(2 / 3)


def test_alignment_looks_at_the_nearest_beat_on_either_side():
    near = np.exp(-0.5)
    assert quality.beat_alignment(np.array([0.95, 3.0]), np.array([1.0])) == pytest.approx(near)
    assert quality.beat_alignment(np.array([0.0, 1.05]), np.array([1.0])) == pytest.approx(near)
    # before the first and after the last
    assert quality.beat_alignment(np.array([1.0, 2.0, 3.0]), np.array([0.95, 3.05])) == pytest.approx(near)


def test_the_last_block_is_as_long_as_what_is_left_of_the_song():
    rng = np.random.default_rng(4)
    beats = np.arange(0.1, 9.0, 0.3)
    for _ in range(50):
        shifted = quality.block_shifted(beats, 9.0, rng=rng)
        assert shifted.max() < 9.0
        assert (shifted[beats >= 8.0] >= 8.0).all()


def test_lag_counts_only_steps_that_start_on_a_heard_beat(phrases, dance):
    steps = phrases(("step", 0.25, 6, 0.5, 0.47))
    made = dance(steps)
    (none,) = quality.lag_measures(made, steps, steps.song_start_s + 0.1)
    assert (none.value, none.is_passed) == (0.0, True)
    (none,) = quality.lag_measures(made, steps, np.zeros(0))
    assert none.value == 0
    shifted = replace(made, lineage=replace(made.lineage, clip_time_s=made.lineage.clip_time_s - 0.05))
    (one,) = quality.lag_measures(shifted, steps, steps.song_start_s[2:3])
    assert one.value == pytest.approx(47, abs=2)


def test_a_lag_of_half_a_frame_passes_and_more_does_not(phrases, dance):
    steps = phrases(("step", 0.25, 6, 0.5, 0.5))
    made = dance(steps)
    for late_s, is_passed in ((0.4 / 60, True), (0.6 / 60, False)):
        late = replace(made, lineage=replace(made.lineage, clip_time_s=made.lineage.clip_time_s - late_s))
        assert quality.lag_measures(late, steps, steps.song_start_s[1:])[0].is_passed == is_passed


def test_warps_on_their_very_bounds_pass(phrases):
    for song_step_s, is_easy, is_hard in (
        (0.45, True, True),
        (0.55, True, True),
        (0.4, False, True),
        (0.39, False, False),
    ):
        found = quality.warp_measures(phrases(("a", 0.0, 6, 0.5, song_step_s)))
        assert values(found)["warp_easy_ratio"] == (1.0 if is_easy else 0.0)
        assert (passed(found)["warp_least_ratio"] and passed(found)["warp_most_ratio"]) == is_hard
    slow = quality.warp_measures(phrases(("a", 0.0, 6, 0.5, 0.64)))
    assert not passed(slow)["warp_most_ratio"]
    assert passed(slow)["warp_least_ratio"]
    nineteen = quality.warp_measures(phrases(("a", 0.0, 19, 0.5, 0.5), ("a", 0.0, 1, 0.5, 0.6)))
    assert passed(nineteen)["warp_easy_ratio"]


def test_intensity_counts_intervals_inside_the_dance_alone(clips):
    position = np.zeros((121, 2, 3))
    position[1:, :, 0] = np.cumsum(np.repeat([0.1, 0.5, 0.2, 0.9], 30))[:, None] / 30
    made = type("Moved", (), {"position_xyz_m": position, "frame_rate_hz": 30.0, "time_s": np.arange(121) / 30})()
    # the intervals before the start and after the end would turn the order round
    grid_s, music = np.arange(-1.0, 7.0), np.array([99, 1, 5, 2, 10, 99, 99.0])
    assert values(quality.intensity_measures(made, music, grid_s))["intensity_rank_correlation_ratio"] == pytest.approx(
        1
    )
    # the last of them ends with the dance, and counts
    music[4] = 0.0
    last = values(quality.intensity_measures(made, music, grid_s))["intensity_rank_correlation_ratio"]
    assert last == pytest.approx(-0.2)
