"""The sequence: the program against trying everything, connectivity, repetition, ties."""

import itertools

import numpy as np
import pytest

from kernels.matching.match_sequence import (
    Candidates,
    Joint,
    at_first_steps,
    choose,
    continues,
    overlaps,
    to_choreography,
    viterbi,
)


def candidates(costs, *, clip=None, start=None, length=2.0):
    n = len(costs)
    start_s = np.zeros(n) if start is None else np.array(start, float)
    return Candidates(
        np.arange(n) if clip is None else np.array(clip), start_s, start_s + length, np.array(costs, float)
    )


def joint(cost, connected=None):
    cost = np.array(cost, float)
    return Joint(cost, np.ones(cost.shape, bool) if connected is None else np.array(connected, bool))


def random_song(seed, n_segments=4, n=3):
    rng = np.random.default_rng(seed)
    songs = [candidates(rng.random(n), clip=rng.integers(0, 4, n), start=rng.random(n) * 5) for _ in range(n_segments)]
    joints = [Joint(rng.random((n, n)), rng.random((n, n)) < 0.5) for _ in range(n_segments - 1)]
    return songs, joints


def every(songs):
    return itertools.product(*(range(len(c.cost)) for c in songs))


@pytest.mark.parametrize("seed", range(5))
def test_viterbi_finds_what_trying_everything_finds(seed):
    songs, joints = random_song(seed)
    own, between = [c.cost for c in songs], [j.cost for j in joints]

    def total(way):
        return sum(c[i] for c, i in zip(own, way, strict=True)) + sum(
            b[i, j] for b, i, j in zip(between, way, way[1:], strict=False)
        )

    assert total(viterbi(own, between)) == pytest.approx(min(total(w) for w in every(songs)))


@pytest.mark.parametrize("seed", range(8))
def test_connectivity_binds_before_anything_else(seed):
    songs, joints = random_song(seed)
    found = choose(songs, joints, repetition_weight=0)

    def missing(way):
        return sum(
            not (j.is_connected | continues(a, b))[x, y]
            for j, a, b, x, y in zip(joints, songs, songs[1:], way, way[1:], strict=False)
        )

    assert (~found.is_connected).sum() == missing(found.choice) == min(missing(w) for w in every(songs))


def test_showing_again_what_was_just_shown_is_no_connection():
    songs = [candidates([0]), candidates([0, 0], clip=[0, 1], start=[0.2, 0])]
    found = choose(songs, [joint([[0, 9]], [[True, True]])], repetition_weight=0)
    np.testing.assert_array_equal(found.choice, [0, 1])
    found = choose(songs, [joint([[0, 9]], [[True, False]])], repetition_weight=0)
    assert not found.is_connected[1]


def test_where_nothing_connects_the_nearest_poses_are_taken_and_said():
    songs = [candidates([0, 0]), candidates([0, 0], clip=[2, 3])]
    found = choose(songs, [joint([[3, 1], [2, 4]], np.zeros((2, 2)))])
    np.testing.assert_array_equal(found.choice, [0, 1])
    np.testing.assert_array_equal(found.is_connected, [True, False])
    assert found.total_cost == 1


def test_equal_costs_go_to_the_first():
    songs = [candidates([1, 1, 1]), candidates([1, 1, 1], clip=[5, 6, 7])]
    np.testing.assert_array_equal(choose(songs, [joint(np.zeros((3, 3)))]).choice, [0, 0])


def test_showing_the_same_again_costs():
    songs = [candidates([0, 0.3]), candidates([0], clip=[7]), candidates([0, 0.3])]
    joints = [joint(np.ones((2, 1))), joint(np.ones((1, 2)))]
    again = choose(songs, joints, repetition_weight=0)
    spread = choose(songs, joints, repetition_weight=1.0)
    np.testing.assert_array_equal(again.choice, [0, 0, 0])
    assert again.repetition_cost.sum() == 0
    assert sorted(spread.choice) == [0, 0, 1]
    assert spread.repetition_cost.sum() == 0
    assert choose(songs, joints, repetition_weight=0.1).repetition_cost.sum() == pytest.approx(0.1)


@pytest.mark.parametrize("seed", range(6))
def test_spreading_repetition_never_costs_more_than_not(seed):
    songs, joints = random_song(seed, n_segments=6)
    found = choose(songs, joints, repetition_weight=1.0)
    plain = choose(songs, joints, repetition_weight=1.0, rounds=0)
    unconnected = 100.0
    assert (
        found.total_cost + unconnected * (~found.is_connected).sum()
        <= plain.total_cost + unconnected * (~plain.is_connected).sum() + 1e-9
    )


