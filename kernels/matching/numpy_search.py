"""The k best clips of every segment in NumPy, pruned: twin of the search on OpenCL, for machines without a device.

The answer is that of :func:`kernels.matching.score.reference_matches`, to the bit: same clips, scales, starts and
scores. Upper bounds of all candidates are matrix products (:mod:`kernels.matching.bounds`), what may be among the best
is scored in float64 (:mod:`kernels.matching.candidates`), and the best of each pair in the reference's order
(:mod:`kernels.matching.refinement`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from kernels.matching.blocks import rows
from kernels.matching.bounds import SumTables
from kernels.matching.catalogue import Chunk, Series, SongLayout, portions
from kernels.matching.chunked import ChunkedSearch
from kernels.matching.refinement import PAIRS, PLACE_BITS, STAGES, Refinement
from kernels.matching.score import Match, ratios, sums_of_candidates

_MOST_FRAMES = 2**30
"""Frames of a chunk. Chosen below the range of int32."""

_TOGETHER = 512
"""Segments of one search. Chosen for memory, by hand; changes no answer."""

_LONGER = 1.6
"""Times the shortest: the longest segment of one search. Tuned on segments that all differ in length; changes no
answer."""

_SPARSE = 0.25
"""Share of frames with music below which a segment is searched with its like. Chosen by hand; changes no answer."""

# Largest values, chosen so that products neither overflow nor lose what a score is made of.
_SIZES = (2.0**-400, 2.0**400)


class NumpyMatcher(ChunkedSearch[SumTables]):
    """The pruned search without a device; see :class:`kernels.matching.chunked.ChunkedSearch`.

    Its memory is the host's: clips, their block sums, and the bounds of pairs.
    """

    @property
    def name(self) -> str:
        """What computes, for metadata."""
        return "reference"

    def _chunks(
        self, clips: Iterable[Series], fiftieths: tuple[int, ...], *, n_segments: int
    ) -> Iterator[Chunk[SumTables]]:
        """Cut a catalogue into chunks that fit with their block sums."""
        for first, some in portions(
            clips,
            bytes_a_frame=bytes_a_frame(fiftieths),
            bytes_a_clip=40 * n_segments,
            most_bytes=self.memory_bytes,
            most_frames=_MOST_FRAMES,
        ):
            yield Chunk(first, some)

    def _search(
        self, song: SongLayout, chunk: Chunk[SumTables], floor: NDArray[np.float64], *, is_kept: bool
    ) -> list[list[Match]]:
        """Search one chunk."""
        # products are small: a second thread would mostly wait
        with threadpool_limits(limits=1, user_api="blas"):
            found = self._search_sounding(song, chunk, floor, is_kept=is_kept)
        return song.with_silences(found, chunk, floor=floor)

    def _search_sounding(
        self, song: SongLayout, chunk: Chunk[SumTables], floor: NDArray[np.float64], *, is_kept: bool
    ) -> list[list[Match]]:
        """Find the matches of segments and clips that are not silent."""
        found: list[list[Match]] = [[] for _ in song.segments]
        if not len(chunk.live) or song.is_silent.all():
            return found
        clips = chunk.sounding()
        loudest = max(float(clip.max()) for clip in clips)
        is_plain = (song.top >= _SIZES[0]) & (song.top <= _SIZES[1]) & (_SIZES[0] <= loudest <= _SIZES[1])
        if is_plain.any():
            tables = chunk.tables or SumTables(clips, numerators=song.fiftieths)
            for alike in _alike(song, np.flatnonzero(is_plain)):
                self._search_alike(song, chunk, tables, alike, floor, found)
            if is_kept:
                chunk.tables = tables
        for index in np.flatnonzero(~is_plain & ~song.is_silent).tolist():
            found[index] = song.by_reference(index, chunk)
        return found

    def _search_alike(
        self,
        song: SongLayout,
        chunk: Chunk[SumTables],
        tables: SumTables,
        chosen: NDArray[np.int64],
        floor: NDArray[np.float64],
        found: list[list[Match]],
    ) -> None:
        """Find the matches of segments that are alike."""
        n_frames = song.n_frames[chosen]
        best = Refinement(
            tables,
            chunk.sounding(),
            song.padded[chosen, : int(n_frames.max())],
            n_frames=n_frames,
            k=song.k,
            floor=floor[chosen],
        ).search()
        order = np.argsort(-best.score, axis=1, kind="stable")[:, : song.k]
        score = np.take_along_axis(best.score, order, 1)
        row, rank = np.nonzero(score >= 0)
        clip = order[row, rank]
        scale, start = np.divmod(best.place[row, clip], 1 << PLACE_BITS)
        frames, first = chunk.flat()
        scores, motion = sums_of_candidates(
            song.padded,
            frames,
            n_frames=song.n_frames,
            segment=chosen[row],
            first=first[clip] + start,
            numerator=np.array(song.fiftieths, np.int64)[scale],
        )
        for i, (c, b_sum) in enumerate(zip(scores.tolist(), motion.tolist(), strict=True)):
            index = int(chosen[row[i]])
            place = (int(chunk.live[clip[i]]) + chunk.first, int(scale[i]), int(start[i]))
            found[index].append(Match(index, 0, *place, c, *ratios(c, song.music_sum[index], b_sum)))


def bytes_a_frame(fiftieths: Sequence[int]) -> int:
    """Memory for one frame of a clip.

    Parameters
    ----------
    fiftieths : the scales times 50

    Returns
    -------
    int
        12, and 2 for each row of block sums.
    """
    return 12 + 2 * sum(len(rows(block, fiftieths)) for block, _ in (PAIRS, *STAGES))


def _alike(song: SongLayout, chosen: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    """Put together segments of like loudness, density and length, the shorter first."""
    n_frames = song.n_frames[chosen]
    loudness = np.frexp(song.top[chosen])[1] // 4
    is_sparse = np.count_nonzero(song.padded[chosen], axis=1) < _SPARSE * n_frames
    order = np.lexsort((n_frames, loudness, is_sparse))
    first = 0
    for index in range(1, len(order) + 1):
        if index < len(order):
            here, there = order[first], order[index]
            is_alike = loudness[here] == loudness[there] and is_sparse[here] == is_sparse[there]
            if is_alike and n_frames[there] <= _LONGER * n_frames[here] + 1 and index - first < _TOGETHER:
                continue
        yield chosen[order[first:index]]
        first = index
