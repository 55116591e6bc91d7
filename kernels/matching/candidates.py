"""Scores of single candidates of one clip in float64, at first to within rounding, at last in the reference's order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels.matching.room import Room
from kernels.matching.score import SCALE_DENOMINATOR

_TILE = 2**14
"""Numbers summed at a time. Chosen so that they stay in the cache, by hand; changes no score."""

_NOWHERE = 2**40
"""A place beyond any clip, by definition: clips have at most 2^23 frames."""


class Scores:
    """Scores of some segments in one stretch of a clip after another.

    Parameters
    ----------
    segments : (S, L) float64, filled up with zeros, each with a value > 0
    numerators : the scales times 50
    n_frames : int, of the longest stretch
    room : Room

    Notes
    -----
    b at p f / 50 is read from a table of the clip at all fiftieths that occur, computed as the reference computes it.
    Frames of silent music are left out, as the reference leaves them out. So each a b / (a + b) has the reference's
    bits, and only the order of the sum is another in :meth:`about`.
    """

    def __init__(
        self, segments: NDArray[np.float64], *, numerators: tuple[int, ...], n_frames: int, room: Room
    ) -> None:
        self._step = int(np.gcd.reduce([SCALE_DENOMINATOR, *numerators]))
        phases = np.arange(0, SCALE_DENOMINATOR, self._step)
        self._weight = (phases / SCALE_DENOMINATOR)[:, None]
        self._width = n_frames
        self._room = room
        # behind the table is one number that is not 0, for what a list of frames is filled up with: 0 1 / (0 + 1) is 0
        self._table = np.zeros(len(phases) * n_frames + 1)
        self._table[-1] = 1
        self._last = (segments > 0).sum(1) - 1
        longest = int(self._last.max()) + 1
        self._n_scales = len(numerators)
        self._music = np.zeros((len(segments), longest))
        place = np.full((len(segments), self._n_scales, longest), _NOWHERE)
        for index, segment in enumerate(segments):
            frames = np.flatnonzero(segment)
            whole, rest = np.divmod(np.outer(numerators, frames), SCALE_DENOMINATOR)
            self._music[index, : len(frames)] = segment[frames]
            place[index, :, : len(frames)] = rest // self._step * n_frames + whole
        self._place = place.reshape(-1, longest)

    @property
    def n_terms(self) -> int:
        """Terms of a score that are computed, at most."""
        return self._music.shape[1]

    def load(self, clip: NDArray[np.float64]) -> None:
        """Take the next stretch.

        Parameters
        ----------
        clip : (T,) float64, T at most the `n_frames` promised
        """
        after = np.append(clip[1:], 0.0)
        table = self._table[:-1].reshape(-1, self._width)[:, : len(clip)]
        np.multiply(1.0 - self._weight, clip, out=table)
        table += self._weight * after

    def about(
        self, segment: NDArray[np.int64], scale: NDArray[np.int64], start: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Score candidates, summing in any order.

        Parameters
        ----------
        segment, scale, start : (N,) int64
            Each candidate lies in the stretch.

        Returns
        -------
        (N,) float64
            Within 2 n 2^-53 of the reference's scores, n terms each.
        """
        found = np.zeros(len(segment))
        for part in self._parts(len(segment)):
            found[part] = self._terms(segment[part], scale[part], start[part]).sum(1)
        return found

    def exact(
        self, segment: NDArray[np.int64], scale: NDArray[np.int64], start: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Score candidates as :func:`kernels.matching.score.sums` does, to the bit.

        Parameters
        ----------
        segment, scale, start : (N,) int64
            Each candidate lies in the stretch.

        Returns
        -------
        (N,) float64
        """
        found = np.zeros(len(segment))
        for part in self._parts(len(segment)):
            terms = self._terms(segment[part], scale[part], start[part])
            np.add.accumulate(terms, axis=1, out=terms)
            found[part] = terms[np.arange(len(terms)), self._last[segment[part]]]
        return found

    def _parts(self, n: int) -> list[slice]:
        """Cut N candidates into tiles."""
        size = max(_TILE // self.n_terms, 1)
        return [slice(at, at + size) for at in range(0, n, size)]

    def _terms(
        self, segment: NDArray[np.int64], scale: NDArray[np.int64], start: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Compute a b / (a + b) of all frames with music, (N, most), in the room."""
        shape = (len(segment), self.n_terms)
        place = self._room.array("place", shape, np.int64)
        np.take(self._place, segment * self._n_scales + scale, axis=0, out=place, mode="clip")
        place += start[:, None]
        a, b, total = (self._room.array(name, shape, np.float64) for name in ("a", "b", "total"))
        np.take(self._table, place, out=b, mode="clip")
        np.take(self._music, segment, axis=0, out=a, mode="clip")
        np.add(a, b, out=total)
        a *= b
        a /= total
        return a
