import numpy as np
import pytest

from kernels import rotation

X, Y, Z = np.eye(3)
ORDERS = ["xyz", "xzy", "yxz", "yzx", "zxy", "zyx"]


@pytest.fixture
def some():
    return rotation.normalize(np.random.default_rng(0).normal(size=(50, 4)))


def quarter(axis):
    return rotation.from_axis_angle(axis, np.pi / 2)


def same(a, b, atol=1e-9):
    return bool((rotation.angle_between(a, b) < atol).all())


def test_a_quarter_turn_takes_each_axis_to_the_next():
    np.testing.assert_allclose(rotation.apply(quarter(Z), X), Y, atol=1e-12)
    np.testing.assert_allclose(rotation.apply(quarter(X), Y), Z, atol=1e-12)
    np.testing.assert_allclose(rotation.apply(quarter(Y), Z), X, atol=1e-12)


def test_mul_applies_the_right_one_first():
    np.testing.assert_allclose(rotation.apply(rotation.mul(quarter(Z), quarter(X)), Y), Z, atol=1e-12)
    np.testing.assert_allclose(rotation.apply(rotation.mul(quarter(X), quarter(Z)), Y), -X, atol=1e-12)


def test_mul_and_apply_broadcast(some):
    vectors = np.random.default_rng(1).normal(size=(50, 1, 3))
    assert rotation.mul(some[:, None], some[None, :3]).shape == (50, 3, 4)
    turned = rotation.apply(some[None, :5], vectors)
    assert turned.shape == (50, 5, 3)
    np.testing.assert_allclose(turned[7, 2], rotation.apply(some[2], vectors[7, 0]))


def test_apply_agrees_with_the_matrix(some):
    vectors = np.random.default_rng(1).normal(size=(50, 3))
    by_matrix = np.einsum("nij,nj->ni", rotation.to_matrix(some), vectors)
    np.testing.assert_allclose(rotation.apply(some, vectors), by_matrix, atol=1e-12)


def test_mul_agrees_with_the_matrix(some):
    product = rotation.to_matrix(some) @ rotation.to_matrix(some[::-1])
    np.testing.assert_allclose(rotation.to_matrix(rotation.mul(some, some[::-1])), product, atol=1e-12)


def test_inv_undoes(some):
    assert same(rotation.mul(some, rotation.inv(some)), rotation.IDENTITY)


def test_normalize_refuses_what_has_no_direction():
    for bad in ([0.0, 0, 0, 0], [np.nan, 0, 0, 1], [np.inf, 0, 0, 1]):
        with pytest.raises(ValueError, match="non-zero length"):
            rotation.normalize(np.array(bad))


@pytest.mark.parametrize("order", [*ORDERS, "x", "yz", "zxz", "yxy", ""])
def test_from_euler_reads_channels_from_left_to_right(order):
    angles = np.random.default_rng(2).uniform(-3, 3, (20, len(order)))
    q = np.tile(rotation.IDENTITY, (20, 1))
    for k, letter in enumerate(order):
        q = rotation.mul(q, rotation.from_axis_angle(np.eye(3)["xyz".index(letter)], angles[:, k]))
    np.testing.assert_allclose(rotation.from_euler(angles, order), q, atol=1e-12)


@pytest.mark.parametrize("order", ORDERS)
def test_to_euler_undoes_from_euler(order):
    angles = np.random.default_rng(3).uniform([-3, -1.5, -3], [3, 1.5, 3], (40, 3))
    np.testing.assert_allclose(rotation.to_euler(rotation.from_euler(angles, order), order), angles, atol=1e-9)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("middle", [np.pi / 2, -np.pi / 2, np.pi / 2 - 1e-7])
def test_to_euler_in_gimbal_lock_is_the_same_rotation(order, middle):
    q = rotation.from_euler(np.array([0.4, middle, -0.9]), order)
    assert same(rotation.from_euler(rotation.to_euler(q, order), order), q, 1e-6)


def test_orders_that_are_none(some):
    with pytest.raises(ValueError, match="want 3 letters of xyz, got 'xyw'"):
        rotation.from_euler(np.zeros(3), "xyw")
    with pytest.raises(ValueError, match="want 2 letters"):
        rotation.from_euler(np.zeros(2), "xyz")
    with pytest.raises(ValueError, match="three different letters"):
        rotation.to_euler(some, "xyx")


def test_from_matrix_undoes_to_matrix(some):
    half_turns = np.concatenate([np.zeros((3, 1)), np.eye(3)], axis=1)
    for q in (some, half_turns, rotation.IDENTITY):
        again = rotation.from_matrix(rotation.to_matrix(q))
        assert same(again, q, 1e-7)
        assert (again[..., 0] >= 0).all()


def test_log_and_exp():
    vectors = np.random.default_rng(4).normal(size=(30, 3))
    vectors = vectors / np.linalg.norm(vectors, axis=1, keepdims=True) * np.linspace(0, 3.14, 30)[:, None]
    np.testing.assert_allclose(rotation.log(rotation.exp(vectors)), vectors, atol=1e-9)
    np.testing.assert_allclose(rotation.log(-rotation.exp(vectors)), vectors, atol=1e-9)
    np.testing.assert_allclose(rotation.exp(np.zeros(3)), rotation.IDENTITY)
    tiny = np.array([1e-13, 0, 0])
    np.testing.assert_allclose(rotation.log(rotation.exp(tiny)), tiny, rtol=1e-6)


def test_angle_between_does_not_see_the_sign(some):
    assert rotation.angle_between(rotation.IDENTITY, quarter(Y)) == pytest.approx(np.pi / 2)
    np.testing.assert_allclose(rotation.angle_between(some, -some), 0, atol=1e-7)


