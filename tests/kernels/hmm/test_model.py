"""Counting: by hand, against known rules, across the ends of performances, and with too little to count."""

import numpy as np
import pytest

from kernels.hmm.model import (
    ALPHAS,
    Model,
    Performed,
    Smoothing,
    choose_smoothing,
    count,
    folds,
    learn,
    smoothed,
    without,
)


def performed(state, heard=None, n_symbols=2):
    heard = np.zeros((len(state), n_symbols)) if heard is None else np.array(heard, float)
    return Performed(np.array(state, np.int64), (heard,))


def test_counts_by_hand():
    found = count([performed([0, 1, 1, 0], [[1, 0], [0, 2], [0, 0], [1, 1]]), performed([1, 0])], 2, [2])
    assert found.initial.tolist() == [1, 1]
    assert found.transition.tolist() == [[0, 1], [2, 1]]
    assert found.emission[0].tolist() == [[2, 1], [0, 2]]


def test_the_end_of_a_performance_is_not_followed_by_the_next():
    apart = count([performed([0, 0]), performed([1, 1])], 2, [2]).transition
    assert apart.tolist() == [[1, 0], [0, 1]]


def test_nothing_is_counted_across_an_unknown_motion():
    found = count([performed([-1, 0, -1, 1], [[1, 0]] * 4)], 2, [2])
    assert found.initial.tolist() == [1, 0]
    assert found.transition.sum() == 0
    assert found.emission[0].sum() == 2


def test_smoothing_by_hand_and_uniform_where_nothing_was_seen():
    np.testing.assert_allclose(np.exp(smoothed(np.array([[3.0, 0.0], [0.0, 0.0]]), 1.0)), [[0.8, 0.2], [0.5, 0.5]])
    with pytest.raises(ValueError, match="alpha"):
        smoothed(np.zeros(2), 0.0)


def test_a_long_performance_gives_its_rules_back():
    rng = np.random.default_rng(0)
    a, b = rng.dirichlet(np.ones(4), 4), rng.dirichlet(np.ones(6), 4)
    state = np.zeros(6000, np.int64)
    for i in range(1, 6000):
        state[i] = rng.choice(4, p=a[state[i - 1]])
    heard = np.array([rng.multinomial(2, b[k]) for k in state], float)
    long = [Performed(state, (heard,))]
    model = learn(long, 4, [6], smoothing=choose_smoothing(long, 4, [6]))
    assert np.abs(np.exp(model.log_transition) - a).mean() < 0.02
    assert np.abs(np.exp(model.log_emission[0]) - b).mean() < 0.02


def test_alpha_is_small_where_much_was_seen_and_large_where_music_is_noise():
    rng = np.random.default_rng(1)
    state = np.arange(400) % 4
    own = [Performed(state, (np.eye(4)[state] * 2,))]
    chosen = choose_smoothing(own, 4, [4])
    assert chosen.transition_alpha == ALPHAS[0]
    assert chosen.emission_alpha == (ALPHAS[0],)
    noise = [Performed(state[:60], (rng.multinomial(1, np.full(30, 1 / 30), 60).astype(float),))]
    assert choose_smoothing(noise, 4, [30]).emission_alpha[0] >= 1.0


def test_one_motion_and_none_can_be_learned_from():
    for state in ([0], []):
        few = [performed(state)]
        chosen = choose_smoothing(few, 2, [2])
        assert (chosen.transition_alpha, chosen.emission_alpha) == (1.0, (1.0,))
        model = learn(few, 2, [2], smoothing=chosen)
        np.testing.assert_allclose(np.exp(model.log_transition), 0.5)


def test_held_out_parts_cover_every_motion_once():
    two = [performed([0] * 11), performed([1] * 3)]
    seen = sorted((i, t) for fold in folds(two) for i, a, b in fold for t in range(a, b))
    assert seen == [(0, t) for t in range(11)] + [(1, t) for t in range(3)]
    left = without(two, [(0, 2, 4), (1, 0, 3)])
    assert [len(one.state) for one in left] == [2, 7]


def test_streams_are_weighed():
    state = np.array([0, 1])
    both = [Performed(state, (np.eye(2), np.array([[0.0, 1.0], [1.0, 0.0]])))]
    model = learn(both, 2, [2, 2], smoothing=Smoothing(1.0, (0.1, 0.1)), weight=(1.0, 0.5))
    found = model.log_likelihood([np.array([[1.0, 0.0]]), np.array([[1.0, 0.0]])])
    np.testing.assert_allclose(found[0], model.log_emission[0][:, 0] + 0.5 * model.log_emission[1][:, 0])


def test_what_does_not_fit_is_refused():
    with pytest.raises(ValueError, match="heard"):
        Performed(np.zeros(2, np.int64), (np.zeros((3, 2)),))
    with pytest.raises(ValueError, match="states"):
        count([performed([5])], 2, [2])
    with pytest.raises(ValueError, match="symbols"):
        count([performed([0])], 2, [3])
    with pytest.raises(ValueError, match="sum to 1"):
        Model(np.log([0.5, 0.2]), np.log(np.full((2, 2), 0.5)), (np.log(np.full((2, 2), 0.5)),), (1.0,))
    with pytest.raises(ValueError, match="weight"):
        Model(np.log([0.5, 0.5]), np.log(np.full((2, 2), 0.5)), (np.log(np.full((2, 2), 0.5)),), ())
    with pytest.raises(ValueError, match="states throughout"):
        Model(np.log([0.5, 0.5]), np.zeros((1, 1)), (), ())


def test_the_next_motion_is_as_improbable_as_the_rules_make_it():
    half = Model(np.log([0.5, 0.5]), np.log([[0.5, 0.5], [0.5, 0.5]]), (), ())
    assert half.entropy_rate == pytest.approx(np.log(2))
    # Alternating states: a round of two is half the time in either, whatever it starts with.
    sure = Model(np.log([0.5, 0.5]), np.log([[1e-12, 1 - 1e-12], [0.5, 0.5]]), (), ())
    assert sure.entropy_rate == pytest.approx(2 / 3 * np.log(2), abs=0.01)
    assert Model(np.zeros(1), np.zeros((1, 1)), (), ()).entropy_rate == 0
