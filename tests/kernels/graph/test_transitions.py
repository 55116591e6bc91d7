import numpy as np
import pytest

from kernels.graph import transitions
from kernels.graph.beat_features import BeatFeatures
from kernels.graph.costs import PathCosts
from kernels.graph.distance import PoseFeatures, pose_distance
from kernels.graph.nodes import beat_nodes
from kernels.graph.transitions import (
    LOCAL_BOUNDS,
    RAISE,
    THRESHOLDS,
    blend_margin_s,
    connect,
    find_transitions,
    nearest,
)


@pytest.fixture
def on_a_line():
    """Beats whose poses are numbers, decimetres: (values of each clip, spacing, d(i) in dm²) to features and nodes."""

    def make(clips, spacing_s=1.0, local=1.0, lead_s=0.5):
        times = [lead_s + spacing_s * np.arange(len(values)) for values in clips]
        nodes = beat_nodes(times, [lead_s + spacing_s * len(values) for values in clips])
        linear = 0.1 * np.concatenate([*map(np.asarray, clips), np.zeros(0)])[:, None]
        pose = PoseFeatures("position", linear, np.zeros((len(linear), 0, 4)), np.zeros(0))
        return BeatFeatures(pose, np.full(len(linear), 0.01 * local)), nodes

    return make


@pytest.fixture
def make_catalogue(make_poses):
    """Random beats of clips of several lengths: (n clips, metric, seed) to features and nodes."""

    def make(n_clips=12, metric="position", seed=0):
        rng = np.random.default_rng(seed)
        times = [np.cumsum(rng.uniform(0.2, 0.9, rng.integers(0, 9))) for _ in range(n_clips)]
        nodes = beat_nodes(times, [float(t.max(initial=0.0)) + rng.uniform(0, 0.4) for t in times])
        return BeatFeatures(make_poses(len(nodes), metric, seed), rng.uniform(0, 0.5, len(nodes))), nodes

    return make


def in_float32(rows, columns):
    """A device's stand-in: right up to the error bound, wrong in the last bits of float32."""
    noise = np.random.default_rng(len(rows)).uniform(-1, 1, (len(rows), len(columns)))
    exact = pose_distance(rows, columns)
    return (exact * (1 + 3e-7 * noise)).astype(np.float32)


def brute_force(features, nodes, k, guard_s, margin_s):
    """The rules of nearest, one pair at a time."""
    local = np.clip(features.local_distance, *LOCAL_BOUNDS[features.pose.metric])
    weight = pose_distance(features.pose, features.pose) / np.add.outer(local, local)
    listed = []
    for i in range(len(nodes)):
        out = bool(nodes.may_leave(margin_s)[i])
        if not out and not nodes.may_enter(margin_s)[i]:
            continue
        useful = nodes.may_enter() if out else nodes.may_leave()
        allowed = nodes.may_enter(margin_s) if out else nodes.may_leave(margin_s)
        step = nodes.next_node[i] if out else nodes.previous_node[i]
        others = [
            j
            for j in np.flatnonzero(useful)
            if j not in (i, step)
            and not (nodes.clip_index[i] == nodes.clip_index[j] and abs(nodes.time_s[i] - nodes.time_s[j]) < guard_s)
        ]
        others.sort(key=lambda j, i=i: (weight[i, j], j))
        kept = [j for j in others if allowed[j]][:k]
        listed += [(i, j) for j in others if j in kept or (not allowed[j] and j in others[:k])]
    return listed


def edges(found):
    return list(zip(found.graph.source.tolist(), found.graph.target.tolist(), strict=True))


def test_weight_is_the_ratio_of_equation_20(on_a_line):
    features, nodes = on_a_line([[0, 10, 20], [0.5, 12, 20]], local=0.25)
    found = find_transitions(features, nodes, threshold=100.0, n_nearest=1)
    at = edges(found).index((1, 4))
    assert found.distance[at] == pytest.approx(0.04)
    assert found.graph.weight[at] == pytest.approx(0.04 / (0.0025 + 0.0025))


def test_only_below_the_threshold(on_a_line):
    features, nodes = on_a_line([[0, 1, 0, 1, 3], [0, 1, 0, 1, 3]], local=0.5)
    weights = find_transitions(features, nodes, threshold=1.0 - 1e-9).graph.weight
    assert (weights < 0.9).all()
    more = find_transitions(features, nodes, threshold=1.0 + 1e-9).graph.weight
    assert more.max() == pytest.approx(1.0)
    assert len(more) > len(weights)


