"""One changed clip in a catalogue of 500: the motion graph brought up to date against made anew.

    python benchmarks/graph_update.py [--clips N] [--device NAME] [--repeats R] [--json]

Made-up dances of twenty beats. Both sides do all there is: features, near pairs, picking, edges. *Anew* takes the
features of every clip and all pairs; *update* those of one changed clip, its row and its column. Figures are medians of
CPU seconds after a warm-up; the edges of both are compared to the bit.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parent))

import pyopencl as cl
from graph import made_up_clip, median

from kernels.graph.beat_features import BeatFeatures, beat_features, concatenate_beats
from kernels.graph.nodes import BeatNodes, beat_nodes
from kernels.graph.shortlist import Shortlist, Work, make_shortlist, nearest_of, update_shortlist
from kernels.graph.transitions import Transitions, connect
from kernels.opencl.choice import pick_device
from kernels.opencl.pose_distance import PoseDistance
from kernels.types import Float

Moved = tuple[Float, Float, Float]


def features_of(clip: Moved) -> BeatFeatures:
    """Take the features of one clip at its beats."""
    turned, position, beat_s = clip
    return beat_features(turned, position, frame_rate_hz=60, time_s=beat_s)


def nodes_of(clips: list[Moved]) -> BeatNodes:
    """Line up the beats of all clips."""
    return beat_nodes([c[2] for c in clips], [(len(c[0]) - 1) / 60 for c in clips])


def anew(clips: list[Moved], distance: PoseDistance) -> tuple[Transitions, Shortlist]:
    """Make the graph of all clips."""
    features, nodes = concatenate_beats(features_of(clip) for clip in clips), nodes_of(clips)
    listed = make_shortlist(features, nodes, distance=distance)
    return connect(nodes, nearest_of(listed, nodes)), listed


def update(
    clips: list[Moved], known: list[BeatFeatures], listed: Shortlist, changed: int, distance: PoseDistance
) -> tuple[Transitions, Work]:
    """Bring the graph up to date with one changed clip."""
    features = concatenate_beats([*known[:changed], features_of(clips[changed]), *known[changed + 1 :]])
    nodes = nodes_of(clips)
    old = np.where(nodes.clip_index == changed, -1, np.arange(len(nodes)))
    new, work = update_shortlist(listed, old, features, nodes, distance=distance)
    return connect(nodes, nearest_of(new, nodes)), work


def measure(n_clips: int, device: str | None, repeats: int) -> dict[str, float | str]:
    """Figures of one catalogue."""
    distance = PoseDistance(cl.Context([pick_device(device)]))
    clips = [made_up_clip(seed) for seed in range(n_clips)]
    known = [features_of(clip) for clip in clips]
    _, listed = anew(clips, distance)
    changed = n_clips // 2
    clips[changed] = made_up_clip(n_clips)
    clock = time.process_time
    anew_s, anew_spread = median(repeats, lambda: anew(clips, distance), clock)
    update_s, update_spread = median(repeats, lambda: update(clips, known, listed, changed, distance), clock)
    whole, _ = anew(clips, distance)
    one, work = update(clips, known, listed, changed, distance)
    same = all(
        np.array_equal(getattr(whole.graph, name), getattr(one.graph, name)) for name in ("source", "target", "weight")
    )
    return {
        "device_name": distance.name,
        "clip_count": n_clips,
        "node_count": len(whole.graph.time_s),
        "edge_count": len(whole.graph.source),
        "anew_cpu_s": anew_s,
        "anew_spread_ratio": anew_spread,
        "update_cpu_s": update_s,
        "update_spread_ratio": update_spread,
        "anew_over_update_ratio": anew_s / update_s,
        "computed_rows": work.computed_nodes,
        "rows_searched_again": work.refilled_rows,
        "different_edge_sets": int(not same),
    }


def main() -> None:
    """Parse the command line, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--clips", type=int, default=500)
    parser.add_argument("--device", default=None, help="index or part of a name; default: first GPU, else CPU")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")
    options = parser.parse_args()
    found = measure(options.clips, options.device, options.repeats)
    if options.json:
        print(json.dumps(found))
        return
    for name, value in found.items():
        print(f"{name:28} {value if isinstance(value, str) else format(value, ',.4g')}")


if __name__ == "__main__":
    main()
