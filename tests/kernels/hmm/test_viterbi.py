"""Viterbi against a worked example, brute force and hmmlearn; spans against brute force and the plain recursion."""

import itertools

import numpy as np
import pytest

from kernels.hmm.viterbi import InfeasibleSpansError, Spans, best_spans, log_probability, sample_spans, viterbi


def random_model(n, n_steps, seed):
    rng = np.random.default_rng(seed)
    return (
        np.log(rng.dirichlet(np.ones(n))),
        np.log(rng.dirichlet(np.ones(n), n)),
        np.log(rng.uniform(0.01, 1, (n_steps, n))),
    )


def test_the_doctor_of_the_textbook():
    """Healthy or feverish, normal, cold, dizzy: the well-known example; healthy, healthy, feverish with 0.01512."""
    first, step = np.log([0.6, 0.4]), np.log([[0.7, 0.3], [0.4, 0.6]])
    seen = np.log(np.array([[0.5, 0.4, 0.1], [0.1, 0.3, 0.6]]).T)
    state, log_p = viterbi(first, step, seen)
    assert state.tolist() == [0, 0, 1]
    assert np.exp(log_p) == pytest.approx(0.01512)


@pytest.mark.parametrize("seed", range(5))
def test_brute_force_finds_no_better(seed):
    first, step, seen = random_model(3, 6, seed)

    def of(path):
        return first[path[0]] + sum(step[a, b] for a, b in itertools.pairwise(path)) + seen[np.arange(6), path].sum()

    every = [of(list(path)) for path in itertools.product(range(3), repeat=6)]
    state, log_p = viterbi(first, step, seen)
    assert log_p == pytest.approx(max(every))
    assert of(state.tolist()) == pytest.approx(max(every))
    assert log_probability(first, step, seen) == pytest.approx(np.log(np.exp(every).sum()))


@pytest.mark.parametrize("seed", range(3))
def test_agrees_with_hmmlearn(seed):
    hmm = pytest.importorskip("hmmlearn.hmm")
    rng = np.random.default_rng(seed)
    n, m = 6, 12
    model = hmm.CategoricalHMM(n_components=n, n_features=m)
    model.startprob_, model.transmat_ = rng.dirichlet(np.ones(n)), rng.dirichlet(np.ones(n), n)
    model.emissionprob_ = rng.dirichlet(np.ones(m), n)
    heard = rng.integers(0, m, 200)
    log_p, path = model.decode(heard[:, None], algorithm="viterbi")
    seen = np.log(model.emissionprob_).T[heard]
    state, own = viterbi(np.log(model.startprob_), np.log(model.transmat_), seen)
    assert own == pytest.approx(log_p)
    np.testing.assert_array_equal(state, path)
    assert log_probability(np.log(model.startprob_), np.log(model.transmat_), seen) == pytest.approx(
        model.score(heard[:, None])
    )


def test_what_is_forbidden_is_not_danced_and_ties_go_to_the_first():
    step = np.log(np.array([[1e-300, 1.0], [1.0, 1e-300]]))
    step[0, 0] = step[1, 1] = -np.inf
    state, _ = viterbi(np.zeros(2), step, np.zeros((5, 2)))
    assert state.tolist() == [0, 1, 0, 1, 0]
    assert viterbi(np.zeros(2), np.zeros((2, 2)), np.zeros((0, 2)))[0].tolist() == []
    assert log_probability(np.zeros(2), np.zeros((2, 2)), np.zeros((0, 2))) == 0.0
    with pytest.raises(ValueError, match="want \\(N,\\)"):
        viterbi(np.zeros(2), np.zeros((3, 3)), np.zeros((5, 2)))


def brute_spans(first, step, seen, length):
    """Every way to cover the grid: log probability and (state, start, length) of each."""
    k_all, n = seen.shape
    found = []

    def go(at, rows, log_p):
        if at >= k_all:
            found.append((log_p, rows))
            return
        for state, d in itertools.product(range(n), range(1, length.shape[1] + 1)):
            enter = step[rows[-1][0], state] if rows else first[state]
            here = enter + length[at, d - 1, state] + seen[at : at + d, state].sum()
            if np.isfinite(here):
                go(at + d, [*rows, (state, at, d)], log_p + here)

    go(0, [], 0.0)
    return found


