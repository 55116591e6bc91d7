"""Stretches of marked frames."""

import numpy as np

from kernels.runs import runs_of


def test_stretches_are_found_at_both_ends_and_between():
    assert runs_of(np.array([1, 1, 0, 1, 0, 0, 1], bool)).tolist() == [[0, 1], [3, 3], [6, 6]]


def test_nothing_marked_and_everything():
    assert runs_of(np.zeros(4, bool)).shape == (0, 2)
    assert runs_of(np.zeros(0, bool)).shape == (0, 2)
    assert runs_of(np.ones(3, bool)).tolist() == [[0, 2]]
