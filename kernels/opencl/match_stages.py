"""The stages of one search on a device: some segments against one chunk of clips, by one plan."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from kernels.matching.blocks import GROUP, Lists, block_sums, bundles, lists, margin, rows
from kernels.matching.plan import Plan
from kernels.matching.score import SCALE_DENOMINATOR
from kernels.opencl.match_program import RUN, SCALE_BITS
from kernels.opencl.match_tables import Tables

# What is less, beside clips whose largest value is 1, is left out of sums and counted in the margin. Chosen so that the
# products of four sums stay within the range of float.
_QUIET = 1e-7
_PLAIN = (1e-2, 1e3)
_SAFE = (1e-9, 1e9)
"""Largest values of segments, beside clips' 1, for which that is little, and those for which squares stay within the
range. Chosen by hand; beyond them one term to a division is used, and then the reference."""

_LEVEL_BYTES = 2**25
"""Groups written between two levels. Chosen for memory, by hand; changes no answer."""


@dataclass(frozen=True)
class Emitted:
    """Candidates that may be the best of their pairs.

    Parameters
    ----------
    pair : (N,) int64, index of the pair asked for
    scale, start : (N,) int64
    """

    pair: NDArray[np.int64]
    scale: NDArray[np.int64]
    start: NDArray[np.int64]


class Stages:
    """Segments laid out for one chunk and one plan.

    Parameters
    ----------
    tables : Tables with the plan's tables built
    segments : (S, L) float64
        Filled up with zeros; best in order of length, since neighbours are taken together.
    n_frames : (S,) int64, frames of each segment
    plan : Plan
    is_safe : bool
        One term to a division: wanted where the sizes of features lie far apart.
    by_level : bool
        Refine level by level (for devices whose work-items run in step) rather than depth first.
    """

    def __init__(
        self,
        tables: Tables,
        segments: NDArray[np.float64],
        *,
        n_frames: NDArray[np.int64],
        plan: Plan,
        is_safe: bool,
        by_level: bool,
    ) -> None:
        self.tables, self.plan, self.is_safe, self.by_level = tables, plan, is_safe, by_level
        program = self.program = tables.program
        scaled = np.ldexp(segments, -tables.exponent)
        self.n_segments = len(segments)
        quiet = _QUIET * (scaled.max(1) if is_safe else np.maximum(scaled.max(1), 1))
        music_sum = scaled.sum(1)
        dropped = np.where(scaled < quiet[:, None], scaled, 0).sum(1)
        self.margin = margin(music_sum, n_frames, dropped)
        bounds = [plan.groups[0], *plan.then] if plan.groups else []
        self._n_bounds = len(bounds)
        self._fold = plan.groups[1] if plan.groups else GROUP
        self._sums = [block_sums(scaled, g) for g in (*bounds, 1)]
        g, self.fold = plan.pairs or (1, 1)
        self._pair_sums = block_sums(scaled, g)
        self._quiet = quiet
        levels = [lists(sums, smallest=quiet) for sums in self._sums]
        self._first, self._block, self._amount = self._lay_lists(levels)
        self._pair_lists = self._lay_lists([lists(self._pair_sums, smallest=quiet)])
        # the first bounds of all blocks, for segments taken together
        dense, n_blocks = bundles(self._sums[0], smallest=quiet, width=1)
        self._dense = (bounds[0] if bounds else 1, n_blocks, program.buffer(dense))
        self._lay_steps(bounds)
        self._music_sum = program.buffer(music_sum.astype(np.float32))
        self._margin = program.buffer(self.margin)
        self._segment_frames = program.buffer(n_frames.astype(np.int32))

    @property
    def is_exact(self) -> bool:
        """Whether :meth:`largest` gives scores rather than bounds."""
        return self._n_bounds == 0

    def largest(self) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Bound (or score, where the plan has no bounds) every pair.

        Returns
        -------
        value : (S, clips) float32
            The largest over all candidates; -1 where there is none.
        place : (S, clips) int32
            scale * 2^24 + group (or start) of the largest.
        """
        shape = (self.n_segments, len(self.tables))
        program, tables = self.program, self.tables
        value, place = (program.room(4 * shape[0] * shape[1]) for _ in range(2))
        clips = (tables.clip_first, tables.clip_stride, tables.clip_frames, self._numerator)
        out = (self._music_sum, self._segment_frames, value, place)
        counts = (shape[1], shape[0], len(tables.numerators))
        g, fold = self.plan.pairs or (1, 1)
        n_rows = len(rows(g, tables.numerators))
        if self.plan.is_sparse:
            table = tables.folded(g, fold) if self._n_bounds else tables.dense(1)
            arguments = (
                *counts,
                self._pair_long,
                n_rows,
                fold,
                *clips,
                self._pair_step,
                table,
                *self._pair_lists,
                *out,
            )
            program.run("bound_alone", shape, *arguments, is_safe=self.is_safe)
        else:
            laid, n_blocks = bundles(self._pair_sums, smallest=self._quiet, width=program.together)
            amount = program.buffer(laid)
            size = (len(laid), shape[1])
            if self._n_bounds:
                steps = (*counts, n_blocks, n_rows, fold, *clips, self._pair_step, tables.folded(g, fold))
                program.run("bound_together", size, *steps, amount, *out, is_safe=self.is_safe)
            else:
                frames = (*counts, n_blocks, *clips, self._shift, self._weight, tables.frame)
                program.run("score_together", size, *frames, amount, *out, is_safe=self.is_safe)
            program.queue.finish()  # `amount` lives until here
        return self.program.read(value, shape, np.float32), self.program.read(place, shape, np.int32)

    def probe(self, pairs: NDArray[np.int32], place: NDArray[np.int32]) -> NDArray[np.float32]:
        """Score one group of 8 starts of each pair.

        Parameters
        ----------
        pairs : (N, 2) int32, segment and clip
        place : (N,) int32, scale * 2^24 + group

        Returns
        -------
        (N,) float32, the best score of each group
        """
        out = self.program.room(4 * len(pairs))
        there = (self.program.buffer(pairs), self.program.buffer(place))
        self.program.run(
            "probe",
            (len(pairs),),
            *(len(pairs), self._n_bounds, self.fold, *self._clips(), *self._segments(), *self._steps()),
            *(*there, out),
            is_safe=self.is_safe,
            light=True,
        )
        return self.program.read(out, (len(pairs),), np.float32)

    def best(self, pairs: NDArray[np.int32], least: NDArray[np.float32]) -> NDArray[np.float32]:
        """Find the best score of each pair, if it reaches what is wanted.

        Parameters
        ----------
        pairs : (N, 2) int32, segment and clip
        least : (N,) float32

        Returns
        -------
        (N,) float32
            The best of those scored: the pair's best wherever that reaches `least`; -1 where nothing was scored.
        """
        if self.by_level:
            return self._best_by_level(pairs, least)
        found = self.program.room(4 * len(pairs))
        self._refine(pairs, least, 0, found, found, found)
        return self.program.read(found, (len(pairs),), np.float32)

    def emit(self, pairs: NDArray[np.int32], least: NDArray[np.float32], *, most: int) -> Emitted | None:
        """List every candidate of the pairs whose score, with the margin, reaches what is wanted.

        Parameters
        ----------
        pairs, least : as for :meth:`best`
        most : int, >= 1

        Returns
        -------
        Emitted, in no order; None where there are more than `most` and more than one pair
        """
        if len(pairs) == 0:
            return Emitted(*(np.zeros(0, np.int64) for _ in range(3)))
        while True:
            count, out = self.program.buffer(np.zeros(1, np.int32)), self.program.room(8 * most)
            if self.by_level:
                if not self._emit_by_level(pairs, least, most, count, out):
                    return None
            else:
                self._refine(pairs, least, most, out, count, out)
            n = int(self.program.read(count, (1,), np.int32)[0])
            if n <= most:
                break
            if len(pairs) > 1:
                return None
            most = n
        found = self.program.read(out, (n, 2), np.int32).astype(np.int64)
        return Emitted(found[:, 0], found[:, 1] >> SCALE_BITS, found[:, 1] & ((1 << SCALE_BITS) - 1))

    def _refine(
        self,
        pairs: NDArray[np.int32],
        least: NDArray[np.float32],
        most: int,
        found: cl.Buffer,
        count: cl.Buffer,
        emitted: cl.Buffer,
    ) -> None:
        """Depth first over all pairs."""
        run = runs(pairs[:, 1], longest=1 if self.plan.is_sparse or not self._n_bounds else RUN)
        there = [self.program.buffer(array) for array in (run, pairs, least)]
        common = (*self._clips(), *self._segments(), *self._steps(), *self._tables())
        self.program.run(
            "refine",
            (len(run) - 1,),
            *(len(run) - 1, most, *common, *self._dense, *there, found, count, emitted),
            is_safe=self.is_safe,
        )
        self.program.queue.finish()

    def _best_by_level(self, pairs: NDArray[np.int32], least: NDArray[np.float32]) -> NDArray[np.float32]:
        """Halve the pairs until the groups that pass fit."""
        if len(pairs) == 0:
            return np.zeros(0, np.float32)
        there = (self.program.buffer(pairs), self.program.buffer(least))
        groups = self._groups(pairs, there)
        if groups is None:
            half = len(pairs) // 2
            parts = (slice(None, half), slice(half, None))
            return np.concatenate([self._best_by_level(pairs[part], least[part]) for part in parts])
        found = self.program.buffer(np.full(len(pairs), -1, np.int32))
        self._last(groups, there, 0, found, found, found)
        bits = self.program.read(found, (len(pairs),), np.int32)
        return np.where(bits < 0, np.float32(-1), bits.view(np.float32))

    def _emit_by_level(
        self, pairs: NDArray[np.int32], least: NDArray[np.float32], most: int, count: cl.Buffer, out: cl.Buffer
    ) -> bool:
        """Emit; whether the groups that pass did fit."""
        there = (self.program.buffer(pairs), self.program.buffer(least))
        groups = self._groups(pairs, there)
        if groups is None:
            return False
        self._last(groups, there, most, out, count, out)
        return True

    def _groups(self, pairs: NDArray[np.int32], there: tuple[cl.Buffer, cl.Buffer]) -> tuple[cl.Buffer, int] | None:
        """Go through the bounds, keeping the groups that pass; None where they do not fit and could be fewer."""
        most = _LEVEL_BYTES // 8
        common = (*self._clips(), *self._segments(), *self._steps(), *self._tables())
        longest = -(-int(self.tables.frames[pairs[:, 1]].max()) // self._fold)
        size = (-(-longest // self.program.lanes), len(self.tables.numerators), len(pairs))
        while True:
            count, passed = self.program.buffer(np.zeros(1, np.int32)), self.program.room(8 * most)
            self.program.run(
                "level_first",
                size,
                *(len(pairs), most, *common, *there, count, passed),
                is_safe=self.is_safe,
                light=True,
            )
            n = int(self.program.read(count, (1,), np.int32)[0])
            if n <= most:
                break
            if len(pairs) > 1:
                return None
            most = n
        for level in range(1, self._n_bounds):
            count, out = self.program.buffer(np.zeros(1, np.int32)), self.program.room(8 * n)
            self.program.run(
                "level_next", (n,), *(n, level, *common, *there, passed, count, out), is_safe=self.is_safe, light=True
            )
            n = int(self.program.read(count, (1,), np.int32)[0])
            passed = out
        return passed, n

    def _last(
        self,
        groups: tuple[cl.Buffer, int],
        there: tuple[cl.Buffer, cl.Buffer],
        most: int,
        found: cl.Buffer,
        count: cl.Buffer,
        emitted: cl.Buffer,
    ) -> None:
        """Score the groups that passed all bounds."""
        passed, n = groups
        common = (*self._clips(), *self._segments(), *self._steps(), *self._tables())
        self.program.run(
            "level_last",
            (n,),
            *(n, most, *common, *there, passed, found, count, emitted),
            is_safe=self.is_safe,
            light=True,
        )
        self.program.queue.finish()

    def _lay_lists(self, levels: list[Lists]) -> tuple[cl.Buffer, cl.Buffer, cl.Buffer]:
        """Put the lists of some levels one after another."""
        starts = np.cumsum([0, *(len(level.block) for level in levels)])
        first = [level.first + start for level, start in zip(levels, starts.tolist(), strict=False)]
        return (
            self.program.buffer(np.concatenate(first).astype(np.int32)),
            self.program.buffer(np.concatenate([level.block for level in levels])),
            self.program.buffer(np.concatenate([level.amount for level in levels])),
        )

    def _lay_steps(self, bounds: list[int]) -> None:
        """Put the steps of all levels one after another, the first folded; and the weights of frames."""
        numerators = self.tables.numerators
        steps = [
            rows(g, numerators).steps(-(-sums.shape[1] // 4) * 4)
            for g, sums in zip((*bounds, 1), self._sums, strict=True)
        ]
        frames = steps[-1]
        if bounds:
            steps[0] = _folded(steps[0], self._fold)
        pair_step = rows((self.plan.pairs or (1, 1))[0], numerators).steps(-(-self._pair_sums.shape[1] // 4) * 4)
        self._pair_long = pair_step.shape[1]
        self._pair_step = self.program.buffer(_folded(pair_step, self.fold))
        self._longest = [step.shape[1] for step in steps]
        starts = np.cumsum([0, *(step.shape[0] * step.shape[1] for step in steps)])[:-1]
        self._step = self.program.buffer(np.concatenate([step.reshape(-1, 2) for step in steps]).astype(np.int32))
        self._shift = self.program.buffer(np.ascontiguousarray(frames[..., 1]))
        phase = np.outer(numerators, np.arange(frames.shape[1])) % SCALE_DENOMINATOR
        self._weight = self.program.buffer((phase / SCALE_DENOMINATOR).astype(np.float32))
        self._level_step = self.program.buffer(starts.astype(np.int32))
        self._level_long = self.program.buffer(np.array(self._longest, np.int32))
        self._numerator = self.program.buffer(np.array(numerators, np.int32))

    def _clips(self) -> tuple[cl.Buffer, ...]:
        tables = self.tables
        return tables.clip_first, tables.clip_stride, tables.clip_frames, tables.frame

    def _segments(self) -> tuple[object, ...]:
        return (
            *(self.n_segments, self._music_sum, self._margin, self._segment_frames),
            *(self._first, self._block, self._amount),
        )

    def _steps(self) -> tuple[object, ...]:
        return (
            *(len(self.tables.numerators), self._numerator, self._step, self._weight),
            *(self._level_step, self._level_long),
        )

    def _tables(self) -> tuple[object, ...]:
        """Arguments of the tables; the clips themselves stand in where a plan has none."""
        tables, plan = self.tables, self.plan
        unused = (0, tables.frame)
        first = (len(rows(plan.groups[0], tables.numerators)), tables.folded(*plan.groups)) if plan.groups else unused
        finer = [(len(rows(g, tables.numerators)), tables.dense(g)) for g in plan.then]
        finer += [unused] * (2 - len(finer))
        return (self._n_bounds, self._fold, *first, *finer[0], *finer[1])


def runs(clip: NDArray[np.integer], *, longest: int) -> NDArray[np.int32]:
    """Cut a list of pairs where their clip changes, and where a run is long enough.

    Parameters
    ----------
    clip : (N,) int, the clip of each pair
    longest : int, >= 1

    Returns
    -------
    (runs + 1,) int32
        The first pair of each run, and N.
    """
    index = np.arange(len(clip))
    changes = np.append(True, clip[1:] != clip[:-1])[: len(clip)]
    since = index - np.maximum.accumulate(np.where(changes, index, 0)) if len(clip) else index
    return np.append(np.flatnonzero(since % longest == 0), len(clip)).astype(np.int32)


def _folded(steps: NDArray[np.int32], fold: int) -> NDArray[np.int32]:
    """Rows and shifts of a table of groups, from those of starts."""
    row, shift = steps[..., 0], steps[..., 1]
    return np.stack([row * fold + shift % fold, shift // fold], -1)


def wants_safe(tables: Tables, segment_max: float) -> bool | None:
    """Whether a segment needs one term to a division beside these clips; None where not even that will do.

    Parameters
    ----------
    tables : Tables
    segment_max : float, > 0, the segment's largest value
    """
    size = float(np.ldexp(segment_max, -tables.exponent))
    if _PLAIN[0] <= size <= _PLAIN[1]:
        return False
    return True if _SAFE[0] <= size <= _SAFE[1] else None
