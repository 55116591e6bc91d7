"""Songs are drawn, with beats and without."""

import base64
import re

import numpy as np

from assets.plots.music import song_beats
from kernels.types import BeatGrid

PNG = b"\x89PNG\r\n\x1a\n"


def png_of(markdown):
    return base64.b64decode(re.search(r"data:image/png;base64,([A-Za-z0-9+/=]+)\)", markdown)[1])


def test_song_with_and_without_beats():
    time_s = np.arange(0, 10, 0.05)
    level = -20 + np.sin(time_s)
    number = np.arange(16)
    grid = BeatGrid(0.5 * number + 0.3, number // 4 + 1, number % 4 + 1, np.ones(16))
    none = BeatGrid(np.zeros(0), np.zeros(0, int), np.zeros(0, int), np.zeros(0))
    pictures = {png_of(song_beats(g, time_s, level)) for g in (grid, none)}
    assert len(pictures) == 2
    assert png_of(song_beats(none, np.zeros(0), np.zeros(0))).startswith(PNG)
