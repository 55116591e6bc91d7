"""Repeated parts of songs: known forms, loops, silence, nothing."""

import numpy as np
import pytest

from kernels.music.repeats import find_repeats


@pytest.fixture
def song():
    """Features of a song from its form: each letter is a part of as many beats, always the same but for noise."""

    def make(form, beats=24, noise=0.2, seed=0):
        rng = np.random.default_rng(seed)
        parts = {letter: rng.normal(size=(beats, 28)) for letter in sorted(set(form))}
        played = np.concatenate([parts[letter] for letter in form])
        return played + noise * rng.normal(size=played.shape)

    return make


def spans(found):
    return [(r.first, r.last, r.source) for r in found]


def test_a_chorus_comes_again(song):
    (found,) = find_repeats(song("abcb"))
    assert found.source == pytest.approx(24, abs=3)
    assert (found.first, found.last) == (pytest.approx(72, abs=3), pytest.approx(96, abs=3))
    assert found.first - found.source == 48
    assert found.likeness > 0.9


def test_a_third_chorus_repeats_the_first_not_the_second(song):
    found = find_repeats(song("abcbdb"))
    assert [r.source // 12 for r in found] == [2, 2]
    assert [round(r.first / 24) for r in found] == [3, 5]


def test_verse_and_chorus_together_are_one_repeat(song):
    (found,) = find_repeats(song("abab"))
    assert (found.source, found.first) == (0, 48)


def test_a_song_without_repeats_has_none(song):
    assert find_repeats(song("abcdef")) == []
    assert find_repeats(np.random.default_rng(3).normal(size=(300, 28))) == []


def test_short_riffs_silence_and_held_notes_are_no_repeats(song):
    assert find_repeats(song("abcb", beats=10)) == []
    assert find_repeats(np.zeros((200, 28))) == []
    held = np.tile(np.random.default_rng(0).normal(size=28), (200, 1))
    assert find_repeats(held) == []


def test_no_interval_is_danced_as_two_and_none_as_a_repeat(song):
    found = find_repeats(song("aabaabcaab"))
    later = np.concatenate([np.arange(r.first, r.last) for r in found])
    earlier = np.concatenate([np.arange(r.source, r.source + r.last - r.first) for r in found])
    assert len(found) > 1
    assert len(np.unique(later)) == len(later)
    assert not np.isin(earlier, later).any()


def test_of_nothing_and_of_little():
    assert find_repeats(np.zeros((0, 28))) == []
    assert find_repeats(np.ones((31, 4))) == []


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match="finite"):
        find_repeats(np.full((40, 2), np.nan))
    with pytest.raises(ValueError, match="alike"):
        find_repeats(np.ones((40, 2)), alike=0.0)


def test_it_repeats_to_the_bit(song):
    feature = song("abcbab")
    assert spans(find_repeats(feature)) == spans(find_repeats(feature.copy()))


def test_a_part_played_again_and_again_never_overlaps_what_it_repeats(song):
    found = find_repeats(song("aaaa"))
    assert found
    for r in found:
        assert r.last - r.first <= r.first - r.source
    assert found[0].source == 0


def test_sixteen_beats_are_a_part_and_fifteen_are_not(song):
    (found,) = find_repeats(song("bb", beats=16, noise=0.05))
    assert (found.first, found.last, found.source) == (16, 32, 0)
    assert find_repeats(song("bb", beats=15, noise=0.05)) == []
    assert len(find_repeats(song("bb", beats=15, noise=0.05), least_beats=15)) == 1


def test_only_music_alike_enough_comes_again(song):
    feature = song("abcb", noise=0.5)
    (found,) = find_repeats(feature)
    assert 0.65 <= found.likeness < 0.9
    assert find_repeats(feature, alike=0.95) == []


def test_a_held_note_inside_a_part_that_comes_again_does_not_break_it(song):
    """Fewer than half of any eight beats stand still: the part is lively enough."""
    feature = song("ab", beats=40, noise=0.05)
    feature[10:13] = feature[10]
    feature[40:] = feature[:40]
    (found,) = find_repeats(feature)
    assert (found.first, found.last) == (40, 80)
    feature[5:35] = feature[5]
    feature[45:75] = feature[5]
    assert all(r.last - r.first < 40 for r in find_repeats(feature))


def test_of_two_sources_as_good_the_earlier_is_repeated(song):
    found = find_repeats(song("bcbdb", noise=0.0))
    assert [r.source for r in found] == [0, 0]


@pytest.mark.parametrize(("least_beats", "alike"), [(0, 0.5), (16, 0.0), (16, 1.1)])
def test_limits_that_cannot_be_are_refused(least_beats, alike):
    with pytest.raises(ValueError, match="least_beats, alike"):
        find_repeats(np.ones((40, 2)), least_beats=least_beats, alike=alike)
    with pytest.raises(ValueError, match=r"\(K, D\)"):
        find_repeats(np.ones(40))
