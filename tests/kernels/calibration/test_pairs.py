import numpy as np

from kernels import rotation
from kernels.calibration.joints import closed_form
from kernels.calibration.pairs import find_swap, pair_residuals, spanning_tree
from kernels.calibration.records import PARENT

TREE = sorted((PARENT[k], k) for k in range(1, 17))


def residuals(made):
    turned = rotation.to_matrix(np.moveaxis(made.recording.rotation_wxyz, 1, 0))
    return turned, np.moveaxis(made.recording.position_xyz_m, 1, 0)


def test_residual_of_a_pair_is_that_of_its_closed_form(perfect):
    turned, place = residuals(perfect)
    got = pair_residuals(turned, place)
    np.testing.assert_array_equal(got, got.T)
    for i, j in ((0, 5), (2, 9), (4, 5)):
        one = closed_form((turned[i], place[i]), (turned[j], place[j]), np.ones(len(place[0])))
        np.testing.assert_allclose(got[i, j], np.sqrt(np.mean(one.residual_m**2)), atol=1e-6)


def test_the_body_is_its_spanning_tree(perfect):
    assert spanning_tree(pair_residuals(*residuals(perfect))) == TREE


def test_spanning_tree_by_hand():
    cost = np.array([[np.inf, 1, 4], [1, np.inf, 2], [4, 2, np.inf]])
    assert spanning_tree(cost) == [(0, 1), (1, 2)]
    assert spanning_tree(np.array([[np.inf]])) == []


def test_every_exchange_is_found(perfect):
    cost = pair_residuals(*residuals(perfect)) + 1e-3
    assert find_swap(cost, PARENT)[2] > 1.5
    for a in range(17):
        for b in range(a + 1, 17):
            order = np.arange(17)
            order[[a, b]] = b, a
            one, other, ratio = find_swap(cost[np.ix_(order, order)], PARENT)
            assert (one, other) == (a, b)
            assert ratio < 0.6


def test_no_frames():
    assert (pair_residuals(np.zeros((17, 0, 3, 3)), np.zeros((17, 0, 3)))[0, 1:] == 0).all()
