"""The encoder as it is stored and asked."""

import numpy as np
import pytest

from kernels import rotation
from kernels.search import network
from kernels.search.discriminant import discriminant, principal
from kernels.search.encoder import N_EMBEDDING, Encoder, from_arrays
from kernels.search.encoder_fit import LABELLED, statistics_of


@pytest.fixture(scope="module")
def encoder(dances):
    motions, labels = dances
    told = statistics_of(motions, has_travel=True)
    number = np.unique(labels, return_inverse=True)[1]
    weights = network.initial_weights(np.random.default_rng(0))
    return Encoder(LABELLED, True, principal(told, 128), discriminant(told, number, 128), weights)


def test_shares_make_one():
    assert sum(LABELLED.values()) == pytest.approx(1)


def test_vectors_are_of_unit_length_and_of_512(encoder, dance, rate_hz):
    found = encoder.embed(dance, rate_hz, np.array([[0.0, 4.0], [1.0, 2.0], [0.5, 0.5]]))
    assert found.shape == (3, N_EMBEDDING) == (3, 512)
    assert found.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, atol=1e-6)
    assert encoder.embed(dance, rate_hz, np.zeros((0, 2))).shape == (0, 512)


def test_where_it_stands_faces_and_how_tall_it_is_change_nothing(encoder, dance, rate_hz):
    whole = np.array([[0.0, 4.0]])
    moved = 1.3 * rotation.apply(rotation.from_heading(np.pi / 2), dance) + np.array([2.0, 0.0, 1.0])
    np.testing.assert_allclose(encoder.embed(moved, rate_hz, whole), encoder.embed(dance, rate_hz, whole), atol=2e-4)


def test_stored_and_read_it_says_the_same(encoder, dance, rate_hz):
    whole = np.array([[0.0, 4.0]])
    again = from_arrays(encoder.arrays())
    np.testing.assert_allclose(again.embed(dance, rate_hz, whole), encoder.embed(dance, rate_hz, whole), atol=1e-5)
    assert again.has_travel


def test_parts_may_be_missing(encoder, dance, rate_hz):
    plain = from_arrays(Encoder({"principal": 1.0}, False, encoder.principal).arrays())
    assert plain.discriminant is None
    assert plain.weights is None
    found = plain.embed(dance, rate_hz, np.array([[0.0, 4.0]]))
    np.testing.assert_array_equal(found[:, : 512 - 128], 0)


def test_half_an_encoder_is_refused(encoder):
    arrays = encoder.arrays()
    del arrays["network.bias_1"]
    with pytest.raises(ValueError, match=r"want the array 'network\.bias_1', got none; train it anew"):
        from_arrays(arrays)
