"""A dancer's character survives: dances by one dancer's model are told from another's, the song being neither's."""

import numpy as np
import pytest

from kernels.hmm.character import identify, likeness
from kernels.hmm.model import Performed, Smoothing, learn
from kernels.hmm.viterbi import viterbi
from kernels.synthetic.performance import draw_states, hidden_rules


def dancer(rules, seed):
    state = draw_states(rules, 500, seed=seed)
    rng = np.random.default_rng(seed)
    heard = np.array([rng.multinomial(3, rules.emission[k]) for k in state], float)
    return learn([Performed(state, (heard,))], 8, [12], smoothing=Smoothing(0.1, (0.1,)))


def test_dances_are_told_apart_by_other_performances_of_their_dancers():
    rules = [hidden_rules(seed=seed) for seed in (4, 5)]
    judges = [dancer(r, 70) for r in rules]
    rng = np.random.default_rng(0)
    hits = 0
    for _ in range(15):
        song = rng.multinomial(3, np.full(12, 1 / 12), size=48).astype(float)
        for who, r in enumerate(rules):
            model = dancer(r, 80)
            path, _ = viterbi(model.log_initial, model.log_transition, model.log_likelihood([song]))
            hits += identify(path, judges) == who
    assert hits >= 27  # of 30; chance gives so many once in 200,000


def test_likeness_by_hand_and_of_what_no_model_knows():
    one = dancer(hidden_rules(seed=4), 1)
    state = np.array([0, 1, -1, 2, 3])
    wanted = (one.log_transition[0, 1] + one.log_transition[2, 3]) / 2
    assert likeness(state, [one])[0] == pytest.approx(wanted)
    assert likeness(np.array([-1, 0, -1]), [one]).tolist() == [0.0]
    with pytest.raises(ValueError, match="same states"):
        likeness(np.array([0, 9]), [one])
