import numpy as np
import pytest

from kernels.graph.costs import PathCosts
from kernels.graph.program import PathProgram


@pytest.fixture
def make_program(make_graph):
    def make(beats, transitions=(), intervals=4, **change):
        arguments = {
            "steps": ((1, 1), (1, 2)),
            "costs": PathCosts(transition_scale=1.0),
            "admissible": None,
            "bounds": (0.8, 1.25),
            "outside_price": 0.0,
        }
        graph = make_graph(beats, transitions, both_ways=False)
        return PathProgram(graph, 0.5 * np.arange(intervals + 1), **(arguments | change))

    return make


def test_step_costs_by_hand(make_program):
    program = make_program([[0, 0.5, 1.5], [0, 0.3]])
    np.testing.assert_array_equal(program.step_cost(0, 0), [0, np.inf, np.inf, np.inf, np.inf])
    np.testing.assert_array_equal(program.step_cost(0, 1), [np.inf, 0.25, np.inf, np.inf, np.inf])
    np.testing.assert_array_equal(program.step_cost(2, 1, np.array([1])), [0.25])
    assert program.step_cost(3, 1) is None


def test_outside_price_is_for_steps_outside_the_hard_bounds(make_program):
    program = make_program([[0, 0.5, 1.2]], bounds=(0.4, 2.5), outside_price=1000.0)
    inside, outside, _ = program.step_cost(0, 0)
    assert inside == 0
    assert 1000 < outside < 1100


def test_a_step_must_be_admitted_in_every_interval_it_covers(make_program):
    admissible = np.ones((4, 3), bool)
    admissible[1] = False
    program = make_program([[0, 0.5, 1.5]], admissible=admissible)
    assert np.isfinite(program.step_cost(0, 0)).any()
    assert not np.isfinite(program.step_cost(0, 1)).any()
    assert not np.isfinite(program.step_cost(1, 1)).any()
    assert np.isfinite(program.step_cost(2, 1)).any()


def test_cost_to_go_is_finite_where_the_last_beat_is_reached(make_program):
    program = make_program([0.5 * np.arange(4)], intervals=2)
    solution = program.solve(0, 2, after={2: np.zeros((1, 4))})
    np.testing.assert_array_equal(np.isfinite(solution.start[1]), [True, True, True, False])
    np.testing.assert_array_equal(np.isfinite(solution.start[0]), [True, True, False, False])
    np.testing.assert_array_equal(np.isfinite(solution.arrive[2][0]), True)


def test_price_is_paid_for_every_stretch(make_program):
    program = make_program([0.25 * np.arange(5)], steps=((2, 1),), intervals=2)
    price = np.array([1.0, 20.0, 300.0, 4000.0, 50000.0])
    np.testing.assert_array_equal(program.stretch_price(price)[0][:3], [21, 320, 4300])
    free, priced = (program.solve(0, 2, after={2: np.zeros((1, 5))}, price=p) for p in (None, price))
    assert priced.start[0][0] - free.start[0][0] == pytest.approx(4321)


def test_a_window_ends_where_it_must(make_program):
    program = make_program([0.5 * np.arange(5), 0.5 * np.arange(5)], [(1, 6, 0.0)])
    for node, expected in ((2, [(0, 0, 0), (1, 1, 0)]), (7, [(0, 0, 0), (1, 6, 0)])):
        solution = program.solve(0, 2, after={2: program.arrive_before(node, None)})
        moves = program.decode(solution, first=0, last=2, arrived=None, starts=np.array([0]))
        assert moves == expected


def test_arriving_before_a_node_costs_the_transition(make_program):
    program = make_program([[0, 1, 2], [0, 1, 2]], [(1, 3, 2.0), (2, 3, 1.0)])
    np.testing.assert_array_equal(program.arrive_before(3, None), [[np.inf, 2.5, 1.5, 0, np.inf, np.inf]])


def test_stretches_and_ends(make_program):
    program = make_program([0.5 * np.arange(5)], steps=((1, 1), (2, 1)))
    node, move = program.stretches([(0, 0, 1), (1, 2, 0)])
    np.testing.assert_array_equal(node, [0, 1, 2])
    np.testing.assert_array_equal(move, [0, 0, 1])
    assert program.ends((1, 2, 0)) == (2, 3)
    assert program.ends((0, 0, 1)) == (1, 2)


def test_furthest_beat(make_program):
    program = make_program([0.5 * np.arange(3), [0, 0.5], [0]], [(2, 3, 1.0)], intervals=9)
    assert program.furthest(np.array([0])) == 3
    assert program.furthest(np.array([3])) == 1
    assert program.furthest(np.array([5])) == 0
    assert make_program([0.5 * np.arange(9)]).furthest(np.array([0])) == 4