@pytest.mark.parametrize("seed", range(4))
def test_spans_brute_force_finds_no_better(seed):
    first, step, seen = random_model(2, 5, seed)
    rng = np.random.default_rng(seed + 10)
    length = np.log(rng.dirichlet(np.ones(3), (5, 2)).transpose(0, 2, 1))
    length[rng.random(length.shape) < 0.2] = -np.inf
    every = brute_spans(first, step, seen, length)
    spans, log_p = best_spans(first, step, seen, length)
    best = max(every, key=lambda way: way[0])
    assert log_p == pytest.approx(best[0])
    assert list(zip(spans.state, spans.start, spans.length, strict=True)) == best[1]


def test_spans_of_one_interval_are_the_plain_model():
    first, step, seen = random_model(4, 30, 3)
    spans, log_p = best_spans(first, step, seen, np.zeros((30, 1, 4)))
    state, plain = viterbi(first, step, seen)
    np.testing.assert_array_equal(spans.state, state)
    assert log_p == pytest.approx(plain)
    assert spans.length.tolist() == [1] * 30


def test_samples_are_drawn_as_often_as_they_are_probable():
    first, step, seen = random_model(2, 3, 5)
    length = np.log(np.full((3, 2, 2), 0.5))
    every = brute_spans(first, step, seen, length)
    p = np.exp([way[0] for way in every])
    p /= p.sum()
    rng = np.random.default_rng(0)
    seen_ways = {}
    for _ in range(4000):
        one = sample_spans(first, step, seen, length, rng=rng)
        key = tuple(zip(one.state.tolist(), one.start.tolist(), one.length.tolist(), strict=True))
        seen_ways[key] = seen_ways.get(key, 0) + 1
    for (_, rows), wanted in zip(every, p, strict=True):
        assert seen_ways.get(tuple(rows), 0) / 4000 == pytest.approx(wanted, abs=0.03)


def test_a_cold_sample_is_the_most_probable_way_and_seeds_repeat():
    first, step, seen = random_model(3, 20, 6)
    length = np.log(np.full((20, 2, 3), 0.5))
    best, _ = best_spans(first, step, seen, length)
    cold = sample_spans(first, step, seen, length, temperature=0.001, rng=np.random.default_rng(1))
    np.testing.assert_array_equal(cold.state, best.state)
    again = [sample_spans(first, step, seen, length, rng=np.random.default_rng(7)).state.tolist() for _ in range(2)]
    assert again[0] == again[1]
    with pytest.raises(ValueError, match="temperature"):
        sample_spans(first, step, seen, length, temperature=0.0, rng=np.random.default_rng(1))


def test_a_grid_that_nothing_covers_is_refused_where_it_stops():
    first, step, seen = random_model(2, 4, 0)
    length = np.zeros((4, 1, 2))
    length[2] = -np.inf
    for way in (best_spans, lambda *a: sample_spans(*a, rng=np.random.default_rng(0))):
        with pytest.raises(InfeasibleSpansError) as refused:
            way(first, step, seen, length)
        assert refused.value.interval == 2
    with pytest.raises(ValueError, match="log_duration"):
        best_spans(first, step, seen, np.zeros((3, 1, 2)))


def test_one_state_is_a_model():
    seen = np.log(np.array([[0.5], [0.25]]))
    state, log_p = viterbi(np.zeros(1), np.zeros((1, 1)), seen)
    assert state.tolist() == [0, 0]
    assert log_p == pytest.approx(np.log(0.125))
    assert log_probability(np.zeros(1), np.zeros((1, 1)), seen) == pytest.approx(np.log(0.125))


def test_spans_start_and_end_on_the_grid_and_beyond_it():
    spans = Spans(np.array([0, 1]), np.array([0, 2]), np.array([2, 3]))
    np.testing.assert_array_equal(spans.edge_s(np.array([0.0, 0.4, 1.0, 1.5, 2.1, 2.6])), [0.0, 1.0, 2.6])
