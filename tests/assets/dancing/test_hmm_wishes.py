import numpy as np
import pytest

from assets.dancing.asked import SOFT_WISH, Direction
from assets.dancing.hmm_wishes import price, served
from kernels.graph.pin_conflicts import Pin


def pin(name, first, last):
    return Pin(name, first, last, np.ones(3, bool))


PINS = [pin("spin", 4, 6), pin("kick", 5, 8)]


@pytest.mark.parametrize(
    ("start", "length", "name"),
    [
        (0, 8, None),  # ends where the first begins, two intervals to a beat
        (0, 9, "spin"),
        (11, 1, "spin"),
        (12, 1, "kick"),
        (9, 6, "spin"),  # of two, the first that was given
        (15, 4, "kick"),
        (16, 4, None),
    ],
)
def test_a_span_serves_the_first_pin_that_it_touches(start, length, name):
    assert served(PINS, 2, start, length) == name


def test_no_pins_are_served_by_none():
    assert served([], 2, 0, 100) is None


def test_a_hard_wish_is_worth_any_price_and_a_soft_one_its_own():
    assert price(Direction()) == np.inf
    assert price(Direction(is_soft=True)) == SOFT_WISH
