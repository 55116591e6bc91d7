import numpy as np
import pytest

from kernels.matching.bounds import Bounds, SumTables
from kernels.matching.layout import Layout, counting
from kernels.matching.room import Room
from kernels.matching.score import SCALE_NUMERATORS, start_count


def made(clip_frames, n_frames, numerators=SCALE_NUMERATORS):
    clips = [np.arange(1.0, n + 1) for n in clip_frames]
    tables = SumTables(clips, numerators=numerators)
    return tables, Layout(tables, clips, n_frames=np.array(n_frames))


def test_counting_begins_anew():
    assert counting(np.array([2, 0, 3])).tolist() == [0, 1, 0, 1, 2]
    assert len(counting(np.zeros(0, int))) == 0


def test_starts_are_those_of_the_reference():
    clip_frames, n_frames = (1, 44, 45, 100), (45, 50, 90)
    _, layout = made(clip_frames, n_frames)
    for clip, n_clip in enumerate(clip_frames):
        assert layout.counts[clip].tolist() == [start_count(45, n_clip, p) for p in SCALE_NUMERATORS]
    fits = [[start_count(n, n_clip, 45) > 0 for n_clip in clip_frames] for n in n_frames]
    assert layout.is_fitting().tolist() == fits


@pytest.mark.parametrize("most", [1, 7, 1000])
def test_pieces_hold_every_start_once(most):
    tables, layout = made((70, 20), (20, 31))
    for clip in (0, 1):
        seen = []
        for piece in layout.pieces(clip, most=most):
            assert piece.first == tables.first[clip] + piece.begin
            assert piece.counts.max() <= most
            assert piece.frames[0] == piece.begin + 1  # clips count from 1
            field = layout.field(piece, np.array([0, 1]), fold=1)
            for column, (scale, start) in enumerate(zip(field.span.scale, field.span.position, strict=True)):
                for row in (0, 1):
                    if field.is_left is None or field.is_left[row, column]:
                        seen.append((row, int(scale), int(start) + piece.begin))
                        assert start + layout.reach[row, scale] < len(piece.frames)
                        assert start <= layout.last(piece, np.array([row]), np.array([scale]))
        expected = [
            (row, scale, start)
            for row, length in enumerate((20, 31))
            for scale, p in enumerate(SCALE_NUMERATORS)
            for start in range(start_count(length, int(tables.frames[clip]), p))
        ]
        assert sorted(seen) == expected


def test_groups_unfold_to_their_starts():
    _, layout = made((60,), (20, 20))
    (piece,) = layout.pieces(0, most=1000)
    field = layout.field(piece, np.array([0, 1]), fold=4)
    assert field.is_left is None
    assert field.n_left == field.n_cells == 2 * 4 * len(field.span)
    single = layout.unfolded(piece, field)
    assert single.fold == 1
    plain = layout.field(piece, np.array([0, 1]), fold=1)
    assert single.span.scale.tolist() == plain.span.scale.tolist()
    assert single.span.position.tolist() == plain.span.position.tolist()
    assert layout.unfolded(piece, single) is single


def test_what_is_left_of_groups_is_left_of_starts():
    _, layout = made((40,), (20, 33), (50,))
    (piece,) = layout.pieces(0, most=1000)
    field = layout.field(piece, np.array([0, 1]), fold=4)
    assert field.span.position.tolist() == [0, 4, 8, 12, 16, 20]
    assert field.is_left.tolist() == [[True] * 6, [True, True, False, False, False, False]]
    assert field.n_left == 32
    single = layout.unfolded(piece, field)
    assert single.span.position.tolist() == list(range(21))
    assert single.is_left.sum(1).tolist() == [21, 8]


def test_what_is_not_left_has_no_bound():
    tables, layout = made((40,), (20, 33), (50,))
    (piece,) = layout.pieces(0, most=1000)
    segments = np.ones((2, 33))
    segments[0, 20:] = 0
    bounds = Bounds(tables, segments, n_frames=np.array([20, 33]), block=10, fold=1, room=Room())
    values = layout.field(piece, np.array([1]), fold=1).bounded(bounds)
    assert np.isfinite(values[0, :8]).all()
    assert (values[0, 8:] == -np.inf).all()


@pytest.mark.parametrize("most", [8, 16, 800])
def test_portions_hold_every_group_once(most):
    tables, layout = made((90, 5, 33, 20, 300), (20, 24))
    seen = []
    for span, first, clips in layout.portions(most=most, fold=8):
        assert len(set(clips.tolist())) == len(clips)
        assert first[0] == 0
        ends = np.append(first[1:], len(span))
        for clip, begin, end in zip(clips, first, ends, strict=True):
            assert begin < end
            position = span.first + span.position[begin:end] - tables.first[clip]
            seen += [(int(clip), int(s), int(f)) for s, f in zip(span.scale[begin:end], position, strict=True)]
            assert span.first + span.position[begin:end].max() + layout.reach[0].max() < span.stop
    expected = [
        (clip, scale, start)
        for clip, n in enumerate(tables.frames.tolist())
        for scale, p in enumerate(SCALE_NUMERATORS)
        for start in range(0, start_count(20, n, p), 8)
    ]
    assert sorted(seen) == expected
