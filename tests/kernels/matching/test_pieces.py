"""Starts brought to beats, spans cut to what clips can fill."""

import numpy as np
import pytest

from kernels.matching.pieces import ease_pace, longest_first, motion_under, other_starts, snap_start, split_span
from kernels.motion.motion_features import bumps

SEGMENT = bumps(240, np.array([0.0, 60, 120, 180]), np.ones(4), width_s=0.05)


def clip(first):
    return bumps(480, first + 60.0 * np.arange(5), np.ones(5), width_s=0.05)


def snap(clip_values, start, beat_s, loss, numerator=50):
    return snap_start(
        SEGMENT, clip_values, numerator=numerator, start_frame_index=start, beat_s=np.array(beat_s), loss_ratio=loss
    )


def test_reading_a_clip_at_a_scale():
    np.testing.assert_allclose(motion_under(np.arange(10.0), 4, numerator=45, start=2), [2, 2.9, 3.8, 4.7])
    np.testing.assert_allclose(motion_under(np.arange(3.0), 4, numerator=50, start=1), [1, 2, 2, 2])


def test_a_near_beat_is_taken_where_it_costs_little():
    assert snap(clip(62), 60, [62 / 120], 0.05) == 62
    assert snap(clip(60), 60, [61 / 120], 0.05) == 61


def test_a_beat_that_costs_too_much_is_not():
    assert snap(clip(60), 60, [68 / 120], 0.05) == 60
    assert snap(clip(60), 60, [68 / 120], 1.0) == 68
    assert snap(clip(60), 60, [61 / 120], 0.0) == 60


def test_far_beats_no_beats_and_the_ends_of_the_clip():
    assert snap(clip(60), 60, [90 / 120], 1.0) == 60
    assert snap(clip(60), 60, [], 1.0) == 60
    assert snap(clip(60)[:300], 60, [64 / 120], 1.0) == 60


def others(clip_values, start, most=4, numerator=50, segment=SEGMENT):
    found = other_starts(segment, clip_values, numerator=numerator, start_frame_index=start, most=most)
    assert found.dtype == np.int64
    return found.tolist()


STEPS = bumps(600, 62.0 * np.arange(1, 10), np.ones(9), width_s=0.05)


STEPPING = bumps(240, np.array([0.0, 62, 124, 186]), np.ones(4), width_s=0.05)


def test_steps_that_come_back_match_a_beat_on():
    found = others(STEPS, 62, most=50, segment=STEPPING)
    np.testing.assert_allclose(sorted(found), [0, 124, 186, 248, 310], atol=2)
    assert others(STEPS, 62, most=2, segment=STEPPING) == found[:2]


def test_other_starts_are_apart_and_within_the_clip():
    found = [62, *others(STEPS, 62, most=50, segment=STEPPING)]
    assert min(np.diff(sorted(found))) >= 60
    assert max(found) <= len(STEPS) - len(SEGMENT)
    slow = others(STEPS, 62, numerator=55, most=50)
    assert all(f + 1.1 * (len(SEGMENT) - 1) <= len(STEPS) - 1 for f in slow)


def test_the_last_start_that_fits_is_one():
    last = max(others(STEPS, 62, most=2, segment=STEPPING))
    assert max(others(STEPS[: last + len(STEPPING)], 62, most=50, segment=STEPPING)) == last


def test_what_matches_far_less_is_no_other_start():
    uneven = np.array([0.0, 50, 170])
    once = bumps(600, 200 + uneven, np.ones(3), width_s=0.05)
    assert others(once, 200, segment=bumps(240, uneven, np.ones(3), width_s=0.05)) == []


def test_no_other_starts_of_silence_of_short_clips_or_where_none_are_wanted():
    assert others(STEPS, 60, segment=np.zeros(240)) == []
    assert others(np.zeros(600), 60) == []
    assert others(STEPS[:200], 0) == []
    assert others(STEPS, 60, most=0) == []


def test_spans_are_cut_at_beats_and_evenly_without():
    np.testing.assert_allclose(split_span(0.0, 4.0, beat_s=np.arange(0, 5, 0.5), longest_s=1.2), [0, 1, 2, 3, 4])
    np.testing.assert_allclose(split_span(0.0, 4.0, beat_s=np.zeros(0), longest_s=1.5), [0, 4 / 3, 8 / 3, 4])
    np.testing.assert_allclose(split_span(0.0, 4.0, beat_s=np.array([2.0]), longest_s=8.0), [0, 4])


@pytest.mark.parametrize("longest_s", [0.05, 0.3, 0.7, 2.0])
def test_no_part_is_too_long(longest_s):
    edges = split_span(1.0, 7.7, beat_s=np.arange(0, 9, 0.41), longest_s=longest_s)
    assert edges[0] == 1.0
    assert edges[-1] == 7.7
    assert (np.diff(edges) > 0).all()
    assert (np.diff(edges) <= longest_s + 1e-9).all()


def test_the_longest_clips_come_first_and_equal_ones_in_order():
    np.testing.assert_array_equal(longest_first(np.array([3, 9, 9, 1]), most=3), [1, 2, 0])


def test_a_slow_match_comes_nearer_to_its_own_pace_where_that_costs_little():
    lonely = bumps(240, np.array([120.0]), np.ones(1), width_s=0.05)
    moving = bumps(480, np.array([168.0]), np.ones(1), width_s=0.05)
    how = {"numerator": 45, "start_frame_index": 60}
    numerator, start = ease_pace(lonely, moving, loss_ratio=0.05, **how)
    assert (numerator, start) == (46, 58)
    assert ease_pace(lonely, moving, loss_ratio=0.0, **how) == (45, 60)
    assert ease_pace(lonely, moving, numerator=50, start_frame_index=60, loss_ratio=1.0) == (50, 60)
    assert ease_pace(lonely, moving[:280], numerator=45, start_frame_index=60, loss_ratio=1.0)[0] == 46
    assert ease_pace(lonely, moving[:20], numerator=45, start_frame_index=0, loss_ratio=1.0) == (45, 0)


@pytest.mark.parametrize(("beat", "start"), [(74, 74), (75, 60), (46, 46), (45, 60)])
def test_a_start_is_moved_by_no_more_than_120_ms(beat, start):
    assert snap(clip(60), 60, [beat / 120], 1.0) == start


def test_of_two_beats_the_nearer_is_taken_and_a_start_may_end_with_its_clip():
    assert snap(clip(60), 60, [53 / 120, 64 / 120], 1.0) == 64
    whole = clip(60)[: 64 + 240]
    assert snap(whole, 60, [64 / 120], 1.0) == 64
    assert snap(whole[:-1], 60, [64 / 120], 1.0) == 60


def test_beats_just_inside_a_span_do_not_cut_it():
    edges = split_span(0.0, 4.0, beat_s=np.array([0.05, 2.0, 3.95]), longest_s=2.5)
    np.testing.assert_allclose(edges, [0, 2, 4])
