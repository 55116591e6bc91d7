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


def lengths(found, interval_s=0.5):
    return np.rint((found.end_s - found.start_s) / interval_s).astype(int).tolist()


def cut(n_beats, interval_s=0.5, numbers=None, change=None, **how):
    return cut_song(
        grid(n_beats, interval_s),
        duration_s=n_beats * interval_s,
        beat_in_bar_number=np.zeros(n_beats + 1, int) if numbers is None else numbers,
        change=np.zeros(n_beats + 1) if change is None else change,
        **how,
    )


@pytest.mark.parametrize("pick_up", [1, 2, 3])
def test_cuts_fall_on_the_first_beats_of_bars(pick_up):
    numbers = (np.arange(65) - pick_up) % 4 + 1
    found = cut(64, numbers=numbers)
    at = np.rint(found.start_s[1:] / 0.5).astype(int)
    assert len(at) > 5
    assert (numbers[at] == 1).all()


def test_where_no_bar_is_known_no_cut_is_paid_for_as_within_one():
    # 13 beats: eight and five cost hardly less than one long segment, so a price on the cut would leave it out
    assert len(cut(13).start_s) == 2
    assert len(cut(13, numbers=np.full(14, 2) - np.eye(1, 14, dtype=int)[0]).start_s) == 1


def test_an_odd_length_is_not_worth_a_change_that_a_usual_one_would_be():
    change = np.zeros(17)
    change[6] = 1.0  # cuts off six beats and ten
    assert lengths(cut(16, change=change)) == [8, 8]
    change = np.zeros(13)
    change[4] = 1.0  # cuts off four beats and eight
    assert lengths(cut(12, change=change)) == [4, 8]


@pytest.mark.parametrize(
    ("metre", "interval_s", "wanted"),
    [(0, 0.5, 8), (2, 0.5, 8), (4, 1.0, 4), (3, 0.5, 6), (3, 0.3, 12), (5, 0.5, 10), (6, 0.5, 6), (7, 0.5, 7)],
)
def test_the_usual_length_is_whole_bars_nearest_to_four_seconds(metre, interval_s, wanted):
    n = 5 * wanted
    numbers = np.arange(n + 1) % metre + 1 if metre else None
    assert lengths(cut(n, interval_s, numbers), interval_s) == [wanted] * 5


def test_fast_songs_are_not_cut_shorter_than_a_second_and_a_half():
    found = cut(128, 0.15)
    assert (found.end_s - found.start_s).min() >= 1.5


def test_a_gap_between_beats_longer_than_a_segment_is_cut_evenly():
    found = cut_song(
        np.array([0.0, 10.0, 20.0]), duration_s=20.0, beat_in_bar_number=np.zeros(3, int), change=np.array([0, 0.5, 0])
    )
    np.testing.assert_allclose(found.start_s, [0.0, 5.0, 10.0, 15.0])
    np.testing.assert_array_equal(found.novelty, [0.0, 0.0, 0.5, 0.0])


@pytest.mark.parametrize(("first_s", "duration_s"), [(0.03, 6.03), (0.0, 6.03)])
def test_beats_at_the_very_ends_of_a_song_are_its_ends(first_s, duration_s):
    """Twelve beats are one segment, thirteen two: no sliver of 0.03 s at an end counts as a beat."""
    g = first_s - 0.5 + np.arange(15) * 0.5
    found = cut_song(g, duration_s=duration_s, beat_in_bar_number=np.zeros(15, int), change=np.zeros(15))
    assert len(found.start_s) == 1


def test_a_texture_that_alternates_evenly_is_no_change():
    restless = np.where(np.arange(24) % 2, 1.0, -1.0)[:, None] * np.ones(3)
    found = novelty(np.concatenate([restless, np.full((16, 3), 3.0)]))
    assert found.argmax() == 24
    assert found[2:20].max() < 0.1


def test_changes_nearby_weigh_more_than_those_a_kernel_away():
    """Two equal changes at once and one after the other: what lies just beside a boundary decides."""
    feature = np.zeros((32, 1))
    feature[16:] = 1.0
    feature[10] = 1.0
    found = novelty(feature)
    assert found[16] == 1
    assert 0 < found[10] < 0.6


def test_beats_closer_than_a_frame_take_the_frame_nearest_to_them():
    rate_hz = 22050
    sound = np.sin(2 * np.pi * 440 * np.arange(rate_hz) / rate_hz)
    feature = beat_features(sound, rate_hz, grid_s=np.array([0.0, 0.5, 0.501, 0.502, 1.0]))
    assert np.isfinite(feature).all()
    np.testing.assert_allclose(feature[1], feature[2])


def test_timbre_and_harmony_weigh_alike_over_a_song():
    rate_hz = 22050
    t = np.arange(4 * rate_hz) / rate_hz
    sound = np.where(t < 2, np.sin(2 * np.pi * 220 * t), np.sin(2 * np.pi * 300 * t)) + 0.1 * np.sin(2 * np.pi * t * 90)
    feature = beat_features(sound, rate_hz, grid_s=grid(8))
    for part in (feature[:, :-12], feature[:, -12:]):
        np.testing.assert_allclose(part.mean(axis=0), 0, atol=1e-9)
        assert (part**2).sum(axis=1).mean() == pytest.approx(1)


def test_a_grid_that_starts_late_or_a_song_of_one_beat_is_refused():
    how = {"duration_s": 4.0, "beat_in_bar_number": np.zeros(9, int), "change": np.zeros(9)}
    with pytest.raises(ValueError, match="from 0 to the end"):
        cut_song(grid(8) + 0.2, **how)
    with pytest.raises(ValueError, match="from 0 to the end"):
        cut_song(np.zeros(1), duration_s=4.0, beat_in_bar_number=np.zeros(1, int), change=np.zeros(1))
    with pytest.raises(ValueError, match="from 0 to the end"):
        cut_song(
            np.array([0.0, 2.0, 1.0, 4.0]), duration_s=4.0, beat_in_bar_number=np.zeros(4, int), change=np.zeros(4)
        )
