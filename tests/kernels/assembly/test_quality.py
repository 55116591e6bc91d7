"""Measures of a dance: closed forms, chance, and negative and positive controls."""

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
