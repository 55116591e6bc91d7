from dataclasses import replace

import numpy as np

from kernels import rotation
from kernels.calibration.cleaning import clean
from kernels.calibration.joints import closed_form
from kernels.calibration.pairs import find_swap, pair_costs, pair_residuals, spanning_tree
from kernels.calibration.records import PARENT
from kernels.synthetic import suit_performer

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


def test_of_equal_pairs_the_one_with_the_sensor_joined_first_is_taken():
    assert spanning_tree(np.ones((4, 4))) == [(0, 1), (0, 2), (0, 3)]


def test_the_edge_between_two_exchanged_labels_stays_and_does_not_count():
    """A chain 1-0-2 labelled as 0-1-2: an edge of 5 m becomes one of 1 m, whatever the one between the two is."""
    for between in (0.0, 4.0):
        residual = np.array([[np.inf, between, 1.0], [between, np.inf, 5.0], [1.0, 5.0, np.inf]])
        assert find_swap(residual, (-1, 0, 1)) == (0, 1, 0.2)


def test_under_tissue_that_slides_how_sensors_turn_tells_neighbours():
    """Two collar bones lie close and hardly turn; each turns less against the thorax than against the other."""
    made = suit_performer.made_up(1, n_frames=3000, disturbance=suit_performer.Disturbance(wobble_m=0.005))
    cleaned = clean(made.recording)
    turned, place = residuals(replace(made, recording=cleaned.recording))
    assert spanning_tree(pair_residuals(turned, place)) != TREE
    assert spanning_tree(pair_costs(turned, place)) == TREE
