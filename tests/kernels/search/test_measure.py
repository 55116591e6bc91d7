"""Measures of retrieval and splits."""

import numpy as np
import pytest

from kernels.search.measure import Retrieval, confusions, group_folds, joined, label_folds, leave_one_out, retrieval


def test_average_precision_of_a_known_ranking():
    """Hits at ranks 1, 3 and 4: (1 + 2/3 + 3/4) / 3."""
    found = retrieval(np.array([[1.0, 2.0, 3.0, 4.0]]), ["a"], ["a", "b", "a", "a"])
    assert found == Retrieval(1.0, pytest.approx((1 + 2 / 3 + 3 / 4) / 3), 1)


def test_a_query_whose_label_is_unknown_does_not_count():
    found = retrieval(np.array([[1.0, 2.0], [1.0, 2.0]]), ["a", "z"], ["b", "a"])
    assert (found.first_ratio, found.mean_precision_ratio, found.n_queries) == (0.0, 0.5, 1)
    assert retrieval(np.zeros((0, 2)), [], ["a", "b"]).n_queries == 0


def test_ties_go_to_the_earlier_row():
    assert retrieval(np.zeros((1, 2)), ["a"], ["b", "a"]).first_ratio == 0


def test_splits_are_averaged_by_queries():
    assert joined([Retrieval(1.0, 1.0, 1), Retrieval(0.0, 0.5, 3)]) == Retrieval(0.25, 0.625, 4)
    assert joined([]) == Retrieval(0.0, 0.0, 0)


def test_groups_are_never_on_both_sides():
    group = ["a"] * 5 + ["b"] * 3 + ["c"] * 2 + ["d"]
    folds = group_folds(group, 3)
    assert np.sum(folds, axis=0).tolist() == [1] * 11
    for fold in folds:
        assert not {g for g, out in zip(group, fold, strict=True) if out} & {
            g for g, out in zip(group, fold, strict=True) if not out
        }
    assert len(group_folds(["a", "a"], 5)) == 1


def test_labels_are_spread_evenly():
    label = np.repeat([0, 1, 2], [12, 6, 1])
    folds = label_folds(label, 3, np.random.default_rng(0))
    assert np.sum(folds, axis=0).tolist() == [1] * 19
    assert {int((label[fold] == 0).sum()) for fold in folds} == {4}
    assert {int((label[fold] == 1).sum()) for fold in folds} == {2}


def test_labels_of_queries_are_counted_against_those_found():
    distance = np.array([[0.1, 0.5, 0.9], [0.4, 0.3, 0.9], [0.5, 0.5, 0.6]])
    found = confusions(distance, ["a", "a", "new"], ["a", "b", "never"])
    assert found.names == ("a", "b", "new")
    np.testing.assert_array_equal(found.count, [[1, 1, 0], [0, 0, 0], [1, 0, 0]])
    assert confusions(np.zeros((0, 3)), [], ["a", "b", "c"]).names == ()


def test_confusions_are_counted_by_label_and_label_of_the_nearest():
    vector = np.array([[1.0, 0.0], [0.99, 0.1], [0.0, 1.0], [0.1, 0.99], [0.6, 0.8]])
    found = leave_one_out(vector, ["a", "a", "b", "b", "alone"])
    assert found.names == ("a", "b")
    np.testing.assert_array_equal(found.count, [[2, 0], [0, 2]])
    assert found.first_ratio == 1
    assert leave_one_out(vector[:1], ["a"]).first_ratio == 0
    assert leave_one_out(np.zeros((0, 2)), []).names == ()


def test_the_largest_groups_are_dealt_first_so_that_folds_are_even():
    group = ["a"] + ["b"] * 2 + ["c"] * 3 + ["d"] * 4
    assert sorted(int(fold.sum()) for fold in group_folds(group, 2)) == [5, 5]


def test_the_remainders_of_labels_go_to_different_folds():
    folds = label_folds(np.repeat([0, 1, 2], 1), 3, np.random.default_rng(0))
    assert [int(fold.sum()) for fold in folds] == [1, 1, 1]


def test_a_clip_whose_nearest_is_alone_in_its_label_is_counted_there():
    vector = np.array([[1.0, 0.0], [0.9, 0.44], [0.8, 0.6]])
    found = leave_one_out(vector, ["a", "a", "alone"])
    assert found.names == ("a", "alone")
    np.testing.assert_array_equal(found.count, [[1, 1], [0, 0]])
    assert found.first_ratio == 0.5
