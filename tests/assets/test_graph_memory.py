"""What the motion graph remembers: what is kept comes back, other rules do not, places are found again."""

import numpy as np
import pytest

from assets.graph_memory import Beats, keep, near_pairs, nodes_of, recall
from kernels.graph.beat_features import beat_features
from kernels.skeleton.kinematics import place
from kernels.synthetic.dancer import take


class Shelf:
    """Memory in memory."""

    def __init__(self):
        self.kept = None

    def recall(self):
        return self.kept

    def keep(self, arrays):
        self.kept = dict(arrays)


def beats(name, version="1"):
    made = take(name.split("_")[0], n_beats=8)
    position, _ = place(made.clip)
    time_s = np.arange(1, 8) * 0.5
    features = beat_features(made.clip.rotation_wxyz, position, frame_rate_hz=made.clip.frame_rate_hz, time_s=time_s)
    ones = np.ones(len(time_s))
    whole = np.zeros(len(time_s)), np.full(len(time_s), made.clip.duration_s)
    return Beats(name, version, time_s, *whole, features, 0.5 * ones, 2 * ones, ones, ones)


def listed(clips, earlier=None):
    nodes = nodes_of(clips)
    asked = {"n_nearest": 5, "min_margin_s": 0.2}
    from kernels.graph.distance import pose_distance

    return near_pairs(earlier, clips, nodes, clips[0].features, distance=pose_distance, **asked)


@pytest.fixture
def shelf():
    """A build of four clips, kept by the rules "a"."""
    clips = [beats(name) for name in ("step", "step_b", "twist", "wave")]
    features, pairs, _ = listed(clips)
    shelf = Shelf()
    keep(shelf, "a", clips, features, pairs)
    return shelf


def test_what_is_kept_comes_back(shelf):
    found = recall(shelf, "a")
    assert list(found.clips) == ["step", "step_b", "twist", "wave"]
    fresh = beats("twist")
    np.testing.assert_array_equal(found.clips["twist"].features.pose.linear, fresh.features.pose.linear)
    np.testing.assert_array_equal(found.clips["twist"].peak_jerk, fresh.peak_jerk)
    assert found.clips["twist"].end_s.tolist() == fresh.end_s.tolist()


def test_other_rules_and_nothing_are_no_memory(shelf):
    assert recall(shelf, "b") is None
    assert recall(Shelf(), "a") is None


def test_a_changed_clip_alone_is_new(shelf):
    found = recall(shelf, "a")
    now = [found.clips["step"], found.clips["step_b"], beats("twist", "2"), found.clips["wave"]]
    np.testing.assert_array_equal(found.old_nodes(now), [*range(14), *[-1] * 7, *range(21, 28)])
    _, _, work = listed(now, found)
    assert (work.computed_nodes, work.refilled_rows) == (7, 0)


def test_clips_that_changed_places_are_a_new_catalogue(shelf):
    found = recall(shelf, "a")
    now = [found.clips[name] for name in ("twist", "step", "wave")]
    assert found.old_nodes(now) is None
    _, _, work = listed(now, found)
    assert work.computed_nodes == 21


def test_removed_clips_leave_the_others_where_they_were(shelf):
    found = recall(shelf, "a")
    now = [found.clips[name] for name in ("step", "wave")]
    np.testing.assert_array_equal(found.old_nodes(now), [*range(7), *range(21, 28)])