def test_k_nearest_with_ties_to_the_lower_node(on_a_line):
    features, nodes = on_a_line([[9, 0, 9], [9, 1, 9], [9, -1, 9], [9, 1, 9]])
    pairs = nearest(features, nodes, n_nearest=2)
    np.testing.assert_array_equal(pairs.other[pairs.row == 1], [4, 7])
    np.testing.assert_array_equal(pairs.other[pairs.row == 4], [10, 1])


def test_closure_is_symmetric(on_a_line):
    # each of the outer poses has the middle one as its nearest; it lists only one of them and is joined to all
    features, nodes = on_a_line([[90, 0, 90], [80, 1, 80], [70, -1.1, 70], [60, 1.2, 60]])
    found = find_transitions(features, nodes, n_nearest=1, threshold=3.0)
    assert {(1, 4), (4, 1), (1, 7), (7, 1)} <= set(edges(found))
    assert len(set(edges(found))) == len(edges(found))


def test_never_itself_the_next_beat_or_the_same_moment(on_a_line):
    features, nodes = on_a_line([np.zeros(8)], spacing_s=0.2)
    joined = edges(find_transitions(features, nodes, guard_s=0.5))
    assert (4, 5) not in joined
    assert all(s != t and abs(nodes.time_s[s] - nodes.time_s[t]) >= 0.5 for s, t in joined)
    near = edges(find_transitions(features, nodes, guard_s=0.0))
    assert (4, 3) in near
    assert all(s != t and t != s + 1 for s, t in near)


def test_rule_of_the_blend(on_a_line):
    # beats 0.05 s after the start: nothing before them to blend with, so the first cannot be entered
    features, nodes = on_a_line([[0, 1, 0, 1], [0, 1, 0, 1]], lead_s=0.05)
    with_margin = find_transitions(features, nodes, min_margin_s=0.1, threshold=3)
    without = find_transitions(features, nodes, min_margin_s=0.0, threshold=3)
    assert (2, 4) in edges(without)
    assert (2, 4) not in edges(with_margin)
    removed = set(edges(without)) - set(edges(with_margin))
    assert removed
    assert with_margin.n_margin_removed == len(removed)
    assert without.n_margin_removed == 0


def test_a_blend_needs_frames_at_the_fastest_usual_pace(on_a_line):
    assert blend_margin_s(0.4) == pytest.approx(0.2 / 0.9)
    assert blend_margin_s(0.4, costs=PathCosts(soft_ratio=(0.85, 1.1))) == pytest.approx(0.2 / 0.85)
    assert blend_margin_s(0.0) == 0
    # 0.21 s are enough at the clip's own pace, not a tenth faster
    features, nodes = on_a_line([[0, 1, 0, 1], [0, 1, 0, 1]], lead_s=0.21)
    assert (2, 4) in edges(find_transitions(features, nodes, min_margin_s=0.2, threshold=3))
    assert (2, 4) not in edges(find_transitions(features, nodes, threshold=3))


def test_rule_of_the_jump(on_a_line):
    features, nodes = on_a_line([[0, 1, 0, 1], [0, 1, 0, 1]])
    jump = np.where(np.arange(8) == 5, 2.0, 1.0)
    rough = BeatFeatures(features.pose, features.local_distance, jump)
    free, ruled = find_transitions(features, nodes), find_transitions(rough, nodes)
    assert (1, 5) in edges(free)
    assert edges(ruled) == [(s, t) for s, t in edges(free) if 5 not in (s, t)]
    assert (free.n_jerk_removed, ruled.n_jerk_removed) == (0, len(edges(free)) - len(edges(ruled)))
    assert edges(find_transitions(rough, nodes, max_jerk_ratio=2.0)) == edges(free)


def test_forbidden_nodes_take_no_place_among_the_nearest(on_a_line):
    features, nodes = on_a_line([[9, 0, 9], [9, 0.1, 9], [9, 0.2, 9]])
    rough = BeatFeatures(features.pose, features.local_distance, np.where(np.arange(9) == 4, 2.0, 1.0))
    pairs = nearest(rough, nodes, n_nearest=1)
    np.testing.assert_array_equal(pairs.other[pairs.row == 1], [4, 7])
    assert (1, 7) in edges(connect(nodes, pairs))
    assert (1, 4) not in edges(connect(nodes, pairs))


