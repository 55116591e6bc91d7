"""Made-up poses, clips and graphs."""

import numpy as np
import pytest

from kernels.graph.costs import stride_cost
from kernels.graph.distance import PoseFeatures
from kernels.graph.nodes import beat_nodes
from kernels.graph.path import STEPS
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.kinematics import forward
from kernels.types import MotionGraph
from kernels.warp import warp_cost


@pytest.fixture
def make_poses():
    """Random poses of a metric: (n, metric, seed) to PoseFeatures; equal weights for equal metrics."""

    def make(n, metric="position", seed=0):
        rng = np.random.default_rng(seed)
        if metric == "position":
            return PoseFeatures(metric, rng.normal(scale=0.1, size=(n, 114)), np.zeros((n, 0, 4)), np.zeros(0))
        q = rng.normal(size=(n, 16, 4))
        weight = np.arange(1.0, 17.0) / 136
        return PoseFeatures(
            metric, rng.normal(scale=0.1, size=(n, 52)), q / np.linalg.norm(q, axis=-1, keepdims=True), weight
        )

    return make


@pytest.fixture
def make_dance():
    """A swaying, turning, travelling body: (frame rate, seconds) to local rotations and world positions."""

    def make(frame_rate_hz=120.0, duration_s=4.0, heading_rad=0.0, shift_m=(0.0, 0.0, 0.0)):
        time_s = np.arange(round(duration_s * frame_rate_hz) + 1) / frame_rate_hz
        rng = np.random.default_rng(7)
        axis = rng.normal(size=(len(JOINTS), 3))
        axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
        phase = rng.uniform(0, 2 * np.pi, len(JOINTS))
        half = 0.2 * np.sin(2 * np.pi * time_s[:, None] + phase)[..., None]
        rotation = np.concatenate([np.cos(half), np.sin(half) * axis], axis=-1)
        turn = (heading_rad + 0.3 * time_s) / 2
        zero = np.zeros_like(turn)
        rotation[:, 0] = np.stack([np.cos(turn), zero, np.sin(turn), zero], axis=-1)
        path = np.stack([0.5 * time_s, 0.94 + 0.05 * np.sin(2 * np.pi * time_s), 0.2 * time_s**2], axis=-1)
        cos, sin = np.cos(heading_rad), np.sin(heading_rad)
        path = path @ np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]]).T + np.array(shift_m)
        return rotation, forward(CANONICAL, path, rotation)[0]

    return make


@pytest.fixture
def make_graph():
    """A graph from clips' beat times and transitions (source, target, weight), each both ways unless one-way."""

    def make(beats, transitions=(), both_ways=True):
        nodes = beat_nodes([np.asarray(b, float) for b in beats], [max(b, default=0.0) + 1.0 for b in beats])
        rows = {(s, t): w for s, t, w in transitions}
        if both_ways:
            rows |= {(t, s): w for s, t, w in transitions}
        order = sorted(rows, key=lambda edge: (edge[0], rows[edge], edge[1]))
        return MotionGraph(
            nodes.clip_index,
            nodes.time_s,
            nodes.next_node,
            np.array([s for s, _ in order], np.int64),
            np.array([t for _, t in order], np.int64),
            np.array([rows[edge] for edge in order], float),
        )

    return make


@pytest.fixture
def make_random_graph(make_graph):
    """A seeded graph of a few clips with uneven beats and random transitions."""

    def make(seed, n_clips=3, n_beats=4, n_transitions=6):
        rng = np.random.default_rng(seed)
        beats = [np.cumsum(rng.uniform(0.35, 0.7, rng.integers(1, n_beats + 1))) for _ in range(n_clips)]
        n = sum(len(b) for b in beats)
        pairs = {tuple(sorted(rng.choice(n, 2, replace=False))) for _ in range(n_transitions)} if n > 1 else set()
        return make_graph(beats, [(int(a), int(b), float(rng.integers(1, 5))) for a, b in sorted(pairs)])

    return make


@pytest.fixture
def every_dance():
    """Every dance within the hard bounds: its cost, what ties go by, its moves; found by trying everything."""

    def find(graph, beat_s, costs, starts, admissible=None, step_price=None):
        n = len(beat_s) - 1
        scale = costs.transition_scale or (np.percentile(graph.weight, 95) if len(graph.weight) else 1.0)
        jumps = {}
        for s, t, w in zip(graph.source.tolist(), graph.target.tolist(), graph.weight.tolist(), strict=True):
            back_s = graph.time_s[s] - graph.time_s[t]
            goes_back = graph.clip_index[s] == graph.clip_index[t] and 0 <= back_s <= costs.jump_back_window_s
            cost = costs.seam + costs.transition * w / scale + costs.jump_back * goes_back
            jumps.setdefault(s, []).append((t, cost))
        found = []

        def dance(beat, ready, moves, cost, order):
            if beat == n:
                found.append((cost, order, moves))
                return
            for is_jump, node, price, stayed in ready:
                for kind, (m, d) in enumerate(STEPS):
                    end = node
                    for _ in range(m):
                        end = int(graph.next_node[end]) if end >= 0 else -1
                    if end < 0 or beat + d > n:
                        continue
                    if admissible is not None and not admissible[beat : beat + d, node].all():
                        continue
                    ratio = (beat_s[beat + d] - beat_s[beat]) / (graph.time_s[end] - graph.time_s[node])
                    if not costs.hard_ratio[0] - 1e-9 <= ratio <= costs.hard_ratio[1] + 1e-9:
                        continue
                    wish = 0.0 if step_price is None or (beat, kind) not in step_price else step_price[beat, kind][node]
                    if np.isinf(wish):
                        continue
                    step = float(warp_cost(ratio, costs.warp_weights)) + stride_cost(m, d, costs) + wish
                    left = max(costs.stay_beats - stayed - d, 0) / costs.stay_beats * costs.stay
                    on = [(0, end, 0.0, stayed + d), *((1, t, c + left, 0) for t, c in jumps.get(end, []))]
                    dance(
                        beat + d, on, [*moves, (beat, node, kind)], cost + price + step, [*order, is_jump, node, kind]
                    )

        dance(0, [(0, int(node), 0.0, 0) for node in starts], [], 0.0, [])
        return found

    return find
