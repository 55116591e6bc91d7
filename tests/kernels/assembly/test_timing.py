"""The beat grid over a song, the clock, and the cut to the song's length."""

import itertools

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
