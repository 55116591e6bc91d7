"""Drums by name, bands of onsets, contours, and what is heard in which interval."""

import numpy as np
import pytest

from kernels.music.drums_and_melody import (
    BAND_OF_KEY,
    CONTOUR,
    FIRST_KEY,
    HIGH,
    KIT_KEYS,
    LOW,
    MIDDLE,
    N_KEYS,
    NEAREST_KEY,
    Hits,
    band_hits,
    banded,
    contour,
    drum_hits,
    heard_in,
    loudest_in,
    spread_bands,
)
from kernels.music.notes import sorted_notes


def notes(*rows):
    return sorted_notes([(at, 0.1, key, velocity, channel, 0) for at, key, velocity, channel in rows])


def test_drums_are_channel_ten_and_nothing_else():
    found = drum_hits(notes((0.0, 36, 100, 10), (0.5, 60, 90, 1), (1.0, 38, 80, 10)))
    assert found.hits.time_s.tolist() == [0.0, 1.0]
    assert found.hits.key_number.tolist() == [36, 38]
    assert found.hits.velocity.tolist() == [100, 80]
    assert (found.mapped, found.dropped) == ({}, {})


def test_all_47_keys_are_kept():
    every = notes(*((0.1 * i, key, 64, 10) for i, key in enumerate(range(35, 82))))
    assert drum_hits(every).hits.key_number.tolist() == list(range(35, 82))
    assert N_KEYS == 47


def test_pads_beyond_general_midi_become_the_nearest_sound_and_are_counted():
    found = drum_hits(
        notes((0, 22, 1, 10), (1, 26, 1, 10), (2, 58, 1, 10), (3, 58, 1, 10), (4, 3, 1, 10), (5, 120, 1, 10))
    )
    assert found.hits.key_number.tolist() == [42, 46, 58, 58]
    assert found.mapped == {22: 1, 26: 1}
    assert found.dropped == {3: 1, 120: 1}
    kit = drum_hits(notes((0, 22, 1, 10), (1, 58, 1, 10), (2, 36, 1, 10)))
    assert kit.hits.key_number.tolist() == [42, 43, 36]
    assert kit.mapped == {22: 1, 58: 1}


def test_a_vibraslap_among_other_instruments_stays_one():
    assert drum_hits(notes((0, 58, 1, 10), (1, 60, 1, 1))).hits.key_number.tolist() == [58]
    assert drum_hits(notes((0, 58, 1, 10), (1, 62, 1, 10))).hits.key_number.tolist() == [58, 62]


def test_no_drums_no_hits():
    assert len(drum_hits(notes((0.0, 60, 90, 1))).hits.time_s) == 0
    assert len(drum_hits(notes()).hits.time_s) == 0


def burst(at_s, hz, rate_hz=22050, seconds=4.0):
    """Short sounds of one pitch on silence."""
    time_s = np.arange(int(seconds * rate_hz)) / rate_hz
    out = np.zeros(len(time_s))
    for at in at_s:
        out += np.where(time_s >= at, np.sin(2 * np.pi * hz * (time_s - at)) * np.exp(-(time_s - at) / 0.04), 0.0)
    return 0.5 * out


@pytest.mark.parametrize(("hz", "key"), [(60.0, LOW), (800.0, MIDDLE), (8000.0, HIGH)])
def test_onsets_are_heard_in_their_band(hz, key):
    at_s = np.array([0.5, 1.0, 1.75, 2.5, 3.0])
    found = band_hits(burst(at_s, hz), 22050)
    own = found.time_s[found.key_number == key]
    assert len(own) == 5
    assert np.abs(own - at_s).max() < 0.05


def test_silence_has_no_onsets():
    assert len(band_hits(np.zeros(22050), 22050).time_s) == 0
    assert len(band_hits(np.zeros(0), 22050).time_s) == 0


def test_contour_by_hand_of_the_highest_notes():
    found = contour(
        notes(
            (0, 60, 1, 1),
            (0, 52, 1, 1),
            (1, 62, 1, 1),
            (2, 62, 1, 2),
            (3, 72, 1, 1),
            (4, 71, 1, 1),
            (5, 50, 1, 1),
            (5, 99, 1, 10),
        )
    )
    assert [CONTOUR[s] for s in found.symbol] == ["step up", "same", "leap up", "step down", "leap down"]
    assert found.time_s.tolist() == [1, 2, 3, 4, 5]
    assert len(contour(notes((0, 60, 1, 1))).time_s) == 0
    assert len(contour(notes((0, 36, 1, 10), (1, 36, 1, 10))).time_s) == 0


def test_what_is_heard_in_which_interval():
    edges = np.array([0.0, 1.0, 2.0])
    time_s = np.array([-0.5, 0.0, 0.5, 0.97, 1.0, 1.99, 2.0])
    symbol = np.zeros(7, np.int64)
    assert heard_in(time_s, symbol, edges, 1)[:, 0].tolist() == [3, 2]
    assert heard_in(time_s, symbol, edges, 1, ahead_s=0.05)[:, 0].tolist() == [2, 2]
    assert heard_in(time_s, symbol, edges[:1], 1).shape == (0, 1)


