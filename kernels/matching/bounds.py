"""Upper bounds of many scores by matrix products: block sums of clips, and of segments against them.

A score is at most the sum over blocks of h(sum of a, sum of b) (:mod:`kernels.matching.blocks`), and that at most a sum
of four products a block (:mod:`kernels.matching.low_rank`). So the bounds of S segments at N starts are one product of
(S, 4 K) with (4 K, N), and no division is left.

Rounding. Block sums of clips are raised by `TABLE_MARGIN` and then to the next node, so they are above the true ones.
A product of n float32 numbers summed in any order errs by at most n u sum |u v|, u = 2^-24, and |v| <= 1. Scores that
bounds are compared with are the reference's, in float64, each within (L + 8) 2^-53 of the true one. All of this, and e
of every block, is the *slack* of a segment: what is dropped has bound + slack < a score that is reached. What float32
cannot hold of quiet clips is at most 2^-95 of the largest value, and counted too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.matching.blocks import UNIT, block_sums, rows
from kernels.matching.low_rank import RANK, codes, low_rank, window
from kernels.matching.room import Room
from kernels.matching.score import SCALE_DENOMINATOR

_TILE = 4096
"""Positions summed at a time. Chosen so that rows of them stay in the cache; changes no bound."""

_TINY = 2.0**-95
"""Added to what rounding may do. Chosen above what products of denormal numbers lose."""

Series = NDArray[np.floating]


class SumTables:
    """Clips one after another, and the block sums of them that were asked for, as codes of nodes.

    Parameters
    ----------
    clips : sequence of (T,) float, T >= 1, finite, >= 0, at least one value > 0
    numerators : the scales times 50

    Attributes
    ----------
    frames, first : (C,) int64
        Frames of each clip, and the position of its first.
    exponent : int
        Values are divided by 2^exponent, so that the largest is in [1/2, 1].
    """

    def __init__(self, clips: Sequence[Series], *, numerators: tuple[int, ...]) -> None:
        self.numerators = numerators
        self.gap = 25 * numerators[-1] // SCALE_DENOMINATOR + 16  # silence between clips, longer than any block
        self.frames = np.array([len(clip) for clip in clips], np.int64)
        stride = self.frames + self.gap
        self.first = np.cumsum(stride) - stride
        self.n_positions = int(stride.sum())
        self.exponent = int(np.frexp(max(float(clip.max()) for clip in clips))[1])
        self._flat = np.zeros(self.n_positions + _TILE + self.gap, np.float32)
        for clip, at in zip(clips, self.first.tolist(), strict=True):
            self._flat[at : at + len(clip)] = np.ldexp(np.asarray(clip, np.float64), -self.exponent)
        self._tables: dict[tuple[int, int], SumTable] = {}

    def __len__(self) -> int:
        return len(self.frames)

    def table(self, n_frames: int, fold: int) -> SumTable:
        """Give the table of one block length, summed when first asked for.

        Parameters
        ----------
        n_frames : int, 1 to 25, frames of a block
        fold : int, a power of two up to 8: neighbouring starts of which the largest sum is kept
        """
        if (n_frames, fold) not in self._tables:
            self._tables[n_frames, fold] = SumTable(
                self._flat, self.n_positions, n_frames=n_frames, fold=fold, numerators=self.numerators
            )
        return self._tables[n_frames, fold]


class SumTable:
    """Block sums of one length at every position of clips laid one after another.

    Parameters
    ----------
    flat : float32, 0 to 1, with silence behind the last position
    n_positions : int, N
    n_frames : int, frames of a block
    fold : int, neighbouring positions of which the largest sum is kept
    numerators : the scales times 50

    Attributes
    ----------
    rows : Rows
    exponent : int
        Sums are divided by 2^exponent, so that the largest is at most 1.
    codes : (rows, N) uint16, the node at or above each sum
    """

    def __init__(
        self, flat: NDArray[np.float32], n_positions: int, *, n_frames: int, fold: int, numerators: tuple[int, ...]
    ) -> None:
        self.rows = rows(n_frames, numerators)
        self.codes = np.zeros((len(self.rows), n_positions), np.uint16)
        # what sums of neighbouring frames need does for most scales; if not, the sums themselves say
        total = np.cumsum(flat, dtype=np.float64)
        self.exponent = int(np.frexp((total[n_frames:] - total[:-n_frames]).max())[1])
        while (largest := self._fill(flat, fold)) > 1:
            self.exponent += int(np.frexp(largest)[1])

    def _fill(self, flat: NDArray[np.float32], fold: int) -> float:
        """Sum all blocks and find their nodes, as far as they are at most 1; the largest sum."""
        taps = self.rows.taps() * np.float32(2.0**-self.exponent)
        n_positions = self.codes.shape[1]
        window = np.zeros((taps.shape[1], _TILE + fold - 1), np.float32)
        sums = np.zeros((len(taps), window.shape[1]), np.float32)
        largest = 0.0
        for at in range(0, n_positions, _TILE):
            for tap, line in enumerate(window):
                line[:] = flat[at + tap : at + tap + len(line)]
            np.matmul(taps, window, out=sums)
            largest = max(largest, float(sums.max()))
            step = 1
            while step < fold:
                np.maximum(sums[:, :-step], sums[:, step:], out=sums[:, :-step])
                step *= 2
            n = min(_TILE, n_positions - at)
            self.codes[:, at : at + n] = codes(sums)[:, :n]
        return largest


@dataclass(frozen=True, eq=False)
class Span:
    """Candidates, or groups of neighbours, that begin in one stretch of the clips.

    Parameters
    ----------
    first, stop : int, the positions that their blocks lie in
    scale : (N,) int64, index of the scale of each
    position : (N,) int64, the first frame of each, counted from `first`
    """

    first: int
    stop: int
    scale: NDArray[np.int64]
    position: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.scale)

    def only(self, columns: NDArray[np.integer]) -> Span:
        """Keep some of the candidates.

        Parameters
        ----------
        columns : (M,) int, their indices
        """
        return Span(self.first, self.stop, self.scale[columns], self.position[columns])


class Bounds:
    """Bounds of some segments by one block length.

    Parameters
    ----------
    tables : SumTables
    segments : (S, L) float64, filled up with zeros, each with a value > 0
    n_frames : (S,) int64, frames of each segment
    block : int, frames of a block
    fold : int, neighbouring starts bounded together
    room : Room

    Attributes
    ----------
    fold : int
    n_blocks : int, K
    slack : (S,) float64
        What a bound may be too small by; see the module.
    """

    def __init__(
        self,
        tables: SumTables,
        segments: NDArray[np.float64],
        *,
        n_frames: NDArray[np.int64],
        block: int,
        fold: int,
        room: Room,
    ) -> None:
        self.fold, self._room = fold, room
        table = tables.table(block, fold)
        self._exponent = tables.exponent + table.exponent
        self._codes = table.codes
        sums = np.ldexp(block_sums(segments, block), -self._exponent)
        bound = low_rank(window(float(sums.max())))
        factor, excess = bound.music(sums)
        self.n_blocks = sums.shape[1]
        self._motion = bound.motion
        self._factor = factor.reshape(len(sums), -1).astype(np.float32)
        n = self._factor.shape[1]
        rounding = 1.01 * (n + 4) * UNIT * np.abs(self._factor.astype(np.float64)).sum(1)
        largest = np.minimum(sums.sum(1), n_frames)  # C is at most the sum of a, and of b
        self.slack = excess.sum(1) + rounding + (n_frames + 16) * 2.0**-50 * largest + _TINY
        steps = table.rows.steps(self.n_blocks).astype(np.int64)
        self._row, self._shift = steps[..., 0], steps[..., 1]

    def values(self, span: Span, segments: NDArray[np.integer] | slice) -> NDArray[np.float32]:
        """Bound candidates, in a unit of their own and without the slack.

        Parameters
        ----------
        span : Span of N candidates
            Where a segment does not fit, what comes back is of no meaning.
        segments : (M,) int, or a slice

        Returns
        -------
        (M, N) float32, in the room: until the next call
        """
        n, width = len(span), span.stop - span.first
        known = self._room.array("known", (len(self._codes), width, RANK), np.float32)
        np.take(self._motion, self._codes[:, span.first : span.stop], axis=0, out=known, mode="clip")
        index = self._room.array("index", (n, self.n_blocks), np.int64)
        np.take(self._row * width + self._shift, span.scale, axis=0, out=index, mode="clip")
        index += span.position[:, None]
        laid = self._room.array("laid", (n, self.n_blocks, RANK), np.float32)
        np.take(known.reshape(-1, RANK), index, axis=0, out=laid, mode="clip")
        factor = self._factor[segments]
        values = self._room.array("values", (len(factor), n), np.float32)
        np.matmul(factor, laid.reshape(n, -1).T, out=values)
        return values

    def least(self, scores: NDArray[np.float64], segments: NDArray[np.integer]) -> NDArray[np.float32]:
        """Give the value below which no candidate reaches a score.

        Parameters
        ----------
        scores : (M,) float64; -1 where every candidate will do
        segments : (M,) int

        Returns
        -------
        (M,) float32
        """
        wanted = (np.ldexp(scores, -self._exponent) - self.slack[segments]).astype(np.float32)
        return np.where(scores < 0, np.finfo(np.float32).min, np.nextafter(wanted, np.float32(-np.inf)))

    def scores(self, values: NDArray[np.float32], segments: NDArray[np.integer]) -> NDArray[np.float64]:
        """Give scores that candidates do not exceed.

        Parameters
        ----------
        values : (M,) float32, -inf where there is no candidate
        segments : (M,) int

        Returns
        -------
        (M,) float64
        """
        above: NDArray[np.float64] = np.ldexp(values + self.slack[segments], self._exponent)
        return above
