"""What the model hears of a song while each motion is danced: strokes of drums and steps of the melody."""

from __future__ import annotations

from dataclasses import dataclass

import pyarrow as pa

from assets.tables import hmm as hmm_tables
from kernels.hmm.model import Model
from kernels.music.drums_and_melody import CONTOUR, FIRST_KEY, N_KEYS, banded, heard_in, loudest_in, spread_bands
from kernels.types import Float

SYMBOLS = (N_KEYS, len(CONTOUR))
"""Symbols of the two streams."""

AHEAD_S = 0.06
"""A motion is taken to hear what sounds from so shortly before it starts: drummers and dancers are not exact. Chosen by
hand."""


@dataclass(frozen=True, eq=False)
class HeardIntervals:
    """Strokes and steps in each of K intervals, (K, M) a stream; ``is_banded`` where drums are not told apart."""

    drums: Float
    melody: Float
    is_banded: bool

    def to_learn(self) -> tuple[Float, Float]:
        """Give what a model learns from: of a band all its drums alike."""
        return (spread_bands(self.drums) if self.is_banded else self.drums), self.melody

    def log_likelihood(self, model: Model) -> Float:
        """Log likelihood of each interval in each state, (K, N); of a band all its drums together.

        Parameters
        ----------
        model : Model of N states, with these streams

        Returns
        -------
        (K, N) float64, natural logarithm; 0 where nothing sounds
        """
        drums, melody = model.log_emission
        log_p: Float = model.weight[0] * (self.drums @ (banded(drums) if self.is_banded else drums).T)
        return log_p + model.weight[1] * (self.melody @ melody.T)


def hear(percussion: pa.Table, melody: pa.Table, edge_s: Float, *, symbols: str) -> HeardIntervals:
    """Count what sounds between edges.

    Parameters
    ----------
    percussion, melody : tables of these names, the rows of one song
    edge_s : (K + 1,) float, seconds of the song, rising
    symbols : setting ``choreography_model.symbols``

    Returns
    -------
    HeardIntervals
        In K intervals; zeros where nothing sounds.
    """
    hits, is_banded = hmm_tables.to_percussion(percussion)
    if symbols == "single":
        drums = loudest_in(hits, edge_s, ahead_s=AHEAD_S)
    else:
        drums = heard_in(hits.time_s, hits.key_number - FIRST_KEY, edge_s, N_KEYS, ahead_s=AHEAD_S)
    tune = hmm_tables.to_melody(melody)
    return HeardIntervals(drums, heard_in(tune.time_s, tune.symbol, edge_s, len(CONTOUR), ahead_s=AHEAD_S), is_banded)
