import numpy as np
import pytest

from kernels import rotation
from kernels.calibration import components


@pytest.fixture
def rng():
    return np.random.default_rng(3)


def quaternions(rng, n):
    """Any rotations, as components and as (n, 4)."""
    q = rotation.exp(rng.normal(0, 1.5, (n, 1, 3)))
    return components.quaternions(q)[0], q[:, 0]


def joined(parts):
    return components.join([parts])[:, 0]


def test_apart_and_together(rng):
    for width, split in ((3, components.vectors), (4, components.quaternions)):
        series = rng.normal(size=(5, 2, width))
        parts = split(series)
        assert len(parts) == 2
        assert parts[1][0].shape == (5,)
        np.testing.assert_array_equal(parts[1][2], series[:, 1, 2])
        np.testing.assert_array_equal(components.join(parts), series)


def test_no_frames():
    assert components.vectors(np.zeros((0, 2, 3)))[1][0].shape == (0,)
    assert components.join(components.quaternions(np.zeros((0, 2, 4)))).shape == (0, 2, 4)


def test_products_of_vectors(rng):
    a, b = rng.normal(size=(2, 6, 3))
    parts = components.vectors(np.stack([a, b], axis=1))
    np.testing.assert_allclose(joined(components.cross(*parts)), np.cross(a, b), atol=1e-15)
    np.testing.assert_allclose(components.dot(*parts), np.sum(a * b, axis=-1), atol=1e-15)
    np.testing.assert_array_equal(joined(components.add(*parts)), a + b)
    np.testing.assert_array_equal(joined(components.subtract(*parts)), a - b)
    np.testing.assert_array_equal(joined(components.scale(-3.0, parts[0])), -3.0 * a)


def test_a_quarter_turn_about_y_carries_ahead_to_the_left():
    half = np.sqrt(0.5)
    q = tuple(np.array([k]) for k in (half, 0.0, half, 0.0))
    np.testing.assert_allclose(joined(components.carry(q, (0.0, 0.0, 2.0))), [[2.0, 0.0, 0.0]], atol=1e-15)


def test_carrying_is_rotation_apply_to_the_bit(rng):
    q, whole = quaternions(rng, 7)
    v = rng.normal(size=3)
    np.testing.assert_array_equal(joined(components.carry(q, v.tolist())), rotation.apply(whole, v))


def test_small_turns_add_up_and_keep_the_length(rng):
    q, whole = quaternions(rng, 7)
    t = rng.normal(0, 1e-3, (7, 3))
    turned = joined(components.turn(q, components.vectors(t[:, None])[0]))
    np.testing.assert_allclose(turned, rotation.mul(rotation.exp(t), whole), atol=1e-9)
    np.testing.assert_allclose(np.sum(turned * turned, axis=-1), 1.0, atol=4 * 2.0**-53)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_rotation_between_two_rotations(rng, sign):
    q, whole = quaternions(rng, 50)
    t = rng.normal(size=(50, 3))
    t *= np.linspace(0.0, np.radians(60), 50)[:, None] / np.linalg.norm(t, axis=-1, keepdims=True)
    other = components.quaternions(sign * rotation.mul(rotation.exp(t), whole)[:, None])[0]
    np.testing.assert_allclose(joined(components.rotation_between(q, other)), t, atol=1e-3)


def test_equations_are_solved(rng):
    root = rng.normal(size=(9, 3, 3))
    whole = root @ root.mT + 0.1 * np.eye(3)
    b = rng.normal(size=(9, 3))
    upper = tuple(np.ascontiguousarray(whole[:, i, j]) for i in range(3) for j in range(i, 3))
    x = components.solve(components.factor(upper), components.vectors(b[:, None])[0])
    np.testing.assert_allclose(joined(x), np.linalg.solve(whole, b[..., None])[..., 0], rtol=1e-9, atol=1e-9)


def test_a_diagonal_is_divided_by():
    zero = np.zeros(1)
    f = components.factor((zero + 2.0, zero, zero, zero + 4.0, zero, zero + 8.0))
    np.testing.assert_array_equal(joined(components.solve(f, (zero + 1, zero + 1, zero + 1))), [[0.5, 0.25, 0.125]])
