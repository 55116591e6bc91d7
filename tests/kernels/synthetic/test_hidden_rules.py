"""The made-up performance: its rules, its drums, its gestures, and the same of a seed."""

import numpy as np
import pytest

from kernels.skeleton import kinematics
from kernels.synthetic.hidden_rules import DRUM_KEYS, GESTURES, dance, draw_notes, draw_states, hidden_rules, perform


def test_rules_are_probabilities_and_every_motion_is_danced_as_often():
    rules = hidden_rules(seed=3)
    for rows in (rules.initial, rules.transition, rules.emission):
        np.testing.assert_allclose(rows.sum(axis=-1), 1.0)
    np.testing.assert_allclose(rules.transition.sum(axis=0), 1.0)
    assert rules.emission.shape == (8, 12)
    np.testing.assert_allclose(hidden_rules(loyalty=0.0).emission, 1 / 12)
    with pytest.raises(ValueError, match="n_states"):
        hidden_rules(n_states=9)


def test_what_is_drawn_follows_the_rules():
    rules = hidden_rules(seed=1)
    state = draw_states(rules, 4000, seed=0)
    seen = np.zeros((8, 8))
    np.add.at(seen, (state[:-1], state[1:]), 1)
    assert np.abs(seen / seen.sum(axis=1, keepdims=True) - rules.transition).max() < 0.08
    notes = draw_notes(rules, state[:50], interval_s=0.5, start_s=1.0, seed=0)
    assert set(notes.key_number.tolist()) <= {*DRUM_KEYS, 44}
    assert notes.start_s[0] == 1.0
    assert len(notes.start_s) == 151
    assert notes.is_drum.all()


def test_gestures_leave_the_stance_and_come_back():
    edge_s = 0.5 * np.arange(9)
    clip = dance(np.arange(8), edge_s=edge_s, frame_rate_hz=60.0, seed=0)
    position, _ = kinematics.place(clip)
    position = position - position[:, :1] * [1, 0, 1]
    at_rest = position[np.rint(edge_s[:-1] * 60).astype(int)]
    half = position[np.rint((edge_s[:-1] + 0.25) * 60).astype(int)]
    assert np.abs(at_rest - at_rest[0]).max() < 0.12
    assert all(np.linalg.norm(h - at_rest[0], axis=-1).max() > 0.2 for h in half)
    assert len(GESTURES) == 8


def test_the_same_of_a_seed_and_another_of_another():
    rules = hidden_rules()
    one, two, other = (perform(rules, n_motions=6, seed=seed) for seed in (1, 1, 2))
    assert one.clip.rotation_wxyz.tobytes() == two.clip.rotation_wxyz.tobytes()
    assert one.notes.start_s.tolist() == two.notes.start_s.tolist()
    assert one.state.tolist() != other.state.tolist()
    assert one.tempo == ((0.0, 120.0),)
    assert one.beats.beat_in_bar_number.tolist() == [1, 2, 3, 4, 1, 2]
