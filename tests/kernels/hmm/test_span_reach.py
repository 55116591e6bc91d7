"""Whether pins can be kept by recorded motions, against every way to cover the beats."""

import itertools

import numpy as np
import pytest

from kernels.graph.pin_conflicts import Pin, find_conflict
from kernels.hmm.places import Places
from kernels.hmm.span_reach import SpanReach


def some_places(seed, n=6, n_motions=5, longest=3):
    rng = np.random.default_rng(seed)
    at = []
    for _ in range(n):
        row = []
        for _ in range(longest):
            fits = np.flatnonzero(rng.random(n_motions) < 0.3)
            row.append((fits, np.zeros(len(fits))))
        at.append(row)
    return Places(at)


def can(places, pins, parts):
    """Try every row of motions."""
    n = places.n_intervals

    def go(at):
        if at >= n:
            return True
        for d, (fits, _) in enumerate(places.at[at], start=1):
            for m in fits.tolist():
                touched = [p for p in pins if at < p.last * parts and at + d > p.first * parts]
                if all(p.nodes[m] for p in touched) and go(at + d):
                    return True
        return False

    return go(0)


@pytest.mark.parametrize("parts", [1, 2])
def test_what_can_be_kept_is_what_some_row_of_motions_keeps(parts):
    n_kept = 0
    for seed in range(120):
        rng = np.random.default_rng(seed)
        places = some_places(seed)
        reach = SpanReach(places, parts=parts)
        assert reach.n_intervals == 6 // parts
        first = rng.integers(0, reach.n_intervals, 2)
        pins = [Pin(str(i), int(k), int(k) + 1, rng.random(5) < 0.5) for i, k in enumerate(first)]
        assert reach.keeps(pins) == can(places, pins, parts)
        assert reach.is_danceable == can(places, [], parts)
        n_kept += reach.keeps(pins)
    assert 10 < n_kept < 110


def test_the_fewest_pins_in_conflict_and_a_way_out():
    both = np.arange(2)
    places = Places([[(both, np.zeros(2))] for _ in range(4)])
    reach = SpanReach(places, parts=1)
    one, other = np.array([True, False]), np.array([False, True])
    pins = [Pin("a", 0, 2, one), Pin("b", 1, 2, other), Pin("c", 3, 4, one)]
    found = find_conflict(reach, pins)
    assert found.pin_index == (0, 1)
    assert found.reason == "same_time"
    assert found.ways_out[0].pin_index == 1
    assert abs(found.ways_out[0].shift_beats) == 1
    assert find_conflict(reach, [pins[0], pins[2]]) is None


def test_a_pin_whose_motions_are_all_too_long():
    places = Places([[(np.array([0]), np.zeros(1))] for _ in range(3)])
    reach = SpanReach(places, parts=1)
    pin = Pin("slow", 1, 2, np.array([False, True]))
    assert not reach.fits(pin)
    assert find_conflict(reach, [pin]).reason == "tempo"
    assert [*itertools.chain(find_conflict(reach, [pin]).ways_out)] == []
