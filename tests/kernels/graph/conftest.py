"""Made-up poses, clips and graphs."""

import numpy as np
import pytest

from kernels.graph.distance import PoseFeatures
from kernels.graph.nodes import beat_nodes
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.kinematics import forward
from kernels.types import MotionGraph


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
