import numpy as np
import pytest

from kernels.graph.alternatives import find_alternatives, same_ratio, shared_ratio, shown_price
from kernels.graph.costs import PathCosts
from kernels.graph.path import Path, find_path

NO_USAGE = PathCosts(usage=0.0)


@pytest.fixture
def three_clips(make_graph):
    """Three clips at the song's tempo, the later the further from it, without transitions."""
    return make_graph([np.arange(6) * 0.5, np.arange(6) * 0.51, np.arange(6) * 0.52])


def dances(graph, n, diversity=1.0):
    beat_s = np.arange(6) * 0.5
    return find_alternatives(
        graph,
        n,
        find=lambda price: find_path(graph, beat_s, costs=NO_USAGE, stretch_price=price),
        diversity=diversity,
    )


def test_best_first_then_others(three_clips):
    found = dances(three_clips, 3)
    assert [int(three_clips.clip_index[path.source_node[0]]) for path in found] == [0, 1, 2]
    assert shared_ratio(three_clips, found[0], found[1]) == 0
    assert shared_ratio(three_clips, found[0], found[0]) == 1
    assert found[0].diversity_cost.sum() == 0


def test_alike_when_there_is_nothing_else(three_clips):
    fourth = dances(three_clips, 4)[3]
    assert fourth.diversity_cost.sum() > 0
    assert shared_ratio(three_clips, dances(three_clips, 2, diversity=0.0)[1], fourth) == 1


def test_price_of_stretch_and_clip(three_clips):
    price = shown_price(three_clips, dances(three_clips, 1), diversity=2.0)
    np.testing.assert_allclose(price, [2, 2, 2, 2, 2, 1] + [0] * 12)
    assert not shown_price(three_clips, [], diversity=2.0).any()


def test_bad_arguments(three_clips):
    with pytest.raises(ValueError, match="n, diversity"):
        dances(three_clips, 0)
    with pytest.raises(ValueError, match="n, diversity"):
        dances(three_clips, 1, diversity=-1.0)


def test_the_price_rises_until_dances_differ(make_graph):
    # The second clip is a fifth too slow: no dance leaves the first for it at the usual price.
    graph = make_graph([np.arange(6) * 0.5, np.arange(6) * 0.6])
    found = dances(graph, 2)
    assert [int(graph.clip_index[path.source_node[0]]) for path in found] == [0, 1]
    assert same_ratio(*found) == 0
    assert same_ratio(found[0], found[0]) == 1


def test_a_price_is_doubled_four_times_at_most(make_graph):
    """Where the catalogue has one dance alone it is asked for five times, at twice the price each time, and given."""
    graph = make_graph([np.arange(6) * 0.5])
    beat_s, asked = np.arange(6) * 0.5, []

    def find(price):
        asked.append(float(price.max()))
        return find_path(graph, beat_s, costs=NO_USAGE, stretch_price=price)

    one, other = find_alternatives(graph, 2, find=find, diversity=0.5)
    assert asked == [0.0, 0.5, 1.0, 2.0, 4.0, 8.0]
    assert same_ratio(one, other) == 1
    asked.clear()
    find_alternatives(graph, 3, find=find, diversity=0.0)
    assert asked == [0.0, 0.0, 0.0]


def test_dances_alike_for_half_of_the_song_are_two():
    def path(*nodes):
        n = len(nodes)
        node, one, no = np.array(nodes), np.ones(n, np.int64), np.zeros(n, bool)
        zero = np.zeros(n)
        at = np.arange(n)
        return Path(node, node + 1, at, one, one, no, zero, zero, zero, zero, zero, zero, zero, zero, zero + 1, no)

    assert same_ratio(path(0, 1, 2, 3), path(0, 1, 7, 8)) == 0.5
    assert same_ratio(path(0, 1, 2, 3), path(1, 2, 3, 4)) == 0  # the same steps at other beats
    assert same_ratio(path(), path(1)) == 0


def test_every_dance_that_shows_a_stretch_adds_its_price(three_clips):
    one = dances(three_clips, 1)
    once, twice = (shown_price(three_clips, one * n, diversity=1.0) for n in (1, 2))
    np.testing.assert_allclose(twice, 2 * once)
