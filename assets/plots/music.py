"""What a song looks like: loudness, beats and tempo over time."""

from __future__ import annotations

import numpy as np

from assets.plots.draw import COOL, INK, WARM, figure_of, picture, plain, png
from kernels.types import BeatGrid, Float


def song_beats(grid: BeatGrid, time_s: Float, loudness_db: Float) -> str:
    """Show a song: loudness, beats and downbeats, and the tempo over time.

    Parameters
    ----------
    grid : BeatGrid
    time_s : (F,) float, seconds
    loudness_db : (F,) float, dB(A)

    Returns
    -------
    str
        Markdown; empty axes where there is neither sound nor beat.
    """
    figure = figure_of(11, 4)
    level, tempo = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    level.plot(time_s, loudness_db, color=INK, linewidth=0.8)
    level.set_ylabel("level, dB(A)", fontsize=8)
    low, high = (float(np.percentile(loudness_db, q)) for q in (5, 100)) if len(time_s) else (-60.0, 0.0)
    level.set_ylim(low - 6, high + 3)
    is_downbeat = grid.beat_in_bar_number == 1
    level.vlines(grid.time_s, low - 6, low - 1, color=COOL, linewidth=0.7)
    level.vlines(grid.time_s[is_downbeat], low - 6, low + 4, color=WARM, linewidth=1.1)
    if len(grid.time_s) > 1:
        tempo.plot(grid.time_s[1:], 60 / np.diff(grid.time_s), color=COOL, linewidth=1)
    tempo.set_ylabel("beats a minute", fontsize=8)
    tempo.set_xlabel("seconds; beats blue, downbeats red", fontsize=8)
    for axes in (level, tempo):
        plain(axes)
    return picture(png(figure), "beats of the song")
