"""Taking a catalogue chunk by chunk, with the reference as what searches a chunk."""

from dataclasses import replace

import numpy as np
import pytest

from kernels.matching.catalogue import Chunk, portions
from kernels.matching.chunked import ChunkedSearch
from kernels.matching.score import reference_matches


class ByReference(ChunkedSearch[None]):
    """Every chunk is searched by trying everything; the floors it is told are kept."""

    def __init__(self, *, memory_bytes):
        super().__init__(memory_bytes=memory_bytes)
        self.told = []

    def _chunks(self, clips, fiftieths, *, n_segments):
        for first, some in portions(
            clips, bytes_a_frame=1, bytes_a_clip=0, most_bytes=self.memory_bytes, most_frames=2**20
        ):
            yield Chunk(first, some)

    def _search(self, song, chunk, floor, *, is_kept):
        self.told.append(floor.tolist())
        found = reference_matches(song.segments, chunk.clips, k=song.k)
        return [[replace(m, clip_index=m.clip_index + chunk.first) for m in matches] for matches in found]


@pytest.fixture
def data():
    rng = np.random.default_rng(3)
    return [rng.random(n) for n in (20, 30)], [rng.random(int(n)) for n in rng.integers(40, 80, 9)]


@pytest.mark.parametrize("memory_bytes", [1, 200, 10**6])
def test_the_answer_does_not_depend_on_the_chunks(data, memory_bytes):
    segments, clips = data
    expected = reference_matches(segments, clips, k=3)
    search = ByReference(memory_bytes=memory_bytes)
    assert search.matches(segments, iter(clips), k=3) == expected
    assert search.matches(segments, search.index(clips), k=3) == expected


def test_a_chunk_is_told_what_is_reached_already(data):
    segments, clips = data
    search = ByReference(memory_bytes=1)
    found = search.matches(segments, clips, k=2, floors=[0.5, -1.0])
    first, *_, last = search.told
    assert first == [0.5, -1.0]
    assert len(search.told) == len(clips)
    assert last[1] <= found[1][-1].score
    assert last[1] > 0


def test_no_segment_asks_for_nothing(data):
    search = ByReference(memory_bytes=1)
    assert search.matches([], data[1], k=2) == []
    assert search.told == []


def test_an_index_is_kept_only_where_all_fits(data):
    assert ByReference(memory_bytes=10**6).index(data[1]).is_resident
    assert not ByReference(memory_bytes=1).index(data[1]).is_resident


@pytest.mark.parametrize("memory_bytes", [0, -1])
def test_no_memory_is_refused(memory_bytes):
    with pytest.raises(ValueError, match="memory_bytes: want > 0"):
        ByReference(memory_bytes=memory_bytes)
