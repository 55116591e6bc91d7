"""The beat grid over a song, the clock, and the cut to the song's length."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from kernels.assembly.timing import blend_widths, clock, cover, trim


def test_cover_reaches_both_ends_at_the_local_tempo():
    grid, is_beat = cover(np.arange(1.3, 8.0, 0.5), 10.0)
    assert grid[0] <= 0
    assert grid[-1] >= 10
    np.testing.assert_allclose(np.diff(grid), 0.5)
    np.testing.assert_allclose(grid[is_beat], np.arange(1.3, 8.0, 0.5))


def test_cover_fills_a_break_evenly():
    beats = np.concatenate([np.arange(0, 4, 0.5), np.arange(6.1, 9, 0.5)])
    grid, is_beat = cover(beats, 8.6)
    assert np.diff(grid).max() < 0.6
    assert (~is_beat).sum() == 4


def test_a_passage_of_slower_beats_is_no_break():
    beats = np.concatenate([[0.0], np.cumsum([0.5] * 20 + [0.9] * 20)])
    grid, is_beat = cover(beats, beats[-1])
    np.testing.assert_allclose(grid, beats)
    assert is_beat.all()


def test_cover_follows_a_ramp():
    beats = np.cumsum(np.linspace(0.6, 0.4, 30))
    grid, _ = cover(beats, beats[-1] + 1.0)
    assert grid[1] - grid[0] == pytest.approx(np.median(np.diff(beats)[:8]))
    assert grid[-1] - grid[-2] == pytest.approx(np.median(np.diff(beats)[-8:]))


def test_cover_of_beats_that_already_reach_the_ends_adds_nothing():
    grid, is_beat = cover(np.arange(0, 5.01, 0.5), 5.0)
    assert is_beat.all()
    assert len(grid) == 11


@pytest.mark.parametrize("beats", [np.zeros(0), np.array([1.0]), np.array([1.0, 1.0])])
def test_cover_refuses_what_is_no_tempo(beats):
    with pytest.raises(ValueError, match="two beats"):
        cover(beats, 5.0)


def test_cover_refuses_a_song_of_no_length():
    with pytest.raises(ValueError, match="duration_s"):
        cover(np.array([0.0, 1.0]), 0.0)


def test_clock_passes_through_every_boundary_without_jumps_of_speed(phrases):
    steps = phrases(("a", 0.0, 4, 0.5, 0.48), ("b", 1.0, 4, 0.5, 0.55))
    found = clock(steps)
    edges = np.append(steps.song_start_s, steps.song_end_s[-1])
    np.testing.assert_allclose(found.at(edges), 0.5 * np.arange(9), atol=1e-12)
    t = np.linspace(-0.5, edges[-1] + 0.5, 4000)
    speed = np.diff(found.at(t)) / np.diff(t)
    assert speed.min() > 0
    assert np.abs(np.diff(speed)).max() < 0.01


def test_clock_wants_a_step(phrases):
    with pytest.raises(ValueError, match="at least one"):
        clock(phrases())


def test_trim_cuts_song_and_clip_alike(phrases):
    steps = phrases(("a", 2.0, 8, 0.5, 0.6))
    shifted = type(steps)(
        steps.clip_id,
        steps.song_start_s - 0.9,
        steps.song_end_s - 0.9,
        steps.clip_start_s,
        steps.clip_end_s,
        steps.has_seam,
        steps.blend_s,
    )
    cut, kept = trim(shifted, 3.0)
    assert kept.tolist() == [1, 2, 3, 4, 5, 6]
    assert cut.song_start_s[0] == 0.0
    assert cut.song_end_s[-1] == 3.0
    np.testing.assert_allclose(cut.warp_ratio, 1.2)
    assert cut.clip_start_s[0] == pytest.approx(2.75)


def test_trim_leaves_no_seam_before_the_first_frame(phrases):
    steps = phrases(("a", 0.0, 1, 0.5, 0.5), ("b", 0.0, 3, 0.5, 0.5))
    moved = type(steps)(
        steps.clip_id,
        steps.song_start_s - 0.5,
        steps.song_end_s - 0.5,
        steps.clip_start_s,
        steps.clip_end_s,
        steps.has_seam,
        steps.blend_s,
    )
    cut, kept = trim(moved, 1.5)
    assert kept.tolist() == [1, 2, 3]
    assert not cut.has_seam[0]
    assert cut.blend_s[0] == 0


def test_blends_never_overlap():
    start = np.array([0.0, 0.5, 0.8, 1.1, 2.0])
    end = np.append(start[1:], 3.0)
    seam = np.array([False, True, True, True, False])
    width = blend_widths(start, end, seam, wanted_s=0.4)
    assert width[0] == 0
    assert width[4] == 0
    np.testing.assert_allclose(width[1:4], [0.3, 0.3, 0.3])
    reach = np.flatnonzero(seam)
    for a, b in itertools.pairwise(reach):
        assert start[a] + width[a] / 2 <= start[b] - width[b] / 2 + 1e-12


@pytest.mark.parametrize(("gap_s", "n_filled"), [(0.75, 0), (0.79, 0), (0.81, 1), (1.0, 1), (1.5, 2)])
def test_only_a_gap_wider_than_the_tempo_allows_is_a_break(gap_s, n_filled):
    beats = np.concatenate([np.arange(9) * 0.5, 4.0 + gap_s + np.arange(9) * 0.5])
    grid, is_beat = cover(beats, float(beats[-1]))
    assert (~is_beat).sum() == n_filled
    np.testing.assert_allclose(np.diff(grid[(grid > 3.99) & (grid < 4.01 + gap_s)]), gap_s / (n_filled + 1))


def test_a_slow_passage_is_no_row_of_breaks():
    """Local tempo counts: half as fast for nine beats is another tempo, not eight gaps."""
    beats = np.concatenate([np.arange(12) * 0.5, 6.0 + np.arange(12) * 1.0])
    grid, is_beat = cover(beats, 17.0)
    assert (~is_beat[(grid > 8.5) & (grid < 16.5)]).sum() == 0


def test_the_grid_reaches_the_very_first_and_last_sample():
    grid, is_beat = cover(np.array([0.5, 1.0, 1.5]), 2.0)
    np.testing.assert_allclose(grid, [0.0, 0.5, 1.0, 1.5, 2.0])
    assert is_beat.tolist() == [False, True, True, True, False]
    assert grid[0] <= 0
    assert grid[-1] >= 2.0
    third = 1 / 3
    grid, _ = cover(third * np.arange(1, 31), 31 * third)
    assert -1e-9 < grid[0] <= 0.0
    assert 31 * third <= grid[-1] < 31 * third + 1e-9
    before, _ = cover(np.array([-0.2, 0.3, 0.8]), 0.9)
    np.testing.assert_allclose(before, [-0.2, 0.3, 0.8, 1.3])


def test_beats_past_the_end_of_the_song_are_kept():
    grid, is_beat = cover(np.arange(0, 5.0, 0.5), 3.0)
    assert is_beat.all()
    assert grid[-1] == 4.5


def test_a_clock_goes_on_evenly_before_its_first_and_after_its_last_boundary(phrases):
    found = clock(phrases(("a", 0.0, 4, 0.5, 0.4)))
    np.testing.assert_allclose(found.at(np.array([-1.0, -0.5, 2.0, 3.0])), [-1.25, -0.625, 2.4375 + 0.0625, 3.75])


def test_steps_that_only_touch_the_song_are_gone(phrases):
    steps = phrases(("a", 0.0, 6, 0.5, 0.5))
    moved = replace(steps, song_start_s=steps.song_start_s - 0.5, song_end_s=steps.song_end_s - 0.5)
    cut, kept = trim(moved, 1.5)
    assert kept.tolist() == [1, 2, 3]
    np.testing.assert_allclose([cut.song_start_s[0], cut.song_end_s[-1]], [0.0, 1.5])
    np.testing.assert_allclose([cut.clip_start_s[0], cut.clip_end_s[-1]], [0.5, 2.0])
    none, left = trim(replace(moved, song_start_s=moved.song_start_s + 9, song_end_s=moved.song_end_s + 9), 1.5)
    assert len(none.clip_id) == len(left) == 0


def test_the_last_step_is_cut_in_song_and_clip_at_its_own_pace(phrases):
    cut, _ = trim(phrases(("a", 0.0, 2, 0.5, 0.4), ("b", 1.0, 1, 0.5, 0.8)), 1.2)
    assert cut.clip_end_s[-1] == pytest.approx(1.25)
    assert cut.has_seam.tolist() == [False, False, True]
    assert cut.blend_s[-1] == pytest.approx(0.3)


def test_half_a_blend_may_take_a_whole_step_that_has_one_seam_and_half_of_one_with_two():
    edges = np.array([0.0, 0.1, 0.2, 2.0])
    one = blend_widths(edges[:-1], edges[1:], np.array([False, False, True]), wanted_s=0.4)
    np.testing.assert_allclose(one, [0, 0, 0.2])
    two = blend_widths(edges[:-1], edges[1:], np.array([False, True, True]), wanted_s=0.4)
    np.testing.assert_allclose(two, [0, 0.1, 0.1])
    last = blend_widths(np.array([0.0, 2.0]), np.array([2.0, 2.1]), np.array([False, True]), wanted_s=0.4)
    np.testing.assert_allclose(last, [0, 0.2])
    assert blend_widths(edges[:-1], edges[1:], np.array([False, False, True]), wanted_s=0.0).tolist() == [0, 0, 0]
