"""From bounds to the best candidates of the best clips, for segments that are alike in length and loudness.

1. *Pairs*: a bound of every segment and clip, blocks of 25 frames, 8 neighbouring starts together.
2. *Probe*: the k + 4 most promising clips of each segment get bounds start by start, blocks of 5 frames, and the best
   candidate by bound is scored: a first k-th best.
3. *Refine*: all pairs whose bound reaches the k-th best; where that are many, four times as many as were probed before.
   Bounds of 10 frames and 4 starts, 10 frames and single starts, 5 frames and single starts; scores of what is left;
   and what may be the best of its pair is scored as the reference scores it. Bounds that cost more than they save are
   left out.

A pair's own best prunes too. What is *known* are lower bounds of the pairs' best scores, so the k-th largest for a
segment, the *least* it wants, is one of its k-th best score: nothing that reaches that is ever left out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from kernels.matching.bounds import Bounds, Series, SumTables
from kernels.matching.candidates import Scores
from kernels.matching.layout import Field, Layout, StartRun
from kernels.matching.low_rank import RANK
from kernels.matching.room import Room

PLACE_BITS = 24
"""Bits of a place below those of its scale. Chosen so that clips of 2^23 frames have room."""

PAIRS = (25, 8)
STAGES = ((10, 4), (10, 1), (5, 1))
"""Frames of a block, and neighbouring starts bounded together. Tuned on energy, rough and impulse data of the
benchmark: (10, 8) between the first two gains hardly anything."""

_MORE = 4
_FEW = 0.5
"""Where more than this share of pairs is left, so many times as many clips are refined first. Tuned on the same data: a
third turn is slower on all three kinds."""

_TELLING = 2**20
"""Starts after which a stage is judged. Chosen by hand; changes no answer."""

_PAIRS_BYTES, _SINGLE_BYTES = 2**19, 2**23
_CELLS = 2**22
_LEAST_GROUPS = 64
"""Sums laid out, and segments by starts, at a time; and groups at least. Chosen for the caches, by hand; changes no
answer."""
_SCORE_NS = 150.0  # of a candidate
_TERM_NS = 6.0  # of a score
_SPREAD_NS = 4.0  # a block of a start, laid out
_PRODUCT_NS = 0.16  # a block of a start, for a segment
"""Nanoseconds, measured on one core (AMD EPYC, AVX2); only their ratios matter, and no answer depends on them."""


@dataclass(frozen=True, eq=False)
class Best:
    """The best candidate of pairs of segment and clip, where it may be among the k best of its segment.

    Parameters
    ----------
    score : (S, C) float64, the reference's; -1 where there is none
    place : (S, C) int64, scale * 2^24 + start
    """

    score: NDArray[np.float64]
    place: NDArray[np.int64]


@dataclass(eq=False)
class _Stage:
    """Bounds of starts, and how much is laid out before and after them in this turn."""

    bounds: Bounds
    cost: float  # beside the next stage's
    before: int = 0
    after: int = 0

    @property
    def is_worth_it(self) -> bool:
        """Whether the next stage gets so much less to do that this one pays."""
        return self.before < _TELLING or self.after < (1 - self.cost) * self.before


class Refinement:
    """One search of some segments among some clips.

    Parameters
    ----------
    tables : SumTables of the clips
    clips : sequence of (T,) float, none of them silent
    segments : (S, L) float64, filled up with zeros, none of them silent; by rising length
    n_frames : (S,) int64, frames of each segment
    k : int, >= 1
    floor : (S,) float64
        Scores that k clips elsewhere reach; -1 for none.
    """

    def __init__(
        self,
        tables: SumTables,
        clips: Sequence[Series],
        segments: NDArray[np.float64],
        *,
        n_frames: NDArray[np.int64],
        k: int,
        floor: NDArray[np.float64],
    ) -> None:
        self._k, self._floor = k, floor
        self._layout = Layout(tables, clips, n_frames=n_frames)
        room = Room()
        pairs, *single = (
            Bounds(tables, segments, n_frames=n_frames, block=block, fold=fold, room=room)
            for block, fold in (PAIRS, *STAGES)
        )
        work = [bounds.n_blocks / bounds.fold for bounds in single]
        costs = [one / two for one, two in pairwise(work)]
        self._pairs = pairs
        self._stages = [_Stage(bounds, cost) for bounds, cost in zip(single, [*costs, -np.inf], strict=True)]
        self._most = self._starts(single[-1], _SINGLE_BYTES)
        longest = min(self._most + int(self._layout.reach.max()), int(tables.frames.max()))
        self._scores = Scores(segments, numerators=tables.numerators, n_frames=longest, room=room)
        # the sum of n terms in another order
        self._near = 1 + (self._scores.n_terms + 16) * 2.0**-51
        shape = (len(segments), len(tables))
        self._bound = np.full(shape, -np.inf)
        self._known = np.full(shape, -1.0)
        self._least = floor.copy()
        self._best = Best(np.full(shape, -1.0), np.zeros(shape, np.int64))
        self._loaded: StartRun | None = None

    def search(self) -> Best:
        """Find the best candidates of all pairs that may be among the k best clips of their segment.

        Returns
        -------
        Best
        """
        self._bound_pairs()
        n_first = self._k + 4
        self._each(self._highest(n_first), self._probe)
        wanted = self._reaching()
        if wanted.sum() > _FEW * wanted.size:  # bounds tell little: a better score to beat is worth one more turn
            first = wanted & self._highest(_MORE * n_first)
            self._each(first, self._refine)
            wanted = self._reaching() & ~first
        self._each(wanted, self._refine)
        return self._best

    def _starts(self, bounds: Bounds, n_bytes: int) -> int:
        """Count the starts of each scale that are laid out at a time."""
        n_scales, n_segments = self._layout.counts.shape[1], len(self._floor)
        groups = min(n_bytes // (bounds.n_blocks * RANK * 4), _CELLS // n_segments) // n_scales
        return max(int(groups), _LEAST_GROUPS) * bounds.fold

    def _bound_pairs(self) -> None:
        """Bound every pair, all segments at a time and as many clips as fit."""
        rows = np.arange(len(self._bound))[:, None]
        most = self._starts(self._pairs, _PAIRS_BYTES)
        for span, first, clips in self._layout.portions(most=most, fold=self._pairs.fold):
            largest = np.maximum.reduceat(self._pairs.values(span, slice(None)), first, axis=1)
            self._bound[:, clips] = np.maximum(self._bound[:, clips], self._pairs.scores(largest, rows))
        self._bound[~self._layout.is_fitting()] = -np.inf

    def _each(self, chosen: NDArray[np.bool_], work: Callable[[int, NDArray[np.int64]], None]) -> None:
        """Work on pairs clip by clip."""
        for stage in self._stages:
            stage.before = stage.after = 0
        for clip in np.flatnonzero(chosen.any(0)).tolist():
            work(clip, np.flatnonzero(chosen[:, clip]))
        self._settle(np.flatnonzero(chosen.any(1)))

    def _reaching(self) -> NDArray[np.bool_]:
        """Mark the pairs that may reach the k-th best score."""
        reaching: NDArray[np.bool_] = (self._bound > -np.inf) & (self._bound >= self._least[:, None])
        return reaching

    def _highest(self, n: int) -> NDArray[np.bool_]:
        """Mark the n clips of highest bound of each segment, those without a candidate never."""
        marked = self._bound > -np.inf
        if n < self._bound.shape[1]:
            highest = np.zeros_like(marked)
            np.put_along_axis(highest, np.argpartition(self._bound, -n, axis=1)[:, -n:], True, axis=1)
            marked &= highest
        return marked

    def _settle(self, rows: NDArray[np.int64]) -> None:
        """Find the k-th best score that is known of some segments."""
        n = self._known.shape[1]
        if self._k <= n and len(rows):
            kth = np.partition(self._known[rows], n - self._k, axis=1)[:, n - self._k]
            self._least[rows] = np.maximum(self._floor[rows], kth)

    def _wanted(self, clip: int, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Scores that candidates of pairs have to reach."""
        wanted: NDArray[np.float64] = np.maximum(self._least[rows], self._known[rows, clip])
        return wanted

    def _probe(self, clip: int, rows: NDArray[np.int64]) -> None:
        """Bound pairs more closely and score the most promising candidates of each."""
        bounds = self._stages[-1].bounds
        highest = np.full(len(rows), -np.inf, np.float32)
        for piece in self._layout.pieces(clip, most=self._most):
            field = self._layout.field(piece, rows, fold=bounds.fold)
            values = field.bounded(bounds)
            best = values.argmax(1)
            largest = values[np.arange(len(rows)), best]
            there = np.flatnonzero(largest > -np.inf)
            self._know(piece, field, there, best[there])
            np.maximum(highest, largest, out=highest)
        self._bound[rows, clip] = np.minimum(self._bound[rows, clip], bounds.scores(highest, rows))

    def _refine(self, clip: int, rows: NDArray[np.int64]) -> None:
        """Find the best candidates of pairs whose bound still reaches the k-th best score."""
        for piece in self._layout.pieces(clip, most=self._most):
            rows = rows[self._bound[rows, clip] >= self._wanted(clip, rows)]
            if not len(rows):
                return
            stages = [stage for stage in self._stages if stage.is_worth_it]
            field = self._layout.field(piece, rows, fold=stages[0].bounds.fold)
            for stage in stages:
                if stage is not stages[0] and not self._is_worth_it(stage.bounds, field):
                    break
                if field.fold > stage.bounds.fold:
                    field = self._layout.unfolded(piece, field)
                stage.before += field.n_cells
                field = self._passing(piece, field, stage.bounds)
                stage.after += field.n_cells
                if not field.n_cells:
                    break
            if field.n_cells:
                self._score(piece, self._layout.unfolded(piece, field))

    def _passing(self, piece: StartRun, field: Field, bounds: Bounds) -> Field:
        """Leave the candidates whose bounds reach what is wanted, and the rows and columns that have any."""
        values = field.bounded(bounds)
        rows = field.rows
        some = np.flatnonzero(values.max(1) >= bounds.least(self._wanted(piece.clip, rows), rows))
        if len(some) < len(rows):
            values, rows = values[some], rows[some]
        self._know(piece, field, some, values.argmax(1))
        passed = values >= bounds.least(self._wanted(piece.clip, rows), rows)[:, None]
        columns = np.flatnonzero(passed.any(0))
        if len(columns) == len(field.span):
            return Field(rows, field.span, field.fold, passed)
        return Field(rows, field.span.only(columns), field.fold, passed[:, columns])

    def _is_worth_it(self, bounds: Bounds, field: Field) -> bool:
        """Whether bounds cost less than scoring all that is left."""
        n_starts = len(field.span) * field.fold
        bounds_ns = bounds.n_blocks * n_starts * (_SPREAD_NS + _PRODUCT_NS * len(field.rows))
        return bool(bounds_ns < (_SCORE_NS + _TERM_NS * self._scores.n_terms) * field.n_left)

    def _know(self, piece: StartRun, field: Field, some: NDArray[np.int64], columns: NDArray[np.int64]) -> None:
        """Score a candidate, or the neighbours of a group, of each of some rows: a score to beat."""
        if not len(some):
            return
        self._load(piece)
        rows = np.repeat(field.rows[some], field.fold)
        scale = np.repeat(field.span.scale[columns], field.fold)
        start = (field.span.position[columns, None] + np.arange(field.fold)).ravel()
        start = np.minimum(start, self._layout.last(piece, rows, scale))
        score = self._scores.about(rows, scale, start).reshape(-1, field.fold).max(1) / self._near
        rows = field.rows[some]
        self._known[rows, piece.clip] = np.maximum(self._known[rows, piece.clip], score)

    def _score(self, piece: StartRun, field: Field) -> None:
        """Score candidates, pair after pair, and keep the best of each."""
        is_left = np.ones((len(field.rows), len(field.span)), bool) if field.is_left is None else field.is_left
        row, column = np.nonzero(is_left)
        if not len(row):
            return
        self._load(piece)
        rows, scale, start = field.rows[row], field.span.scale[column], field.span.position[column]
        about = self._scores.about(rows, scale, start)
        first = np.flatnonzero(np.diff(rows, prepend=-1))
        pairs = rows[first]
        best = np.maximum.reduceat(about, first) / self._near
        self._known[pairs, piece.clip] = np.maximum(self._known[pairs, piece.clip], best)
        near = np.flatnonzero(about * self._near >= self._wanted(piece.clip, rows))
        rows, scale, start = rows[near], scale[near], start[near]
        score = self._scores.exact(rows, scale, start)
        place = (scale << PLACE_BITS) + start + piece.begin
        order = np.lexsort((place, -score, rows))
        order = order[np.diff(rows[order], prepend=-1) > 0]
        rows, score, place = rows[order], score[order], place[order]
        before = self._best.score[rows, piece.clip]
        better = (score > before) | ((score == before) & (place < self._best.place[rows, piece.clip]))
        self._best.score[rows[better], piece.clip] = score[better]
        self._best.place[rows[better], piece.clip] = place[better]
        self._settle(pairs[self._known[pairs, piece.clip] > self._least[pairs]])

    def _load(self, piece: StartRun) -> None:
        """Have the scores read from a piece."""
        if self._loaded is not piece:
            self._scores.load(piece.frames)
            self._loaded = piece
