"""Stretches of marked frames."""

import numpy as np

from kernels.runs import runs_of, touches


def test_stretches_are_found_at_both_ends_and_between():
    assert runs_of(np.array([1, 1, 0, 1, 0, 0, 1], bool)).tolist() == [[0, 1], [3, 3], [6, 6]]


def test_nothing_marked_and_everything():
    assert runs_of(np.zeros(4, bool)).shape == (0, 2)
    assert runs_of(np.zeros(0, bool)).shape == (0, 2)
    assert runs_of(np.ones(3, bool)).tolist() == [[0, 2]]


def test_an_interval_touches_the_frames_it_lies_between():
    marked = np.zeros(10, bool)
    marked[4] = True
    start = np.array([0.0, 0.0, 0.31, 0.4, 0.45, 0.5])
    end = np.array([0.3, 0.31, 0.35, 0.4, 0.5, 0.9])
    assert touches(marked, 10.0, start, end).tolist() == [False, True, True, True, True, False]


def test_an_interval_beyond_the_frames_touches_nothing():
    assert touches(np.ones(3, bool), 10.0, np.array([1.0]), np.array([2.0])).tolist() == [False]
    assert touches(np.zeros(0, bool), 10.0, np.array([0.0]), np.array([1.0])).tolist() == [False]
