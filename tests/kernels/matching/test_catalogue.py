import numpy as np
import pytest

from kernels.matching.catalogue import Chunk, MatchCatalogue, SongLayout, check_search, portions
from kernels.matching.score import Match, reference_matches

FIFTIETHS = tuple(range(45, 56))


def firsts(clips, **limits):
    limits = {"bytes_a_frame": 1, "bytes_a_clip": 0, "most_bytes": 10**9, "most_frames": 10**9, **limits}
    return [(first, len(some)) for first, some in portions(clips, **limits)]


def test_portions_fill_what_there_is():
    clips = [np.ones(76)] * 5  # 100 frames each, with what lies between
    assert firsts(clips) == [(0, 5)]
    assert firsts(clips, most_bytes=200) == [(0, 2), (2, 2), (4, 1)]
    assert firsts(clips, most_bytes=399, bytes_a_frame=2) == [(index, 1) for index in range(5)]
    assert firsts(clips, most_bytes=300, bytes_a_clip=50) == [(0, 2), (2, 2), (4, 1)]
    assert firsts(clips, most_frames=300) == [(0, 3), (3, 2)]
    assert firsts(clips, most_bytes=1) == [(index, 1) for index in range(5)]  # a clip is never cut
    assert firsts([]) == []


def test_portions_read_no_more_than_is_asked_for():
    read = []

    def clips():
        for index in range(9):
            read.append(index)
            yield np.ones(76)

    next(portions(clips(), bytes_a_frame=1, bytes_a_clip=0, most_bytes=200, most_frames=10**9))
    assert read == [0, 1, 2]


def test_clips_no_search_takes_are_refused_by_their_place():
    with pytest.raises(ValueError, match=r"clip 1: .*not finite"):
        firsts([np.ones(3), np.array([np.inf])])
    with pytest.raises(ValueError, match=r"clip 2: want at most 8388608 frames"):
        firsts([np.ones(1), np.ones(2), np.zeros(2**23 + 1, np.int8)])


def test_silent_clips_stand_aside():
    chunk = Chunk(4, [np.ones(3), np.zeros(5), np.full(2, 7, np.float32), np.zeros(0)])
    assert chunk.live.tolist() == [0, 2]
    assert chunk.silent.tolist() == [1, 3]
    frames, first = chunk.flat()
    assert frames.tolist() == [1, 1, 1, 7, 7]
    assert frames.dtype == np.float64
    assert first.tolist() == [0, 3]
    left, right = chunk.halves()
    assert (left.first, right.first) == (4, 6)
    assert [len(clip) for clip in right.clips] == [2, 0]


def test_silence_is_answered_by_the_tie_rule():
    segments = [np.ones(4), np.zeros(3)]
    clips = [np.zeros(9), np.ones(3), np.zeros(2), np.zeros(9)]
    song, chunk = SongLayout(segments, k=3, fiftieths=FIFTIETHS), Chunk(5, clips)
    none = np.full(2, -1.0)
    found = song.with_silences([[], []], chunk, floor=none)
    expected = reference_matches(segments, clips, k=3)
    assert found == [[Match(**{**vars(m), "clip_index": m.clip_index + 5}) for m in some] for some in expected]
    # where k clips elsewhere reach more than 0, nobody asks for zeros
    assert song.with_silences([[], []], chunk, floor=np.array([0.5, 0.0])) == [[], found[1]]


def test_what_was_found_goes_before_silence():
    song, chunk = SongLayout([np.ones(2)], k=2, fiftieths=FIFTIETHS), Chunk(0, [np.zeros(4), np.ones(4)])
    best = Match(0, 0, 1, 3, 0, 1.0, 1.0, 1.0)
    (found,) = song.with_silences([[best]], chunk, floor=np.array([-1.0]))
    assert [(m.rank_number, m.clip_index) for m in found] == [(1, 1), (2, 0)]


def test_the_reference_counts_through_the_catalogue():
    rng = np.random.default_rng(0)
    clips, segment = [rng.random(30), np.zeros(30), rng.random(30)], rng.random(12)
    song, chunk = SongLayout([np.ones(1), segment], k=2, fiftieths=FIFTIETHS), Chunk(10, clips)
    expected = reference_matches([segment], clips, k=2)[0]
    assert [(m.segment_index, m.clip_index, m.score) for m in song.by_reference(1, chunk)] == [
        (1, m.clip_index + 10, m.score) for m in expected
    ]


def test_questions_without_an_answer_are_refused():
    good = [np.ones(3)]
    ask = {"k": 1, "fiftieths": FIFTIETHS, "floors": None}
    assert check_search(good, good, **ask).tolist() == [-1]
    assert check_search(good, good, **{**ask, "floors": [2]}).tolist() == [2]
    with pytest.raises(ValueError, match="k: want >= 1"):
        check_search(good, good, **{**ask, "k": 0})
    with pytest.raises(ValueError, match=r"segment 0: .*negative"):
        check_search([-good[0]], good, **ask)
    with pytest.raises(ValueError, match="floors: want one a segment, 1, got 2"):
        check_search(good, good, **{**ask, "floors": [0, 1]})
    other = MatchCatalogue([Chunk(0, good)], fiftieths=(50,), is_resident=True)
    assert len(other) == 1
    with pytest.raises(ValueError, match="clips: want an index for the scales"):
        check_search(good, other, **ask)
