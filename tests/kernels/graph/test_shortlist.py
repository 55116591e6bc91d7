"""A graph kept up to date: equal to the bit to one made anew, whatever changed."""

from dataclasses import fields, replace

import numpy as np
import pytest

from kernels.graph.beat_features import BeatFeatures, concatenate_beats
from kernels.graph.nodes import beat_nodes
from kernels.graph.shortlist import SPARE, make_shortlist, nearest_of, update_shortlist
from kernels.graph.transitions import connect, nearest

N_NEAREST = 3


@pytest.fixture
def make_clip(make_poses):
    """One clip's beats: (features, times, duration); clips of one ``near`` have like poses."""

    def make(seed, metric="position", most=9):
        rng = np.random.default_rng(seed)
        times = np.cumsum(rng.uniform(0.2, 0.9, rng.integers(0, most)))
        pose = make_poses(len(times), metric, seed)
        rough = rng.uniform(0, 1.8, len(times))
        return (
            BeatFeatures(pose, rng.uniform(0, 0.5, len(times)), rough),
            times,
            float(times.max(initial=0.0)) + rng.uniform(0, 0.4),
        )

    return make


def gather(clips):
    """Features and nodes of clips by name, in the order of their names."""
    parts = [clips[name] for name in sorted(clips)]
    return concatenate_beats(p[0] for p in parts), beat_nodes([p[1] for p in parts], [p[2] for p in parts])


def old_nodes(before, after, changed):
    """Which node of the clips before each node after is."""
    first, n = {}, 0
    for name in sorted(before):
        first[name] = n
        n += len(before[name][1])
    found = []
    for name in sorted(after):
        count = len(after[name][1])
        is_kept = name in first and name not in changed
        found += [first[name] + i if is_kept else -1 for i in range(count)]
    return np.array(found, np.int64)


def in_float32(rows, columns):
    from kernels.graph.distance import pose_distance

    return pose_distance(rows, columns).astype(np.float32)


def assert_same(one, other):
    for field in fields(one):
        np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name), err_msg=field.name)


@pytest.mark.parametrize("metric", ["position", "rotation"])
def test_the_shortlist_gives_what_the_search_gives(make_clip, metric):
    features, nodes = gather({str(i): make_clip(i, metric) for i in range(30)})
    listed = make_shortlist(features, nodes, n_nearest=N_NEAREST)
    assert_same(nearest_of(listed, nodes, n_nearest=N_NEAREST), nearest(features, nodes, n_nearest=N_NEAREST))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("distance", [None, in_float32])
def test_changes_one_after_the_other_end_as_a_graph_made_anew(make_clip, seed, distance):
    rng = np.random.default_rng(seed)
    asked = {"n_nearest": N_NEAREST} | ({"distance": distance} if distance else {})
    clips = {f"c{i:02}": make_clip(100 * seed + i) for i in range(30)}
    listed = make_shortlist(*gather(clips), **asked)
    refilled = 0
    for turn in range(12):
        before, name = dict(clips), f"c{rng.integers(0, 34):02}"
        if rng.random() < 0.3:
            clips.pop(name, None)
        else:
            clips[name] = make_clip(1000 + 100 * seed + turn)
        features, nodes = gather(clips)
        listed, work = update_shortlist(listed, old_nodes(before, clips, {name}), features, nodes, **asked)
        refilled += work.refilled_rows
        assert_same(nearest_of(listed, nodes, n_nearest=N_NEAREST), nearest(features, nodes, n_nearest=N_NEAREST))
        if work.refilled_rows == 0:
            n_new = len(clips[name][1]) if name in clips else 0
            assert work.computed_nodes == n_new
            assert work.distances == 2 * n_new * len(nodes)
    assert refilled < 12 * len(nodes)


def test_one_changed_clip_of_many_searches_no_other_row_again(make_clip):
    clips = {f"c{i:03}": make_clip(i) for i in range(80)}
    listed = make_shortlist(*gather(clips), n_nearest=8)
    changed = dict(clips) | {"c040": make_clip(1234)}
    features, nodes = gather(changed)
    new, work = update_shortlist(listed, old_nodes(clips, changed, {"c040"}), features, nodes, n_nearest=8)
    assert (work.computed_nodes, work.refilled_rows) == (len(changed["c040"][1]), 0)
    one, other = (
        connect(nodes, nearest_of(found, nodes, n_nearest=8))
        for found in (new, make_shortlist(features, nodes, n_nearest=8))
    )
    assert_same(one.graph, other.graph)
    np.testing.assert_array_equal(one.distance, other.distance)


def test_nothing_changed_computes_nothing(make_clip):
    features, nodes = gather({str(i): make_clip(i) for i in range(20)})
    listed = make_shortlist(features, nodes, n_nearest=N_NEAREST)
    again, work = update_shortlist(listed, np.arange(len(nodes)), features, nodes, n_nearest=N_NEAREST)
    assert (work.computed_nodes, work.refilled_rows, work.distances) == (0, 0, 0)
    assert_same(again.pairs, listed.pairs)


def test_equal_poses_are_ordered_as_in_a_search(make_clip):
    features, times, duration_s = make_clip(3)
    clips = {f"c{i}": (features, times, duration_s) for i in range(3 * SPARE)}
    listed = make_shortlist(*gather(clips), n_nearest=N_NEAREST)
    for name in ("c5", "c0", "c9"):
        whole, nodes = gather(clips)
        listed, _ = update_shortlist(listed, old_nodes(clips, clips, {name}), whole, nodes, n_nearest=N_NEAREST)
        assert_same(nearest_of(listed, nodes, n_nearest=N_NEAREST), nearest(whole, nodes, n_nearest=N_NEAREST))


def test_from_nothing_and_to_nothing(make_clip):
    features, nodes = gather({"a": make_clip(5), "b": make_clip(6)})
    empty = replace(features, pose=features.pose.take(slice(0, 0)), local_distance=np.zeros(0), jerk_ratio=np.zeros(0))
    none = beat_nodes([], [])
    listed = make_shortlist(empty, none, n_nearest=N_NEAREST)
    full, work = update_shortlist(listed, np.full(len(nodes), -1), features, nodes, n_nearest=N_NEAREST)
    assert work.computed_nodes == len(nodes)
    assert_same(nearest_of(full, nodes, n_nearest=N_NEAREST), nearest(features, nodes, n_nearest=N_NEAREST))
    gone, _ = update_shortlist(full, np.zeros(0, np.int64), empty, none, n_nearest=N_NEAREST)
    assert len(gone.pairs.row) == 0
