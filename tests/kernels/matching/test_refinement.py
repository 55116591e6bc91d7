from functools import cache

import numpy as np
import pytest

from kernels.matching import refinement as module
from kernels.matching.bounds import SumTables
from kernels.matching.candidates import Scores
from kernels.matching.refinement import PLACE_BITS, Refinement, _Stage
from kernels.matching.score import SCALE_NUMERATORS, reference_matches, start_count


def smooth(rng, n):
    return np.convolve(rng.random(n + 40), np.hanning(41), "valid")


def rough(rng, n):
    return rng.random(n)


def constant(_, n):
    return np.ones(n)


def refined(segments, clips, *, k, floor=-1.0):
    order = np.argsort([len(segment) for segment in segments], kind="stable")
    padded = np.zeros((len(segments), max(map(len, segments))))
    for row, index in enumerate(order):
        padded[row, : len(segments[index])] = segments[index]
    n_frames = np.array([len(segments[index]) for index in order])
    tables = SumTables(clips, numerators=SCALE_NUMERATORS)
    floors = np.full(len(segments), floor)
    return order, Refinement(tables, clips, padded, n_frames=n_frames, k=k, floor=floors).search()


def answers(segments, clips, *, k):
    """The k best of each segment, in the order of the segments."""
    order, best = refined(segments, clips, k=k)
    found = [[] for _ in segments]
    for row, index in enumerate(order):
        ranks = np.argsort(-best.score[row], kind="stable")[:k]
        for clip in ranks[best.score[row, ranks] >= 0].tolist():
            scale, start = divmod(int(best.place[row, clip]), 1 << PLACE_BITS)
            found[index].append((clip, scale, start, float(best.score[row, clip])))
    return found


def by_reference(segments, clips, *, k):
    return [
        [(m.clip_index, m.scale_index, m.start_frame_index, m.score) for m in matches]
        for matches in reference_matches(segments, clips, k=k)
    ]


def made(seed, *, kind=smooth, n_segments=4, n_clips=14):
    rng = np.random.default_rng(seed)
    segments = [kind(rng, int(n)) for n in rng.integers(40, 60, n_segments)]
    return segments, [kind(rng, int(n)) for n in rng.integers(30, 110, n_clips)]


@cache
def case(kind):
    segments, clips = made(1, kind=kind)
    return segments, clips, by_reference(segments, clips, k=2)


def test_a_match_by_hand():
    # three frames of 1 in a clip of 0.1; at the smallest scale, frames 10, 10.9, 11.8 are the first to find them
    clips = [np.full(40, 0.1) for _ in range(3)]
    clips[1][10:13] = 1
    (found,) = answers([np.ones(3)], clips, k=1)
    assert found == [(1, 0, 10, 1.5)]


@pytest.mark.parametrize(
    "changed",
    [
        {"_SINGLE_BYTES": 1, "_LEAST_GROUPS": 3, "_PAIRS_BYTES": 1},  # many pieces
        {"_CELLS": 1, "_LEAST_GROUPS": 1},
        {"_TELLING": 1},  # stages are left out at once
        {"_SCORE_NS": 1e9},  # all bounds are worth it
        {"_SCORE_NS": 0.0, "_TERM_NS": 0.0},  # none is
        {"_FEW": 0.0, "_MORE": 1},  # a turn of few
        {"_FEW": 2.0},
        {"_STAGES": ((10, 8), (5, 2), (5, 1))},
        {"_STAGES": ((5, 1),), "_PAIRS": (10, 1)},
    ],
    ids=str,
)
@pytest.mark.parametrize("kind", [smooth, rough, constant])
def test_no_way_of_searching_changes_the_answer(monkeypatch, changed, kind):
    segments, clips, expected = case(kind)
    for name, value in changed.items():
        monkeypatch.setattr(module, name, value)
    assert answers(segments, clips, k=2) == expected


def test_few_candidates_are_scored(monkeypatch):
    counts = []
    about = Scores.about
    monkeypatch.setattr(Scores, "about", lambda self, rows, *args: counts.append(len(rows)) or about(self, rows, *args))
    rng = np.random.default_rng(2)
    slow = [np.convolve(rng.random(n + 100), np.hanning(101), "valid") * rng.uniform(0.5, 2) for n in [300] * 60]
    segments = [np.convolve(rng.random(250), np.hanning(101), "valid") for _ in range(10)]
    answers(segments, slow, k=2)
    everything = 10 * 60 * sum(start_count(150, 300, p) for p in SCALE_NUMERATORS)
    assert sum(counts) < 0.02 * everything


def test_what_k_clips_reach_elsewhere_is_not_looked_for():
    segments, clips = made(3)
    _, best = refined(segments, clips, k=3, floor=1e9)
    assert (best.score == -1).all()
    order, best = refined(segments, clips, k=3, floor=0.0)
    whole = by_reference(segments, clips, k=3)
    assert [np.sort(row)[-3:][::-1].tolist() for row in best.score] == [[m[3] for m in whole[i]] for i in order]


def test_a_stage_is_left_out_where_nearly_all_passes_it():
    stage = _Stage(bounds=None, cost=0.25)
    assert stage.is_worth_it
    stage.before, stage.after = 2**21, 2**20
    assert stage.is_worth_it
    stage.after = 2**21 - 2**18
    assert not stage.is_worth_it
    last = _Stage(bounds=None, cost=-np.inf, before=2**21, after=2**21)
    assert last.is_worth_it
