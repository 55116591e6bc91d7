"""Pins against every path there is, on small graphs."""

from itertools import combinations

import numpy as np
import pytest

from kernels.graph.costs import PathCosts
from kernels.graph.path import STEPS, find_path
from kernels.graph.pin_conflicts import Pin, Reach, admitted, find_conflict, step_price
from kernels.graph.pose_nodes import pose_steps

NO_USAGE = PathCosts(usage=0.0)


def reach_of(graph, beat_s, starts=None):
    starts = np.arange(len(graph.clip_index)) if starts is None else starts
    return Reach(graph, beat_s, costs=NO_USAGE, starts=starts)


def random_case(seed, make_graph):
    """Four short clips at the song's pace, twice and half of it; up to six pins of every kind, some that overlap."""
    rng = np.random.default_rng(seed)
    paces = rng.permutation([0.5, 0.5, 0.26, 1.0])
    beats = [np.cumsum(pace * rng.uniform(0.85, 1.15, rng.integers(3, 6))) for pace in paces]
    n = sum(map(len, beats))
    pairs = {tuple(rng.integers(n, size=2)) for _ in range(9)}
    graph = make_graph(beats, [(int(s), int(t), 0.3) for s, t in sorted(pairs) if s != t], both_ways=False)
    beat_s = np.arange(int(rng.integers(3, 7))) * 0.5
    last_beat = len(beat_s) - 1
    style = rng.integers(0, 2, 4)[graph.clip_index]
    pins = []
    for i in range(int(rng.integers(1, 7))):
        first = int(rng.integers(last_beat))
        last = min(first + int(rng.integers(1, 4)), last_beat)
        clip = graph.clip_index == rng.integers(4)
        kind = ("label", "not", "style", "pose")[int(rng.integers(4))]
        wanted = {"label": clip, "not": ~clip, "style": style == rng.integers(2), "pose": np.ones(n, bool)}[kind]
        pin = Pin(f"{kind} {i}", first, last, wanted)
        if kind == "pose":
            near = np.where(rng.random(n) < 0.4, rng.random(n), np.inf)
            at = last_beat if rng.random() < 0.3 else first
            first = min(at, last_beat - 1)
            pin = Pin(f"pose {i}", first, first + 1, wanted, pose_steps(graph, at, near, last_beat))
        pins.append(pin)
    return graph, beat_s, pins


@pytest.fixture
def kept_dances(every_dance):
    """All dances that keep pins, with their costs; a pin is checked step by step, not by masks."""

    def find(graph, beat_s, pins, costs):
        kept = []
        for cost, _, moves in every_dance(graph, beat_s, costs, range(len(graph.clip_index))):
            price = 0.0
            for pin in pins:
                for beat, node, kind in moves:
                    touches = beat < pin.last and beat + STEPS[kind][1] > pin.first
                    price += 0.0 if not touches or pin.nodes[node] else np.inf
                    price += pin.steps[beat, kind][node] if (beat, kind) in pin.steps else 0.0
            if np.isfinite(price):
                kept.append((cost + price, moves))
        return kept

    return find


@pytest.mark.parametrize("seed", range(220))
def test_kept_or_the_fewest_that_cannot_be(seed, make_graph, kept_dances):
    graph, beat_s, pins = random_case(seed, make_graph)
    reach = reach_of(graph, beat_s)
    if reach.bounds != NO_USAGE.hard_ratio:
        pytest.skip("this seed's song cannot be danced within the bounds")
    costs = PathCosts(usage=0.0, stay=1.5, stay_beats=3)
    kept = kept_dances(graph, beat_s, pins, costs)
    assert reach.keeps(pins) == bool(kept)
    conflict = find_conflict(reach, pins)
    if conflict is None:
        mask = admitted(pins, len(beat_s) - 1, len(graph.clip_index))
        path = find_path(
            graph, beat_s, costs=costs, starts="any", admissible=mask, step_price=step_price(pins), strict=True
        )
        assert path.total_cost == pytest.approx(min(cost for cost, _ in kept))
        kinds = [STEPS.index(step) for step in zip(path.motion_span.tolist(), path.beat_span.tolist(), strict=True)]
        moves = list(zip(path.beat_index.tolist(), path.source_node.tolist(), kinds, strict=True))
        assert moves in [moves for _, moves in kept]
        return
    assert not kept_dances(graph, beat_s, [pins[i] for i in conflict.pin_index], costs)
    for size in range(len(conflict.pin_index)):
        for chosen in combinations(range(len(pins)), size):
            assert kept_dances(graph, beat_s, [pins[i] for i in chosen], costs)
    without = [[pin for i, pin in enumerate(pins) if i != index] for index in conflict.pin_index]
    assert conflict.has_more != any(kept_dances(graph, beat_s, rest, costs) for rest in without)


