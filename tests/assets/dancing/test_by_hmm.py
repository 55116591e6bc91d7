"""A song as the dancer hears it, and the pool of motions he dances from."""

from types import SimpleNamespace

import numpy as np
import pytest

from assets.dancing import by_hmm
from assets.dancing.avoided import AvoidedSpan
from assets.dancing.by_hmm import listen
from assets.reading.hearing import SYMBOLS
from assets.tables import hmm as hmm_tables
from assets.tables.hmm import ClipMotions
from kernels.hmm.instances import Motions
from kernels.hmm.model import Performed, Smoothing, learn
from kernels.music.drums_and_melody import Contour, Hits
from schemas.settings import Settings

SMOOTH = Smoothing(1.0, (0.01, 1.0))


@pytest.fixture
def heard():
    """Hear a song without a sound by a dancer whose motions last so long."""
    tune = tuple(np.zeros((2, n)) for n in SYMBOLS)
    model = learn([Performed(np.array([0, 1]), tune)], 2, SYMBOLS, smoothing=SMOOTH)
    hits = Hits(np.zeros(0), np.zeros(0, np.int64), np.zeros(0, np.int64))
    drums = hmm_tables.from_percussion("s", hits, heard_as="drums")
    melody = hmm_tables.from_melody("s", Contour(np.zeros(0), np.zeros(0, np.int64)))

    def hear(beat_s, *length_s):
        n = len(length_s)
        motions = Motions(np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n), np.array(length_s))
        return listen(SimpleNamespace(motions=motions, model=model), drums, melody, beat_s, Settings())

    return hear


def test_the_grid_goes_on_beyond_the_song_at_the_same_step(heard):
    found = heard(2.0 + 0.5 * np.arange(5), 0.5, 1.0)
    assert found.grid.parts == 1
    assert found.grid.longest == 2  # a second and a quarter are two and a half beats
    np.testing.assert_allclose(found.grid.point_s, 2.0 + 0.5 * np.arange(6))
    assert found.log_likelihood.shape == (4, 2)


def test_beats_are_cut_where_motions_are_shorter_and_each_beat_is_one(heard):
    found = heard(np.arange(4.0), 0.5, 0.5, 0.9)
    assert (found.grid.parts, found.grid.longest) == (2, 2)
    np.testing.assert_allclose(found.grid.point_s, 0.5 * np.arange(8))
    assert found.grid.is_beat.tolist() == [True, False] * 4


def test_a_motion_lasts_one_interval_at_least_and_eight_at_most(heard):
    assert heard(np.arange(0, 10.0), 0.1).grid.longest == 1
    assert heard(np.arange(0, 10.0), 0.9, 0.9, 60.0).grid.longest == 8


def motions_of(n):
    start = np.arange(float(n))
    return ClipMotions(start, start + 1.0, np.zeros(n, np.int64))


def test_a_pool_takes_pinned_clips_first_then_performances_then_by_name(monkeypatch):
    monkeypatch.setattr(by_hmm, "LARGEST_POOL", 5)
    usable = {name: motions_of(2) for name in ("a", "b", "c", "d", "e")}
    names, motions = by_hmm._pool(usable, {"e"}, {"d"})
    assert names == ("a", "d", "e")  # the last one fills it to the brim and over
    np.testing.assert_array_equal(motions.clip_index, [0, 0, 1, 1, 2, 2])
    monkeypatch.setattr(by_hmm, "LARGEST_POOL", 2)
    assert by_hmm._pool(usable, {"e"}, {"d"})[0] == ("e",)
    assert by_hmm._pool(usable, set(), {"d"})[0] == ("d",)
    monkeypatch.setattr(by_hmm, "LARGEST_POOL", 5)
    names, motions = by_hmm._pool(usable, set(), set())
    assert names == ("a", "b", "c")
    assert len(motions.start_s) == 6


def test_motions_that_show_what_is_to_be_avoided_are_left_out():
    span = AvoidedSpan("a", 2.2, 2.3)
    assert by_hmm._untouched("a", motions_of(5), [span], 0.0).start_s.tolist() == [0, 1, 3, 4]
    assert by_hmm._untouched("a", motions_of(5), [span], 0.5).start_s.tolist() == [0, 3, 4]
    assert by_hmm._untouched("b", motions_of(5), [span], 0.5).start_s.tolist() == [0, 1, 2, 3, 4]
