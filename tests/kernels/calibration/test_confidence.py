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