def test_a_piece_that_goes_on_has_no_seam():
    songs = [candidates([0], clip=[4], start=[1.0]), candidates([0], clip=[4], start=[3.002])]
    found = choose(songs, [joint([[5]], [[False]])])
    assert found.total_cost == 0
    assert not found.has_seam.any()
    assert found.is_connected.all()
    steps, segment = to_choreography(
        songs,
        found,
        start_s=np.array([0.0, 2.0]),
        end_s=np.array([2.0, 4.0]),
        beat_s=np.arange(0, 5, 1.0),
        clip_ids=("a", "b", "c", "d", "e"),
        blend_s=0.4,
    )
    assert steps.clip_id == ("e",) * 4
    np.testing.assert_array_equal(segment, [0, 0, 1, 1])
    np.testing.assert_array_equal(steps.clip_start_s[1:], steps.clip_end_s[:-1])
    assert not steps.has_seam.any()


def test_steps_end_on_beats_at_the_pace_of_the_scale():
    songs = [candidates([0], start=[1.0], length=3.6), candidates([0], clip=[1], start=[0.5], length=2.2)]
    found = choose(songs, [joint([[0.0]])])
    steps, segment = to_choreography(
        songs,
        found,
        start_s=np.array([0.0, 4.0]),
        end_s=np.array([4.0, 6.0]),
        beat_s=np.arange(0, 7, 1.0),
        clip_ids=("a", "b"),
        blend_s=0.4,
    )
    np.testing.assert_allclose(steps.warp_ratio, [1 / 0.9] * 4 + [1 / 1.1] * 2)
    np.testing.assert_allclose(steps.song_start_s, np.arange(6))
    np.testing.assert_array_equal(steps.has_seam, [0, 0, 0, 0, 1, 0])
    np.testing.assert_array_equal(steps.blend_s > 0, steps.has_seam)
    np.testing.assert_array_equal(segment, [0, 0, 0, 0, 1, 1])


def test_overlap_is_a_share_of_the_piece_shown():
    pieces = candidates([0, 0, 0], clip=[1, 1, 2], start=[0.0, 1.5, 0.0])
    np.testing.assert_allclose(overlaps(pieces, 1, 1.0, 3.0), [0.5, 0.75, 0])


def test_prices_of_what_is_shown_again_rise_until_a_sequence_leaves_it():
    # Two pairs that must go together, each of clip 0 or of clip 1; leaving clip 0 costs more than half a repetition.
    def pair(other_cost):
        return [
            candidates([0, other_cost], clip=[0, 1], start=[0, 0]),
            candidates([0, other_cost], clip=[0, 1], start=[3, 3]),
        ]

    together, free = joint([[0, 9], [9, 0]]), joint(np.zeros((2, 2)))
    found = choose([*pair(0.7), *pair(1.1)], [together, free, together], unconnected_cost=0.0)
    np.testing.assert_array_equal(found.choice, [1, 1, 0, 0])
    assert found.total_cost == pytest.approx(1.4)


def total_by_hand(songs, joints, way, weight):
    """What a way costs where connectivity does not bind: own costs, seams, and what earlier pieces show of each."""
    cost = sum(song.cost[i] for song, i in zip(songs, way, strict=True))
    for j, a, b, x, y in zip(joints, songs, songs[1:], way, way[1:], strict=False):
        cost += 0 if continues(a, b)[x, y] else j.cost[x, y]
    for later, i in enumerate(way):
        piece = songs[later]
        for earlier in range(later):
            where = (int(piece.clip_index[i]), float(piece.start_s[i]), float(piece.end_s[i]))
            cost += weight * overlaps(songs[earlier], *where)[way[earlier]]
    return cost


@pytest.mark.parametrize("seed", range(12))
def test_no_single_change_betters_what_was_chosen(seed):
    songs, joints = random_song(seed, n_segments=7, n=4)
    found = choose(songs, joints, unconnected_cost=0.0, repetition_weight=2.0)
    assert found.total_cost == pytest.approx(total_by_hand(songs, joints, found.choice, 2.0))
    for i, song in enumerate(songs):
        for other in range(len(song.cost)):
            changed = found.choice.copy()
            changed[i] = other
            assert total_by_hand(songs, joints, changed, 2.0) >= found.total_cost - 1e-9


