import numpy as np
import pytest

from kernels.matching.blocks import TABLE_MARGIN, block_sums, bundles, lists, margin, rows
from kernels.matching.score import SCALE_NUMERATORS, similarity


@pytest.mark.parametrize(("n_frames", "n_rows"), [(50, 11), (25, 17), (10, 43), (5, 65), (1, 50)])
def test_rows_of_the_usual_scales(n_frames, n_rows):
    assert len(rows(n_frames, SCALE_NUMERATORS)) == n_rows


@pytest.mark.parametrize("n_frames", [1, 5, 10, 25, 50])
def test_a_row_at_its_step_is_the_sum_of_its_block(n_frames):
    clip = np.random.default_rng(0).random(400)
    table, taps = rows(n_frames, SCALE_NUMERATORS), rows(n_frames, SCALE_NUMERATORS).taps()
    steps = table.steps(4)
    for s, p in enumerate(SCALE_NUMERATORS):
        for k in range(4):
            f = np.arange(n_frames * k, n_frames * (k + 1))
            expected = np.interp(7 + p * f / 50, np.arange(400), clip).sum()
            row, shift = steps[s, k]
            got = taps[row] @ clip[7 + shift : 7 + shift + taps.shape[1]]
            assert got == pytest.approx(expected * (TABLE_MARGIN if n_frames > 1 else 1), rel=1e-6)
            assert n_frames == 1 or got >= expected


@pytest.mark.parametrize(("large", "small"), [(10, 5), (25, 5), (50, 25)])
def test_larger_blocks_are_sums_of_smaller_ones(large, small):
    ours, theirs = rows(large, SCALE_NUMERATORS), rows(small, SCALE_NUMERATORS)
    taps, parts = ours.taps().astype(float), theirs.taps().astype(float)
    for row, children in enumerate(ours.children(theirs)):
        total = np.zeros(200)
        for child, shift in children:
            total[shift : shift + parts.shape[1]] += parts[child]
        np.testing.assert_allclose(total[: taps.shape[1]], taps[row], atol=1e-5)


def test_the_score_of_sums_bounds_the_sum_of_scores():
    rng = np.random.default_rng(2)
    for _ in range(100):
        a, b = rng.random((2, 60)) ** rng.uniform(0.2, 8)
        blocks = [similarity(x.reshape(-1, 10).sum(1), y.reshape(-1, 10).sum(1)).sum() for x, y in [(a, b)]]
        assert blocks[0] >= similarity(a, b).sum() * (1 - 1e-12)


def test_lists_leave_silence_out_and_fill_up_to_fours():
    sums = np.array([[0.0, 2.0, 0.0, 3.0, 1e-9], [0.0] * 5, [1.0] * 5])
    found = lists(sums, smallest=np.full(3, 1e-6))
    assert found.first.tolist() == [0, 4, 4, 12]
    assert found.block[:2].tolist() == [1, 3]
    assert found.amount[:4].tolist() == [[2, 4], [3, 9], [1, 0], [1, 0]]


def test_bundles_lay_segments_side_by_side():
    laid, n_blocks = bundles(np.array([[1.0, 2.0], [0.0, 4.0], [5.0, 0.0]]), smallest=np.zeros(3), width=2)
    assert (laid.shape, n_blocks) == ((2, 4, 2, 2), 4)
    assert laid[0, :2].tolist() == [[[1, 1], [1, 0]], [[2, 4], [4, 16]]]
    assert laid[1, 0].tolist() == [[5, 1], [25, 0]]


def test_short_last_blocks_are_summed():
    np.testing.assert_array_equal(block_sums(np.ones((1, 7)), 5), [[5, 2]])


def test_the_margin_grows_with_length_and_loudness():
    a, b, c = margin(np.array([100.0, 100.0, 200.0]), np.array([100, 200, 100]), np.zeros(3))
    assert 0 < a < b
    assert c == pytest.approx(2 * a, rel=1e-6)