def test_the_cases_hold_all_kinds(make_graph):
    """Sets that are kept, conflicts of one, of two and of more pins; poses among both; half- and double-time danced."""
    sizes, kinds, strides, more = set(), set(), set(), set()
    for seed in range(220):
        graph, beat_s, pins = random_case(seed, make_graph)
        reach = reach_of(graph, beat_s)
        if reach.bounds != NO_USAGE.hard_ratio:
            continue
        conflict = find_conflict(reach, pins)
        size = 0 if conflict is None else len(conflict.pin_index)
        sizes.add(size)
        more |= set() if conflict is None else {conflict.has_more}
        kinds |= {(pin.name.split()[0], size > 0) for pin in pins}
        if conflict is None:
            mask = admitted(pins, len(beat_s) - 1, len(graph.clip_index))
            path = find_path(graph, beat_s, costs=NO_USAGE, starts="any", admissible=mask, step_price=step_price(pins))
            strides |= set(zip(path.motion_span.tolist(), path.beat_span.tolist(), strict=True))
    assert {0, 1, 2, 3} <= sizes
    assert more == {False, True}
    assert kinds == {(kind, is_refused) for kind in ("label", "not", "style", "pose") for is_refused in (True, False)}
    assert strides == set(STEPS)


@pytest.fixture
def two_clips(make_graph):
    """Two clips of six beats; from beat 2 of the first there is a way to the second, and none back."""
    beats = np.arange(6) * 0.5
    return make_graph([beats, beats], [(2, 7, 0.1)], both_ways=False)


def test_reasons_and_ways_out(two_clips):
    beat_s = np.arange(6) * 0.5
    reach = reach_of(two_clips, beat_s, np.array([0]))
    first, second = two_clips.clip_index == 0, two_clips.clip_index == 1
    none = np.zeros(12, bool)

    nothing = find_conflict(reach, [Pin("p", 0, 1, none)], choices=[{"first": first}])
    assert nothing.reason == "nothing"
    assert [(w.shift_beats, w.choice) for w in nothing.ways_out] == [(0, "first")]

    too_soon = find_conflict(reach, [Pin("p", 1, 2, second)])
    assert too_soon.reason == "start"
    assert too_soon.ways_out[0].shift_beats == 1

    both = find_conflict(reach, [Pin("a", 3, 4, second), Pin("c", 0, 1, first), Pin("b", 4, 5, first)])
    assert both.reason == "path"
    assert both.pin_index == (0, 2)
    at_once = find_conflict(reach, [Pin("a", 3, 5, second), Pin("b", 4, 5, first)])
    assert (at_once.reason, at_once.pin_index) == ("same_time", (0, 1))
    assert find_conflict(reach, [Pin("a", 3, 4, second)]) is None
    assert find_conflict(reach, []) is None


def test_many_pins_that_only_together_conflict(make_graph):
    """Each forbids one of 24 clips: all sets by size would be sixteen million. Of equal conflicts the first is told."""
    beat_s = np.arange(3) * 0.5
    graph = make_graph([beat_s] * 24)
    reach = reach_of(graph, beat_s)
    pins = [Pin(f"not {clip}", 0, 1, graph.clip_index != clip) for clip in range(24)]
    assert find_conflict(reach, pins).pin_index == tuple(range(24))
    assert find_conflict(reach, pins[1:]) is None
    nothing = [Pin(f"nothing {i}", 1, 2, np.zeros(72, bool)) for i in range(2)]
    assert find_conflict(reach, [*pins, *nothing]).pin_index == (24,)


def test_tempo_is_named(two_clips, make_graph):
    graph = make_graph([np.arange(6) * 0.5, np.arange(3) * 5.0])
    reach = reach_of(graph, np.arange(5) * 0.5)
    assert find_conflict(reach, [Pin("slow", 1, 2, graph.clip_index == 1)]).reason == "tempo"


def test_half_time_steps_must_be_admitted_throughout(make_graph):
    """A step over two music beats of which one is pinned to another clip is no way."""
    graph = make_graph([np.arange(4) * 1.0, np.arange(8) * 0.5])
    reach = reach_of(graph, np.arange(5) * 0.5)
    slow, fast = graph.clip_index == 0, graph.clip_index == 1
    assert reach.keeps([Pin("slow", 0, 2, slow)]) is True
    assert reach.keeps([Pin("slow", 0, 1, slow), Pin("fast", 1, 2, fast)]) is False


