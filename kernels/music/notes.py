"""Notes of a song as arrays: what MIDI files hold, synthesizers play and drum patterns are made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Int = NDArray[np.int64]

DRUM_CHANNEL_NUMBER = 10
"""Channel of percussion in General MIDI [MMA1991]; its keys name instruments."""


@dataclass(frozen=True, eq=False)
class Notes:
    """Notes sorted by start, then channel, then key.

    Parameters
    ----------
    start_s : (N,) float64, seconds, >= 0, not decreasing
    duration_s : (N,) float64, seconds, >= 0
    key_number : (N,) int64, 0 to 127
        60 is middle C; on channel 10 the key of a percussion instrument.
    velocity : (N,) int64, 1 to 127
    channel_number : (N,) int64, 1 to 16
    program_number : (N,) int64, 0 to 127
        General MIDI instrument, counted from 0 as in the file.

    Raises
    ------
    ValueError
        If shapes differ, starts go back or a value is out of range.
    """

    start_s: Float
    duration_s: Float
    key_number: Int
    velocity: Int
    channel_number: Int
    program_number: Int

    def __post_init__(self) -> None:
        n = len(self.start_s)
        for name, low, high in (
            ("start_s", 0, np.inf),
            ("duration_s", 0, np.inf),
            ("key_number", 0, 127),
            ("velocity", 1, 127),
            ("channel_number", 1, 16),
            ("program_number", 0, 127),
        ):
            value = getattr(self, name)
            if value.shape != (n,):
                raise ValueError(f"{name}: want ({n},), got {value.shape}")
            if not (np.isfinite(value).all() and (value >= low).all() and (value <= high).all()):
                raise ValueError(f"{name}: want finite values from {low} to {high}")
        if not (np.diff(self.start_s) >= 0).all():
            raise ValueError("start_s: want starts that never go back; sort the notes")

    @property
    def end_s(self) -> float:
        """When the last note ends, seconds; 0 without notes."""
        return float((self.start_s + self.duration_s).max()) if len(self.start_s) else 0.0

    @property
    def is_drum(self) -> NDArray[np.bool_]:
        """Which notes are percussion, (N,)."""
        return np.asarray(self.channel_number == DRUM_CHANNEL_NUMBER)


def sorted_notes(rows: list[tuple[float, float, int, int, int, int]]) -> Notes:
    """Sort rows into a record.

    Parameters
    ----------
    rows : (start_s, duration_s, key_number, velocity, channel_number, program_number) each, any order, may be empty

    Returns
    -------
    :class:`Notes`

    Raises
    ------
    ValueError
        If a value is out of range.
    """
    ordered = sorted(rows, key=lambda row: (row[0], row[4], row[2]))
    return Notes(
        start_s=np.array([row[0] for row in ordered], np.float64),
        duration_s=np.array([row[1] for row in ordered], np.float64),
        key_number=np.array([row[2] for row in ordered], np.int64),
        velocity=np.array([row[3] for row in ordered], np.int64),
        channel_number=np.array([row[4] for row in ordered], np.int64),
        program_number=np.array([row[5] for row in ordered], np.int64),
    )
