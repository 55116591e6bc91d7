"""Which dance is sought first: from where, and within which bounds."""

import dagster as dg
import numpy as np
import pytest

from assets.graph_path import path_costs, search
from kernels.types import MotionGraph
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
    with pytest.raises(dg.Failure, match="no clip can be danced"):
        search(empty, np.arange(3) * 0.5, COSTS)
    with pytest.raises(dg.Failure, match="path: want a dance to music beat 6"):
        search(one_clip(0.5), np.arange(7) * 0.5, COSTS)
