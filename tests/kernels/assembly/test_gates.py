"""What seams, feet and knees of a dance are worth: bars on made-up clips that no change may fall below.

Twelve takes of six moves, joined where the motion graph joins them. Made-up moves are far smoother than captured ones:
a seam is measured against hardly any jerk. ``docs/seams.md`` has the figures of real clips, ``benchmarks/dances.py``
makes them.
"""

import numpy as np
import pytest

from kernels.assembly.blend import assemble
from kernels.assembly.feet import lock_feet, planted_feet
from kernels.assembly.foot_quality import foot_measures, knee_measures, slip_measures
from kernels.assembly.quality import warp_measures
from kernels.assembly.seam_quality import seam_measures
from kernels.graph.beat_features import beat_features, concatenate_beats
from kernels.graph.costs import PathCosts
from kernels.graph.nodes import beat_nodes
from kernels.graph.path import find_path, to_choreography
from kernels.graph.transitions import find_transitions
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL
from kernels.synthetic.dancer import take

MOVES = ("step", "twist", "wave", "rock", "bounce", "kick")


@pytest.fixture(scope="module")
def takes():
    """Each move danced small and large, ten beats long."""
    return {f"{m} {size}": take(m, size=size, n_beats=10, first_beat_s=0.5) for m in MOVES for size in (0.8, 1.1)}


@pytest.fixture(scope="module")
def danced(takes):
    """The clips, the choreography the graph finds for 48 beats, the dance with its feet locked, and before."""
    clips = {name: made.clip for name, made in takes.items()}
    features = concatenate_beats(
        beat_features(
            made.clip.rotation_wxyz,
            kinematics.place(made.clip)[0],
            frame_rate_hz=made.clip.frame_rate_hz,
            time_s=made.beat_s,
        )
        for made in takes.values()
    )
    nodes = beat_nodes([made.beat_s for made in takes.values()], [clip.duration_s for clip in clips.values()])
    graph = find_transitions(features, nodes).graph
    beat_s = 0.51 * np.arange(49)
    path = find_path(graph, beat_s, costs=PathCosts(seam=0.0, usage=2.0), starts="any")
    steps = to_choreography(path, graph, beat_s=beat_s, clip_ids=tuple(clips), blend_s=0.4)
    free = assemble(steps, clips, skeleton=CANONICAL, frame_rate_hz=60.0, duration_s=float(beat_s[-1]))
    return clips, steps, lock_feet(free, planted_feet(free, steps, clips)), free


def values(measures):
    return {m.name: m.value for m in measures}


def test_seams_are_hardly_rougher_than_the_clips_and_far_smoother_than_cuts(danced):
    clips, steps, locked, free = danced
    found = values(seam_measures(free, steps, clips, skeleton=CANONICAL))
    assert found["seam_count"] >= 12
    assert found["seam_jerk_ratio"] < 1.5
    assert found["seam_jerk_median_ratio"] < 1.2
    assert found["seam_jerk_ratio"] < 0.05 * found["seam_jerk_plain_cut_ratio"]
    assert values(seam_measures(locked, steps, clips, skeleton=CANONICAL))["seam_jerk_ratio"] < 3.5


def test_feet_planted_through_a_seam_stay_where_they_stand(danced):
    clips, steps, locked, free = danced
    slip = values(slip_measures(locked, steps, clips))
    assert slip["seam_planted_count"] >= 8
    assert slip["seam_foot_slip_worst_cm"] < 0.3
    assert values(slip_measures(free, steps, clips))["seam_foot_slip_worst_cm"] > 1.0


def test_planted_feet_slide_no_more_than_those_of_the_clips(danced):
    clips, steps, locked, free = danced
    feet = values(foot_measures(locked, steps, clips))
    assert feet["planted_s"] > 20
    assert feet["added_foot_slide_cm_per_s"] < 0
    assert feet["penetration_cm"] < 0.1
    assert values(foot_measures(free, steps, clips))["added_foot_slide_cm_per_s"] > 1


def test_knees_change_no_more_abruptly_than_those_of_the_clips(danced):
    clips, steps, locked, _ = danced
    assert values(knee_measures(locked, steps, clips))["knee_pop_ratio"] < 1.1


def test_clips_are_danced_near_their_own_pace(danced):
    _, steps, _, _ = danced
    assert values(warp_measures(steps))["warp_easy_ratio"] == 1
