"""Projections in closed form."""

import numpy as np
import pytest

from kernels.search.discriminant import discriminant, principal, unit


@pytest.fixture
def clouds(rng):
    """Three labels told apart by the first two of eight values, which vary least."""
    label = np.repeat([3, 7, 9], 30)
    value = rng.normal(size=(90, 8)) * np.array([0.1, 0.1, 5, 5, 5, 5, 5, 5])
    value[:, 0] += label == 7
    value[:, 1] += label == 9
    return value, label


def test_labels_come_together_and_stand_apart(clouds):
    value, label = clouds
    found = discriminant(value, label, 4)(value)
    centre = np.stack([found[label == name].mean(axis=0) for name in (3, 7, 9)])
    within = max(
        np.linalg.norm(found[label == name] - c, axis=1).mean() for name, c in zip((3, 7, 9), centre, strict=True)
    )
    between = min(np.linalg.norm(centre[i] - centre[j]) for i, j in ((0, 1), (0, 2), (1, 2)))
    assert between > 4 * within
    np.testing.assert_array_equal(found[:, 2:], 0)


def test_within_a_label_the_spread_is_about_one(clouds):
    value, label = clouds
    found = discriminant(value, label, 2)(value)
    spread = np.concatenate([found[label == n] - found[label == n].mean(axis=0) for n in (3, 7, 9)])
    assert 0.3 < spread.std(axis=0).min() <= spread.std(axis=0).max() < 1.3


def test_one_label_is_refused(clouds):
    with pytest.raises(ValueError, match="want two or more, got 1"):
        discriminant(clouds[0], np.zeros(90, int), 4)


def test_more_values_than_rows_are_no_trouble(rng):
    value = rng.normal(size=(6, 200))
    assert np.isfinite(discriminant(value, np.array([0, 0, 0, 1, 1, 1]), 8)(value)).all()
    assert np.isfinite(principal(value, 8)(value)).all()


def test_principal_components_are_ordered_and_of_fixed_sign(rng):
    value = rng.normal(size=(50, 1)) @ rng.normal(size=(1, 20)) + 0.01 * rng.normal(size=(50, 20))
    first, again = principal(value, 4)(value), principal(value[::-1], 4)(value)
    assert first.std(axis=0)[0] == first.std(axis=0).max()
    np.testing.assert_allclose(first[:, 0], again[:, 0], atol=1e-6)


def test_one_row_or_equal_rows_project_to_nothing():
    np.testing.assert_array_equal(principal(np.ones((1, 5)), 3)(np.ones((1, 5))), np.zeros((1, 3)))
    np.testing.assert_array_equal(principal(np.ones((4, 5)), 3)(np.ones((4, 5))), np.zeros((4, 3)))


def test_unit_leaves_nothing_as_it_is():
    np.testing.assert_allclose(unit(np.array([[3.0, 4.0], [0.0, 0.0]])), [[0.6, 0.8], [0.0, 0.0]])
