"""Evidence for music: there where it is, none where there is none, and slow change alone is no proof."""

from types import SimpleNamespace

import numpy as np
import pytest

from kernels.hmm.evidence import Evidence, measure, predicted, shuffled_order
from kernels.hmm.model import Performed, Smoothing, choose_smoothing
from kernels.synthetic.hidden_rules import DRUM_KEYS, draw_notes, draw_states, hidden_rules


def performance(loyalty, n=600, seed=0):
    rules = hidden_rules(loyalty=loyalty, seed=seed)
    state = draw_states(rules, n, seed=seed)
    notes = draw_notes(rules, state, interval_s=1.0, seed=seed)
    heard = np.zeros((n + 1, 12))
    keys = [DRUM_KEYS.index(k) if k in DRUM_KEYS else 0 for k in notes.key_number.tolist()]
    np.add.at(heard, (np.floor(notes.start_s + 1e-9).astype(int), keys), 1.0)
    return Performed(state, (heard[:n],))


def found(performances):
    smoothing = choose_smoothing(performances, 8, [12])
    return measure(performances, 8, [12], smoothing=smoothing)


def test_music_that_calls_the_motions_is_found():
    one = found([performance(0.8), performance(0.8, n=200, seed=0)])
    assert one.music_adds
    assert one.p < 0.01
    assert (one.with_music > one.bigram).all()
    assert (one.bigram > one.shuffled).all()


def test_music_that_tells_nothing_is_told_so():
    one = found([performance(0.0)])
    assert not one.music_adds


def test_chance_is_even_where_music_tells_nothing():
    p = [found([performance(0.0, n=160, seed=seed)]).p for seed in range(12)]
    assert np.mean(np.array(p) < 0.05) < 0.4
    assert max(p) > 0.3


def test_two_things_that_change_slowly_are_not_taken_for_one():
    """Motions in long spells, drums in long spells, each by itself."""
    rng = np.random.default_rng(3)
    p = []
    for _ in range(8):
        state = np.repeat(rng.integers(0, 4, 40), 4)
        drum = np.repeat(rng.integers(0, 4, 40), 4)
        p.append(measure([Performed(state, (np.eye(4)[drum],))], 4, [4], smoothing=Smoothing(0.1, (0.1,))).p)
    assert np.mean(np.array(p) < 0.01) < 0.3


def test_blocks_are_kept_together_and_nothing_is_lost():
    order = shuffled_order(50, np.random.default_rng(0))
    assert sorted(order.tolist()) == list(range(50))
    assert (np.diff(order) == 1).mean() > 0.5
    assert shuffled_order(0, np.random.default_rng(0)).tolist() == []


@pytest.mark.parametrize("state", [[], [0], [0, 1]])
def test_too_little_to_hold_out_is_no_evidence(state):
    few = [Performed(np.array(state, np.int64), (np.ones((len(state), 3)),))]
    one = measure(few, 2, [3], smoothing=Smoothing(1.0, (1.0,)))
    assert isinstance(one, Evidence)
    assert not one.music_adds
    assert measure([], 2, [3], smoothing=Smoothing(1.0, (1.0,))).gain == 0.0


def test_gain_weighs_performances_by_what_was_predicted_and_passes_over_the_others():
    nan = np.nan
    one = Evidence(np.array([-1.0, -2.0, nan]), np.array([-2.0, -2.5, nan]), np.zeros(3), np.array([30, 10, 0]), 0.005)
    assert one.gain == pytest.approx(0.75 * 1.0 + 0.25 * 0.5)
    assert one.music_adds


@pytest.mark.parametrize(("gain", "p", "adds"), [(0.01, 0.009, True), (0.009, 0.005, False), (0.5, 0.01, False)])
def test_music_adds_only_where_it_gains_and_chance_is_small(gain, p, adds):
    one = Evidence(np.array([gain]), np.zeros(1), np.zeros(1), np.ones(1, np.int64), p)
    assert one.music_adds == adds


def test_the_music_itself_counts_among_the_shuffles():
    found = measure([performance(0.9, n=400)], 8, [12], smoothing=Smoothing(0.1, (0.1,)), n_shuffles=4)
    assert found.p == pytest.approx(1 / 5)


def test_motions_are_predicted_from_the_one_before_with_their_music():
    log = np.log(np.array([[0.5, 0.5], [0.2, 0.8]]))
    model = SimpleNamespace(log_transition=log)
    state, at = np.array([1, 0, 1]), np.array([1, 2])
    silent = np.zeros((2, 2))
    assert predicted(model, state, at, silent) == pytest.approx(np.log(0.2) + np.log(0.5))
    loud = np.log(np.array([[0.9, 0.1], [0.3, 0.7]]))
    wanted = 0.2 * 0.9 / (0.2 * 0.9 + 0.8 * 0.1), 0.5 * 0.7 / (0.5 * 0.3 + 0.5 * 0.7)
    assert predicted(model, state, at, loud) == pytest.approx(np.log(wanted).sum())
    far = predicted(model, state, at, loud - 1e4)  # however small the likelihoods are
    assert far == pytest.approx(np.log(wanted).sum())


def test_likelihoods_far_apart_leave_the_motion_that_the_music_calls():
    model = SimpleNamespace(log_transition=np.log(np.full((2, 2), 0.5)))
    told = predicted(model, np.array([0, 1]), np.array([1]), np.array([[-5000.0, -100.0]]))
    assert told == pytest.approx(0.0)


def test_one_motion_cannot_be_held_out():
    few = [Performed(np.array([0]), (np.ones((1, 3)),))]
    one = measure(few, 2, [3], smoothing=Smoothing(1.0, (1.0,)))
    assert (one.n_motions.tolist(), one.p) == ([0], 1.0)
    assert np.isnan([one.with_music, one.bigram, one.shuffled]).all()
