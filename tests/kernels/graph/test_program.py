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


def decoded(program, starts=(0,)):
    n = program.n_beats
    whole = program.solve(0, n, after={n: program.at_the_end})
    return program.decode(whole, first=0, last=n, arrived=None, starts=np.array(starts))


@pytest.mark.parametrize("steps", [((1, 1), (1, 2)), ((1, 2), (1, 1))])
def test_of_equal_costs_the_earlier_kind_of_step(make_program, steps):
    """Played a quarter too slow or half as fast again, both for nothing: the kind named first is danced."""
    costs = PathCosts(warp=0.0, leaving=0.0, warp_outside=0.0, stride=0.0)
    program = make_program([0.7 * np.arange(6)], intervals=4, steps=steps, costs=costs, bounds=(0.4, 2.5))
    assert {kind for _, _, kind in decoded(program)} == {0}


def test_of_equal_costs_no_transition_before_any_and_then_the_lower_node(make_program):
    beats = 0.5 * np.arange(5)
    free = PathCosts(seam=0.0, transition=0.0, jump_back=0.0)
    stays = make_program([beats, beats], [(1, 6, 0.0)], costs=free)
    assert [node for _, node, _ in decoded(stays)] == [0, 1, 2, 3]
    # The first clip ends after two steps: of two ways on as good, the one to the lower node.
    moves = make_program([beats[:3], beats, beats], [(2, 3, 1.0), (2, 8, 1.0)])
    assert [node for _, node, _ in decoded(moves)] == [0, 1, 3, 4]
    assert [node for _, node, _ in decoded(stays, starts=(0, 5))] == [0, 1, 2, 3]


def test_a_half_time_step_counts_its_music_beats_of_a_stay(make_program):
    costs = PathCosts(stay=6.0, stay_beats=4)
    program = make_program([np.arange(5.0)], steps=((1, 1), (1, 2)), intervals=8, costs=costs)
    np.testing.assert_array_equal(program.stayed_after(0), [0, 1, 2, 3, 3])
    np.testing.assert_array_equal(program.stayed_after(1), [1, 2, 3, 3, 3])
    longer = make_program([np.arange(9.0)], intervals=12, costs=PathCosts(stay=6.0, stay_beats=9))
    assert longer.beats_stayed([(0, 0, 1), (2, 1, 1), (4, 2, 1)]) == 6
    assert longer.beats_stayed([(0, 0, 1), (2, 4, 1), (4, 5, 1)]) == 4
    assert longer.beats_stayed([(2 * i, i, 1) for i in range(6)]) == 9
    assert longer.beats_stayed([]) == 0


def test_a_dance_leaves_after_as_many_music_beats_as_its_price_says(make_program):
    """Two half-time steps are four beats of six: going on costs 3, leaving then 2, and would cost 4 after two beats."""
    wish = np.zeros((6, 10))
    wish[4:, :5] = 1.5
    costs = PathCosts(seam=0.0, transition=0.0, jump_back=0.0, stay=6.0, stay_beats=6)
    program = make_program(
        [np.arange(5.0), np.arange(5.0)], [(2, 5, 1.0)], intervals=6, costs=costs, interval_price=wish
    )
    assert decoded(program) == [(0, 0, 1), (2, 1, 1), (4, 5, 1)]
    whole = program.solve(0, 6, after={6: program.at_the_end})
    assert whole.start[0][0] == pytest.approx(3 * costs.stride + 2.0)


def test_the_end_of_a_song_cuts_no_stay_short(make_program):
    costs = PathCosts(seam=0.0, transition=0.0, jump_back=0.0, stay=6.0, stay_beats=6)
    program = make_program([0.5 * np.arange(3)], intervals=2, costs=costs)
    assert program.solve(0, 2, after={2: program.at_the_end}).start[0][0] == 0
    assert program.hurried(1, None) == 0
    assert program.hurried(1, 2) == pytest.approx(3.0)
    assert program.hurried(5, 9) == 0


def test_stretches_past_the_end_of_a_clip_are_not_priced_beyond_it(make_program):
    program = make_program([0.25 * np.arange(3), 0.25 * np.arange(3)], steps=((2, 1),), intervals=2)
    price = np.array([1.0, 20.0, 300.0, 4000.0, 50000.0, 600000.0])
    np.testing.assert_array_equal(program.stretch_price(price)[0][[0, 3]], [21, 54000])


def test_wishes_are_paid_for_every_interval_that_a_step_covers(make_program):
    wish = np.arange(12.0).reshape(4, 3)
    step = {(1, 1): np.array([100.0, 200.0, 300.0])}
    program = make_program([np.arange(3.0)], interval_price=wish, step_price=step)
    np.testing.assert_array_equal(program.wish_cost(0, 1), [3, 5, 7])
    np.testing.assert_array_equal(program.wish_cost(1, 1), [109, 211, 313])
    np.testing.assert_array_equal(program.wish_cost(1, 0, np.array([2])), [5])
    np.testing.assert_array_equal(make_program([np.arange(3.0)]).wish_cost(0, 0), np.zeros(3))
