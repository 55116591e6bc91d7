import numpy as np
import pytest

from kernels.matching import candidates as module
from kernels.matching.candidates import Scores
from kernels.matching.room import Room
from kernels.matching.score import SCALE_NUMERATORS, start_count, sums


def some(rng, n):
    return np.where(rng.random(n) < 0.6, rng.random(n), 0)


def scores(segments, numerators, n_frames):
    return Scores(segments, numerators=numerators, n_frames=n_frames, room=Room())


def test_a_score_by_hand():
    # scale 1.1 reads frames 0, 1.1, 2.2; the second frame of music is silent
    found = scores(np.array([[1.0, 0.0, 3.0]]), (55,), 4)
    found.load(np.array([1.0, 2.0, 4.0, 0.0]))
    one = (np.zeros(1, int), np.zeros(1, int), np.zeros(1, int))
    assert found.exact(*one) == pytest.approx(1 / 2 + 3 * 3.2 / 6.2, rel=1e-15)
    assert found.about(*one) == pytest.approx(1 / 2 + 3 * 3.2 / 6.2, rel=1e-15)


@pytest.mark.parametrize("numerators", [SCALE_NUMERATORS, (50,), (25, 50, 100), (1, 200)])
def test_the_references_bits(numerators, monkeypatch):
    monkeypatch.setattr(module, "_TILE", 100)  # a few candidates at a time
    rng = np.random.default_rng(0)
    segments = np.zeros((3, 40))
    for row, n in enumerate((17, 40, 29)):
        segments[row, :n] = some(rng, n)
        segments[row, 0] = 0.25
    found = scores(segments, numerators, 200)
    for clip in (some(rng, 200), some(rng, 171), np.zeros(60)):
        found.load(clip)
        asked, expected = [], []
        for row, n in enumerate((17, 40, 29)):
            for scale, p in enumerate(numerators):
                starts = np.arange(min(start_count(n, len(clip), p), 60))
                asked += [(row, scale, start) for start in starts]
                expected.append(sums(segments[row, :n], clip, numerator=p, starts=starts)[0])
        row, scale, start = np.array(asked).T
        assert np.array_equal(found.exact(row, scale, start), np.concatenate(expected))
        np.testing.assert_allclose(found.about(row, scale, start), np.concatenate(expected), rtol=1e-14)


def test_other_candidates_change_no_bit():
    rng = np.random.default_rng(1)
    found = scores(rng.random((2, 50)), SCALE_NUMERATORS, 90)
    found.load(rng.random(90))
    rows, scale, start = np.array([0, 0, 1, 1]), np.array([0, 10, 3, 3]), np.array([0, 30, 7, 8])
    together = found.exact(rows, scale, start)
    for i in range(4):
        one = slice(i, i + 1)
        assert found.exact(rows[one], scale[one], start[one]) == together[one]


def test_only_frames_with_music_count():
    segments = np.zeros((2, 300))
    segments[0, [3, 200]], segments[1, [0, 5, 299]] = 1, 1
    assert scores(segments, (50,), 400).n_terms == 3


def test_no_candidate_no_score():
    found = scores(np.ones((1, 3)), (50,), 5)
    found.load(np.ones(5))
    none = np.zeros(0, int)
    assert len(found.exact(none, none, none)) == len(found.about(none, none, none)) == 0
