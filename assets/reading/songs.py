"""A song as its dance counts it, read once for whatever dances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from assets.tables import matching as matching_tables
from kernels.assembly.timing import cover
from kernels.music.repeats import Repeat
from kernels.types import BeatGrid, Float


@dataclass(frozen=True, eq=False)
class PlayedSong:
    """The beats of a song as its dance counts them.

    Parameters
    ----------
    grid_s : (K + 1,) float64, seconds, the beats the dance covers, those before and after the song's own included
    beats : BeatGrid, the song's own
    duration_s : float, seconds, > 0
    intensity : (K,) float, how strong each interval of the grid is, or None where it is not known
    repeats : stretches of the grid that play earlier ones again
    """

    grid_s: Float
    beats: BeatGrid
    duration_s: float
    intensity: Float | None = None
    repeats: Sequence[Repeat] = ()

    @property
    def own(self) -> NDArray[np.int64]:
        """Place in the grid of each of the song's own beats."""
        return np.searchsorted(self.grid_s, self.beats.time_s - 1e-9)


def played_song(
    beats: BeatGrid, duration_s: float, *, feature: pa.Table | None = None, repeat: pa.Table | None = None
) -> PlayedSong:
    """Gather what a dance knows of its song.

    Parameters
    ----------
    beats : BeatGrid of at least two
    duration_s : float, seconds, > 0
    feature, repeat : rows of ``music_feature`` and ``music_repeat`` of the song, or None
    """
    grid_s, _ = cover(beats.time_s, duration_s)
    intensity = None
    if feature is not None and feature.num_rows:
        intensity = matching_tables.strength_between(feature, grid_s)
    repeats = matching_tables.to_music_repeat(repeat, grid_s) if repeat is not None else []
    return PlayedSong(grid_s, beats, duration_s, intensity, repeats)
