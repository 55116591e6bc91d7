"""Nearest windows and clips."""

import numpy as np
import pytest

from kernels.search.aligned import COPY_M, Alignment
from kernels.search.discriminant import unit
from kernels.search.nearest import distances, nearest_clips, propose, steer


@pytest.fixture
def catalogue(rng):
    """Ten clips of three windows each."""
    return unit(rng.normal(size=(30, 16))).astype(np.float32), np.arange(0, 30, 3)


def test_distances_are_euclidean(catalogue):
    vector, _ = catalogue
    there = np.linalg.norm(vector[:4, None].astype(float) - vector[None], axis=-1)
    np.testing.assert_allclose(distances(vector, vector[:4]), there, atol=5e-4)
    assert distances(vector, vector[:0]).shape == (0, 30)


def test_brute_force_is_the_specification(catalogue, rng):
    vector, start = catalogue
    query = unit(rng.normal(size=(4, 16))).astype(np.float32)
    apart = np.linalg.norm(query[:, None].astype(float) - vector[None], axis=-1).reshape(4, 10, 3)
    score = apart.min(axis=2).mean(axis=0)
    hits = nearest_clips(vector, start, query, k=10)
    assert [h.clip for h in hits] == np.argsort(score).tolist()
    np.testing.assert_allclose([h.distance for h in hits], np.sort(score))
    for hit in hits:
        assert apart[hit.query_row, hit.clip, hit.row - 3 * hit.clip] == apart[:, hit.clip].min()


def test_itself_is_at_distance_nothing(catalogue):
    vector, start = catalogue
    hits = nearest_clips(vector, start, vector[6:9], k=1)
    assert (hits[0].clip, hits[0].distance) == (2, 0.0)


def test_what_is_not_allowed_is_not_found(catalogue):
    vector, start = catalogue
    is_allowed = np.zeros(30, bool)
    is_allowed[[4, 20]] = True
    hits = nearest_clips(vector, start, vector[:1], k=5, is_allowed=is_allowed)
    assert sorted((h.clip, h.row) for h in hits) == [(1, 4), (6, 20)]
    assert nearest_clips(vector, start, vector[:1], k=5, is_allowed=np.zeros(30, bool)) == []
    assert nearest_clips(vector[:0], start[:0], vector[:1], k=5) == []


def test_good_candidates_give_the_exact_answer(catalogue, rng):
    vector, start = catalogue
    query = unit(rng.normal(size=(2, 16))).astype(np.float32)
    exact = nearest_clips(vector, start, query, k=3)

    def candidates(asked, n):
        return np.unique([h.row for q in asked for h in nearest_clips(vector, start, q[None], k=n)])

    assert nearest_clips(vector, start, query, k=3, candidates=candidates) == exact


def test_liked_and_unliked_motions_pull_and_push(catalogue):
    vector, _ = catalogue
    query, like, unlike = vector[:1], vector[5:6], vector[9:10]
    moved = steer(query, like, unlike)
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), 1, atol=1e-6)
    assert moved[0] @ like[0] > query[0] @ like[0]
    assert moved[0] @ unlike[0] < query[0] @ unlike[0]
    np.testing.assert_allclose(steer(query[:0], like, unlike[:0]), like, atol=1e-6)
    np.testing.assert_allclose(steer(query, like[:0], unlike[:0]), query, atol=1e-6)


def test_the_near_have_the_say():
    distance = np.array([[0.1, 0.1, 0.5, 0.9], [0.9, 0.8, 0.1, 0.7]])
    first, second = propose(distance, np.array([4, 4, 7, 7]), n_neighbours=3)
    assert (first[0].label, first[0].nearest, first[0].distance) == (4, 0, 0.1)
    assert first[0].vote_ratio > 0.9
    assert [p.label for p in second] == [7, 4]
    assert sum(p.vote_ratio for p in second) == pytest.approx(1)
    assert propose(np.zeros((1, 0)), np.zeros(0, int)) == [[]]


def test_a_copy_comes_first_and_says_where_it_lies(catalogue):
    vector, start = catalogue
    plain = nearest_clips(vector, start, vector[:1], k=10)
    copy = plain[6].clip
    asked = []

    def copies(clips):
        asked.append(clips.tolist())
        return [Alignment(0.1 * COPY_M if c == copy else 1.0, 1.5, 3.5) for c in clips.tolist()]

    found = nearest_clips(vector, start, vector[:1], k=10, copies=copies)
    assert asked == [[h.clip for h in plain]]
    at = next(rank for rank, h in enumerate(found) if h.clip == copy)
    assert found[at].distance == pytest.approx(0.1 * plain[6].distance)
    assert (found[at].copied.start_s, found[at].copied.end_s) == (1.5, 3.5)
    rest = [(h.clip, h.distance) for h in found if h.clip != copy]
    assert rest == [(h.clip, h.distance) for h in plain if h.clip != copy]
    assert at == sum(h.distance < found[at].distance for h in plain)