def test_bad_pins(two_clips):
    with pytest.raises(ValueError, match="first < last"):
        Pin("p", 3, 3, np.ones(12, bool))
    with pytest.raises(ValueError, match="before music beat 5"):
        admitted([Pin("p", 4, 6, np.ones(12, bool))], 5, 12)
    with pytest.raises(ValueError, match="nodes"):
        admitted([Pin("p", 0, 1, np.ones(3, bool))], 5, 12)
    assert admitted([], 2, 3).all()


def test_what_is_not_allowed_is_no_way(two_clips):
    """With the second clip forbidden the first still carries the song, and a pin to the second cannot be kept."""
    first = two_clips.clip_index == 0
    beat_s = np.arange(6) * 0.5
    only = Reach(two_clips, beat_s, costs=NO_USAGE, starts=np.array([0]), allowed=first)
    assert only.is_danceable
    assert not only.keeps([Pin("second", 4, 5, ~first)])
    assert not Reach(two_clips, beat_s, costs=NO_USAGE, starts=np.array([0]), allowed=~first).is_danceable


def test_soft_wishes_are_violated_where_hard_pins_are_kept(two_clips):
    """The document's attribute values against a seam that costs more: the wish is paid for and not kept."""
    beat_s = np.arange(6) * 0.5
    second = two_clips.clip_index == 1
    pin = Pin("second", 4, 5, second)
    mask = admitted([pin], 5, 12)

    def clips(path):
        return {int(two_clips.clip_index[node]) for node in path.source_node}

    soft = find_path(two_clips, beat_s, costs=NO_USAGE, starts=np.array([0]), interval_price=np.where(mask, 0.0, 1.0))
    assert clips(soft) == {0}
    assert soft.wish_cost.sum() == 1.0
    assert not mask[soft.beat_index[-1], soft.source_node[-1]]
    hard = find_path(two_clips, beat_s, costs=NO_USAGE, starts=np.array([0]), admissible=mask)
    assert clips(hard) == {0, 1}
    assert mask[hard.beat_index[-1], hard.source_node[-1]]
    assert hard.total_cost > soft.total_cost
    dear = find_path(two_clips, beat_s, costs=NO_USAGE, starts=np.array([0]), interval_price=np.where(mask, 0.0, 9.0))
    assert clips(dear) == {0, 1}


@pytest.fixture
def one_way(make_graph):
    """One clip of 21 beats at the song's pace, from its first beat: interval k can be danced from node k alone."""
    beat_s = np.arange(21) * 0.5
    return reach_of(make_graph([beat_s]), beat_s, np.array([0]))


def shown_at(*intervals):
    nodes = np.zeros(21, bool)
    nodes[list(intervals)] = True
    return nodes


def shifts(reach, pins, choices=None):
    return [
        (way.pin_index, way.shift_beats, way.choice) for way in find_conflict(reach, pins, choices=choices).ways_out
    ]


@pytest.mark.parametrize(
    ("wanted", "shift"),
    [
        ((3, 7), 1),  # the nearest, not the earliest
        ((5, 9), -1),
        ((5, 7), -1),  # of two as near the earlier
        ((19,), 13),  # the last interval of the song
        ((0,), -6),  # its first
    ],
)
def test_a_way_out_goes_to_the_nearest_beat(one_way, wanted, shift):
    assert shifts(one_way, [Pin("p", 6, 7, shown_at(*wanted))]) == [(0, shift, "")]


def test_a_long_pin_may_end_with_the_song_and_not_after_it(one_way):
    assert shifts(one_way, [Pin("p", 15, 18, shown_at(17, 18, 19))]) == [(0, 2, "")]
    assert shifts(one_way, [Pin("p", 15, 18, shown_at(18, 19, 20))]) == []


def test_a_way_out_is_no_further_than_sixteen_beats(one_way):
    assert shifts(one_way, [Pin("p", 17, 18, shown_at(1))]) == [(0, -16, "")]
    assert shifts(one_way, [Pin("p", 18, 19, shown_at(1))]) == []


def test_the_first_choice_that_does_is_named_after_the_shifts(one_way):
    wish = shown_at(8)
    choices = [{"same again": wish, "neither": shown_at(2), "this": shown_at(6, 7), "that too": shown_at(6)}]
    assert shifts(one_way, [Pin("p", 6, 7, wish)], choices) == [(0, 2, ""), (0, 0, "this")]
    assert shifts(one_way, [Pin("p", 6, 7, np.zeros(21, bool))], choices) == [(0, 0, "this")]


