"""Clips and segments as every search takes them: in chunks that fit, checked, silence answered by rule.

A search by bounds leaves two kinds of answers to this module: silent segments, for which every score is 0, and silent
clips, which score 0 for every segment. Both go by the tie rule alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from kernels.matching.score import (
    SCALE_DENOMINATOR,
    Match,
    check_query,
    check_series,
    music_sum,
    ranked,
    reference_matches,
    start_count,
)

LONGEST = 2**23
"""Frames of the longest clip a search takes: 19 hours at 120 Hz. Chosen below the 24 bits a place has."""

Series = NDArray[np.floating]
TablesT = TypeVar("TablesT")


class Chunk(Generic[TablesT]):
    """Neighbouring clips of a catalogue that are searched together.

    Parameters
    ----------
    first : int, index in the catalogue of the first
    clips : sequence of (T,) float
    """

    def __init__(self, first: int, clips: Sequence[Series]) -> None:
        self.first = first
        self.clips = tuple(clips)
        self.tables: TablesT | None = None
        silent = [not clip.any() for clip in self.clips]
        self.live = np.flatnonzero(~np.array(silent, bool))
        self.silent = np.flatnonzero(silent)
        self._flat: tuple[NDArray[np.float64], NDArray[np.int64]] | None = None

    def sounding(self) -> list[Series]:
        """Clips that are not silent throughout: those that bounds are made of."""
        return [self.clips[index] for index in self.live]

    def flat(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """All sounding clips one after another, and where each begins."""
        if self._flat is None:
            clips = self.sounding()
            starts = np.cumsum([0, *(len(clip) for clip in clips)])[:-1]
            self._flat = np.concatenate(clips).astype(np.float64), starts.astype(np.int64)
        return self._flat

    def halves(self) -> tuple[Chunk[TablesT], Chunk[TablesT]]:
        """Split, without tables."""
        half = len(self.clips) // 2
        return Chunk(self.first, self.clips[:half]), Chunk(self.first + half, self.clips[half:])


class MatchCatalogue(Generic[TablesT]):
    """A catalogue prepared for many songs; made by the ``index`` of a search.

    Parameters
    ----------
    chunks : sequence of Chunk
    fiftieths : the scales times 50
    is_resident : bool, whether tables are kept between searches
    """

    def __init__(self, chunks: Sequence[Chunk[TablesT]], *, fiftieths: tuple[int, ...], is_resident: bool) -> None:
        self.chunks = tuple(chunks)
        self.fiftieths = fiftieths
        self.is_resident = is_resident

    def __len__(self) -> int:
        return sum(len(chunk.clips) for chunk in self.chunks)


class SongLayout:
    """Segments laid out once for all chunks.

    Parameters
    ----------
    segments : sequence of (L,) float, at least one, L >= 1, finite, >= 0
    k : int, >= 1
    fiftieths : the scales times 50
    """

    def __init__(self, segments: Sequence[Series], *, k: int, fiftieths: tuple[int, ...]) -> None:
        self.segments, self.k, self.fiftieths = segments, k, fiftieths
        self.n_frames = np.array([len(segment) for segment in segments], np.int64)
        self.order = np.argsort(self.n_frames, kind="stable")
        self.padded = np.zeros((len(segments), int(self.n_frames.max())))
        for index, segment in enumerate(segments):
            self.padded[index, : len(segment)] = segment
        self.top = self.padded.max(1)
        self.is_silent = self.top == 0
        self.music_sum = [music_sum(segment) for segment in segments]

    def by_reference(self, index: int, chunk: Chunk[TablesT]) -> list[Match]:
        """Find the matches of a segment among the sounding clips by trying everything.

        Parameters
        ----------
        index : int, the segment
        chunk : Chunk

        Returns
        -------
        list of Match
            Their clips count through the catalogue.
        """
        scales = [p / SCALE_DENOMINATOR for p in self.fiftieths]
        (matches,) = reference_matches([self.segments[index]], chunk.sounding(), k=self.k, scales=scales)
        return [
            replace(m, segment_index=index, clip_index=int(chunk.live[m.clip_index]) + chunk.first) for m in matches
        ]

    def with_silences(
        self, found: Sequence[list[Match]], chunk: Chunk[TablesT], *, floor: NDArray[np.float64]
    ) -> list[list[Match]]:
        """Rank what was found in a chunk, with the candidates whose scores are 0 because there is silence.

        Parameters
        ----------
        found : one list a segment, matches of segments and clips that are not silent
        chunk : Chunk
        floor : (S,) float64, scores that k clips elsewhere reach; -1 for none

        Returns
        -------
        list, one a segment, of lists of Match, at most k each
        """
        answers = []
        for index, matches in enumerate(found):
            silent = range(len(chunk.clips)) if self.is_silent[index] else chunk.silent.tolist()
            zeros = self._silences(index, chunk, silent) if silent and floor[index] <= 0 else []
            answers.append(ranked([*matches, *zeros], k=self.k))
        return answers

    def _silences(self, index: int, chunk: Chunk[TablesT], clips: Iterable[int]) -> list[Match]:
        """List the first k of some clips that a segment fits into, where all scores are 0."""
        matches: list[Match] = []
        for clip in clips:
            if start_count(len(self.segments[index]), len(chunk.clips[clip]), self.fiftieths[0]):
                matches.append(Match(index, 0, clip + chunk.first, 0, 0, 0.0, 0.0, 0.0))
                if len(matches) == self.k:
                    break
        return matches


def portions(
    clips: Iterable[Series], *, bytes_a_frame: int, bytes_a_clip: int, most_bytes: int, most_frames: int
) -> Iterator[tuple[int, list[Series]]]:
    """Cut a catalogue into portions of neighbouring clips that fit into memory, at least one clip each.

    Parameters
    ----------
    clips : iterable of (T,) float, finite, >= 0
        Read once, a portion at a time.
    bytes_a_frame, bytes_a_clip : int
        What a search needs; a clip counts 24 frames more than it has.
    most_bytes, most_frames : int, what a portion may need

    Yields
    ------
    first : int, index of the first clip
    clips : list of (T,) float

    Raises
    ------
    ValueError
        If a clip is not (F,), not finite, negative, or of more than 2^23 frames.
    """
    waiting: list[Series] = []
    first, n_bytes, n_frames = 0, 0, 0
    for index, clip in enumerate(clips):
        clip = np.asarray(clip)
        try:
            check_series([clip], "clip")
        except ValueError as error:
            raise ValueError(str(error).replace("clip 0", f"clip {index}", 1)) from None
        if len(clip) > LONGEST:
            raise ValueError(f"clip {index}: want at most {LONGEST} frames, got {len(clip)}; cut it")
        stride = len(clip) + 24
        more = stride * bytes_a_frame + bytes_a_clip
        if waiting and (n_bytes + more > most_bytes or n_frames + stride > most_frames):
            yield first, waiting
            first, waiting, n_bytes, n_frames = index, [], 0, 0
        waiting.append(clip)
        n_bytes += more
        n_frames += stride
    if waiting:
        yield first, waiting


def check_search(
    segments: Sequence[Series],
    clips: object,
    *,
    k: int,
    fiftieths: tuple[int, ...],
    floors: Sequence[float] | None,
) -> NDArray[np.float64]:
    """Refuse a question without an answer; otherwise give the scores that are known to be reached elsewhere.

    Parameters
    ----------
    segments : sequence of arrays, to be (L,) float with L >= 1, finite, >= 0
    clips : a MatchCatalogue made for the same scales, or anything else, which is left alone
    k : int, to be >= 1
    fiftieths : the scales times 50
    floors : one a segment, or None

    Returns
    -------
    (S,) float64, -1 where nothing is known

    Raises
    ------
    ValueError
        If a segment is not (L,) with L >= 1, not finite or negative; k < 1; an index was made for other scales; or
        there is not one floor a segment.
    """
    check_query(segments, k=k)
    if floors is not None and len(floors) != len(segments):
        raise ValueError(f"floors: want one a segment, {len(segments)}, got {len(floors)}")
    if isinstance(clips, MatchCatalogue) and clips.fiftieths != fiftieths:
        scales = tuple(p / SCALE_DENOMINATOR for p in fiftieths)
        raise ValueError(f"clips: want an index for the scales {scales}, got one for others; make it anew")
    return np.full(len(segments), -1.0) if floors is None else np.asarray(floors, np.float64)
