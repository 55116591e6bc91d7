"""The record of notes."""

import numpy as np
import pytest

from kernels.music.notes import Notes, sorted_notes


def test_rows_are_sorted_by_start_channel_key():
    notes = sorted_notes([(1.0, 0.5, 60, 90, 2, 0), (0.5, 1.5, 64, 90, 10, 0), (1.0, 0.5, 50, 90, 1, 5)])
    assert notes.start_s.tolist() == [0.5, 1.0, 1.0]
    assert notes.channel_number.tolist() == [10, 1, 2]
    assert notes.is_drum.tolist() == [True, False, False]
    assert notes.end_s == 2.0


def test_no_notes():
    notes = sorted_notes([])
    assert len(notes.start_s) == 0
    assert notes.end_s == 0.0


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ((-1.0, 0.5, 60, 90, 1, 0), "start_s"),
        ((0.0, -0.5, 60, 90, 1, 0), "duration_s"),
        ((0.0, np.nan, 60, 90, 1, 0), "duration_s"),
        ((0.0, 0.5, 128, 90, 1, 0), "key_number"),
        ((0.0, 0.5, 60, 0, 1, 0), "velocity"),
        ((0.0, 0.5, 60, 90, 0, 0), "channel_number"),
        ((0.0, 0.5, 60, 90, 1, 128), "program_number"),
    ],
)
def test_values_out_of_range(row, said):
    with pytest.raises(ValueError, match=said):
        sorted_notes([row])


def test_shapes_and_order():
    one = np.ones(2, np.int64)
    with pytest.raises(ValueError, match="sort the notes"):
        Notes(np.array([1.0, 0.0]), np.ones(2), one, one, one, one)
    with pytest.raises(ValueError, match=r"duration_s: want \(2,\)"):
        Notes(np.array([0.0, 1.0]), np.ones(3), one, one, one, one)
