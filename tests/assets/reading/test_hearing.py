"""What the model hears: drums by name where they are told apart, else by band."""

import numpy as np
import pytest

from assets.reading.hearing import SYMBOLS, hear
from assets.tables import hmm as hmm_tables
from kernels.hmm.model import Performed, Smoothing, learn
from kernels.music.drums_and_melody import FIRST_KEY, Contour, Hits

EDGE_S = np.array([0.0, 1.0, 2.0])


def heard(heard_as, symbols="product"):
    hits = Hits(np.array([0.0, 0.5, 0.97]), np.array([36, 38, 42]), np.array([90, 100, 70]))
    drums = hmm_tables.from_percussion("s", hits, heard_as=heard_as)
    tune = hmm_tables.from_melody("s", Contour(np.array([1.2]), np.array([3])))
    return hear(drums, tune, EDGE_S, symbols=symbols)


def test_strokes_just_before_a_motion_are_its_own():
    found = heard("drums")
    assert found.drums[:, 36 - FIRST_KEY].tolist() == [1, 0]
    assert found.drums[:, 42 - FIRST_KEY].tolist() == [0, 1]
    assert found.melody[:, 3].tolist() == [0, 1]
    assert heard("drums", "single").drums.sum(axis=1).tolist() == [1, 1]


def test_of_a_band_nothing_is_learned_of_one_drum_more_than_of_another():
    drums, _ = heard("bands").to_learn()
    assert drums[0].sum() == pytest.approx(2)
    assert drums[0, 35 - FIRST_KEY] == drums[0, 36 - FIRST_KEY] > 0


def test_a_model_of_drums_hears_bands_as_any_of_them():
    rows = np.zeros((2, SYMBOLS[0]))
    rows[0, 35 - FIRST_KEY], rows[1, 40 - FIRST_KEY] = 20, 20
    tune = np.zeros((2, SYMBOLS[1]))
    model = learn([Performed(np.array([0, 1]), (rows, tune))], 2, SYMBOLS, smoothing=Smoothing(1.0, (0.01, 1.0)))
    low = hmm_tables.from_percussion("s", Hits(np.zeros(1), np.array([36]), np.array([90])), heard_as="bands")
    none = hmm_tables.from_melody("s", Contour(np.zeros(0), np.zeros(0, np.int64)))
    log_p = hear(low, none, EDGE_S, symbols="product").log_likelihood(model)
    assert log_p[0, 0] > log_p[0, 1] + 3
    assert (log_p[1] == 0).all()
