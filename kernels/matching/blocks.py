"""Sums over blocks of frames: the upper bounds of a score, and the tables and lists that make them cheap.

h(a, b) = a b / (a + b) is concave and homogeneous of degree 1, so sum of h(a_i, b_i) <= h(sum a_i, sum b_i) over any
set of frames; and it rises with b, so the largest block sum of 8 neighbouring starts bounds all 8.

Conventions: scales are p / 50. Block k of g frames begins at music frame g k, that is at clip position
f0 + floor(p g k / 50) + phase / 50 with phase = p g k mod 50. So the sums of one clip over all starts are a few rows,
one a pair (p, phase): the sum of block k is row (p, phase) at f0 + floor(p g k / 50).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.matching.score import SCALE_DENOMINATOR

GROUP = 8
"""Starts bounded together at most. Chosen as the width of a vector of float32."""

UNIT = 2.0**-24
"""The relative error of one rounded float32 operation, by definition."""

TABLE_MARGIN = 1 + 116 * UNIT
"""By proof more than the error of summing 50 frames in float32: tables are true upper bounds (docs/matching.md)."""

_PARENTS = {10: 5, 25: 5, 50: 25}
"""Blocks by whose sums longer ones are made, frames. Chosen as divisors."""


def parent(n_frames: int) -> int:
    """Which blocks larger blocks are summed from; 0 for blocks summed from frames.

    Parameters
    ----------
    n_frames : int, >= 1, frames of a block

    Returns
    -------
    int, >= 0
    """
    return _PARENTS.get(n_frames, 0)


@dataclass(frozen=True)
class Rows:
    """The rows of one block length for some scales.

    Parameters
    ----------
    n_frames : int, g >= 1
    numerators : the scales times 50
    keys : (p, phase) of each row, rising; p is 0 for g = 1, where the row does not depend on it
    """

    n_frames: int
    numerators: tuple[int, ...]
    keys: tuple[tuple[int, int], ...]

    def __len__(self) -> int:
        return len(self.keys)

    def steps(self, n_blocks: int) -> NDArray[np.int32]:
        """Where the blocks of each scale are.

        Parameters
        ----------
        n_blocks : int, >= 0, blocks of a segment

        Returns
        -------
        (scales, n_blocks, 2) int32
            The row, and the frames from the start to the block.
        """
        place = {key: index for index, key in enumerate(self.keys)}
        steps = np.zeros((len(self.numerators), n_blocks, 2), np.int32)
        for s, p in enumerate(self.numerators):
            whole, phase = np.divmod(p * self.n_frames * np.arange(n_blocks), SCALE_DENOMINATOR)
            row_of = np.zeros(SCALE_DENOMINATOR, np.int32)
            for rest in range(SCALE_DENOMINATOR):
                row_of[rest] = place.get((p if self.n_frames > 1 else 0, rest), 0)
            steps[s, :, 0] = row_of[phase]
            steps[s, :, 1] = whole
        return steps

    def taps(self) -> NDArray[np.float32]:
        """Weights of the frames from a row's position on: row[n] = sum over t of weight[t] m[n + t].

        Returns
        -------
        (rows, most) float32, >= 0
            For g > 1 larger than the truth by `TABLE_MARGIN`.
        """
        weights = []
        for p, phase in self.keys:
            whole, rest = np.divmod(phase + p * np.arange(self.n_frames), SCALE_DENOMINATOR)
            weight = np.zeros(whole[-1] + 2)
            np.add.at(weight, whole, 1 - rest / SCALE_DENOMINATOR)
            np.add.at(weight, whole + 1, rest / SCALE_DENOMINATOR)
            weights.append(weight)
        taps = np.zeros((len(self), max(map(len, weights))))
        for row, weight in enumerate(weights):
            taps[row, : len(weight)] = weight
        return (taps * (TABLE_MARGIN if self.n_frames > 1 else 1)).astype(np.float32)

    def children(self, smaller: Rows) -> NDArray[np.int32]:
        """Which rows of smaller blocks add up to each row.

        Parameters
        ----------
        smaller : Rows of the same scales whose block length divides this one's

        Returns
        -------
        (rows, n, 2) int32
            Row of the smaller blocks, and frames from this row's position to it.
        """
        place = {key: index for index, key in enumerate(smaller.keys)}
        n = self.n_frames // smaller.n_frames
        children = np.zeros((len(self), n, 2), np.int32)
        for row, (p, phase) in enumerate(self.keys):
            for child in range(n):
                whole, rest = divmod(phase + p * smaller.n_frames * child, SCALE_DENOMINATOR)
                children[row, child] = place[p, rest], whole
        return children


def rows(n_frames: int, numerators: Sequence[int]) -> Rows:
    """List the rows of one block length.

    Parameters
    ----------
    n_frames : int, g >= 1
    numerators : the scales times 50

    Returns
    -------
    Rows
        For the 11 usual scales: 11 rows for g = 50, 17 for 25, 43 for 10, 65 for 5, 50 for 1.
    """
    keys = set()
    for p in numerators:
        for k in range(SCALE_DENOMINATOR):
            keys.add((p if n_frames > 1 else 0, p * n_frames * k % SCALE_DENOMINATOR))
    return Rows(n_frames, tuple(numerators), tuple(sorted(keys)))


@dataclass(frozen=True)
class Lists:
    """The blocks of some segments in which there is music, one list a segment after another.

    Parameters
    ----------
    first : (N + 1,) int32
        Where each segment's list begins; all lengths are multiples of 4.
    block : (B,) int32, which block of its segment
    amount : (B, 2) float32
        Sum of a, and its square; (1, 0) where a list is filled up, which adds nothing.
    """

    first: NDArray[np.int32]
    block: NDArray[np.int32]
    amount: NDArray[np.float32]


def block_sums(segments: NDArray[np.float64], n_frames: int) -> NDArray[np.float64]:
    """Sum blocks of segments, (N, L) to (N, ceil(L / g)); the last block may be short.

    Parameters
    ----------
    segments : (N, L) float64, >= 0, filled up with zeros
    n_frames : int, g >= 1

    Returns
    -------
    (N, ceil(L / g)) float64
    """
    n, length = segments.shape
    n_blocks = -(-length // n_frames)
    padded = np.zeros((n, n_blocks * n_frames))
    padded[:, :length] = segments
    sums: NDArray[np.float64] = padded.reshape(n, n_blocks, n_frames).sum(-1)
    return sums


def lists(sums: NDArray[np.float64], *, smallest: NDArray[np.float64]) -> Lists:
    """List the blocks with music.

    Parameters
    ----------
    sums : (N, K) float64, from :func:`block_sums`
    smallest : (N,) float64
        Blocks of less than this are left out.

    Returns
    -------
    Lists
    """
    loud = sums >= np.maximum(smallest, np.finfo(np.float64).tiny)[:, None]
    count = loud.sum(1)
    first = np.zeros(len(sums) + 1, np.int32)
    np.cumsum(-(-count // 4) * 4, out=first[1:])
    block = np.zeros(first[-1], np.int32)
    amount = np.zeros((first[-1], 2), np.float32)
    amount[:, 0] = 1
    segment, k = np.nonzero(loud)
    place = first[segment] + np.arange(len(segment)) - np.repeat(np.cumsum(count) - count, count)
    block[place] = k
    value = sums[segment, k].astype(np.float32)
    amount[place, 0] = value
    amount[place, 1] = value * value
    return Lists(first, block, amount)


def bundles(sums: NDArray[np.float64], *, smallest: NDArray[np.float64], width: int) -> tuple[NDArray[np.float32], int]:
    """Lay the blocks of neighbouring segments side by side, silence included.

    Parameters
    ----------
    sums : (N, K) float64
    smallest : (N,) float64, as for :func:`lists`
    width : int, segments in a bundle

    Returns
    -------
    amount : (ceil(N / width), K4, 2, width) float32
        Sum and its square, (1, 0) where there is nothing.
    n_blocks : int, K4, a multiple of 4
    """
    n, n_blocks = sums.shape
    n_bundles, padded = -(-n // width), -(-n_blocks // 4) * 4
    amount = np.zeros((n_bundles * width, padded, 2), np.float32)
    amount[..., 0] = 1
    loud = sums >= np.maximum(smallest, np.finfo(np.float64).tiny)[:, None]
    value = sums.astype(np.float32)
    amount[:n, :n_blocks, 0] = np.where(loud, value, 1)
    amount[:n, :n_blocks, 1] = np.where(loud, value * value, 0)
    laid = amount.reshape(n_bundles, width, padded, 2).transpose(0, 2, 3, 1)
    return np.ascontiguousarray(laid), padded


def margin(
    music_sum: NDArray[np.float64], n_frames: NDArray[np.integer], dropped: NDArray[np.float64]
) -> NDArray[np.float32]:
    """How far two float32 scores, or a bound and a score, may lie on the wrong sides of each other.

    Parameters
    ----------
    music_sum : (N,) float64, sum of a
    n_frames : (N,) int, frames of each segment
    dropped : (N,) float64, the part of it in frames that were left out

    Returns
    -------
    (N,) float32
        (L / 2 + 64) 2 u (sum of a) and all that was dropped: more than twice the rounding of the kernels, see
        docs/matching.md.
    """
    wide = (n_frames / 2 + 64) * 2 * UNIT * music_sum + 2 * dropped
    return np.nextafter(wide.astype(np.float32), np.float32(np.inf))