def test_a_transition_is_left_after_a_beat_and_entered_before_one(on_a_line):
    features, nodes = on_a_line([[0, 0, 0], [0, 0, 0]])
    for source, target in edges(find_transitions(features, nodes)):
        assert nodes.previous_node[source] >= 0
        assert nodes.next_node[target] >= 0


def test_frozen_poses_count_as_moving_a_little(on_a_line):
    features, nodes = on_a_line([[0, 0.15, 0], [0, 0.3, 0]], local=0.0)
    found = find_transitions(features, nodes, threshold=1e9)
    at = edges(found).index((1, 4))
    assert found.graph.weight[at] == pytest.approx(0.015**2 / (2 * LOCAL_BOUNDS["position"][0]))
    assert np.isfinite(found.graph.weight).all()


def test_a_jump_in_a_recording_is_not_near_to_everything(on_a_line):
    features, nodes = on_a_line([[0, 10, 0], [0, 30, 0]], local=1.0)
    broken = BeatFeatures(features.pose, np.where(np.arange(6) == 4, 25.0, features.local_distance))
    assert (1, 4) in edges(find_transitions(broken, nodes, threshold=2.0, local_bounds=(1e-4, 100.0)))
    assert (1, 4) not in edges(find_transitions(broken, nodes, threshold=2.0))
    pairs = nearest(broken, nodes)
    weight = pairs.weight[(pairs.row == 1) & (pairs.other == 4)]
    np.testing.assert_allclose(weight, 2.0**2 / (0.01 + LOCAL_BOUNDS["position"][1]))


def test_default_threshold_is_the_metrics(make_catalogue):
    for metric in ("position", "rotation"):
        assert find_transitions(*make_catalogue(20, metric)).threshold_asked == THRESHOLDS[metric]


def test_threshold_is_raised_until_a_dance_can_go_on(on_a_line):
    features, nodes = on_a_line([[0, 5, 10], [50, 60, 70]], local=0.5)
    found = find_transitions(features, nodes, threshold=2.0)
    assert found.is_endless
    assert found.threshold_asked == 2.0
    steps = np.log(found.threshold_used / 2.0) / np.log(RAISE)
    assert steps > 0
    assert steps == pytest.approx(round(steps))
    assert not find_transitions(features, nodes, threshold=found.threshold_used / RAISE).threshold_used < (
        found.threshold_used * 0.999
    )
    enough = find_transitions(features, nodes, threshold=1000.0)
    assert enough.threshold_used == enough.threshold_asked


def test_threshold_stays_where_raising_does_not_help(on_a_line):
    features, nodes = on_a_line([[0, 5], [1]], lead_s=0.0)
    found = find_transitions(features, nodes, threshold=2.0)
    assert not found.is_endless
    assert found.threshold_used == 2.0


@pytest.mark.parametrize("metric", ["position", "rotation"])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("k", "guard_s", "margin_s"), [(1, 0.5, 0.1), (3, 0.0, 0.0), (5, 1.0, 0.3), (50, 0.5, 0.2)])
def test_agrees_with_brute_force(make_catalogue, metric, seed, k, guard_s, margin_s):
    features, nodes = make_catalogue(metric=metric, seed=seed)
    arguments = {"n_nearest": k, "guard_s": guard_s, "min_margin_s": margin_s}
    expected = brute_force(features, nodes, k, guard_s, margin_s)
    for distance in (pose_distance, in_float32):
        pairs = nearest(features, nodes, distance=distance, **arguments)
        assert list(zip(pairs.row.tolist(), pairs.other.tolist(), strict=True)) == sorted(
            expected,
            key=lambda pair: (pair[0], pairs.weight[(pairs.row == pair[0]) & (pairs.other == pair[1])][0], pair[1]),
        )


@pytest.mark.parametrize("metric", ["position", "rotation"])
def test_backends_agree_to_the_bit(make_catalogue, metric, monkeypatch):
    features, nodes = make_catalogue(60, metric)
    monkeypatch.setattr(transitions, "_TILE", 700)  # several tiles
    reference, device = (nearest(features, nodes, distance=d, n_nearest=4) for d in (pose_distance, in_float32))
    for name in ("row", "other", "distance", "weight"):
        np.testing.assert_array_equal(getattr(device, name), getattr(reference, name))


