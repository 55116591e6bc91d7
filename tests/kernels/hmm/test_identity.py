"""A dancer's character survives: dances by one dancer's model are told from another's, the song being neither's."""

import numpy as np
import pytest

from kernels.hmm.identity import chance_of, identify, likeness, nearest_dancer, pose_windows
from kernels.hmm.model import Performed, Smoothing, learn
from kernels.hmm.viterbi import viterbi
from kernels.skeleton import kinematics
from kernels.synthetic.hidden_rules import draw_states, hidden_rules, perform


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


def seen(rules, seed, n=24):
    position, _ = kinematics.place(perform(rules, n_motions=n, seed=seed).clip)
    return pose_windows(position, 30.0)


def test_who_danced_is_seen_by_the_body():
    """Dancers who share eight gestures: what they let follow what is in their poses."""
    rules = [hidden_rules(seed=seed) for seed in (4, 5)]
    known = [seen(r, 1, n=240) for r in rules]
    hits = sum(nearest_dancer(seen(r, 20 + i, n=60), known) == who for who, r in enumerate(rules) for i in range(4))
    assert hits >= 7


def test_stretches_are_free_of_place_heading_and_their_number_is_known():
    position, _ = kinematics.place(perform(hidden_rules(), n_motions=10, seed=0).clip)
    found = pose_windows(position, 30.0)
    assert len(found) == 4  # five seconds
    turned = position[..., [2, 1, 0]] * [1, 1, -1] + [3.0, 0, 4.0]
    np.testing.assert_allclose(pose_windows(turned, 30.0), found, atol=1e-4)
    assert len(pose_windows(position[:1], 30.0)) == 1


def test_nobody_is_nearest_for_being_known_longer():
    rng = np.random.default_rng(0)
    few, many = rng.normal(0, 1, (20, 3)), rng.normal(0, 1, (2000, 3))
    who = [nearest_dancer(rng.normal(0, 1, (5, 3)), [few, many]) for _ in range(200)]
    assert 60 < sum(who) < 140
    with pytest.raises(ValueError, match="at least one stretch"):
        nearest_dancer(np.zeros((0, 3)), [few])


def test_chance_by_hand():
    assert chance_of(3, 3) == pytest.approx(1 / 8)
    assert chance_of(0, 5) == 1.0
    assert chance_of(2, 2, n_dancers=4) == pytest.approx(1 / 16)


def test_of_equal_likenesses_and_votes_the_first_counts():
    one = dancer(hidden_rules(seed=4), 1)
    assert identify(np.array([0, 1, 2]), [one, one]) == 0
    here, there = np.zeros((1, 2)), np.ones((1, 2))
    assert nearest_dancer(np.array([[0.0, 0.0], [1.0, 1.0]]), [here, there]) == 0
    assert nearest_dancer(np.array([[0.0, 0.0], [1.0, 1.0], [1.0, 1.0]]), [here, there]) == 1


@pytest.mark.parametrize(("seconds", "n"), [(0.5, 1), (2.0, 1), (2.9, 1), (3.0, 2), (5.0, 4)])
def test_a_stretch_every_second_and_one_of_what_is_shorter(seconds, n):
    position = np.random.default_rng(0).normal(size=(round(seconds * 30) + 1, 22, 3))
    assert len(pose_windows(position, 30.0)) == n
