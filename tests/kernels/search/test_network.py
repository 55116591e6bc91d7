"""The network: one definition for NumPy and JAX."""

import jax.numpy as jnp
import numpy as np
import pytest

from kernels.search import network
from kernels.search.normalise import N_CHANNELS


@pytest.fixture
def weights(rng):
    return network.initial_weights(rng)


@pytest.mark.parametrize("n_frames", [1, 3, 4, 37, 90])
def test_numpy_and_jax_agree(weights, rng, n_frames):
    channel, mask = network.batch([rng.normal(size=(n_frames, N_CHANNELS)).astype(np.float32)])
    there = network.forward({k: jnp.asarray(v) for k, v in weights.items()}, channel, mask, jnp)
    np.testing.assert_allclose(network.forward(weights, channel, mask), np.asarray(there), atol=2e-5)


def test_what_lies_beyond_the_end_counts_for_nothing(weights, rng):
    channel = rng.normal(size=(30, N_CHANNELS)).astype(np.float32)
    alone = network.forward(weights, *network.batch([channel]))
    padded, mask = network.batch([channel], 96)
    padded[0, 30:] = 1e3
    np.testing.assert_allclose(network.forward(weights, padded, mask), alone, atol=1e-5)


def test_rows_of_a_batch_do_not_know_each_other(weights, rng):
    stretches = [rng.normal(size=(n, N_CHANNELS)).astype(np.float32) for n in (5, 60, 33)]
    together = network.forward(weights, *network.batch(stretches))
    for row, stretch in zip(together, stretches, strict=True):
        np.testing.assert_allclose(network.forward(weights, *network.batch([stretch]))[0], row, atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(together, axis=1), 1, atol=1e-5)


def test_batches_are_a_multiple_of_four_long():
    channel, mask = network.batch([np.ones((5, N_CHANNELS), np.float32), np.ones((2, N_CHANNELS), np.float32)])
    assert channel.shape == (2, 8, N_CHANNELS)
    assert mask.sum(axis=1).tolist() == [5, 2]


def test_weights_have_their_shapes_and_their_seed(weights):
    assert {k: v.shape for k, v in weights.items()} == network.weight_shapes()
    again = network.initial_weights(np.random.default_rng(0))
    assert all(np.array_equal(weights[k], again[k]) for k in weights)


@pytest.mark.parametrize("n_frames", [4, 5, 11])
def test_frames_are_pooled_two_by_two_and_a_lone_last_one_by_itself(weights, rng, n_frames):
    """Frame by frame, as the network's description says it."""
    frames = rng.normal(size=(n_frames, N_CHANNELS)).astype(np.float32)
    value = list(frames)
    for i, (k, is_pooled) in enumerate(zip(network.KERNELS, network.POOLED, strict=True)):
        none = np.zeros_like(value[0])
        padded = [none] * (k // 2) + value + [none] * (k // 2)
        value = [
            np.concatenate(padded[t : t + k]) @ weights[f"matrix_{i}"] + weights[f"bias_{i}"] for t in range(len(value))
        ]
        value = [(v - v.mean()) / np.sqrt(v.var() + 1e-5) for v in value]
        value = [np.maximum(v * weights[f"gain_{i}"] + weights[f"shift_{i}"], 0) for v in value]
        if is_pooled:
            value = [np.mean(value[t : t + 2], axis=0) for t in range(0, len(value), 2)]
    out = np.concatenate([np.mean(value, axis=0), np.max(value, axis=0)]) @ weights["head"]
    got = network.forward(weights, *network.batch([frames]))[0]
    np.testing.assert_allclose(got, out / np.linalg.norm(out), atol=1e-5)
