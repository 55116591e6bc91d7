import numpy as np

from assets.reading.songs import played_song
from kernels.types import BeatGrid


def test_the_grid_covers_the_song_and_knows_its_own_beats():
    time_s = np.arange(1.0, 5.0, 0.5)
    beats = BeatGrid(time_s, *(np.zeros(len(time_s), int) for _ in range(2)), np.ones(len(time_s)))
    song = played_song(beats, 6.0)
    assert song.grid_s[0] <= 0
    assert song.grid_s[-1] >= 6.0
    np.testing.assert_allclose(song.grid_s[song.own], time_s)
    assert song.intensity is None
    assert list(song.repeats) == []
