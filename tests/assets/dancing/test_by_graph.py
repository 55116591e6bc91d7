"""Which dance is sought first: from where, and within which bounds."""

import numpy as np
import polars as pl
import pytest

from assets.dancing.by_graph import catalogue, path_costs, search
from assets.dancing.refusal import RefusalError
from kernels.types import MotionGraph
from schemas.keys import mirrored
from schemas.settings import PathSettings

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
