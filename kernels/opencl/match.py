"""The k best clips of every segment on an OpenCL device: twin of :func:`kernels.matching.score.reference_matches`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from kernels.matching.catalogue import Chunk, Series, SongLayout, portions
from kernels.matching.chunked import MEMORY_BYTES, ChunkedSearch
from kernels.matching.plan import PLANS, Plan, bytes_a_frame
from kernels.matching.score import (
    Match,
    merge_matches,
    ratios,
    sums_of_candidates,
)
from kernels.opencl.choice import pick_device
from kernels.opencl.match_finalists import candidates, finalists
from kernels.opencl.match_program import MatchProgram
from kernels.opencl.match_stages import Stages, wants_safe
from kernels.opencl.match_tables import Tables
from kernels.opencl.match_tuning import pick_plan

_CANDIDATES = 2**14
"""Candidates scored at a time. Chosen for memory, by hand; changes no score."""


class Matcher(ChunkedSearch[Tables]):
    """The search on one device.

    Parameters
    ----------
    context : cl.Context of one device, or None for the device :func:`kernels.opencl.choice.pick_device` picks
    memory_bytes : int
        Device memory for clips and their tables; more clips are taken chunk by chunk.
    plan : Plan or None
        The way of searching; None: timed on a sample of the data. No way changes the answer.
    by_level : bool or None
        Refine level by level rather than depth first; None: not on a CPU.
    program : MatchProgram or None
        Compiled kernels to share; None: the context's own.

    Raises
    ------
    kernels.opencl.choice.NoDeviceError
        If no device is given and there is none.
    ValueError
        If the memory is not > 0, or the context has not exactly one device.

    Notes
    -----
    Kernels work in float32 with a margin above their rounding; whatever may be among the best is scored again in
    float64, in the reference's order. So every answer has the reference's bits. See docs/matching.md.
    """

    def __init__(
        self,
        context: cl.Context | None = None,
        *,
        memory_bytes: int = MEMORY_BYTES,
        plan: Plan | None = None,
        by_level: bool | None = None,
        program: MatchProgram | None = None,
    ) -> None:
        super().__init__(memory_bytes=memory_bytes)
        self.program = program or MatchProgram(context or cl.Context([pick_device()]))
        self.plan = plan
        self.by_level = not self.program.is_cpu if by_level is None else by_level
        self.last_plan: Plan | None = plan

    @property
    def name(self) -> str:
        """Device and driver, for metadata."""
        return self.program.name

    def _begin(self) -> None:
        self.last_plan = self.plan

    def _chunks(
        self, clips: Iterable[Series], fiftieths: tuple[int, ...], *, n_segments: int
    ) -> Iterator[Chunk[Tables]]:
        """Cut a catalogue into chunks whose tables fit, for the plan that needs most."""
        plans = [self.plan] if self.plan else list(PLANS)
        a_frame = max(bytes_a_frame(plan, fiftieths) for plan in plans)
        most = min(self.memory_bytes, 2**31 * 4)
        # one table is one buffer, and a buffer has a limit of its own
        frames_most = min(self.program.device.max_mem_alloc_size // a_frame, 2**30)
        for first, some in portions(
            clips, bytes_a_frame=a_frame, bytes_a_clip=8 * n_segments, most_bytes=most, most_frames=frames_most
        ):
            yield Chunk(first, some)

    def _search(
        self, song: SongLayout, chunk: Chunk[Tables], floor: NDArray[np.float64], *, is_kept: bool
    ) -> list[list[Match]]:
        """Search one chunk; if the device's memory does not suffice, its halves."""
        try:
            found = self._search_device(song, chunk, floor, is_kept=is_kept)
        except (cl.MemoryError, MemoryError) as error:
            chunk.tables = None
            if len(chunk.clips) < 2:
                raise MemoryError(
                    f"device: want memory for one clip of {len(chunk.clips[0])} frames and its tables, got {error}; "
                    "cut the clip or choose another device"
                ) from error
            parts = [self._search(song, half, floor, is_kept=False) for half in chunk.halves()]
            return merge_matches(parts, k=song.k)
        return song.with_silences(found, chunk, floor=floor)

    def _search_device(
        self, song: SongLayout, chunk: Chunk[Tables], floor: NDArray[np.float64], *, is_kept: bool
    ) -> list[list[Match]]:
        """Find the matches of segments and clips that are not silent."""
        found: list[list[Match]] = [[] for _ in song.segments]
        if not len(chunk.live) or song.is_silent.all():
            return found
        tables = chunk.tables or Tables(self.program, chunk.sounding(), numerators=song.fiftieths)
        kinds = [
            None if quiet else (wants_safe(tables, top),) for quiet, top in zip(song.is_silent, song.top, strict=True)
        ]
        for is_safe in (False, True):
            chosen = np.array([index for index in song.order if kinds[index] == (is_safe,)], np.int64)
            if not len(chosen):
                continue
            plan = self.last_plan or pick_plan(
                self.program,
                song.padded[chosen],
                n_frames=song.n_frames[chosen],
                clips=chunk.sounding(),
                numerators=song.fiftieths,
                k=song.k,
                by_level=self.by_level,
            )
            self.last_plan = plan
            tables.build(plan)
            longest = int(song.n_frames[chosen].max())
            stages = Stages(
                tables,
                song.padded[chosen, :longest],
                n_frames=song.n_frames[chosen],
                plan=plan,
                is_safe=is_safe,
                by_level=self.by_level,
            )
            self._finish(song, chunk, stages, chosen, floor, found)
        for index, kind in enumerate(kinds):
            if kind == (None,):
                found[index] = song.by_reference(index, chunk)
        if is_kept:
            chunk.tables = tables
        return found

    def _finish(
        self,
        song: SongLayout,
        chunk: Chunk[Tables],
        stages: Stages,
        chosen: NDArray[np.int64],
        floor: NDArray[np.float64],
        found: list[list[Match]],
    ) -> None:
        """Score what may be among the best in float64."""
        most = np.finfo(np.float32).max
        scaled = np.minimum(np.ldexp(floor[chosen], -stages.tables.exponent), most).astype(np.float32)
        lowest = np.where(floor[chosen] < 0, np.float32(-1), np.nextafter(scaled, np.float32(-np.inf)))
        pairs, score = finalists(stages, k=song.k, floor=lowest)
        frames, starts = chunk.flat()
        for some, emitted in candidates(stages, pairs, score):
            segment, clip = some[emitted.pair].astype(np.int64).T
            numerator = np.array(song.fiftieths, np.int64)[emitted.scale]
            exact = [
                sums_of_candidates(
                    song.padded,
                    frames,
                    n_frames=song.n_frames,
                    segment=chosen[segment[part]],
                    first=starts[clip[part]] + emitted.start[part],
                    numerator=numerator[part],
                )
                for part in (slice(at, at + _CANDIDATES) for at in range(0, len(segment), _CANDIDATES))
            ]
            if not exact:
                continue
            scores, motion = (np.concatenate(column) for column in zip(*exact, strict=True))
            order = np.lexsort((emitted.start, emitted.scale, -scores, emitted.pair))
            best = order[np.append(True, np.diff(emitted.pair[order]) > 0)]
            for i in best.tolist():
                index = int(chosen[segment[i]])
                found[index].append(
                    Match(
                        index,
                        0,
                        int(chunk.live[clip[i]]) + chunk.first,
                        int(emitted.scale[i]),
                        int(emitted.start[i]),
                        float(scores[i]),
                        *ratios(float(scores[i]), song.music_sum[index], float(motion[i])),
                    )
                )
