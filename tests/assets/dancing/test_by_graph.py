"""Which dance is sought first: from where, and within which bounds."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from assets.dancing.asked import SOFT_WISH, Direction
from assets.dancing.avoided import AvoidedSpan
from assets.dancing.by_graph import by_graph, catalogue, path_costs, search, without_stretches
from assets.dancing.refusal import RefusalError
from assets.reading.songs import PlayedSong
from kernels.types import BeatGrid, MotionGraph
from schemas.keys import mirrored
from schemas.pins import parse_pin
from schemas.settings import PathSettings, Settings

COSTS = path_costs(PathSettings())


def one_clip(*interval_s):
    """A graph of one clip without transitions."""
    n = len(interval_s) + 1
    none = np.zeros(0, np.int64)
    time_s = np.append(0.0, np.cumsum(interval_s))
    return MotionGraph(np.zeros(n, np.int64), time_s, np.append(np.arange(1, n), -1), none, none, np.zeros(0))


@pytest.mark.parametrize(
    ("interval_s", "first", "is_outside"),
    [
        ([0.5] * 8, 0, False),
        ([0.75] + [0.5] * 8, 1, False),  # from the first beat only at 0.67 or 1.33 of its pace
        ([0.75] + [0.5] * 3 + [0.75] + [0.5] * 2, 0, True),
    ],
)
def test_any_beat_at_a_good_pace_comes_before_a_first_beat_at_a_bad_one(interval_s, first, is_outside):
    path = search(one_clip(*interval_s), np.arange(7) * 0.5, COSTS)
    assert path.source_node[0] == first
    assert path.is_outside.any() == is_outside


def test_no_dance_at_all_is_a_sentence():
    none = np.zeros(0, np.int64)
    empty = MotionGraph(none, np.zeros(0), none, none, none, np.zeros(0))
    with pytest.raises(RefusalError, match="no clip can be danced"):
        search(empty, np.arange(3) * 0.5, COSTS)
    with pytest.raises(RefusalError, match="path: want a dance to music beat 6"):
        search(one_clip(0.5), np.arange(7) * 0.5, COSTS)


def test_what_may_not_be_changed_is_neither_joined_nor_mirrored():
    names = ("a", "b", mirrored("a"), mirrored("b"))
    ends = np.arange(0, 8, 2)
    graph = MotionGraph(
        np.repeat(np.arange(4), 2),
        np.tile([0.0, 0.5], 4),
        np.array([1, -1, 3, -1, 5, -1, 7, -1]),
        np.repeat(ends + 1, 4),
        np.tile(ends, 4),
        np.ones(16),
    )
    licences = {"a": "CC-BY-4.0", "b": "CC-BY-ND-4.0"}
    clips = pl.DataFrame(
        [{"clip_id": c, "label": "x-left", "style": "", "licence": name} for c, name in licences.items()]
    )
    known = catalogue(graph, names, clips, ())
    assert [known.nodes.label[node] for node in ends] == ["x-left", "x-left", "x-right", "x-right"]
    assert known.is_allowed[ends].tolist() == [True, True, True, False]
    assert set(zip(known.graph.source.tolist(), known.graph.target.tolist(), strict=True)) == {
        (source, target) for source in (1, 5) for target in (0, 4)
    }
    assert not catalogue(graph, names, clips, ["CC-BY-4.0"]).is_allowed[[2, 3, 6, 7]].any()


def danced(*wishes, intensity=None, weight=1.0, is_soft=True):
    """Six beats of a song to the one clip there is, labelled step."""
    graph = replace(one_clip(*[0.5] * 6), speed=np.array([1.0, 5.0, 2.0, 4.0, 3.0, 6.0, 7.0]))
    clips = pl.DataFrame([{"clip_id": "a", "label": "step", "style": "", "licence": ""}])
    time_s = np.arange(7) * 0.5
    song = PlayedSong(time_s, BeatGrid(time_s, np.zeros(7, int), np.zeros(7, int), np.ones(7)), 3.0, intensity)
    settings = Settings(path=PathSettings(intensity_weight=weight))
    asked = Direction(tuple(parse_pin(text) for text in wishes), is_soft=is_soft)
    return by_graph(catalogue(graph, ("a",), clips, ()), song, settings, asked)


def test_what_a_dance_costs_is_the_sum_of_its_columns_each_counted_once():
    found = danced("1-2=spin", intensity=np.array([1.0, 2.0, 3.0, 3.0, 2.0, 1.0]))
    costs = found.metadata["costs"]
    assert costs["intensity"] > 0
    assert costs["wish"] == pytest.approx(2 * SOFT_WISH)
    assert sum(costs.values()) == pytest.approx(found.metadata["cost"])
    assert found.costs["wish_cost"].sum() == pytest.approx(2 * SOFT_WISH)
    assert found.costs["intensity_cost"].sum() == pytest.approx(costs["intensity"])


def test_movement_unlike_the_music_in_strength_is_no_wish():
    found = danced(intensity=np.arange(6.0))
    assert found.metadata["costs"]["intensity"] > 0
    assert found.metadata["costs"]["wish"] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("how", [{"intensity": None}, {"intensity": np.arange(6.0), "weight": 0.0}])
def test_where_strength_is_not_known_or_has_no_weight_it_costs_nothing(how):
    assert danced(**how).metadata["costs"]["intensity"] == 0


def test_a_soft_wish_that_cannot_be_kept_costs_and_a_hard_one_is_refused():
    found = danced("1-2=spin")
    assert [fact["is_kept"] for fact in found.metadata["pins"]] == [False]
    with pytest.raises(RefusalError) as refused:
        danced("1-2=spin", is_soft=False)
    assert refused.value.conflict == ["1-2=spin"]
    assert refused.value.ways_out


def test_a_pin_that_is_kept_costs_nothing_and_names_its_steps():
    found = danced("1-2=step", is_soft=False)
    assert found.metadata["costs"]["wish"] == 0
    assert [fact["is_kept"] for fact in found.metadata["pins"]] == [True]
    assert found.pin_ids == [None, None, "1-2=step", "1-2=step", None, None]


def test_no_step_goes_through_what_is_to_be_avoided():
    graph = one_clip(*[0.5] * 8)
    span = AvoidedSpan("a", 1.7, 1.8)  # between the fourth beat and the fifth
    assert without_stretches(graph, ("a",), [span], blend_s=0.0).next_node.tolist() == [1, 2, 3, -1, 5, 6, 7, 8, -1]
    near = without_stretches(graph, (mirrored("a"),), [AvoidedSpan("a", 1.45, 1.45)], blend_s=0.2)
    assert near.next_node.tolist() == [
        1,
        2,
        -1,
        -1,
        5,
        6,
        7,
        8,
        -1,
    ]  # half a blend of the stretch after it shows it too
    assert without_stretches(graph, ("b",), [span], blend_s=0.2).next_node.tolist() == graph.next_node.tolist()


def test_a_dance_goes_round_what_is_to_be_avoided_and_is_refused_where_there_is_no_way():
    clips = pl.DataFrame([{"clip_id": c, "label": "step", "style": "", "licence": ""} for c in ("a", "b")])
    time_s = np.arange(7) * 0.5
    song = PlayedSong(time_s, BeatGrid(time_s, np.zeros(7, int), np.zeros(7, int), np.ones(7)), 3.0)
    none, following = np.zeros(0, np.int64), np.array([*range(1, 7), -1, *range(8, 14), -1])
    two = MotionGraph(np.repeat([0, 1], 7), np.tile(time_s, 2), following, none, none, np.zeros(0))

    def dance(*avoid):
        return by_graph(catalogue(two, ("a", "b"), clips, (), avoid=avoid), song, Settings(), Direction()).steps.clip_id

    assert set(dance()) == {"a"}
    assert set(dance(AvoidedSpan("a", 1.2, 1.3))) == {"b"}
    with pytest.raises(RefusalError, match="path: want a dance"):
        dance(AvoidedSpan("a", 0.0, 3.0), AvoidedSpan("b", 0.0, 3.0))


def test_dances_begin_on_the_first_beats_of_clips_not_after_what_is_avoided():
    clips = pl.DataFrame([{"clip_id": "a", "label": "step", "style": "", "licence": ""}])
    known = catalogue(one_clip(*[0.5] * 8), ("a",), clips, (), avoid=[AvoidedSpan("a", 1.2, 1.3)])
    assert known.starts.tolist() == [0]
