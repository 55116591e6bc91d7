import numpy as np
import pytest

from kernels import rotation
from kernels.calibration.cleaning import clean
from kernels.calibration.joints import UNSEEN, closed_form, from_moments, solve_joints, solve_pair
from kernels.synthetic import suit_performer

C_I, C_J = np.array([0.1, -0.2, 0.05]), np.array([-0.03, 0.12, 0.2])


def pair(n=400, *, axes=3, seed=0):
    """Two sensors on bones that meet in a joint, moved about some axes."""
    rng = np.random.default_rng(seed)
    q_i = rotation.exp(rng.normal(0, 0.8, (n, 3)))
    bend = rng.normal(0, 0.5, (n, 3)) * (np.arange(3) < axes)
    q_j = rotation.mul(q_i, rotation.exp(bend))
    p_i = rng.normal(size=(n, 3))
    p_j = p_i + rotation.apply(q_i, C_I) - rotation.apply(q_j, C_J)
    return (rotation.to_matrix(q_i), p_i), (rotation.to_matrix(q_j), p_j)


def test_exact_motion_gives_the_exact_joint():
    solved = solve_pair(*pair(), np.ones(400, bool))
    np.testing.assert_allclose(solved.in_parent_m, C_I, atol=1e-12)
    np.testing.assert_allclose(solved.in_child_m, C_J, atol=1e-12)
    assert solved.rank == 3
    assert solved.residual_m.max() < 1e-12


def test_closed_form_is_the_least_squares_of_the_document():
    parent, child = pair()
    noise = np.random.default_rng(1).normal(0, 0.01, (400, 3))
    child = (child[0], child[1] + noise)
    stacked = np.concatenate([parent[0], -child[0]], axis=-1).reshape(-1, 6)
    expected = np.linalg.lstsq(stacked, (child[1] - parent[1]).reshape(-1), rcond=None)[0]
    solved = closed_form(parent, child, np.ones(400))
    np.testing.assert_allclose(np.concatenate([solved.in_parent_m, solved.in_child_m]), expected, atol=1e-10)


def test_spread_tells_the_singular_values():
    parent, child = pair()
    stacked = np.concatenate([parent[0], -child[0]], axis=-1).reshape(-1, 6) / np.sqrt(400)
    expected = np.sort(np.linalg.svd(stacked)[1] ** 2)
    spread = closed_form(parent, child, np.ones(400)).spread
    np.testing.assert_allclose(np.sort(np.concatenate([spread, 2 - spread])), expected, atol=1e-10)


def test_a_hinge_is_right_across_its_axis_and_midway_along_it():
    solved = solve_pair(*pair(axes=1), np.ones(400, bool))
    assert solved.rank == 2
    axis = np.array([1.0, 0.0, 0.0])
    off = solved.in_parent_m - C_I
    np.testing.assert_allclose(off - axis * (off @ axis), 0.0, atol=1e-9)
    assert solved.in_parent_m @ axis == pytest.approx(-(solved.in_child_m @ axis), abs=1e-9)


def test_a_frozen_joint_has_no_rank():
    solved = solve_pair(*pair(axes=0), np.ones(400, bool))
    assert solved.rank == 0
    assert np.abs([solved.in_parent_m, solved.in_child_m]).max() < 0.5


def test_outliers_do_not_count():
    parent, child = pair()
    child[1][::20] += 0.3
    solved = solve_pair(parent, child, np.ones(400, bool))
    np.testing.assert_allclose(solved.in_parent_m, C_I, atol=1e-9)
    assert (solved.weight[::20] == 0).all()


def test_correction_takes_the_bias_of_orientation_noise_away():
    parent, child = pair(20000)
    sigma = np.radians(4.0)
    rng = np.random.default_rng(2)
    noisy = [
        (rotation.to_matrix(rotation.mul(rotation.exp(rng.normal(0, sigma, (20000, 3))), rotation.from_matrix(R))), p)
        for R, p in (parent, child)
    ]
    plain, corrected = (
        closed_form(*noisy, np.ones(20000), rotation_noise_rad=(s, s)).in_parent_m - C_I for s in (0.0, sigma)
    )
    assert np.linalg.norm(corrected) < 0.2 * np.linalg.norm(plain)


def test_batches_are_their_members():
    rng = np.random.default_rng(3)
    M, b_i, b_j = rng.normal(0, 0.3, (5, 3, 3)), rng.normal(size=(5, 3)), rng.normal(size=(5, 3))
    together = from_moments(M, b_i, b_j)
    for k in range(5):
        for whole, one in zip(together, from_moments(M[k], b_i[k], b_j[k]), strict=True):
            np.testing.assert_allclose(whole[k], one, atol=1e-12)


def test_no_good_frame():
    solved = solve_pair(*pair(), np.zeros(400, bool))
    assert solved.rank == 0
    for values in (solved.in_parent_m, solved.in_child_m, solved.spread, solved.weight):
        assert not values.any()


def test_all_joints_of_a_clean_body(perfect):
    solved = solve_joints(clean(perfect.recording))
    off = [s.in_child_m - truth for s, truth in zip(solved, perfect.body.in_child_sensor_m, strict=True)]
    # the low-pass alone moves fast sensors by fractions of a millimetre
    assert np.linalg.norm(off, axis=1).max() < 1e-3
    assert min(s.spread[-1] for s in solved) > UNSEEN


def test_wobble_is_told_from_noise(pairs):
    assert max(one.soft_m for one in pairs) < 1e-3
    shaken = suit_performer.made_up(7, n_frames=3000, disturbance=suit_performer.Disturbance(wobble_m=0.01))
    assert min(one.soft_m for one in solve_joints(clean(shaken.recording))) > 1e-3


def test_soft_tissue_holds_back_what_is_seldom_seen_and_hardly_what_is_seen_well():
    M = np.diag([0.2, 0.5, 0.995])
    b_i, b_j = np.array([0.1, 0.1, 0.001]), np.array([0.1, 0.1, 0.001])
    rigid = from_moments(M, b_i, b_j)
    soft = from_moments(M, b_i, b_j, soft_m2=0.01**2)
    ratio = soft[0] / rigid[0]
    assert ratio[0] > 0.95
    assert ratio[2] < 0.7
