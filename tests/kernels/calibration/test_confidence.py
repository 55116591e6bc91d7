import numpy as np
import pytest

from kernels.calibration.confidence import advise, rate


@pytest.mark.parametrize(
    ("rank", "degrees", "sigma_mm", "word"),
    [
        (3, 20, 1, "high"),
        (3, 20, 4.1, "medium"),
        (3, 5, 1, "medium"),
        (3, 3.9, 1, "low"),
        (3, 20, 8.1, "low"),
        (3, 20, float("nan"), "low"),
        (2, 2, 1, "axis-unobserved"),
        (1, 0, 1, "none"),
        (0, 0, 1, "none"),
    ],
)
def test_words(rank, degrees, sigma_mm, word):
    assert rate(rank=rank, least_motion_rad=np.radians(degrees), residual_sigma_m=sigma_mm / 1000) == word


def test_advice_only_where_there_is_some():
    good = {"rank": 3, "least_motion_rad": 0.4, "residual_sigma_m": 0.001}
    assert advise("head", **good) == ""
    assert "did not turn" in advise("head", **(good | {"rank": 0, "least_motion_rad": 0.0}))
    assert "head rolls" in advise("head", **(good | {"rank": 0, "least_motion_rad": 0.0}))
    assert "strap them tighter" in advise("l_thigh", **(good | {"residual_sigma_m": 0.006}))


@pytest.mark.parametrize(
    ("degrees", "sigma_mm", "word"), [(4.0, 1, "medium"), (6.0, 1, "high"), (20, 4.0, "high"), (20, 8.0, "medium")]
)
def test_a_joint_on_a_bound_has_the_better_word(degrees, sigma_mm, word):
    assert rate(rank=3, least_motion_rad=np.radians(degrees), residual_sigma_m=sigma_mm / 1000) == word


def test_a_hinge_is_advised_however_far_it_bends_and_a_joint_that_bends_little_too():
    far = {"least_motion_rad": 0.4, "residual_sigma_m": 0.001}
    assert advise("l_shank", rank=2, **far).startswith("l_shank turned only 22.9 degrees about its weakest axis: bend")
    assert "turned only 5.9 degrees" in advise("head", rank=3, least_motion_rad=np.radians(5.9), residual_sigma_m=0.0)
    assert advise("head", rank=3, least_motion_rad=np.radians(6.0), residual_sigma_m=0.004) == ""


def test_both_troubles_are_told():
    both = advise("head", rank=1, least_motion_rad=0.0, residual_sigma_m=0.0123)
    assert both.startswith("head did not turn (0.0 degrees): ")
    assert both.endswith("; its sensors slide (12 mm): strap them tighter, nearer to the bone")
