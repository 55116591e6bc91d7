import numpy as np
import pytest

from kernels import rotation
from kernels.skeleton.inverse import two_bone

X, Y, Z = np.eye(3)


def limb(start, upper, lower, *, upper_m=0.4, lower_m=0.3):
    knee = start + rotation.apply(upper, -upper_m * Y)
    return knee, knee + rotation.apply(lower, -lower_m * Y)


def test_a_right_angle_by_hand():
    start, target = np.zeros((1, 3)), np.array([[0.0, -0.3, 0.4]])
    upper, lower, end = two_bone(start, target, upper_m=0.4, lower_m=0.3, pole=np.array([[0.0, 1.0, 1.0]]))
    knee, _ = limb(start, upper, lower)
    np.testing.assert_allclose(end, target, atol=1e-12)
    np.testing.assert_allclose(knee, [[0, 0, 0.4]], atol=1e-9)


def test_targets_in_reach_are_met_with_the_knee_towards_the_pole():
    rng = np.random.default_rng(0)
    start = rng.normal(size=(50, 3))
    way = rng.normal(size=(50, 3))
    target = start + way / np.linalg.norm(way, axis=1, keepdims=True) * rng.uniform(0.15, 0.68, (50, 1))
    pole = np.cross(way, rng.normal(size=(50, 3)))
    upper, lower, end = two_bone(start, target, upper_m=0.4, lower_m=0.3, pole=pole)
    knee, ankle = limb(start, upper, lower)
    np.testing.assert_allclose(end, target, atol=1e-9)
    np.testing.assert_allclose(ankle, target, atol=1e-9)
    assert (np.sum((knee - start) * pole, axis=1) > 0).all()


@pytest.mark.parametrize("far_m", [0.05, 0.9])
def test_targets_out_of_reach_are_approached(far_m):
    upper, lower, end = two_bone(
        np.zeros((1, 3)), np.array([[0.0, -far_m, 0.0]]), upper_m=0.4, lower_m=0.3, pole=Z[None]
    )
    _, ankle = limb(np.zeros((1, 3)), upper, lower)
    np.testing.assert_allclose(ankle, end, atol=1e-6)
    assert np.linalg.norm(end) == pytest.approx(0.1 if far_m < 0.1 else 0.7, abs=1e-5)


def test_no_frame():
    none = np.zeros((0, 3))
    assert two_bone(none, none, upper_m=0.4, lower_m=0.3, pole=none)[0].shape == (0, 4)


def test_refusals():
    with pytest.raises(ValueError, match="want > 0"):
        two_bone(np.zeros((1, 3)), np.ones((1, 3)), upper_m=0.0, lower_m=0.3, pole=Z[None])
    with pytest.raises(ValueError, match="got the start itself"):
        two_bone(np.zeros((1, 3)), np.zeros((1, 3)), upper_m=0.4, lower_m=0.3, pole=Z[None])
