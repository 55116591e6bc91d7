"""A chunk of the catalogue on a device: its clips and the tables of their block sums."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from kernels.matching.blocks import Rows, parent, rows
from kernels.matching.plan import Plan, built
from kernels.opencl.match_program import MatchProgram

_BATCH_BYTES = 2**24
"""Tables summed at a time. Tuned on the catalogue of the benchmark: with such batches, large pages and whole rows an
index is built in 0.15 to 0.25 instead of 0.6 CPU-seconds."""


class Tables:
    """Clips in device memory and, for the plans asked for, the sums of their blocks.

    Parameters
    ----------
    program : MatchProgram
    clips : sequence of (T,) float, each with T >= 1, finite, >= 0, and at least one value > 0
    numerators : the scales times 50

    Raises
    ------
    cl.MemoryError
        If the device's memory does not suffice.

    Notes
    -----
    Values are divided by a power of two, so that the largest lies between 1/2 and 1 whatever the features' unit.
    """

    def __init__(
        self, program: MatchProgram, clips: Sequence[NDArray[np.floating]], *, numerators: tuple[int, ...]
    ) -> None:
        self.program = program
        self.numerators = numerators
        self.exponent = int(np.frexp(max(float(clip.max()) for clip in clips))[1])
        self.frames = np.array([len(clip) for clip in clips], np.int32)
        self.stride = (-(-(self.frames + 8) // 16) * 16).astype(np.int32)
        self.first = (np.cumsum(self.stride) - self.stride).astype(np.int32)
        self.n_frames = int(self.stride.sum())
        self._slack = int(self.stride.max()) + 64
        flat = np.zeros(self.n_frames + self._slack, np.float32)
        for clip, at in zip(clips, self.first.tolist(), strict=True):
            flat[at : at + len(clip)] = np.ldexp(np.asarray(clip), -self.exponent)
        self.clip_first, self.clip_stride, self.clip_frames, self.frame = (
            program.buffer(array) for array in (self.first, self.stride, self.frames, flat)
        )
        self._dense: dict[int, cl.Buffer] = {}
        self._folded: dict[tuple[int, int], cl.Buffer] = {}

    def __len__(self) -> int:
        return len(self.frames)

    @property
    def n_bytes(self) -> int:
        """Device memory of the clips and of all tables built so far."""
        n_rows = sum(len(rows(g, self.numerators)) for g in (*self._dense, *(g for g, _ in self._folded)))
        n_tables = len(self._dense) + len(self._folded)
        return 4 * (self.n_frames * (1 + n_rows) + self._slack * (1 + n_tables)) + 12 * len(self)

    def dense(self, n_frames: int) -> cl.Buffer:
        """Give the table of blocks of so many frames, start by start.

        Parameters
        ----------
        n_frames : int, a block length of a plan that was built

        Raises
        ------
        KeyError
            If no plan that was built has it.
        """
        return self._dense[n_frames]

    def folded(self, n_frames: int, starts: int) -> cl.Buffer:
        """Give the table of the largest of neighbouring starts.

        Parameters
        ----------
        n_frames, starts : int, block length and starts taken together, of a plan that was built

        Raises
        ------
        KeyError
            If no plan that was built has it.
        """
        return self._folded[n_frames, starts]

    def build(self, plan: Plan) -> None:
        """Build the tables a plan reads and that are not there yet.

        Parameters
        ----------
        plan : Plan

        Raises
        ------
        cl.MemoryError
            If the device's memory does not suffice; what was there before is kept.
        """
        keep = [g for g in plan.dense if g not in self._dense]
        fold = [entry for entry in plan.folded if entry not in self._folded]
        if not keep and not fold:
            return
        all_rows = {g: rows(g, self.numerators) for g in built(plan)}
        dense = {g: self._table(len(all_rows[g])) for g in keep}
        folded = {(g, starts): self._table(len(all_rows[g])) for g, starts in fold}
        there = {**self._dense, **dense}
        missing = [g for g in all_rows if g in keep or g not in self._dense]
        # a batch of clips at a time, so that small blocks are still in the cache when larger ones are summed from them
        widest = sum(len(all_rows[g]) for g in missing)
        per_batch = max(_BATCH_BYTES // 4 // max(widest, 1), int(self.stride.max()))
        scratch = {
            g: self.program.room(4 * (per_batch * len(all_rows[g]) + self._slack)) for g in missing if g not in there
        }
        weights = {g: self._weights(g, all_rows) for g in missing}
        for begin, end in self._batches(per_batch):
            batch_first = int(self.first[begin])
            where = {g: (there[g], 0) if g in there else (scratch[g], batch_first) for g in all_rows}
            for g in missing:
                self._sum(g, where, all_rows, weights[g], begin, end)
            for g, starts in fold:
                table, origin = where[g]
                span = self._span(begin, end)
                self.program.run(
                    "largest_of",
                    (-(-int(self.stride[begin:end].max()) // span), len(all_rows[g]), end - begin),
                    *(begin, end - begin, len(all_rows[g]), starts, 0, origin, span),
                    *(self.clip_first, self.clip_stride, table, folded[g, starts]),
                    light=True,
                )
        self.program.queue.finish()
        self._dense.update(dense)
        self._folded.update(folded)

    def _weights(self, g: int, all_rows: dict[int, Rows]) -> tuple[cl.Buffer, int]:
        """Upload what rows are summed from; and how many of them each."""
        if parent(g) in all_rows:
            children = all_rows[g].children(all_rows[parent(g)])
            return self.program.buffer(children), children.shape[1]
        taps = all_rows[g].taps()
        return self.program.buffer(taps), taps.shape[1]

    def _sum(
        self,
        g: int,
        where: dict[int, tuple[cl.Buffer, int]],
        all_rows: dict[int, Rows],
        weights: tuple[cl.Buffer, int],
        begin: int,
        end: int,
    ) -> None:
        """Sum the rows of a few clips."""
        table, origin = where[g]
        span = self._span(begin, end)
        size = (-(-int(self.stride[begin:end].max()) // span), len(all_rows[g]), end - begin)
        common = (begin, end - begin, len(all_rows[g]))
        if parent(g) in all_rows:
            small, small_origin = where[parent(g)]
            self.program.run(
                *("sum_blocks", size, *common, len(all_rows[parent(g)]), weights[1], origin, small_origin, span),
                *(self.clip_first, self.clip_stride, small, weights[0], table),
                light=True,
            )
        else:
            self.program.run(
                *("sum_frames", size, *common, weights[1], origin, span),
                *(self.clip_first, self.clip_stride, self.frame, weights[0], table),
                light=True,
            )

    def _span(self, begin: int, end: int) -> int:
        """Columns a work-item takes: whole rows of some clips on a CPU, else 64."""
        return -(-int(self.stride[begin:end].max()) // 64) * 64 if self.program.is_cpu else 64

    def _batches(self, n_frames: int) -> list[tuple[int, int]]:
        """Cut the clips into runs of at most so many frames, at least one clip each."""
        batches, begin = [], 0
        for clip in range(len(self)):
            if clip > begin and int(self.first[clip] + self.stride[clip] - self.first[begin]) > n_frames:
                batches.append((begin, clip))
                begin = clip
        return [*batches, (begin, len(self))]

    def _table(self, n_rows: int) -> cl.Buffer:
        """Make room for a table; what may be read behind its end is 0."""
        table = self.program.room(4 * (n_rows * self.n_frames + self._slack))
        self.program.write(table, np.zeros(self._slack, np.float32), offset_bytes=4 * n_rows * self.n_frames)
        return table
