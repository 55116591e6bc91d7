"""Candidates of clips laid out for bounds: pieces of a clip, and fields of segments by starts.

Conventions: segments are by rising length, so the first has the most starts in a clip. A *piece* is a stretch of
neighbouring starts of one clip, a *field* some segments (rows) by some starts at all scales (columns), or groups of
neighbouring starts, scale after scale.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.matching.bounds import Bounds, Series, Span, SumTables
from kernels.matching.score import SCALE_DENOMINATOR


@dataclass(frozen=True, eq=False)
class StartRun:
    """Neighbouring starts in a clip.

    Parameters
    ----------
    clip : int
    begin : int, the first of them, a frame of the clip
    first : int, its position in the tables
    counts : (scales,) int64, starts at each scale
    frames : (T,) float64, those of all candidates
    """

    clip: int
    begin: int
    first: int
    counts: NDArray[np.int64]
    frames: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Field:
    """Segments by starts of a piece, or groups of them.

    Parameters
    ----------
    rows : (M,) int64, segments
    span : Span of N starts, positions from the piece's first
    fold : int, neighbouring starts in a group
    is_left : (M, N) bool, or None where all are
        Of a group: whether its first start is a candidate, and any may be wanted.
    """

    rows: NDArray[np.int64]
    span: Span
    fold: int
    is_left: NDArray[np.bool_] | None

    @property
    def n_cells(self) -> int:
        """Starts of all segments, left or not."""
        return len(self.rows) * len(self.span) * self.fold

    @property
    def n_left(self) -> int:
        """Starts of all segments that are left, counting groups as whole."""
        return self.n_cells if self.is_left is None else int(np.count_nonzero(self.is_left)) * self.fold

    def bounded(self, bounds: Bounds) -> NDArray[np.float32]:
        """Bound all.

        Parameters
        ----------
        bounds : Bounds

        Returns
        -------
        (M, N) float32, until the next call; -inf where nothing is left
        """
        values = bounds.values(self.span, self.rows)
        if self.is_left is not None:
            np.copyto(values, np.float32(-np.inf), where=~self.is_left)
        return values


class Layout:
    """Where segments fit in clips.

    Parameters
    ----------
    tables : SumTables of the clips
    clips : sequence of (T,) float
    n_frames : (S,) int64, rising, frames of segments

    Attributes
    ----------
    reach : (S, scales) int64
        Frames from a start to the last frame of a segment.
    counts : (C, scales) int64, starts of the shortest segment in each clip
    """

    def __init__(self, tables: SumTables, clips: Sequence[Series], *, n_frames: NDArray[np.int64]) -> None:
        self._tables, self._clips = tables, clips
        self.reach = -(-np.outer(n_frames - 1, np.array(tables.numerators)) // SCALE_DENOMINATOR)
        self.counts = np.maximum(tables.frames[:, None] - self.reach[0], 0)
        self._is_one_length = bool(n_frames[0] == n_frames[-1])

    def is_fitting(self) -> NDArray[np.bool_]:
        """Mark the pairs of segment and clip that have a candidate, (S, C)."""
        fitting: NDArray[np.bool_] = self.reach[:, :1] < self._tables.frames
        return fitting

    def portions(self, *, most: int, fold: int) -> Iterator[tuple[Span, NDArray[np.int64], NDArray[np.int64]]]:
        """Lay out the groups of all clips, some at a time.

        Parameters
        ----------
        most : int, starts of a clip at each scale taken together, a multiple of `fold`
        fold : int, neighbouring starts in a group

        Yields
        ------
        span : Span of N groups, clip after clip, the last groups of a scale with fewer starts
        first : (clips,) int64, the first column of each clip
        clips : (clips,) int64, rising
        """
        tables = self._tables
        n_parts = -(-self.counts.max(1) // most)
        clip = np.repeat(np.arange(len(n_parts)), n_parts)
        begin = counting(n_parts) * most
        groups = -(-np.clip(self.counts[clip] - begin[:, None], 0, most) // fold)
        columns = groups.sum(1)
        for part in _cut(columns.tolist(), begin.tolist(), limit=most // fold * groups.shape[1]):
            here, counts = clip[part], groups[part]
            first = int(tables.first[here[0]] + begin[part.start])
            stop = int(tables.first[here[-1]] + tables.frames[here[-1]]) + tables.gap
            scale = np.repeat(np.tile(np.arange(counts.shape[1]), len(counts)), counts.ravel())
            origin = np.repeat(tables.first[here] + begin[part] - first, columns[part])
            position = counting(counts.ravel()) * fold + origin
            yield Span(first, stop, scale, position), np.cumsum(columns[part]) - columns[part], here

    def pieces(self, clip: int, *, most: int) -> Iterator[StartRun]:
        """Cut the starts in a clip into pieces.

        Parameters
        ----------
        clip : int
        most : int, starts of a piece at each scale
        """
        first, n_frames = int(self._tables.first[clip]), int(self._tables.frames[clip])
        samples = np.asarray(self._clips[clip], np.float64)
        n_starts, reach = int(self.counts[clip].max()), int(self.reach.max())
        for begin in range(0, n_starts, most):
            counts = np.clip(self.counts[clip] - begin, 0, most)
            frames = samples[begin : min(begin + most + reach, n_frames)]
            yield StartRun(clip, begin, first + begin, counts, frames)

    def field(self, piece: StartRun, rows: NDArray[np.int64], *, fold: int) -> Field:
        """Lay out all starts of a piece in groups.

        Parameters
        ----------
        piece : StartRun
        rows : (M,) int64, segments
        fold : int, starts in a group
        """
        counts = -(-piece.counts // fold)
        scale = np.repeat(np.arange(len(counts)), counts)
        span = Span(piece.first, piece.first + len(piece.frames), scale, counting(counts) * fold)
        return Field(rows, span, fold, self._fitting(piece, rows, span))

    def unfolded(self, piece: StartRun, field: Field) -> Field:
        """Lay out the single starts of a field.

        Parameters
        ----------
        piece : StartRun
        field : Field of it
        """
        if field.fold == 1:
            return field
        scale = np.repeat(field.span.scale, field.fold)
        position = (field.span.position[:, None] + np.arange(field.fold)).ravel()
        there = np.flatnonzero(position < piece.counts[scale])
        span = Span(field.span.first, field.span.stop, scale[there], position[there])
        is_left = self._fitting(piece, field.rows, span)
        if field.is_left is not None:
            of_group = np.repeat(field.is_left, field.fold, axis=1)[:, there]
            is_left = of_group if is_left is None else of_group & is_left
        return Field(field.rows, span, 1, is_left)

    def last(self, piece: StartRun, rows: NDArray[np.int64], scale: NDArray[np.int64]) -> NDArray[np.int64]:
        """Find the last start in a piece.

        Parameters
        ----------
        piece : StartRun
        rows, scale : (N,) int64, segments and scales

        Returns
        -------
        (N,) int64
            Less than 0 where there is none.
        """
        found: NDArray[np.int64] = len(piece.frames) - 1 - self.reach[rows, scale]
        return found

    def _fitting(self, piece: StartRun, rows: NDArray[np.int64], span: Span) -> NDArray[np.bool_] | None:
        """Mark the starts from which a segment ends within the clip; None where all do."""
        if self._is_one_length:
            return None
        fitting: NDArray[np.bool_] = span.position < len(piece.frames) - self.reach[rows][:, span.scale]
        return fitting


def counting(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Count from 0 anew for each.

    Parameters
    ----------
    counts : (N,) int64, >= 0

    Returns
    -------
    (sum of counts,) int64
        2 and 3 give 0, 1, 0, 1, 2.
    """
    first = np.cumsum(counts) - counts
    found: NDArray[np.int64] = np.arange(int(counts.sum())) - np.repeat(first, counts)
    return found


def _cut(columns: list[int], begin: list[int], *, limit: int) -> Iterator[slice]:
    """Cut stretches of clips into portions of not too many columns, two stretches of one clip never together."""
    first, total = 0, 0
    for index, (more, at) in enumerate(zip(columns, begin, strict=True)):
        if index > first and (total + more > limit or at > 0):
            yield slice(first, index)
            first, total = index, 0
        total += more
    if total:
        yield slice(first, len(columns))
