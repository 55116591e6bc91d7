"""Time the motion graph and the path on made-up dances: distance a pair, whole graph, path through it.

    python benchmarks/graph.py [--nodes N] [--beats K] [--device NAME] [--repeats R] [--json]

*A pair*: our distance on an OpenCL device and by the NumPy reference, beside a plain Python loop in the manner of
fairmotion's construction (for every pair the two poses are aligned and compared joint by joint with small arrays), all
on the same poses in one run; and beside fairmotion itself, 528 s for 378 nodes, measured elsewhere and quoted. *Graph*:
features, all pairs, edges, pruning, each metric in a process of its own for its peak of memory. *Path*: a random graph
of as many nodes with 20 transitions each. Every figure is the median of the repeats after one warm-up; ``spread_ratio``
is (slowest - fastest) / median.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import resource
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import pyopencl as cl

from kernels import rotation
from kernels.graph import prune
from kernels.graph.beat_features import BeatFeatures, beat_features, concatenate_beats, default_weight
from kernels.graph.costs import PathCosts
from kernels.graph.distance import Metric, pose_distance
from kernels.graph.nodes import BeatNodes, beat_nodes
from kernels.graph.path import find_path
from kernels.graph.transitions import N_NEAREST, connect, nearest
from kernels.opencl.choice import pick_device
from kernels.opencl.pose_distance import PoseDistance
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.kinematics import forward
from kernels.types import Float, MotionGraph

FAIRMOTION_PAIR_US = 528e6 / 378**2
BEATS_A_CLIP = 20


def made_up_clip(seed: int) -> tuple[Float, Float, Float]:
    """Joints that swing at some tempo, ten seconds at 60 Hz: local rotations, world positions, beats."""
    rng = np.random.default_rng(seed)
    interval_s = rng.uniform(0.40, 0.65)
    time_s = np.arange(round((BEATS_A_CLIP + 1) * interval_s * 60)) / 60
    axis = rng.normal(size=(len(JOINTS), 3))
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    swing = rng.uniform(0, 0.5, len(JOINTS)) * np.cos(
        np.pi * time_s[:, None] / interval_s + rng.uniform(0, 6, len(JOINTS))
    )
    turned = rotation.exp(swing[..., None] * axis)
    root = np.stack([0.3 * np.sin(time_s), 0.9 + 0.04 * np.cos(2 * time_s), 0.2 * time_s], -1)
    beats = interval_s * (0.5 + np.arange(BEATS_A_CLIP))
    return turned, forward(CANONICAL, root, turned)[0], beats


def made_up_catalogue(n_nodes: int, metric: Metric) -> tuple[BeatFeatures, BeatNodes, float]:
    """Features of as many clips as it takes, and the seconds spent on them alone."""
    features, beats, lengths, spent_s = [], [], [], 0.0
    for seed in range(max(n_nodes // BEATS_A_CLIP, 1)):
        turned, position, beat_s = made_up_clip(seed)
        begin = time.perf_counter()
        features.append(beat_features(turned, position, frame_rate_hz=60, time_s=beat_s, metric=metric))
        spent_s += time.perf_counter() - begin
        beats.append(beat_s)
        lengths.append((len(turned) - 1) / 60)
    return concatenate_beats(features), beat_nodes(beats, lengths), spent_s


def pair_by_pair(poses: list[tuple[Float, Float]], n_pairs: int) -> float:
    """Compare poses in plain Python: each pair aligned and gone through joint by joint; seconds."""
    weight = default_weight("rotation")
    begin = time.perf_counter()
    total = 0.0
    for pair in range(n_pairs):
        (q, p), (r, s) = poses[pair % len(poses)], poses[(7 * pair + 1) % len(poses)]
        angle = float(rotation.heading_rad(q[0]) - rotation.heading_rad(r[0]))
        turn = rotation.to_matrix(rotation.from_heading(angle))
        for joint in range(len(JOINTS)):
            apart = (p[joint] - p[0]) - turn @ (s[joint] - s[0])
            bent = np.linalg.norm(rotation.log(rotation.mul(rotation.inv(r[joint]), q[joint])))
            total += weight[joint] * (float(np.dot(apart, apart)) + float(bent) ** 2)
    seconds = time.perf_counter() - begin
    if not np.isfinite(total):
        raise ValueError("total: not finite")
    return seconds


def median(
    repeats: int, run: Callable[[], object], clock: Callable[[], float] = time.perf_counter
) -> tuple[float, float]:
    """Median seconds of some runs after a warm-up, and their spread."""
    run()
    times = []
    for _ in range(repeats):
        begin = clock()
        run()
        times.append(clock() - begin)
    middle = statistics.median(times)
    return middle, (max(times) - min(times)) / middle


def pairs(device: str | None, n_nodes: int, repeats: int) -> dict[str, float | str]:
    """Figures of the distance alone."""
    twin = PoseDistance(cl.Context([pick_device(device)]))
    clips = [made_up_clip(seed)[:2] for seed in range(8)]
    poses = [(turned[f], position[f]) for turned, position in clips for f in range(0, 400, 40)]
    n_python = 300
    python_s, spread = median(repeats, lambda: pair_by_pair(poses, n_python))
    found: dict[str, float | str] = {
        "device_name": twin.name,
        "fairmotion_quoted_pair_us": FAIRMOTION_PAIR_US,
        "python_pair_us": 1e6 * python_s / n_python,
        "python_spread_ratio": spread,
    }
    for metric in ("position", "rotation"):
        pose = made_up_catalogue(min(n_nodes, 4000), metric)[0].pose
        rows = pose.take(slice(0, 1024))
        few = pose.take(slice(0, 64))
        device_s, spread = median(repeats, lambda rows=rows, pose=pose: twin(rows, pose))
        device_cpu_s, _ = median(repeats, lambda rows=rows, pose=pose: twin(rows, pose), time.process_time)
        numpy_s, numpy_spread = median(repeats, lambda few=few, pose=pose: pose_distance(few, pose))
        device_ns = 1e9 * device_s / (len(rows) * len(pose))
        found |= {
            f"{metric}_opencl_pair_ns": device_ns,
            f"{metric}_opencl_pair_cpu_ns": 1e9 * device_cpu_s / (len(rows) * len(pose)),
            f"{metric}_opencl_spread_ratio": spread,
            f"{metric}_numpy_pair_ns": 1e9 * numpy_s / (len(few) * len(pose)),
            f"{metric}_numpy_spread_ratio": numpy_spread,
            f"{metric}_python_over_opencl_ratio": 1e9 * python_s / n_python / device_ns,
            f"{metric}_fairmotion_over_opencl_ratio": 1e3 * FAIRMOTION_PAIR_US / device_ns,
        }
    return found


def whole_graph(metric: Metric, n_nodes: int, device: str | None) -> dict[str, float]:
    """Figures of one graph, in a process of its own."""
    begin = time.perf_counter()
    distance = PoseDistance(cl.Context([pick_device(device)]))
    build_s = time.perf_counter() - begin
    features, nodes, feature_s = made_up_catalogue(n_nodes, metric)
    before_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    begin, begin_cpu = time.perf_counter(), time.process_time()
    listed = nearest(features, nodes, distance=distance)
    nearest_s, nearest_cpu_s = time.perf_counter() - begin, time.process_time() - begin_cpu
    begin = time.perf_counter()
    found = connect(nodes, listed)
    connect_s = time.perf_counter() - begin
    begin = time.perf_counter()
    kept = prune.keep_endless(found.graph)
    return {
        f"{metric}_node_count": len(nodes),
        f"{metric}_edge_count": len(found.graph.source),
        f"{metric}_kept_node_count": int(kept.is_kept.sum()),
        f"{metric}_device_build_s": build_s,
        f"{metric}_features_s": feature_s,
        f"{metric}_all_pairs_s": nearest_s,
        f"{metric}_all_pairs_cpu_s": nearest_cpu_s,
        f"{metric}_connect_s": connect_s,
        f"{metric}_prune_s": time.perf_counter() - begin,
        f"{metric}_peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        f"{metric}_before_mib": before_mib,
    }


def random_graph(n_nodes: int) -> MotionGraph:
    """Clips of twenty beats at 92 to 150 a minute, a node with 20 transitions or more on average, both ways."""
    rng = np.random.default_rng(0)
    interval_s = rng.uniform(0.40, 0.65, n_nodes // BEATS_A_CLIP)
    nodes = beat_nodes([0.2 + t * np.arange(BEATS_A_CLIP) for t in interval_s], list(0.4 + BEATS_A_CLIP * interval_s))
    one = np.repeat(np.arange(len(nodes)), N_NEAREST // 2 + 2)  # some are not useful
    other, weight = rng.integers(0, len(nodes), len(one)), rng.uniform(0.1, 2, len(one))
    source, target = np.concatenate([one, other]), np.concatenate([other, one])
    useful = nodes.may_leave()[source] & nodes.may_enter()[target] & (source != target)
    _, first = np.unique((source * len(nodes) + target)[useful], return_index=True)
    chosen = np.flatnonzero(useful)[first]
    source, target, weight = source[chosen], target[chosen], np.tile(weight, 2)[chosen]
    order = np.lexsort((target, weight, source))
    return MotionGraph(nodes.clip_index, nodes.time_s, nodes.next_node, source[order], target[order], weight[order])


def paths(n_nodes: int, n_beats: int, repeats: int) -> dict[str, float]:
    """Figures of the path, exact and with repetition spread, and exact with a price on short stays."""
    graph = random_graph(n_nodes)
    beat_s = np.cumsum(0.5 + 0.01 * np.random.default_rng(1).normal(size=n_beats + 1))
    exact_s, spread = median(repeats, lambda: find_path(graph, beat_s, rounds=0))
    whole_s, whole_spread = median(repeats, lambda: find_path(graph, beat_s))
    stays = PathCosts(stay=4.0, stay_beats=4)
    stay_s, stay_spread = median(repeats, lambda: find_path(graph, beat_s, costs=stays, rounds=0), time.process_time)
    plain_s, _ = median(repeats, lambda: find_path(graph, beat_s, rounds=0), time.process_time)
    exact, spread_out = find_path(graph, beat_s, rounds=0), find_path(graph, beat_s)
    return {
        "path_node_count": len(graph.clip_index),
        "path_edge_count": len(graph.source),
        "path_beat_count": n_beats,
        "path_exact_s": exact_s,
        "path_exact_spread_ratio": spread,
        "path_s": whole_s,
        "path_spread_ratio": whole_spread,
        "path_exact_cpu_s": plain_s,
        "path_exact_with_stays_cpu_s": stay_s,
        "path_exact_with_stays_spread_ratio": stay_spread,
        "path_exact_total_score": exact.total_cost,
        "path_total_score": spread_out.total_cost,
    }


def main() -> None:
    """Parse the command line, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=int, default=10_000)
    parser.add_argument("--beats", type=int, default=600)
    parser.add_argument("--device", default=None, help="index or part of a name; default: first GPU, else CPU")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    arguments = parser.parse_args()
    found: dict[str, float | str] = pairs(arguments.device, arguments.nodes, arguments.repeats)
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        for metric in ("position", "rotation"):
            found |= pool.apply(whole_graph, (metric, arguments.nodes, arguments.device))
    found |= paths(arguments.nodes, arguments.beats, arguments.repeats)
    if arguments.json:
        print(json.dumps(found))
        return
    for name, value in found.items():
        print(f"{name:40s} {value if isinstance(value, str) else format(value, ',.4g')}")


if __name__ == "__main__":
    main()