@pytest.mark.parametrize("turned", [False, True])
def test_a_single_change_counts_the_seams_on_both_sides(turned):
    # The piece shown again may give way to clip 2, or to clip 3, which is cheaper but for its seam.
    songs = [candidates([0]), candidates([0], clip=[7]), candidates([0, 0.6, 0.55], clip=[0, 2, 3])]
    joints = [joint([[0]]), joint([[0, 0, 5]])]
    if turned:
        songs, joints = songs[::-1], [joint(joints[1].cost.T), joints[0]]
    found = choose(songs, joints, rounds=1)
    assert found.choice[0 if turned else 2] == 1


def test_connectivity_binds_before_repetition_however_dear():
    songs = [candidates([0]), candidates([0], clip=[7]), candidates([0, 0], clip=[0, 1])]
    joints = [joint([[0]]), joint([[0, 0]], [[True, False]])]
    found = choose(songs, joints, repetition_weight=50.0)
    np.testing.assert_array_equal(found.choice, [0, 0, 0])
    assert found.total_cost == found.repetition_cost.sum() == 50


def test_a_piece_that_shows_just_half_again_still_connects():
    before, just_half, more = candidates([0]), candidates([0], clip=[0], start=[1.0]), candidates([0], start=[0.98])
    assert choose([before, just_half], [joint([[1]])]).is_connected[1]
    assert not choose([before, more], [joint([[1]])]).is_connected[1]


def test_a_piece_goes_on_within_half_a_frame_and_in_its_own_clip_only():
    before = candidates([0], clip=[4], start=[1.0])
    after = candidates(np.zeros(5), clip=[4, 4, 4, 4, 5], start=[3.004, 2.996, 3.0045, 2.9955, 3.0])
    np.testing.assert_array_equal(continues(before, after), [[True, True, False, False, False]])


def test_a_piece_ends_where_its_candidate_does_to_the_bit():
    rng = np.random.default_rng(3)
    edge = np.cumsum(np.append(0.1, rng.uniform(1.0, 3.0, 40)))
    songs = [
        candidates([0], clip=[i], start=[s], length=n)
        for i, (s, n) in enumerate(rng.uniform([0, 1], [0.01, 3], (40, 2)))
    ]
    found = choose(songs, [joint([[0]])] * 39)
    steps, segment = to_choreography(
        songs,
        found,
        start_s=edge[:-1],
        end_s=edge[1:],
        beat_s=np.arange(0, 99, 0.5),
        clip_ids=tuple(map(str, range(40))),
        blend_s=0.4,
    )
    last = np.flatnonzero(np.append(np.diff(segment), 1))
    np.testing.assert_array_equal(steps.clip_end_s[last], [song.end_s[0] for song in songs])


def test_beats_within_a_tenth_of_a_second_of_a_segments_ends_cut_no_step():
    found = choose([candidates([0])], [])
    steps, _ = to_choreography(
        [candidates([0])],
        found,
        start_s=np.array([1.0]),
        end_s=np.array([3.0]),
        beat_s=np.array([1.09, 1.11, 2.0, 2.89, 2.91]),
        clip_ids=("a",),
        blend_s=0.4,
    )
    np.testing.assert_array_equal(steps.song_start_s, [1.0, 1.11, 2.0, 2.89])


def test_of_equal_sums_the_last_candidate_that_comes_first_decides():
    # 0-1 and 1-0 cost the same: the way whose last candidate comes first is taken.
    own, between = [np.zeros(2), np.zeros(2)], [np.array([[1.0, 0.0], [0.0, 1.0]])]
    np.testing.assert_array_equal(viterbi(own, between), [1, 0])


def test_errors():
    with pytest.raises(ValueError, match="segments"):
        choose([], [])
    with pytest.raises(ValueError, match="segments"):
        choose([candidates([])], [])
    with pytest.raises(ValueError, match="joints"):
        choose([candidates([1])], [joint([[1]])])


def test_the_first_step_of_a_span_pays_for_it():
    np.testing.assert_array_equal(at_first_steps(np.array([1.0, 2.0, 3.0]), np.array([0, 0, 2, 2, 2])), [1, 0, 3, 0, 0])
    np.testing.assert_array_equal(at_first_steps(np.array([1.0, 2.0]), np.array([1])), [2])


def test_a_choice_that_shows_less_of_the_one_before_is_taken_only_where_the_whole_is_cheaper():
    """Of a long piece half was shown before, of a short one all of it, though it shows less of what was before."""
    before = candidates([0.0], clip=[0], length=4.0)
    after = Candidates(np.zeros(2, np.int64), np.zeros(2), np.array([8.0, 2.0]), np.array([0.0, 0.1]))
    found = choose([before, after], [joint(np.zeros((1, 2)))], unconnected_cost=0.0)
    assert found.choice.tolist() == [0, 0]
    assert found.total_cost == pytest.approx(0.5)
