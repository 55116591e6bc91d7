import numpy as np
import pytest

from kernels.matching.blocks import TABLE_MARGIN
from kernels.matching.bounds import Bounds, Span, SumTables
from kernels.matching.low_rank import nodes
from kernels.matching.room import Room
from kernels.matching.score import SCALE_NUMERATORS, start_count, sums


def smooth(rng, n):
    return np.abs(np.convolve(rng.normal(size=n + 20), np.hanning(21), "valid"))


def laid(tables, clip, length, fold):
    """All groups of a segment's starts in one clip."""
    counts = [-(-start_count(length, int(tables.frames[clip]), p) // fold) for p in tables.numerators]
    scale = np.repeat(np.arange(len(counts)), counts)
    position = np.concatenate([np.arange(n) * fold for n in counts])
    first = int(tables.first[clip])
    return Span(first, first + int(tables.frames[clip]) + tables.gap, scale, position)


def best_of_groups(segment, clip, span, numerators, fold):
    """The largest score of each group, as the reference has it."""
    best = np.zeros(len(span))
    for scale in np.unique(span.scale):
        n = start_count(len(segment), len(clip), numerators[scale])
        score, _ = sums(segment, clip, numerator=numerators[scale], starts=np.arange(n))
        best[span.scale == scale] = np.maximum.reduceat(score, np.arange(0, n, fold))
    return best


def test_sums_of_a_block_by_hand():
    clip = np.array([1.0, 2, 3, 4, 5, 6, 7, 8, 4, 4, 4, 4])
    tables = SumTables([np.full(3, 0.5), clip], numerators=(50,))
    assert tables.exponent == 4  # the largest is 8, and 2^3 would make it 1
    table = tables.table(5, 1)
    assert len(table.rows) == 1
    sums_there = nodes()[table.codes[0]] * 2.0 ** (tables.exponent + table.exponent)
    first = int(tables.first[1])
    expected = np.convolve(clip, np.ones(5))[4:]  # blocks end in the silence behind the clip
    np.testing.assert_allclose(sums_there[first : first + 12], expected, rtol=1 / 256)
    assert (sums_there[first : first + 12] >= expected).all()
    assert sums_there[0] == pytest.approx(1.5, rel=1 / 256)  # the clip before ends in silence too
    folded = tables.table(5, 4)
    of_four = [expected[i : i + 4].max() for i in range(12)]
    np.testing.assert_allclose(
        nodes()[folded.codes[0, first : first + 12]] * 2.0 ** (tables.exponent + folded.exponent), of_four, rtol=1 / 256
    )


def test_a_table_is_made_once():
    tables = SumTables([np.ones(20)], numerators=(50,))
    assert tables.table(10, 1) is tables.table(10, 1)
    assert len(tables) == 1


@pytest.mark.parametrize("numerators", [(45, 50), (1, 200)])
def test_tables_are_above_the_true_sums_everywhere(numerators):
    rng = np.random.default_rng(5)
    clips = [rng.random(n) ** 8 for n in (1, 2100, 37)]  # longer than a tile
    tables = SumTables(clips, numerators=numerators)
    for block in (5, 10, 25):
        table = tables.table(block, 1)
        there = nodes()[table.codes] * 2.0 ** (tables.exponent + table.exponent)
        taps = table.rows.taps().astype(np.float64) / TABLE_MARGIN
        for clip, first in zip(clips, tables.first, strict=True):
            padded = np.append(clip, np.zeros(taps.shape[1]))
            for row, weights in enumerate(taps):
                true = np.convolve(padded, weights[::-1], "valid")[: len(clip)]
                assert (there[row, first : first + len(clip)] >= true * (1 - 1e-6)).all()


@pytest.mark.parametrize(("block", "fold"), [(25, 8), (10, 4), (10, 1), (5, 1)])
@pytest.mark.parametrize("size", [1e-5, 1.0, 1e5])
def test_bounds_are_above_every_score(block, fold, size):
    rng = np.random.default_rng(3)
    segments = np.zeros((4, 60))
    n_frames = np.array([60, 60, 60, 60])
    for row, kind in enumerate((smooth(rng, 60), rng.random(60), rng.random(60) < 0.1, rng.random(60) ** 20)):
        segments[row] = size * kind
    clips = [smooth(rng, 90), rng.random(75), (rng.random(120) < 0.05) * 1.0, rng.random(61)]
    tables = SumTables(clips, numerators=SCALE_NUMERATORS)
    bounds = Bounds(tables, segments, n_frames=n_frames, block=block, fold=fold, room=Room())
    rows = np.arange(4)
    for index, clip in enumerate(clips):
        span = laid(tables, index, 60, fold)
        values = bounds.values(span, slice(None)).copy()
        for row in rows:
            score = best_of_groups(segments[row], clip, span, SCALE_NUMERATORS, fold)
            assert (bounds.scores(values[row], np.full(len(span), row)) >= score).all()
            # what is wanted is never dropped, to the last bit
            assert (values[row] >= bounds.least(score, np.full(len(span), row))).all()


def test_bounds_are_close_for_smooth_features():
    rng = np.random.default_rng(4)
    segment, clip = (np.convolve(rng.random(n + 60), np.hanning(61), "valid") for n in (100, 160))
    tables = SumTables([clip], numerators=SCALE_NUMERATORS)
    span = laid(tables, 0, 100, 1)
    score = best_of_groups(segment, clip, span, SCALE_NUMERATORS, 1)
    for block, most in ((10, 1.01), (5, 1.005)):
        bounds = Bounds(tables, segment[None], n_frames=np.array([100]), block=block, fold=1, room=Room())
        above = bounds.scores(bounds.values(span, np.array([0]))[0], np.zeros(len(span), int))
        assert (above / score).max() < most


def test_shorter_segments_beside_longer_ones_have_the_same_bounds():
    rng = np.random.default_rng(6)
    clip, short = smooth(rng, 80), smooth(rng, 30)
    padded = np.zeros((2, 57))
    padded[0, :30], padded[1] = short, smooth(rng, 57) / 2
    tables = SumTables([clip], numerators=SCALE_NUMERATORS)
    span = laid(tables, 0, 30, 1)
    args = {"block": 10, "fold": 1, "room": Room()}
    alone = Bounds(tables, short[None], n_frames=np.array([30]), **args)
    beside = Bounds(tables, padded, n_frames=np.array([30, 57]), **args)
    one = alone.scores(alone.values(span, np.array([0]))[0].copy(), np.zeros(len(span), int))
    two = beside.scores(beside.values(span, np.array([0]))[0], np.zeros(len(span), int))
    np.testing.assert_allclose(one, two, rtol=3e-3)


def test_nothing_known_wants_everything():
    tables = SumTables([np.ones(9)], numerators=(50,))
    bounds = Bounds(tables, np.ones((1, 3)), n_frames=np.array([3]), block=5, fold=1, room=Room())
    least = bounds.least(np.array([-1.0, 0.0, 1.0]), np.zeros(3, int))
    assert least[0] == np.finfo(np.float32).min
    assert least[0] < least[1] < least[2]


def test_some_of_a_span():
    span = Span(3, 9, np.array([0, 0, 1]), np.array([0, 4, 2]))
    some = span.only(np.array([2, 0]))
    assert (some.first, some.stop, len(some)) == (3, 9, 2)
    assert some.scale.tolist() == [1, 0]
    assert some.position.tolist() == [2, 0]
