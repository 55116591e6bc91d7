"""Beats of songs into tables and back."""

import numpy as np

from assets.tables.music import from_music_beat, to_music_beat
from kernels.types import BeatGrid
from schemas.music import MUSIC_BEAT


def test_music_beats_round_trip():
    grid = BeatGrid(np.array([0.5, 1.0, 1.5]), np.array([1, 1, 2]), np.array([1, 2, 1]), np.array([0.2, 0.5, 1.0]))
    back = to_music_beat(MUSIC_BEAT.check(from_music_beat("x", grid)))
    np.testing.assert_array_equal(back.time_s, grid.time_s)
    np.testing.assert_array_equal(back.beat_in_bar_number, [1, 2, 1])
    np.testing.assert_allclose(back.confidence, grid.confidence, atol=1e-7)
