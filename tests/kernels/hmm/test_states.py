"""Clusters of motions: known kinds found again, whatever their order; few, equal and single motions."""

import numpy as np
import pytest

from kernels.hmm.states import States, _chosen, assign, clearness, cluster, k_means, squared_distances


def kinds(n_kinds=5, n_each=40, spread=0.1, seed=0):
    rng = np.random.default_rng(seed)
    centre = rng.normal(0, 3, (n_kinds, 12))
    truth = np.repeat(np.arange(n_kinds), n_each)
    return centre[truth] + rng.normal(0, spread, (len(truth), 12)), truth


def test_clear_kinds_are_found_with_their_number():
    points, truth = kinds()
    found = cluster(points)
    assert len(found.count) == 5
    label, _ = assign(points, found)
    assert all(len(np.unique(label[truth == k])) == 1 for k in range(5))


def test_k_means_agrees_with_scikit_learn_on_inertia():
    from sklearn.cluster import KMeans

    points = np.random.default_rng(2).normal(size=(300, 4))
    label = k_means(points, 6)
    own = sum(((points[label == k] - points[label == k].mean(axis=0)) ** 2).sum() for k in range(6))
    theirs = KMeans(6, n_init=10, random_state=0).fit(points).inertia_
    assert own <= 1.02 * theirs


def test_same_bytes_twice_and_the_most_frequent_first():
    points, truth = kinds(n_kinds=3)
    points = np.concatenate([points, points[truth == 2][:30] + 0.01])
    one, two = cluster(points, n_states=3), cluster(points, n_states=3)
    assert one.centroid.tobytes() == two.centroid.tobytes()
    assert one.count.tolist() == [70, 40, 40]
    turned = cluster(points[::-1], n_states=3)
    np.testing.assert_allclose(turned.centroid[0], one.centroid[0])


def test_a_real_dancer_without_clear_kinds_gets_more_than_two():
    blur = np.random.default_rng(3).normal(size=(600, 6))
    assert len(cluster(blur).count) > 4


@pytest.mark.parametrize("n", [1, 2, 5])
def test_few_motions_are_one_kind_or_as_many_as_differ(n):
    points = np.arange(n, dtype=float)[:, None] * np.ones((1, 3))
    assert len(cluster(points).count) == 1
    assert len(cluster(points, n_states=50).count) == n


def test_equal_motions_are_one_kind_and_no_cluster_is_empty():
    assert cluster(np.ones((30, 4)), n_states=5).count.tolist() == [30]
    almost = np.concatenate([np.zeros((50, 2)), [[1.0, 0], [0, 1.0], [1.0, 1.0]]])
    assert (cluster(almost, n_states=4).count >= 1).all()


def test_a_motion_far_from_all_is_of_no_kind():
    points, _ = kinds()
    found = cluster(points)
    label, apart = assign(np.concatenate([points[:1], points[:1] + 50.0]), found)
    assert label[0] >= 0
    assert label[1] == -1
    assert apart[1] > 50
    assert assign(np.zeros((2, 3)), States(np.zeros((0, 3)), np.zeros(0), np.zeros(0, np.int64)))[0].tolist() == [
        -1,
        -1,
    ]
    assert assign(np.zeros((0, 12)), found)[0].tolist() == []


def test_clearness_by_hand():
    points = np.array([[0.0], [2.0], [10.0], [12.0]])
    assert clearness(points, np.array([0, 0, 1, 1]), 2) == pytest.approx(np.mean([10 / 11, 8 / 9, 8 / 9, 10 / 11]))
    assert clearness(points, np.zeros(4, int), 1) == 0.0
    np.testing.assert_allclose(squared_distances(points, points[:1])[:, 0], [0, 4, 100, 144])


def test_what_cannot_be_clustered_is_refused():
    with pytest.raises(ValueError, match="N >= 1"):
        cluster(np.zeros((0, 3)))
    with pytest.raises(ValueError, match="finite"):
        cluster(np.full((3, 3), np.nan))
    with pytest.raises(ValueError, match="n_states"):
        cluster(np.zeros((3, 3)), n_states=-1)


def test_of_clear_numbers_the_largest_that_is_almost_as_clear_is_chosen():
    assert _chosen(((2, 0.9), (3, 0.88), (4, 0.87), (5, 0.75))) == 3
    assert _chosen(((2, 0.9), (3, 0.5))) == 2


def test_where_no_number_is_clear_the_largest_that_is_clear_enough_beside_the_clearest_is():
    assert _chosen(((2, 0.6), (3, 0.5), (4, 0.43), (5, 0.41))) == 4
    assert _chosen(((1, 0.0),)) == 1


def test_no_more_states_are_tried_than_leave_twelve_motions_to_each():
    blur = np.random.default_rng(0).normal(size=(47, 3))
    assert [k for k, _ in cluster(blur).tried] == [2, 3]
    assert [k for k, _ in cluster(np.append(blur, blur[:1] + 1, axis=0)).tried] == [2, 3, 4]


def test_a_motion_not_clustered_belongs_within_one_and_a_half_times_the_reach():
    states = States(np.zeros((1, 2)), np.array([2.0]), np.array([9]))
    label, apart = assign(np.array([[2.99, 0.0], [3.01, 0.0]]), states)
    assert label.tolist() == [0, -1]
    np.testing.assert_allclose(apart, [2.99, 3.01])


def test_a_state_reaches_to_the_95th_percentile_of_its_motions():
    points = np.concatenate([np.linspace(-1, 1, 41)[:, None] * [[1.0, 0.0]]])
    found = cluster(points, n_states=1)
    assert found.reach[0] == pytest.approx(np.percentile(np.abs(points[:, 0]), 95))


def test_states_of_as_many_motions_stand_in_the_order_of_their_centroids():
    points = np.repeat([[5.0, 0.0], [-5.0, 1.0], [-5.0, -1.0]], 20, axis=0)
    found = cluster(points + 1e-3 * np.random.default_rng(0).normal(size=points.shape), n_states=3)
    assert found.count.tolist() == [20, 20, 20]
    np.testing.assert_allclose(np.round(found.centroid), [[-5, -1], [-5, 1], [5, 0]])
