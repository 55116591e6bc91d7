"""What the motion graph remembers from one build to the next: features of the beats, and which pairs are near."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from kernels.graph.beat_features import BeatFeatures, concatenate_beats
from kernels.graph.distance import PairDistance, PoseFeatures
from kernels.graph.nodes import BeatNodes
from kernels.graph.shortlist import Shortlist, Work, make_shortlist, update_shortlist
from kernels.graph.transitions import Nearest
from kernels.types import Float, Int

_CLIP_ARRAYS = ("time_s", "start_s", "end_s", "accent", "peak_jerk", "usual_jerk", "speed")
_PAIR_ARRAYS = ("row", "other", "distance", "weight")


@dataclass(frozen=True, eq=False)
class Beats:
    """The beats of one clip as the graph takes them.

    ``version`` is that of what they were made from; ``start_s`` and ``end_s`` bound what may be shown around each.
    """

    clip_id: str
    version: str
    time_s: Float
    start_s: Float
    end_s: Float
    features: BeatFeatures
    accent: Float
    peak_jerk: Float
    usual_jerk: Float
    speed: Float


class KeptArrays(Protocol):
    """Arrays kept beside the lake: losing them costs time, nothing else."""

    def recall(self) -> Mapping[str, NDArray[Any]] | None:
        """Read what was kept; None when there is nothing, or nothing that can be read."""
        ...

    def keep(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep these instead of what was kept."""
        ...


@dataclass(frozen=True, eq=False)
class Remembered:
    """An earlier build: its clips in order, and its near pairs."""

    clips: Mapping[str, Beats]
    listed: Shortlist

    def old_nodes(self, beats: Sequence[Beats]) -> Int | None:
        """Which earlier node each node is, -1 for new ones; None where clips have changed places."""
        first, n = {}, 0
        for clip, earlier in self.clips.items():
            first[clip] = n
            n += len(earlier.time_s)
        found = []
        for b in beats:
            at = np.arange(len(b.time_s))
            earlier_clip = self.clips.get(b.clip_id)
            is_same = earlier_clip is not None and earlier_clip.version == b.version
            found.append(first[b.clip_id] + at if is_same else np.full(len(at), -1))
        old = np.concatenate([*found, np.zeros(0, np.int64)]).astype(np.int64)
        return old if (np.diff(old[old >= 0]) > 0).all() else None


def recall(memory: KeptArrays, rules: str) -> Remembered | None:
    """Read an earlier build made by the same rules; None when there is none."""
    kept = memory.recall()
    if kept is None or "rules" not in kept or str(kept["rules"]) != rules:
        return None
    end = np.cumsum(kept["beat_count"])
    metric: Any = str(kept["metric"])
    clips = {}
    for i, (clip, version) in enumerate(zip(kept["clip_id"].tolist(), kept["version"].tolist(), strict=True)):
        here = slice(int(end[i] - kept["beat_count"][i]), int(end[i]))
        pose = PoseFeatures(metric, kept["linear"][here], kept["quaternion_wxyz"][here], kept["quaternion_weight"])
        features = BeatFeatures(pose, kept["local_distance"][here], kept["jerk_ratio"][here])
        clips[clip] = Beats(clip, version, features=features, **{name: kept[name][here] for name in _CLIP_ARRAYS})
    row, other, apart, weight = (kept[name] for name in _PAIR_ARRAYS)
    pairs = Nearest(row, other, apart, weight, metric, float(kept["min_margin_s"]), kept["is_smooth"])
    return Remembered(clips, Shortlist(pairs, kept["radius"], kept["allowed_radius"]))


def keep(memory: KeptArrays, rules: str, beats: Sequence[Beats], features: BeatFeatures, listed: Shortlist) -> None:
    """Keep a build for the next."""
    pose, pairs = features.pose, listed.pairs
    memory.keep(
        {
            "rules": np.array(rules),
            "metric": np.array(pose.metric),
            "clip_id": np.array([b.clip_id for b in beats], np.str_),
            "version": np.array([b.version for b in beats], np.str_),
            "beat_count": np.array([len(b.time_s) for b in beats], np.int64),
            "linear": pose.linear,
            "quaternion_wxyz": pose.quaternion_wxyz,
            "quaternion_weight": pose.quaternion_weight,
            "local_distance": features.local_distance,
            "jerk_ratio": np.zeros(len(pose)) if features.jerk_ratio is None else features.jerk_ratio,
            "min_margin_s": np.array(pairs.min_margin_s),
            "is_smooth": pairs.is_smooth,
            "radius": listed.radius,
            "allowed_radius": listed.allowed_radius,
            **{name: np.concatenate([*(getattr(b, name) for b in beats), np.zeros(0)]) for name in _CLIP_ARRAYS},
            **{name: getattr(pairs, name) for name in _PAIR_ARRAYS},
        }
    )


def nodes_of(beats: Sequence[Beats]) -> BeatNodes:
    """Line up the beats of all clips as nodes.

    Parameters
    ----------
    beats : of all clips, in order

    Returns
    -------
    BeatNodes, clips numbered in that order
    """
    joined = (np.concatenate([*(getattr(b, n) for b in beats), np.zeros(0)]) for n in ("time_s", "start_s", "end_s"))
    return BeatNodes(np.repeat(np.arange(len(beats)), [len(b.time_s) for b in beats]), *joined)


def near_pairs(
    earlier: Remembered | None,
    beats: Sequence[Beats],
    nodes: BeatNodes,
    nothing: BeatFeatures,
    *,
    distance: PairDistance,
    n_nearest: int,
    min_margin_s: float,
) -> tuple[BeatFeatures, Shortlist, Work]:
    """Find the near pairs of all beats: of new ones alone where an earlier build is remembered.

    Parameters
    ----------
    earlier : what is remembered
    beats : of all clips, in order
    nodes : of these beats
    nothing : features of no beat
    distance, n_nearest, min_margin_s : as :func:`kernels.graph.transitions.nearest` has them

    Returns
    -------
    features of all beats, their shortlist, what it took
    """
    features = concatenate_beats([b.features for b in beats] or [nothing])
    asked: dict[str, Any] = {"distance": distance, "n_nearest": n_nearest, "min_margin_s": min_margin_s}
    old = earlier.old_nodes(beats) if earlier is not None else None
    if earlier is not None and old is not None:
        return features, *update_shortlist(earlier.listed, old, features, nodes, **asked)
    return features, make_shortlist(features, nodes, **asked), Work(len(nodes), 0, len(nodes) ** 2)