def test_the_documents_single_symbol_is_the_loudest():
    hits = Hits(np.array([0.1, 0.2, 0.3, 1.5]), np.array([42, 38, 36, 49]), np.array([90, 100, 100, 30]))
    one = loudest_in(hits, np.array([0.0, 1.0, 2.0, 3.0]))
    assert np.argwhere(one).tolist() == [[0, 36 - FIRST_KEY], [1, 49 - FIRST_KEY]]


def test_the_single_symbol_is_the_loudest_of_each_interval_alone():
    rng = np.random.default_rng(5)
    time_s = np.sort(rng.uniform(-1, 9, 200))
    hits = Hits(time_s, rng.integers(35, 82, 200), rng.integers(1, 6, 200))
    edge_s = np.sort(rng.uniform(0, 8, 12))
    found = loudest_in(hits, edge_s, ahead_s=0.06)
    for i in range(11):
        here = (time_s >= edge_s[i] - 0.06) & (time_s < edge_s[i + 1] - 0.06)
        ranked = sorted(zip((-hits.velocity[here]).tolist(), hits.key_number[here].tolist(), strict=True))
        assert np.flatnonzero(found[i]).tolist() == [key - FIRST_KEY for _, key in ranked[:1]]
    assert loudest_in(hits, np.zeros(0)).shape == (0, N_KEYS)


def test_a_band_stands_for_all_its_drums():
    counts = np.zeros((1, N_KEYS))
    counts[0, [LOW - FIRST_KEY, HIGH - FIRST_KEY]] = [2, 1]
    spread = spread_bands(counts)
    assert spread.sum() == pytest.approx(3)
    assert spread[0, 35 - FIRST_KEY] == spread[0, 36 - FIRST_KEY] > 0
    log_p = np.log(np.random.default_rng(0).dirichlet(np.ones(N_KEYS), 2))
    total = sum(np.exp(banded(log_p)[:, key - FIRST_KEY]) for key in (LOW, MIDDLE, HIGH))
    np.testing.assert_allclose(total, 1.0)


def test_a_leap_is_more_than_four_semitones():
    found = contour(notes((0, 60, 1, 1), (1, 64, 1, 1), (2, 69, 1, 1), (3, 65, 1, 1), (4, 60, 1, 1)))
    assert [CONTOUR[s] for s in found.symbol] == ["step up", "leap up", "step down", "leap down"]


def test_notes_within_three_hundredths_are_one_chord():
    found = contour(notes((0.0, 60, 1, 1), (0.02, 67, 1, 1), (1.0, 62, 1, 1)))
    assert found.time_s.tolist() == [1.0]
    assert [CONTOUR[s] for s in found.symbol] == ["leap down"]
    assert len(contour(notes((0.0, 60, 1, 1), (0.04, 67, 1, 1), (1.0, 62, 1, 1))).time_s) == 2


def test_two_onsets_of_a_band_lie_a_tenth_of_a_second_apart():
    loud = burst([0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5], 800.0)
    once = band_hits(loud, 22050)
    double = band_hits(loud + np.roll(loud, int(0.05 * 22050)), 22050)
    middle = double.time_s[double.key_number == MIDDLE]
    assert len(middle) == (once.key_number == MIDDLE).sum() == 7
    assert np.diff(middle).min() >= 0.1 - 1e-9


def test_velocities_are_of_the_rise_of_each_band():
    sound = burst([0.5, 1.5], 800.0)
    sound[22050 : 2 * 22050] *= 0.05
    hits = band_hits(sound, 22050)
    velocity = hits.velocity[hits.key_number == MIDDLE]
    assert velocity.max() == 127
    assert velocity[0] > velocity[-1] >= 1


def test_of_equally_loud_symbols_the_lowest_key_is_kept():
    hits = Hits(np.array([0.1, 0.2, 0.3]), np.array([49, 38, 42]), np.array([90, 90, 90]))
    one = loudest_in(hits, np.array([0.0, 1.0]))
    assert np.argwhere(one).tolist() == [[0, 38 - FIRST_KEY]]


def test_every_sound_a_pad_becomes_is_one_of_general_midi():
    assert set(NEAREST_KEY.values()) <= set(range(FIRST_KEY, FIRST_KEY + N_KEYS))
    assert not set(NEAREST_KEY) & set(range(FIRST_KEY, FIRST_KEY + N_KEYS))
    assert set(BAND_OF_KEY.tolist()) == {LOW, MIDDLE, HIGH}
    assert [int(BAND_OF_KEY[key - FIRST_KEY]) for key in (LOW, MIDDLE, HIGH)] == [LOW, MIDDLE, HIGH]


@pytest.mark.parametrize(
    ("key", "band"), [(36, LOW), (41, LOW), (38, MIDDLE), (60, MIDDLE), (42, HIGH), (53, HIGH), (81, HIGH)]
)
def test_bass_drums_are_low_cymbals_high_and_the_rest_between(key, band):
    assert BAND_OF_KEY[key - FIRST_KEY] == band


def test_pads_of_a_kit_are_its_drums_and_cymbals_and_no_percussion():
    assert {22, 26, 36, 38, 42, 46, 49, 51, 53, 58} <= KIT_KEYS  # the bell of the ride among them
    assert not {35, 54, 56, 60, 69} & KIT_KEYS  # tambourine, cowbell, bongo, cabasa
