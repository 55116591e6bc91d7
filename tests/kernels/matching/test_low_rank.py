import numpy as np
import pytest

from kernels.matching.low_rank import RANK, codes, low_rank, nodes, window


def half_harmonic(a, b):
    return a[:, None] * b / (a[:, None] + b)


def test_nodes_are_zero_and_512_to_the_octave():
    found = nodes()
    assert len(found) == 14 * 512 + 2
    assert found[0] == 0
    assert found[1] == 2.0**-14
    assert found[-1] == 1
    np.testing.assert_allclose(np.diff(found[-512:]), 2.0**-10)
    assert np.array_equal(found, np.sort(found))


def test_codes_are_the_nodes_just_above():
    sums = np.array([0, 1e-38, 2.0**-14, 2.0**-14 * 1.0001, 0.5, np.nextafter(np.float32(0.5), 1), 1], np.float32)
    assert codes(sums).tolist() == [0, 1, 1, 2, 6657, 6658, 7169]
    rng = np.random.default_rng(0)
    some = (2.0 ** -rng.uniform(0, 13.9, 5000)).astype(np.float32)
    code = codes(some)
    assert (nodes()[code] >= some).all()
    assert (nodes()[code - 1] < some).all()
    assert codes(nodes().astype(np.float32)).tolist() == list(range(len(nodes())))


@pytest.mark.parametrize("exponent", [-60, -8, -2, 0, 2, 8, 20])
def test_it_is_above_everywhere(exponent):
    rng = np.random.default_rng(1)
    bound = low_rank(exponent)
    # within the window, at its nodes, far below it and above it
    a = 2.0**exponent * np.append(2.0 ** rng.uniform(-20, 3, 2000), 2.0 ** np.arange(-16.0, 3))
    b = np.append(2.0 ** rng.uniform(-20, 0, 500), [2.0**-14, 1e-30, 1]).astype(np.float32)
    factor, excess = bound.music(a)
    above = factor @ bound.motion[codes(b)].T.astype(np.float64) + excess[:, None]
    assert (above >= half_harmonic(a, b.astype(np.float64))).all()


def test_it_is_close_where_it_matters():
    a, b = np.linspace(0.05, 1, 200), np.linspace(0.05, 1, 300).astype(np.float32)
    bound = low_rank(0)
    factor, excess = bound.music(a)
    above = factor @ bound.motion[codes(b)].T.astype(np.float64) + excess[:, None]
    too_much = above - half_harmonic(a, b.astype(np.float64))
    assert too_much.mean() < 1e-3
    assert too_much.max() < 4e-3


def test_silence_is_nothing():
    bound = low_rank(0)
    factor, excess = bound.music(np.array([[0.0, 0.5]]))
    assert factor.shape == (1, 2, RANK)
    assert not factor[0, 0].any()
    assert excess[0, 0] == 0
    assert not bound.motion[0].any()
    assert np.abs(bound.motion).max() <= 1


def test_windows_are_even_and_hold_the_largest():
    assert [window(value) for value in (1e-9, 0.2, 0.99, 1.0, 3.9, 4.0, 1e-300, 1e300)] == [
        -28,
        -2,
        0,
        2,
        2,
        4,
        -60,
        20,
    ]
    for value in 2.0 ** np.random.default_rng(2).uniform(-50, 19, 200):
        assert value < 2.0 ** window(value) <= 4 * value
