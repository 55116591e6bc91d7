import numpy as np
import pytest

from kernels.graph.nodes import BeatNodes, beat_nodes, is_same_row, stretch_around


@pytest.fixture
def nodes():
    """Clip 0 has beats at 0.05, 0.55, 1.05, clip 1 none, clip 2 one, clip 3 two that end with the clip."""
    beats = [np.array([0.05, 0.55, 1.05]), np.zeros(0), np.array([0.4]), np.array([0.3, 1.0])]
    return beat_nodes(beats, [1.2, 1.0, 1.0, 1.0])


def test_beats_in_a_row(nodes):
    np.testing.assert_array_equal(nodes.clip_index, [0, 0, 0, 2, 3, 3])
    np.testing.assert_array_equal(nodes.next_node, [1, 2, -1, -1, 5, -1])
    np.testing.assert_array_equal(nodes.previous_node, [-1, 0, 1, -1, -1, 4])


def test_a_blend_needs_frames_on_both_sides(nodes):
    np.testing.assert_array_equal(nodes.may_leave(), [False, True, True, False, False, True])
    np.testing.assert_array_equal(nodes.may_leave(0.1), [False, True, True, False, False, False])
    np.testing.assert_array_equal(nodes.may_leave(0.2), [False, True, False, False, False, False])
    np.testing.assert_array_equal(nodes.may_enter(), [True, True, False, False, True, False])
    np.testing.assert_array_equal(nodes.may_enter(0.1), [False, True, False, False, True, False])


@pytest.mark.parametrize("guard_s", [0.0, 0.3, 0.5, 0.50001, 5.0])
def test_same_moment_is_nearer_than_the_guard(nodes, guard_s):
    first, last = nodes.same_moment(guard_s)
    for i in range(len(nodes)):
        same = [
            j
            for j in range(len(nodes))
            if i == j
            or (nodes.clip_index[i] == nodes.clip_index[j] and abs(nodes.time_s[i] - nodes.time_s[j]) < guard_s - 1e-12)
        ]
        assert list(range(first[i], last[i])) == same


def test_no_clips_and_no_beats():
    for nodes in (beat_nodes([], []), beat_nodes([np.zeros(0)], [1.0])):
        assert len(nodes) == len(nodes.next_node) == len(nodes.previous_node) == len(nodes.may_leave()) == 0
        assert [len(part) for part in nodes.same_moment(0.5)] == [0, 0]


def test_errors():
    with pytest.raises(ValueError, match="one a clip, 1, got 2"):
        beat_nodes([np.zeros(1)], [1.0, 2.0])
    with pytest.raises(ValueError, match="sorted by clip"):
        beat_nodes([np.array([0.5, 0.5])], [1.0])
    with pytest.raises(ValueError, match="sorted by clip"):
        BeatNodes(np.array([1, 0]), np.zeros(2), np.zeros(2), np.ones(2))
    with pytest.raises(ValueError, match="within the clip's stretch"):
        beat_nodes([np.array([1.5])], [1.0])
    with pytest.raises(ValueError, match="time_s: want"):
        BeatNodes(np.zeros(2, int), np.zeros(1), np.zeros(2), np.ones(2))


def test_a_beat_may_lie_a_last_bit_past_its_clip_and_no_further():
    assert len(beat_nodes([np.array([1.0 + 5e-7])], [1.0])) == 1
    with pytest.raises(ValueError, match="within the clip's stretch"):
        beat_nodes([np.array([1.00001])], [1.0])
    with pytest.raises(ValueError, match="within the clip's stretch"):
        beat_nodes([np.array([-0.1])], [1.0])
    with pytest.raises(ValueError, match="sorted by clip"):
        BeatNodes(np.array([-1]), np.zeros(1), np.zeros(1), np.ones(1))


def test_clips_may_begin_at_the_same_time_and_be_left_out(nodes):
    other = BeatNodes(np.array([0, 3]), np.array([0.5, 0.5]), np.zeros(2), np.ones(2))
    assert other.next_node.tolist() == [-1, -1]
    assert [part.tolist() for part in other.same_moment(9.0)] == [[0, 1], [1, 2]]


def test_a_margin_is_kept_to_the_bit():
    nodes = beat_nodes([np.array([0.25, 0.5, 0.75])], [1.0])
    assert nodes.may_leave(0.25).tolist() == [False, True, True]
    assert nodes.may_enter(0.25).tolist() == [True, True, False]
    assert nodes.may_leave(0.2501).tolist() == [False, True, False]
    assert nodes.may_enter(0.2501).tolist() == [False, True, False]


@pytest.fixture
def fenced():
    """One clip of 4 s at 10 Hz, a beat every half second, frames 12 to 14 never shown."""
    time_s, is_fenced = np.array([0.5, 1.0, 2.0, 2.5, 3.0]), np.zeros(41, bool)
    is_fenced[12:15] = True
    return BeatNodes(np.zeros(5, np.int64), time_s, *stretch_around(time_s, is_fenced, 10.0))


def test_no_beat_goes_on_across_frames_that_are_never_shown(fenced):
    assert fenced.start_s.tolist() == [0.0, 0.0, 1.5, 1.5, 1.5]
    np.testing.assert_allclose(fenced.end_s, [1.1, 1.1, 4.0, 4.0, 4.0])
    assert fenced.next_node.tolist() == [1, -1, 3, 4, -1]
    assert fenced.previous_node.tolist() == [-1, 0, -1, 2, 3]


def test_no_blend_reaches_into_frames_that_are_never_shown(fenced):
    assert fenced.may_leave(0.2).tolist() == [False, False, False, True, True]
    assert fenced.may_leave(0.09).tolist() == [False, True, False, True, True]
    assert fenced.may_enter(0.6).tolist() == [False, False, False, True, False]


def test_a_stretch_of_a_beat_between_two_frames_holds_it():
    is_fenced = np.array([0, 0, 0, 1, 0], bool)
    start_s, end_s = stretch_around(np.array([0.23, 0.38]), is_fenced, 10.0)
    np.testing.assert_allclose(start_s, [0.0, 0.38])
    np.testing.assert_allclose(end_s, [0.23, 0.4])
    assert [len(part) for part in stretch_around(np.zeros(0), is_fenced, 10.0)] == [0, 0]


def test_two_rows_are_one_where_most_of_both_lie_on_the_other():
    row = np.arange(0.2, 5, 0.5)
    assert is_same_row(row, row + 0.06)
    assert is_same_row(row, row[1:] - 0.06)
    assert not is_same_row(row, row + 0.1)
    assert not is_same_row(row, np.arange(0.2, 5, 0.25))  # twice as many
    assert not is_same_row(row, np.zeros(0))
