import dataclasses

import numpy as np
import pytest

from kernels.types import BeatGrid, Choreography, Clip, MotionGraph, Skeleton

TWO = Skeleton(("hips", "head"), np.array([-1, 0]), np.array([[0.0, 1, 0], [0, 0.6, 0]]))


def clip(**changes):
    still = {"root_xyz_m": np.zeros((3, 3)), "rotation_wxyz": np.tile([1.0, 0, 0, 0], (3, 2, 1))}
    return Clip(**{"skeleton": TWO, "frame_rate_hz": 30.0, **still, **changes})


def test_skeleton_finds_its_joints():
    assert TWO.index("head") == 1
    with pytest.raises(ValueError, match="want one of hips, head, got 'tail'"):
        TWO.index("tail")


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"joints": ()}, "at least one"),
        ({"joints": ("a", "a")}, "no name twice"),
        ({"parent": np.array([0, 0])}, "-1 first"),
        ({"parent": np.array([-1])}, "want \\(2,\\)"),
        ({"parent": np.array([-1, 1])}, "sort the joints"),
        ({"parent": np.array([-1, -1])}, "sort the joints"),
        ({"offset_xyz_m": np.zeros((2, 2))}, "offset_xyz_m"),
        ({"offset_xyz_m": np.full((2, 3), np.nan)}, "offset_xyz_m"),
    ],
)
def test_skeletons_that_are_none(changes, what):
    with pytest.raises(ValueError, match=what):
        dataclasses.replace(TWO, **changes)


def test_clip_lengths():
    assert (clip().n_frames, clip().duration_s) == (3, 2 / 30)
    one = clip(root_xyz_m=np.zeros((1, 3)), rotation_wxyz=np.ones((1, 2, 4)) / 2)
    assert (one.n_frames, one.duration_s) == (1, 0)
    none = clip(root_xyz_m=np.zeros((0, 3)), rotation_wxyz=np.zeros((0, 2, 4)))
    assert (none.n_frames, none.duration_s) == (0, 0)


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"frame_rate_hz": 0.0}, "frame_rate_hz"),
        ({"frame_rate_hz": np.nan}, "frame_rate_hz"),
        ({"root_xyz_m": np.zeros((3, 2))}, "root_xyz_m"),
        ({"rotation_wxyz": np.zeros((3, 3, 4))}, "rotation_wxyz"),
        ({"rotation_wxyz": np.full((3, 2, 4), np.nan)}, "rotation_wxyz: not finite"),
        ({"translation_xyz_m": np.zeros((3, 1, 3))}, "translation_xyz_m"),
    ],
)
def test_clips_that_are_none(changes, what):
    with pytest.raises(ValueError, match=what):
        clip(**changes)


def test_records_are_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        clip().frame_rate_hz = 60.0


def beats(**changes):
    whole = {"bar_number": np.ones(3, int), "beat_in_bar_number": np.arange(3), "confidence": np.full(3, 0.5)}
    return BeatGrid(**{"time_s": np.array([0.0, 0.5, 1.0]), **whole, **changes})


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"time_s": np.array([0.0, 1.0, 0.5])}, "strictly increasing"),
        ({"time_s": np.array([0.0, 0.5, 0.5])}, "strictly increasing"),
        ({"time_s": np.array([0.0, 0.5, np.inf])}, "finite"),
        ({"bar_number": np.ones(2, int)}, "bar_number"),
        ({"confidence": np.full(3, 1.5)}, "0 to 1"),
        ({"confidence": np.array([0.5, -0.1, 0.5])}, "0 to 1"),
        ({"time_s": np.array([0.0, np.nan, 1.0])}, "finite"),
    ],
)
def test_beat_grids_that_are_none(changes, what):
    assert len(beats().time_s) == 3
    with pytest.raises(ValueError, match=what):
        beats(**changes)


def graph(**changes):
    nodes = {"clip_index": np.zeros(3, int), "time_s": np.arange(3.0), "next_node": np.array([1, 2, -1])}
    edges = {"source": np.array([0, 2]), "target": np.array([2, 0]), "weight": np.full(2, 0.25)}
    return MotionGraph(**{**nodes, **edges, **changes})


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"time_s": np.arange(2.0)}, "time_s"),
        ({"next_node": np.array([1, 3, -1])}, "next_node: want -1 <= node < 3"),
        ({"target": np.array([2, -1])}, "target: want 0 <= node < 3"),
        ({"weight": np.array([0.1, -0.1])}, "weight"),
        ({"weight": np.array([0.1, np.inf])}, "weight"),
        ({"next_node": np.array([1, 2, -2])}, "next_node: want -1 <= node < 3"),
        ({"source": np.array([0, 3])}, "source: want 0 <= node < 3"),
        ({"accent": np.array([0.0, 1.0, 1.5])}, "accent: want \\(3,\\) from 0 to 1"),
        ({"accent": np.array([0.0, 1.0, -0.5])}, "accent: want \\(3,\\) from 0 to 1"),
        ({"accent": np.zeros(2)}, "accent: want \\(3,\\)"),
        ({"peak_jerk": np.array([0.0, 1.0, -1.0])}, "peak_jerk: want \\(3,\\) finite, >= 0"),
        ({"usual_jerk": np.array([0.0, 1.0, np.inf])}, "usual_jerk"),
        ({"speed": np.zeros(4)}, "speed"),
    ],
)
def test_graphs_that_are_none(changes, what):
    assert len(graph().source) == 2
    with pytest.raises(ValueError, match=what):
        graph(**changes)


def test_graphs_may_end_at_their_bounds():
    none = graph(source=np.zeros(0, int), target=np.zeros(0, int), weight=np.zeros(0))
    assert len(none.source) == 0
    bounds = graph(accent=np.array([0.0, 1.0, 0.5]), speed=np.zeros(3), peak_jerk=np.zeros(3), weight=np.zeros(2))
    assert (bounds.accent == [0, 1, 0.5]).all()


def steps(**changes):
    song = {"song_start_s": np.array([0.0, 1.0]), "song_end_s": np.array([1.0, 3.0])}
    moves = {"clip_start_s": np.array([2.0, 5.0]), "clip_end_s": np.array([3.0, 6.0])}
    seams = {"has_seam": np.array([True, True]), "blend_s": np.zeros(2)}
    return Choreography(**{"clip_id": ("a", "b"), **song, **moves, **seams, **changes})


def test_warp_is_song_over_clip():
    np.testing.assert_allclose(steps().warp_ratio, [1.0, 2.0])


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"blend_s": np.zeros(1)}, "blend_s"),
        ({"clip_end_s": np.array([3.0, 5.0])}, "end > start"),
        ({"song_start_s": np.array([0.0, 1.5])}, "where the one before ended"),
        ({"song_end_s": np.array([1.0, 1.0])}, "end > start"),
        ({"clip_end_s": np.array([1.0, 6.0])}, "end > start"),
    ],
)
def test_choreographies_that_are_none(changes, what):
    with pytest.raises(ValueError, match=what):
        steps(**changes)


def test_a_dance_of_no_steps_is_one():
    nothing = {name: np.zeros(0) for name in ("song_start_s", "song_end_s", "clip_start_s", "clip_end_s", "blend_s")}
    assert len(Choreography((), **nothing, has_seam=np.zeros(0, bool)).warp_ratio) == 0
