import pytest

from kernels.matching.plan import BRUTE, BRUTE_SPARSE, PLANS, Plan, built, bytes_a_frame
from kernels.matching.score import SCALE_NUMERATORS


def test_plans_say_what_they_need():
    assert bytes_a_frame(BRUTE, SCALE_NUMERATORS) == 4
    assert bytes_a_frame(BRUTE_SPARSE, SCALE_NUMERATORS) == 4 * 51
    assert bytes_a_frame(Plan((25, 8), (10, 8), (5,)), SCALE_NUMERATORS) == 4 * (1 + 17 + 43 + 65)
    assert built(Plan((50, 8), (10, 8))) == (5, 10, 25, 50)
    assert len({str(plan) for plan in PLANS}) == len(PLANS)
    for wrong in ({"pairs": (25, 8)}, {"then": (5,)}, {"pairs": (25, 3), "groups": (10, 8)}):
        with pytest.raises(ValueError, match="plan: want"):
            Plan(**wrong)
