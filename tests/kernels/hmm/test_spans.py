"""How long basic motions may last where recordings fit, what spans cost, and what two ways share."""

import numpy as np
import pytest

from kernels.hmm.durations import log_durations
from kernels.hmm.instances import Motions
from kernels.hmm.model import Performed, Smoothing, learn
from kernels.hmm.places import Places
from kernels.hmm.spans import LEAST_LOG, log_lasting, shared_ratio, span_costs
from kernels.hmm.viterbi import Spans, best_spans


def spans_of(*rows):
    """(state, start, length) each."""
    return Spans(*np.array(rows, np.int64).T)


@pytest.fixture
def model():
    """Two states that mostly alternate, with one stream of one symbol."""
    state = np.array([0, 1, 0, 1, 1, 0])
    return learn([Performed(state, (np.ones((6, 1)),))], 2, (1,), smoothing=Smoothing(1.0, (1.0,)), weight=(1.0,))


def test_a_length_without_a_recording_is_never_danced():
    """Motion 0 of state 0 fits one interval from each start, motion 1 of state 1 two, and from the first alone."""
    zero, one, none = np.array([0]), np.array([1]), np.zeros(0, np.int64)
    free = np.zeros(1)
    places = Places([[(zero, free), (one, free)], [(zero, free), (none, np.zeros(0))]])
    motions = Motions(np.array([0, 0]), np.array([0, 1]), np.array([0.0, 0.5]), np.array([0.5, 1.5]))
    grid = 0.5 * np.arange(4)
    found = log_lasting(places, motions, grid, n_states=3)
    counted = log_durations(grid, [np.array([0.5]), np.array([1.0]), np.zeros(0)], longest=2)
    assert found.shape == (2, 2, 3)
    np.testing.assert_array_equal(found[:, 0, 0], counted[:, 0, 0])
    assert found[0, 1, 1] == counted[0, 1, 1]
    is_danced = np.zeros((2, 2, 3), bool)
    is_danced[:, 0, 0] = is_danced[0, 1, 1] = True
    np.testing.assert_array_equal(np.isfinite(found), is_danced)


def test_a_recording_that_fits_keeps_its_length_possible_however_seldom_it_is():
    """A hundred motions of one interval and one of two: its length counts, and one that nothing is counted for too."""
    motions = Motions(np.zeros(2, np.int64), np.zeros(2, np.int64), np.zeros(2), np.array([0.5, 0.5]))
    free = np.zeros(1)
    places = Places([[(np.array([0]), free), (np.array([1]), free)]])
    found = log_lasting(places, motions, 0.5 * np.arange(3), n_states=1)
    assert found[0, 1, 0] == LEAST_LOG
    assert found[0, 0, 0] == pytest.approx(0.0, abs=1e-3)


def test_costs_of_spans_are_the_log_probability_of_the_way(model):
    rng = np.random.default_rng(0)
    log_music = np.log(rng.uniform(0.1, 1, (6, 2)))
    lasting = np.log(np.array([[[0.6, 0.5], [0.4, 0.5]]] * 6))
    spans, total = best_spans(model.log_initial, model.log_transition, log_music, lasting)
    by_model, by_music = span_costs(model, log_music, spans)
    lasts = lasting[spans.start, spans.length - 1, spans.state].sum()
    assert len(spans.state) > 2
    assert -(by_model.sum() + by_music.sum()) + lasts == pytest.approx(total)
    assert (by_model >= 0).all()


def test_each_span_pays_for_its_own_music_as_far_as_the_song_goes(model):
    log_music = np.array([[-1.0, -10.0], [-2.0, -20.0], [-3.0, -30.0]])
    by_model, by_music = span_costs(model, log_music, spans_of((1, 0, 1), (0, 1, 5)))
    np.testing.assert_allclose(by_music, [10, 5])
    np.testing.assert_allclose(by_model, [-model.log_initial[1], -model.log_transition[1, 0]])


def test_what_two_ways_share():
    one, other = spans_of((0, 0, 2), (1, 2, 2)), spans_of((0, 0, 1), (1, 1, 2), (0, 3, 9))
    assert shared_ratio(one, one, 4) == 1.0
    assert shared_ratio(one, other, 4) == 0.5
    assert shared_ratio(spans_of((0, 0, 4)), spans_of((1, 0, 4)), 4) == 0.0
