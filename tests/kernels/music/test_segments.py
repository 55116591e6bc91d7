"""Cuts of songs at changes, bars and beats."""

import numpy as np
import pytest

from kernels.music.segments import LONGEST_S, beat_features, cut_song, novelty


def grid(n_beats, interval_s=0.5):
    return np.arange(n_beats + 1) * interval_s


def bars(n, metre=4):
    return np.arange(n) % metre + 1


def test_a_change_is_the_largest_novelty():
    feature = np.concatenate([np.zeros((16, 2)), np.ones((16, 2))])
    found = novelty(feature)
    assert found.argmax() == 16
    assert found[16] == 1
    assert found[0] == found[-1] == 0


def test_nothing_changes_in_one_texture_or_none():
    assert not novelty(np.ones((20, 3))).any()
    assert not novelty(np.zeros((0, 3))).any()
    assert len(novelty(np.zeros((1, 3)))) == 2


def test_even_songs_are_cut_every_eight_beats():
    g = grid(64)
    found = cut_song(g, duration_s=32.0, beat_in_bar_number=np.zeros(65, int), change=np.zeros(65))
    np.testing.assert_allclose(found.start_s, np.arange(0, 32, 4.0))


def test_slow_songs_are_cut_every_four_beats():
    g = grid(32, 1.0)
    found = cut_song(g, duration_s=32.0, beat_in_bar_number=bars(33), change=np.zeros(33))
    np.testing.assert_allclose(np.diff(found.start_s), 4.0)


def test_waltzes_are_cut_at_bars():
    g = grid(48)
    found = cut_song(g, duration_s=24.0, beat_in_bar_number=bars(49, 3), change=np.zeros(49))
    assert set(np.rint(found.start_s / 0.5).astype(int) % 3) == {0}


def test_cuts_move_to_where_the_music_changes():
    change = np.zeros(65)
    change[[12, 28, 44]] = 1.0
    found = cut_song(grid(64), duration_s=32.0, beat_in_bar_number=bars(65), change=change)
    assert {6.0, 14.0, 22.0} <= set(found.start_s)
    assert found.novelty[list(found.start_s).index(6.0)] == 1


@pytest.mark.parametrize("interval_s", [0.2, 0.37, 0.9, 3.0, 11.0])
@pytest.mark.parametrize("longest_s", [LONGEST_S, 2.5])
def test_the_whole_song_is_covered_without_gaps(interval_s, longest_s):
    g = grid(int(40 / interval_s) + 2, interval_s) - 0.1
    n = len(g)
    rng = np.random.default_rng(1)
    found = cut_song(g, duration_s=39.3, beat_in_bar_number=bars(n), change=rng.random(n), longest_s=longest_s)
    assert found.start_s[0] == 0
    assert found.end_s[-1] == 39.3
    np.testing.assert_array_equal(found.start_s[1:], found.end_s[:-1])
    assert ((found.end_s - found.start_s) <= longest_s + 1e-9).all()
    assert (found.frame_count <= round(longest_s * 120)).all()
    np.testing.assert_array_equal(np.cumsum(found.frame_count)[:-1], found.start_frame_index[1:])
    assert found.frame_count.sum() == int(39.3 * 120) + 1


def test_a_song_shorter_than_a_beat_is_one_segment():
    found = cut_song(grid(2), duration_s=0.3, beat_in_bar_number=np.zeros(3, int), change=np.zeros(3))
    assert len(found.start_s) == 1


def test_timbre_between_beats_tells_two_tones_apart():
    rate_hz = 22050
    t = np.arange(4 * rate_hz) / rate_hz
    sound = np.where(t < 2, np.sin(2 * np.pi * 220 * t), np.sin(2 * np.pi * 3000 * t))
    feature = beat_features(sound, rate_hz, grid_s=grid(8))
    assert feature.shape[0] == 8
    assert novelty(feature, reach=3).argmax() == 4
    assert not beat_features(np.zeros(rate_hz), rate_hz, grid_s=grid(2)).any()


@pytest.mark.parametrize(
    ("change", "match"),
    [({"duration_s": 0.0}, "duration_s"), ({"duration_s": 99.0}, "grid_s"), ({"longest_s": 9.0}, "longest_s")],
)
def test_errors(change, match):
    how = {"duration_s": 4.0, "beat_in_bar_number": np.zeros(9, int), "change": np.zeros(9)}
    with pytest.raises(ValueError, match=match):
        cut_song(grid(8), **(how | change))


def test_places_must_fit_the_grid():
    with pytest.raises(ValueError, match="places and changes"):
        cut_song(grid(8), duration_s=4.0, beat_in_bar_number=np.zeros(3, int), change=np.zeros(9))
