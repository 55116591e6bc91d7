"""Parts that come again are danced again, where they can be, and never against a pin."""

import numpy as np
import pytest

from kernels.graph.costs import PathCosts
from kernels.graph.path import find_path
from kernels.graph.pin_conflicts import Pin, Reach, admitted
from kernels.graph.structure import FREE_BEATS, node_of_interval, structure_pins
from kernels.music.repeats import Repeat

BEAT_S = 0.5 * np.arange(41)
CHORUS = Repeat(28, 40, 8, 0.9)


@pytest.fixture
def joined(make_graph):
    """Four clips of thirty beats; from every beat of the one there is a way to some of the next."""
    beats = [0.5 * np.arange(30) for _ in range(4)]
    doors = (2, 6, 10, 14, 18)
    pairs = [(30 * c + b, 30 * ((c + 1) % 4) + door, 1.0) for c in range(4) for b in range(1, 29) for door in doors]
    graph = make_graph(beats, pairs)
    return graph, Reach(graph, BEAT_S, costs=PathCosts(), starts=np.arange(120))


def danced(graph, pins):
    return find_path(graph, BEAT_S, starts="any", admissible=admitted(pins, 40, 120) if pins else None)


def same(path):
    node = node_of_interval(path)
    k = np.arange(CHORUS.first + FREE_BEATS, CHORUS.last - FREE_BEATS)
    return node[k] == node[k - CHORUS.first + CHORUS.source]


def test_a_chorus_is_danced_again(joined):
    graph, reach = joined
    first = danced(graph, [])
    assert not same(first).all()
    pins, n_held = structure_pins(first, [CHORUS], reach)
    assert n_held == 1
    again = danced(graph, pins)
    assert same(again).all()
    k = np.arange(CHORUS.source + FREE_BEATS, CHORUS.source + 12 - FREE_BEATS)
    np.testing.assert_array_equal(node_of_interval(again)[k], node_of_interval(first)[k])


@pytest.mark.parametrize("first", [30, 10])
def test_pins_come_first_and_come_again(joined, first):
    """What is pinned in the one part is shown in the other too, wherever of the two it is pinned."""
    graph, reach = joined
    wish = Pin("there", first, first + 3, np.arange(120) // 30 == 2)
    once = danced(graph, [wish])
    pins, n_held = structure_pins(once, [CHORUS], reach, kept=[wish])
    assert n_held == 1
    again = danced(graph, [wish, *pins])
    for place in (10, 30):
        assert (node_of_interval(again)[place : place + 3] // 30 == 2).all()
    assert same(again).all()


def test_pins_against_each_other_are_left_to_themselves(joined):
    graph, reach = joined
    wishes = [Pin("a", 30, 33, np.arange(120) // 30 == 2), Pin("b", 10, 13, np.arange(120) // 30 == 1)]
    pins, n_held = structure_pins(danced(graph, wishes), [CHORUS], reach, kept=wishes)
    assert n_held == 1
    assert not {30, 31, 32, 10, 11, 12} & {pin.first for pin in pins}
    again = danced(graph, [*wishes, *pins])
    assert (node_of_interval(again)[30:33] // 30 == 2).all()
    assert (node_of_interval(again)[10:13] // 30 == 1).all()


def test_what_cannot_be_danced_again_is_left(make_graph):
    graph = make_graph([0.5 * np.arange(60)])
    reach = Reach(graph, BEAT_S, costs=PathCosts(), starts=np.arange(60))
    first = find_path(graph, BEAT_S, starts="any")
    assert structure_pins(first, [CHORUS], reach) == ([], 0)


def test_no_repeats_no_pins(joined):
    graph, reach = joined
    assert structure_pins(danced(graph, []), [], reach) == ([], 0)


def test_steps_over_two_intervals_have_their_node_in_both(make_graph):
    graph = make_graph([np.arange(30) * 1.0])
    path = find_path(graph, 0.5 * np.arange(9))
    assert (path.beat_span == 2).all()
    np.testing.assert_array_equal(node_of_interval(path), np.repeat(path.source_node, 2))


def test_the_ends_of_a_part_stay_free(joined):
    graph, reach = joined
    first = danced(graph, [])
    pins, _ = structure_pins(first, [CHORUS], reach)
    inner = [*range(8 + FREE_BEATS, 20 - FREE_BEATS), *range(28 + FREE_BEATS, 40 - FREE_BEATS)]
    assert sorted(pin.first for pin in pins) == inner
    assert all(pin.last == pin.first + 1 and pin.nodes.sum() == 1 for pin in pins)
    short = Repeat(28, 28 + 2 * FREE_BEATS, 8, 0.9)
    assert structure_pins(first, [short], reach) == ([], 0)


def test_a_part_that_goes_on_past_the_song_is_held_as_far_as_it_is_danced(joined):
    graph, reach = joined
    pins, n_held = structure_pins(danced(graph, []), [Repeat(28, 46, 8, 0.9)], reach)
    assert n_held == 1
    assert max(pin.last for pin in pins) == 40 - FREE_BEATS


def test_a_repeat_that_cannot_be_held_leaves_the_others(make_graph):
    """One clip alone: the first repeat would have to go back, the second asks for nothing new."""
    graph = make_graph([0.5 * np.arange(60)] * 2, [(39, 60 + 19, 1.0)], both_ways=False)
    reach = Reach(graph, BEAT_S, costs=PathCosts(), starts=np.arange(60))
    first = find_path(graph, BEAT_S, starts=np.array([0]))
    pins, n_held = structure_pins(first, [CHORUS, Repeat(20, 32, 20, 0.9)], reach)
    assert n_held == 1
    assert {pin.first for pin in pins} == set(range(22, 30))