def test_copies_are_looked_for_among_candidates_by_the_clips_own_numbers(catalogue):
    vector, start = catalogue
    far = Alignment(1.0, 0.0, 0.0)
    seen = []

    def copies(clips):
        seen.extend(clips.tolist())
        return [far] * len(clips)

    nearest_clips(vector, start, vector[:1], k=2, candidates=lambda query, n: np.array([6, 21]), copies=copies)
    assert sorted(seen) == [2, 7]


def test_of_clips_as_near_the_one_that_stands_first_comes_first(catalogue):
    vector, start = catalogue
    twice = np.concatenate([vector, vector])
    hits = nearest_clips(twice, np.concatenate([start, 30 + start]), vector[6:9], k=3)
    assert [h.clip for h in hits[:2]] == [2, 12]
    assert hits[0].distance == hits[1].distance == 0


def test_no_more_hits_than_wanted_and_one_a_clip(catalogue):
    vector, start = catalogue
    for k, n in ((0, 0), (1, 1), (4, 4), (99, 10)):
        hits = nearest_clips(vector, start, vector[:3], k=k)
        assert len(hits) == len({h.clip for h in hits}) == n


def test_of_a_long_query_sixteen_windows_from_its_first_to_its_last_count(catalogue):
    vector, start = catalogue
    query = np.repeat(vector[:1], 61, axis=0)  # every fourth window counts
    query[1::4], query[2::4], query[3::4] = vector[9], vector[9], vector[9]
    found = nearest_clips(vector, start, query, k=1)[0]
    assert (found.clip, found.distance) == (0, 0.0)
    query[60] = vector[9]
    last = nearest_clips(vector, start, query, k=1)[0]
    assert last.distance == pytest.approx(np.linalg.norm(vector[9] - vector[:3], axis=1).min() / 16, rel=1e-4)


def test_the_window_of_a_query_that_is_nearest_is_told_by_its_own_number(catalogue):
    vector, start = catalogue
    query = np.tile(vector[27:28], (40, 1))
    query[39] = vector[4]
    hit = next(h for h in nearest_clips(vector, start, query, k=10) if h.clip == 1)
    assert (hit.row, hit.query_row) == (4, 39)


def test_what_is_liked_counts_whole_and_what_is_not_by_half():
    query, like, unlike = (np.eye(3, dtype=np.float32)[i : i + 1] for i in range(3))
    np.testing.assert_allclose(steer(query, like, unlike), np.array([[1, 1, -0.5]]) / 1.5, atol=1e-6)
    two = np.concatenate([like, unlike])  # two wishes count as their mean
    np.testing.assert_allclose(steer(query, two, unlike[:0]), np.array([[1, 0.5, 0.5]]) / np.sqrt(1.5), atol=1e-6)
    assert steer(np.repeat(query, 3, axis=0), like, unlike[:0]).shape == (3, 3)


def test_wishes_that_cancel_point_nowhere():
    one = np.eye(2, dtype=np.float32)[:1]
    assert not steer(one, one[:0], 2 * one).any()


def test_a_vote_weighs_by_its_distance_beside_the_nearest():
    (found,) = propose(np.array([[0.2, 0.4, 0.4]]), np.array([1, 0, 0]))
    one, two = np.exp(-1.0), 2 * np.exp(-4.0)
    assert [(p.label, p.nearest, p.distance) for p in found] == [(1, 0, 0.2), (0, 1, 0.4)]
    assert [p.vote_ratio for p in found] == pytest.approx([one / (one + two), two / (one + two)])


def test_of_labels_with_as_many_votes_the_first_is_proposed_first_and_no_more_than_wanted():
    label = np.array([3, 1, 2, 0])
    (found,) = propose(np.full((1, 4), 0.5), label)
    assert [p.label for p in found] == [0, 1, 2]
    (one,) = propose(np.full((1, 4), 0.5), label, n_neighbours=3, n_proposals=1)
    assert [(p.label, p.vote_ratio) for p in one] == [(1, pytest.approx(1 / 3))]


def test_of_one_labels_clips_the_nearest_is_named():
    (found,) = propose(np.array([[0.3, 0.1, 0.2]]), np.array([5, 5, 5]))
    assert (found[0].nearest, found[0].distance, found[0].vote_ratio) == (1, 0.1, pytest.approx(1))
