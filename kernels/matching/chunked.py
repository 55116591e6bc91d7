"""What every search for matches has in common: a catalogue taken chunk by chunk, and the best of all chunks kept."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from typing import Generic

import numpy as np
from numpy.typing import NDArray

from kernels.matching.catalogue import Chunk, MatchCatalogue, Series, SongLayout, TablesT, check_search
from kernels.matching.score import SCALES, Match, merge_matches, numerators

MEMORY_BYTES = 2**31
"""Memory a search takes where nobody says how much. Chosen to fit beside everything else on a workstation."""


class ChunkedSearch(ABC, Generic[TablesT]):
    """The search for the k best clips of every segment; what one chunk takes is the backend's.

    Parameters
    ----------
    memory_bytes : int, > 0
        For clips and their tables; more clips are taken chunk by chunk.

    Raises
    ------
    ValueError
        If the memory is not > 0.
    """

    def __init__(self, *, memory_bytes: int = MEMORY_BYTES) -> None:
        if memory_bytes <= 0:
            raise ValueError(f"memory_bytes: want > 0, got {memory_bytes}")
        self.memory_bytes = memory_bytes

    def index(self, clips: Iterable[Series], *, scales: Sequence[float] = SCALES) -> MatchCatalogue[TablesT]:
        """Prepare a catalogue for many songs.

        Parameters
        ----------
        clips : iterable of (T,) float, finite, >= 0, in ascending order of their keys
        scales : rising multiples of 1/50

        Returns
        -------
        MatchCatalogue
            Its tables are built by the first search and kept if all fit into the memory allowed; else they are built
            anew, chunk by chunk, by every search.

        Raises
        ------
        ValueError
            If a clip is not (F,), not finite or negative; or the scales are not as wanted.
        """
        fiftieths = numerators(scales)
        chunks = list(self._chunks(clips, fiftieths, n_segments=0))
        return MatchCatalogue(chunks, fiftieths=fiftieths, is_resident=len(chunks) <= 1)

    def matches(
        self,
        segments: Sequence[Series],
        clips: Iterable[Series] | MatchCatalogue[TablesT],
        *,
        k: int,
        scales: Sequence[float] = SCALES,
        floors: Sequence[float] | None = None,
    ) -> list[list[Match]]:
        """Find the k best clips of every segment.

        Parameters
        ----------
        segments : sequence of (L,) float, L >= 1, finite, >= 0
        clips : iterable of (T,) float, finite, >= 0, in ascending order of their keys; or their index
            An iterable is read once, a chunk at a time.
        k : int, >= 1
        scales : rising multiples of 1/50
        floors : sequence of S float, or None
            Scores that k clips elsewhere are known to reach, as when many workers share a song: worse ones may be left
            out here. What :func:`kernels.matching.score.merge_matches` makes of all parts stays the same.

        Returns
        -------
        list, one a segment, of lists of Match
            As :func:`kernels.matching.score.reference_matches`, to the bit. Empty without segments.

        Raises
        ------
        ValueError
            As the reference; or if an index was made for other scales, or there is not one floor a segment.
        MemoryError
            If there is not the memory for even one clip and its tables.
        """
        fiftieths = numerators(scales)
        segments = [np.asarray(segment) for segment in segments]
        given = check_search(segments, clips, k=k, fiftieths=fiftieths, floors=floors)
        found: list[list[Match]] = [[] for _ in segments]
        if not segments:
            return found
        song = SongLayout(segments, k=k, fiftieths=fiftieths)
        self._begin()
        if isinstance(clips, MatchCatalogue):
            chunks, is_kept = iter(clips.chunks), clips.is_resident
        else:
            chunks, is_kept = self._chunks(clips, fiftieths, n_segments=len(segments)), False
        for chunk in chunks:
            reached = [matches[-1].score if len(matches) == k else -1.0 for matches in found]
            part = self._search(song, chunk, np.maximum(given, reached), is_kept=is_kept)
            found = merge_matches([found, part], k=k)
        return found

    def _begin(self) -> None:
        """Forget what the last search chose."""

    @abstractmethod
    def _chunks(
        self, clips: Iterable[Series], fiftieths: tuple[int, ...], *, n_segments: int
    ) -> Iterator[Chunk[TablesT]]:
        """Cut a catalogue into chunks that fit with their tables."""

    @abstractmethod
    def _search(
        self, song: SongLayout, chunk: Chunk[TablesT], floor: NDArray[np.float64], *, is_kept: bool
    ) -> list[list[Match]]:
        """Search one chunk, silence included; its tables stay with it where they are kept."""
