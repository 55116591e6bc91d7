"""Model, motions and music to tables and back."""

import numpy as np
import pytest

from assets.sources.performances import Performance
from assets.tables import hmm as hmm_tables
from kernels.hmm.evidence import Evidence
from kernels.hmm.model import Performed, Smoothing, learn
from kernels.hmm.states import States
from kernels.motion.key_poses import KeyPoses
from kernels.music.drums_and_melody import Contour, Hits
from schemas.music import PERCUSSION


def test_motions_there_and_back():
    found = KeyPoses(np.array([0.0, 0.5]), np.array([0.1, 0.7]), np.array([0.5, 1.0]))
    table = hmm_tables.from_key_pose("a-x", found, np.array([3, -1]), np.array([0.1, 9.0]))
    motions = hmm_tables.all_motions([table])["a-x"]
    assert motions.state.tolist() == [3, -1]
    np.testing.assert_array_equal(motions.end_s, found.end_s)


def test_the_model_there_and_back():
    state = np.array([0, 1, 2, 1, 0])
    heard = np.random.default_rng(0).poisson(1.0, (5, 47)).astype(float), np.ones((5, 5))
    model = learn([Performed(state, heard)], 3, (47, 5), smoothing=Smoothing(0.1, (0.2, 0.3)))
    table = hmm_tables.from_choreography_model(model, ["a", "b", "c"])
    again = hmm_tables.to_model(table, melody_weight=0.25)
    np.testing.assert_allclose(again.log_transition, model.log_transition)
    np.testing.assert_allclose(again.log_emission[0], model.log_emission[0])
    np.testing.assert_allclose(again.log_emission[1], model.log_emission[1])
    assert again.weight == (1.0, 0.25)
    emission = [r for r in table.to_pylist() if r["parameter_name"] == "emission" and r["state_index"] == 1]
    assert [r["target_index"] for r in emission] == list(range(35, 82))
    assert sum(r["probability"] for r in emission) == pytest.approx(1.0)


def test_basic_motions_there_and_back():
    states = States(np.random.default_rng(1).normal(size=(2, 198)), np.array([0.1, 0.2]), np.array([5, 3]))
    again = hmm_tables.to_states(hmm_tables.from_basic_motion(states, ["a", "b"], np.zeros(2), np.ones(2)))
    np.testing.assert_allclose(again.centroid, states.centroid, atol=1e-5)
    assert again.count.tolist() == [5, 3]


def test_evidence_there_and_back_without_what_could_not_be_held_out():
    found = Evidence(
        np.array([-1.0, np.nan]), np.array([-2.0, np.nan]), np.array([-3.0, np.nan]), np.array([9, 0]), 0.005
    )
    two = [Performance("a", "s", 0.0, "name"), Performance("b", "s", 1.0, "clips.csv")]
    again = hmm_tables.to_evidence(hmm_tables.from_music_evidence(two, found, [4, 0]))
    assert again.gain == pytest.approx(1.0)
    assert again.music_adds
    assert hmm_tables.to_performances(hmm_tables.from_performance(two)) == two


def test_what_is_heard_there_and_back():
    hits = Hits(np.array([0.5]), np.array([36]), np.array([90]))
    again, is_banded = hmm_tables.to_percussion(hmm_tables.from_percussion("s", hits, heard_as="bands"))
    assert (again.key_number.tolist(), is_banded) == ([36], True)
    assert hmm_tables.to_percussion(PERCUSSION.empty())[1] is False
    tune = Contour(np.array([1.0, 2.0]), np.array([0, 4]))
    assert hmm_tables.to_melody(hmm_tables.from_melody("s", tune)).symbol.tolist() == [0, 4]
