"""The graph and the path on recorded dances."""

import numpy as np
import pytest

from assets.formats import bvh
from kernels import rotation
from kernels.graph.beat_features import beat_features, concatenate_beats
from kernels.graph.distance import paired_distance, pose_distance
from kernels.graph.nodes import beat_nodes
from kernels.graph.path import find_path
from kernels.graph.prune import keep_endless, keep_strongest
from kernels.graph.transitions import find_transitions
from kernels.motion.motion_beats import motion_beats
from kernels.skeleton.retarget import retarget


@pytest.fixture(scope="module")
def salsa(data_dir):
    """Six takes of salsa on the canonical skeleton: rotations, positions, rate, beats."""
    found = []
    for path in sorted((data_dir / "bvh_dance").glob("**/6*_0[1257]_*.bvh"))[:6]:
        take = bvh.to_clip(bvh.read(path))
        motion = retarget(take.clip, take.mapping)
        rate_hz = take.clip.frame_rate_hz
        heading = rotation.heading_rad(motion.rotation_wxyz[:, 0])
        beats = motion_beats(motion.position_xyz_m, rate_hz, heading_rad=heading)
        found.append((motion.rotation_wxyz, motion.position_xyz_m, rate_hz, beats.time_s))
    assert len(found) == 6
    return found


def catalogue(clips, metric):
    parts = [beat_features(q, p, frame_rate_hz=hz, time_s=t, metric=metric) for q, p, hz, t in clips]
    return concatenate_beats(parts), beat_nodes([t for *_, t in clips], [(len(q) - 1) / hz for q, _, hz, _ in clips])


@pytest.mark.parametrize("metric", ["position", "rotation"])
def test_a_recording_at_120_and_at_30_frames_a_second_has_the_same_features(data_dir, metric):
    take = bvh.to_clip(bvh.read(next((data_dir / "bvh_dance").glob("**/60_03_*_120fps.bvh"))))
    motion = retarget(take.clip, take.mapping)
    time_s = np.arange(0.5, take.clip.duration_s - 0.5, 0.37)
    fine, coarse = (
        beat_features(
            motion.rotation_wxyz[::step],
            motion.position_xyz_m[::step],
            frame_rate_hz=take.clip.frame_rate_hz / step,
            time_s=time_s,
            metric=metric,
        )
        for step in (1, 4)
    )
    usual = np.median(np.sqrt(pose_distance(fine.pose, fine.pose)))
    assert np.median(np.sqrt(paired_distance(fine.pose, coarse.pose))) < 0.05 * usual
    ratio = np.sqrt(coarse.local_distance / fine.local_distance)
    assert 0.85 < np.median(ratio) < 1.15


@pytest.mark.parametrize("metric", ["position", "rotation"])
def test_takes_are_joined(salsa, metric):
    found = find_transitions(*catalogue(salsa, metric))
    assert found.threshold_used == found.threshold_asked
    graph = found.graph
    assert len(set(graph.clip_index[graph.source] * 6 + graph.clip_index[graph.target])) > 20
    endless, strongest = keep_endless(graph), keep_strongest(graph)
    assert endless.n_clips_lost == strongest.n_clips_lost == 0
    assert endless.lost_s <= strongest.lost_s < 0.15 * strongest.total_s


def test_a_minute_is_danced_in_tempo(salsa):
    graph = find_transitions(*catalogue(salsa, "position")).graph
    for tempo_bpm in (100, 125):
        path = find_path(graph, np.arange(0, 60, 60 / tempo_bpm))
        inside = (path.warp_ratio >= 0.9) & (path.warp_ratio <= 1.1)
        assert inside.mean() >= 0.95
        assert not path.is_outside.any()
        assert len(set(graph.clip_index[path.source_node])) > 1