def test_of_two_conflicts_the_ways_out_mend_the_first_alone(one_way):
    pins = [Pin("a", 6, 7, shown_at(7)), Pin("b", 2, 3, shown_at(4))]
    conflict = find_conflict(one_way, pins)
    assert (conflict.pin_index, conflict.has_more) == ((0,), True)
    assert [(way.pin_index, way.shift_beats) for way in conflict.ways_out] == [(0, 1)]


def test_a_way_out_keeps_the_other_pins(one_way):
    """One beat on would do for the pin by itself, were it not for the other pin that forbids what is shown there."""
    other = Pin("other", 7, 8, shown_at(7))
    moved = Pin("p", 6, 7, shown_at(7, 9), steps_at=None)
    assert shifts(one_way, [moved, other]) == [(0, 1, "")]
    beat_s = np.arange(21) * 0.5
    assert one_way.keeps([moved.moved(1), other])
    assert one_way.n_intervals == len(beat_s) - 1


def test_ways_out_of_several_pins_are_nearest_first_and_choices_last(make_graph):
    """Two clips without a way between them: each pin wants one clip, or a moment of the other a little later."""
    beats = np.arange(9) * 0.5
    graph = make_graph([beats, beats])
    reach = reach_of(graph, beats, np.array([0, 9]))
    first, second = graph.clip_index == 0, graph.clip_index == 1
    a, b = first.copy(), second.copy()
    a[9 + 4] = b[6] = True
    conflict = find_conflict(
        reach, [Pin("a", 2, 3, a), Pin("b", 5, 6, b)], choices=[{"second": second}, {"first": first}]
    )
    assert (conflict.pin_index, conflict.reason) == ((0, 1), "path")
    assert [(way.pin_index, way.shift_beats, way.choice) for way in conflict.ways_out] == [
        (1, 1, ""),
        (0, 2, ""),
        (0, 0, "second"),
        (1, 0, "first"),
    ]


def test_a_moved_pin_takes_the_steps_of_its_new_beat(make_graph):
    graph = make_graph([np.arange(8) * 0.5])
    near = np.where(np.arange(8) == 3, 0.0, np.inf)
    everything = np.ones(8, bool)

    def at(beat):
        return pose_steps(graph, beat, near, 7)

    reach = reach_of(graph, np.arange(8) * 0.5, np.array([0]))
    pin = Pin("pose", 2, 3, everything, at(2), at)
    assert [way.shift_beats for way in find_conflict(reach, [pin]).ways_out] == [1]
    assert set(pin.moved(1).steps) == set(at(3))
    assert pin.moved(1).moved(-1).steps.keys() == pin.steps.keys()
    assert pin.instead(everything).steps == {}


def test_pins_keep_the_hard_bounds_wherever_the_song_does(make_graph):
    """A clip far from the tempo beside one in tempo is no way to keep a pin; alone it is danced at the last resort."""
    beat_s = np.arange(9) * 0.5
    both = make_graph([beat_s, 0.36 * np.arange(12)])
    reach = reach_of(both, beat_s)
    assert reach.bounds == NO_USAGE.hard_ratio
    assert not reach.keeps([Pin("far", 2, 3, both.clip_index == 1)])
    alone = make_graph([0.36 * np.arange(12)])
    last_resort = reach_of(alone, beat_s)
    assert last_resort.bounds == NO_USAGE.last_resort_ratio
    assert last_resort.keeps([Pin("far", 2, 3, np.ones(12, bool))])


def test_a_half_time_pin_covers_both_of_its_beats(make_graph):
    """Whether a pin's tempo fits is asked of every step that covers the interval, from before it too."""
    graph = make_graph([np.arange(6) * 1.0])
    reach = reach_of(graph, np.arange(9) * 0.5)
    for interval in range(8):
        assert reach.fits(Pin("p", interval, interval + 1, np.ones(6, bool)))
    assert not reach.fits(Pin("p", 0, 1, np.arange(6) == 5))


def test_the_same_nodes_without_their_steps_are_no_other_choice(make_graph):
    """A pose that cannot be shown in time is not answered by the same clip without the pose."""
    graph = make_graph([np.arange(8) * 0.5])
    reach = reach_of(graph, np.arange(8) * 0.5, np.array([0]))
    far = np.where(np.arange(8) == 7, 0.0, np.inf)
    pin = Pin("pose", 2, 3, np.ones(8, bool), pose_steps(graph, 2, far, 7))
    conflict = find_conflict(reach, [pin], choices=[{"the same": np.ones(8, bool), "all but one": np.arange(8) != 5}])
    assert [way.choice for way in conflict.ways_out] == ["all but one"]