def test_slerp_walks_evenly_along_the_shorter_way(some):
    other = some[::-1]
    angle = rotation.angle_between(some, other)
    third = rotation.slerp(some, -other, np.full(50, 1 / 3))
    np.testing.assert_allclose(rotation.angle_between(some, third), angle / 3, atol=1e-7)
    np.testing.assert_allclose(rotation.angle_between(third, other), 2 * angle / 3, atol=1e-7)


def test_between_is_the_shortest_arc():
    rng = np.random.default_rng(5)
    u, v = rng.normal(size=(2, 60, 3))
    q = rotation.between(u, v)
    turned = rotation.apply(q, u)
    np.testing.assert_allclose(np.cross(turned, v), 0, atol=1e-9)
    assert (np.sum(turned * v, axis=-1) > 0).all()
    cosine = np.sum(u * v, axis=-1) / np.linalg.norm(u, axis=-1) / np.linalg.norm(v, axis=-1)
    np.testing.assert_allclose(rotation.angle_between(rotation.IDENTITY, q), np.arccos(cosine), atol=1e-7)


def test_between_of_opposite_directions_turns_half():
    u = np.array([X, Y, Z, [1.0, 2, 3]])
    q = rotation.between(u, -u)
    np.testing.assert_allclose(rotation.apply(q, u), -u, atol=1e-12)
    np.testing.assert_allclose(rotation.angle_between(rotation.IDENTITY, q), np.pi)
    np.testing.assert_allclose(rotation.apply(rotation.between(X, -u[:1]), X), -X[None], atol=1e-12)


def test_between_refuses_zero():
    with pytest.raises(ValueError, match="non-zero length"):
        rotation.between(X, np.zeros(3))


def test_twist_is_the_part_about_the_axis(some):
    swing = rotation.between(Y, np.array([0.3, 1.0, -0.2]))
    turn = rotation.from_axis_angle(Y, 0.7)
    assert same(rotation.twist(rotation.mul(swing, turn), Y), turn)
    rest = rotation.mul(some, rotation.inv(rotation.twist(some, Y)))
    np.testing.assert_allclose(rest[:, 2], 0, atol=1e-9)
    assert same(rotation.twist(rotation.from_axis_angle(X, np.pi), Y), rotation.IDENTITY)


def test_continuous_chooses_signs_only(some):
    q = rotation.continuous(some[:, None] * np.array([1.0, -1.0])[:, None])
    assert (np.sum(q[1:] * q[:-1], axis=-1) >= 0).all()
    assert (q[0, :, 0] >= 0).all()
    np.testing.assert_allclose(np.abs(q), np.abs(np.stack([some, some], axis=1)))
    assert rotation.continuous(np.zeros((0, 4))).shape == (0, 4)


def test_heading_of_upright_and_bent_bodies():
    angles = np.linspace(-3, 3, 13)
    upright = rotation.from_heading(angles)
    np.testing.assert_allclose(rotation.heading_rad(upright), angles, atol=1e-12)
    bent = rotation.mul(upright, rotation.from_axis_angle(X, 1.5))
    np.testing.assert_allclose(rotation.heading_rad(bent), angles, atol=1e-9)
    upside = rotation.mul(upright, rotation.from_axis_angle(X, np.pi / 2))
    np.testing.assert_allclose(rotation.heading_rad(upside), angles, atol=1e-9)


def test_continuous_leaves_a_first_half_turn_as_it_is():
    half = np.array([[0.0, 1.0, 0, 0], [-0.1, -0.99, 0, 0]])
    np.testing.assert_array_equal(rotation.continuous(half), [half[0], -half[1]])


def test_continuous_leaves_what_is_square_to_the_one_before():
    square = np.array([[1.0, 0, 0, 0], [0.0, -1.0, 0, 0], [0.0, 0, 0, 1.0]])
    np.testing.assert_array_equal(rotation.continuous(square), square)


def test_forward_decides_the_heading_until_it_points_within_thirty_degrees_of_the_vertical():
    lean = rotation.from_axis_angle(Z, 0.3)  # the left axis now leaves the horizontal: the two would differ
    for bend, by_forward in ((np.radians(59), True), (np.radians(61), False)):
        q = rotation.mul(rotation.from_axis_angle(X, bend), lean)
        forward, left = rotation.apply(q, Z), rotation.apply(q, X)
        expected = np.arctan2(forward[0], forward[2]) if by_forward else np.arctan2(-left[2], left[0])
        assert rotation.heading_rad(q) == pytest.approx(float(expected), abs=1e-12)


@pytest.mark.parametrize("bad", [np.zeros(3), np.array([np.nan, 0, 1.0]), np.array([np.inf, 0, 1.0])])
def test_between_refuses_either_vector(bad):
    for u, v in ((bad, X), (X, bad), (np.stack([X, bad]), np.stack([Y, Y]))):
        with pytest.raises(ValueError, match="non-zero length"):
            rotation.between(u, v)


def test_between_turns_half_about_a_square_axis_where_it_is_opposite_and_only_there():
    u = np.array([X, X, [0.89, np.sqrt(1 - 0.89**2), 0]])
    v = np.array([-X, Y, [-0.89, -np.sqrt(1 - 0.89**2), 0]])
    q = rotation.between(u, v)
    np.testing.assert_allclose(rotation.apply(q, u), v, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(q, axis=-1), 1)
    np.testing.assert_allclose(q[1], rotation.from_axis_angle(Z, np.pi / 2), atol=1e-12)
