"""Training: repeatable, and it learns."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from kernels.search import network
from kernels.search.augment import Augmentation
from kernels.search.measure import leave_one_out
from kernels.search.normalise import channels
from kernels.search.train import Training, _Draw, contrast, train
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS

SHORT = Training(steps=12, rows=16)


def test_contrast_of_a_known_batch():
    """Two rows of one label alike and one of another at a right angle: -log(1 / (1 + e^-10))."""
    rows = jnp.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    assert float(contrast(rows, jnp.array([0, 0, 1]))) == pytest.approx(np.log1p(np.exp(-10.0)), rel=2e-2)


def test_a_batch_without_pairs_has_no_slope():
    slope = jax.grad(lambda rows: contrast(rows, jnp.arange(3)))(jnp.eye(3))
    np.testing.assert_array_equal(np.asarray(slope), 0)


def test_same_arguments_same_bytes(dances):
    motions, labels = dances
    number = np.unique(labels, return_inverse=True)[1]
    a, b, other = (train(motions, number, how=h) for h in (SHORT, SHORT, Training(steps=12, rows=16, seed=1)))
    assert all(a[name].tobytes() == b[name].tobytes() for name in a)
    assert any(a[name].tobytes() != other[name].tobytes() for name in a)


def test_labels_come_together(dances):
    motions, labels = dances
    number = np.unique(labels, return_inverse=True)[1]
    weights = train(motions, number, how=Training(steps=40, rows=32))
    vectors = np.concatenate([network.forward(weights, *network.batch([channels(m)])) for m in motions])
    assert leave_one_out(vectors, labels).first_ratio == 1


def test_it_ends_when_told(dances):
    seen, steps = [], []
    train(
        dances[0],
        np.arange(16),
        how=Training(steps=100, rows=8),
        watch=lambda done, weights: bool(seen.append(done)) or done >= 50,
        progress=lambda: steps.append(1),
    )
    assert seen == [25, 50]
    assert len(steps) == 50


def test_one_motion_is_refused(dance):
    with pytest.raises(ValueError, match="want two motions or more, got 1"):
        train([dance], np.zeros(1, int), how=SHORT)


def test_the_other_side_of_a_label_is_drawn_mirrored():
    """Two motions that raise a hand, one the left and one the right: a label holds one side, drawn from both."""
    rest = np.tile(kinematics.rest_position(CANONICAL), (30, 1, 1))
    left, right = rest.copy(), rest.copy()
    left[:, JOINTS.index("leftHand"), 1] += 0.5
    right[:, JOINTS.index("rightHand"), 1] += 0.5
    how = Training(rows=32, rows_a_label=16, augmentation=Augmentation(1.0, 1.0, 0.0))
    draw = _Draw([left, right], np.array([0, 1]), np.array([1, 0]), how, np.random.default_rng(0))
    channel, _, label = draw()
    height = channel[:, 0, [3 * JOINTS.index(f"{side}Hand") + 1 for side in ("left", "right")]]
    np.testing.assert_array_equal(height[:, 0] > height[:, 1], label == 0)