@pytest.mark.parametrize("distance", [pose_distance, in_float32])
def test_frozen_alike_by_the_hundred(on_a_line, distance, monkeypatch):
    monkeypatch.setattr(transitions, "_CROWD", 1000)  # several blocks
    features, nodes = on_a_line([np.zeros(300), np.zeros(300)], local=0.0)
    pairs = nearest(features, nodes, distance=distance, n_nearest=3)
    np.testing.assert_array_equal(pairs.other[pairs.row == 100], [0, 1, 2])
    np.testing.assert_array_equal(pairs.other[pairs.row == 1], [0, 3, 4])
    np.testing.assert_array_equal(np.bincount(pairs.row, minlength=600)[1:299], 3)


def test_rows_can_be_made_apart(make_catalogue):
    features, nodes = make_catalogue(20)
    whole = nearest(features, nodes)
    part = nearest(features, nodes, rows=np.arange(10, 30))
    inside = (whole.row >= 10) & (whole.row < 30)
    np.testing.assert_array_equal(part.other, whole.other[inside])
    np.testing.assert_array_equal(part.weight, whole.weight[inside])


def test_edges_are_sorted(make_catalogue):
    graph = find_transitions(*make_catalogue(20), threshold=1e9).graph
    order = np.lexsort((graph.target, graph.weight, graph.source))
    np.testing.assert_array_equal(order, np.arange(len(graph.source)))


@pytest.mark.parametrize("clips", [[], [[]], [[1.0]], [[1.0], [1.0]]])
def test_too_little_to_join(on_a_line, clips):
    features, nodes = on_a_line(clips)
    found = find_transitions(features, nodes)
    assert len(found.graph.source) == len(found.distance) == 0
    assert not found.is_endless


def test_errors(on_a_line):
    features, nodes = on_a_line([[0, 1, 2]])
    for change, message in [
        ({"n_nearest": 0}, "n_nearest"),
        ({"guard_s": -1.0}, "guard_s"),
        ({"min_margin_s": np.nan}, "min_margin_s"),
        ({"local_bounds": (0.0, 1.0)}, "local_bounds"),
        ({"local_bounds": (2.0, 1.0)}, "local_bounds"),
        ({"max_jerk_ratio": 0.0}, "max_jerk_ratio"),
        ({"threshold": 0.0}, "threshold"),
    ]:
        with pytest.raises(ValueError, match=message):
            find_transitions(features, nodes, **change)
    with pytest.raises(ValueError, match="want 6 beats"):
        nearest(features, on_a_line([[0, 1, 2], [0, 1, 2]])[1])
    pairs = nearest(features, nodes)
    with pytest.raises(ValueError, match="threshold"):
        connect(nodes, pairs, threshold=np.inf)


def test_edges_of_one_weight_are_sorted_by_their_targets(on_a_line):
    features, nodes = on_a_line([np.zeros(4)] * 3)
    graph = find_transitions(features, nodes).graph
    assert len(np.unique(graph.weight)) == 1
    order = np.lexsort((graph.target, graph.source))
    np.testing.assert_array_equal(order, np.arange(len(graph.source)))
    assert len(set(zip(graph.source.tolist(), graph.target.tolist(), strict=True))) == len(graph.source)


def test_a_recording_as_rough_as_allowed_may_be_a_seam(on_a_line):
    features, nodes = on_a_line([[0, 1, 0, 1], [0, 1, 0, 1]])
    free = edges(find_transitions(features, nodes))
    for roughness, is_joined in ((1.5, True), (1.5001, False)):
        rough = BeatFeatures(features.pose, features.local_distance, np.where(np.arange(8) == 5, roughness, 0.0))
        found = edges(find_transitions(rough, nodes))
        assert (found == free) == is_joined


def test_a_blend_with_exactly_the_frames_it_needs_has_room(on_a_line):
    features, nodes = on_a_line([[0, 1, 0, 1], [0, 1, 0, 1]], lead_s=0.25)
    assert (2, 4) in edges(find_transitions(features, nodes, min_margin_s=0.25, threshold=3))
    assert (2, 4) not in edges(find_transitions(features, nodes, min_margin_s=0.2501, threshold=3))


def test_nodes_exactly_the_guard_apart_are_two_moments(on_a_line):
    features, nodes = on_a_line([np.zeros(9)], spacing_s=0.25)
    joined = edges(find_transitions(features, nodes, guard_s=0.5))
    assert (4, 2) in joined
    assert (4, 3) not in joined
