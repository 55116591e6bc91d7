"""Recordings for a path: on end where they can be, near their pace, and not the same over and over."""

import numpy as np
import pytest

from kernels.hmm.instances import HARD_COST, PACE, Motions, choose, motions_of_clips, shortlist
from kernels.warp import warp_cost


def motions():
    """Two clips of four motions each, states 0 1 0 1, half a second; the second clip is slower."""
    start = np.concatenate([0.5 * np.arange(4), 0.62 * np.arange(4)])
    end = np.concatenate([0.5 * np.arange(1, 5), 0.62 * np.arange(1, 5)])
    return Motions(np.repeat([0, 1], 4), np.array([0, 1, 0, 1] * 2), start, end)


def test_what_goes_on_is_known():
    assert motions().following.tolist() == [1, 2, 3, -1, 5, 6, 7, -1]
    none = np.zeros(0, np.int64)
    assert Motions(none, none, none.astype(float), none.astype(float)).following.tolist() == []


def fits(states):
    return [np.flatnonzero(motions().state == s) for s in states]


def test_a_run_that_can_be_danced_on_end_is_on_the_list():
    here = fits([0, 1, 0, 1])
    found = shortlist(motions(), here, [np.zeros(len(f)) for f in here], seam=np.zeros(8), most=2)
    assert 0 in found[0]
    assert 3 in found[3]
    assert all((motions().state[f] == s).all() for f, s in zip(found, [0, 1, 0, 1], strict=True))


def test_what_is_cheap_by_itself_is_on_the_list_and_what_is_to_be_kept():
    alone = Motions(np.arange(4), np.zeros(4, np.int64), np.zeros(4), np.full(4, 0.5))
    here, own, seam = [np.arange(4)], [np.array([0.0, 2.0, 1.0, 3.0])], np.array([5.0, 0.0, 0.0, 0.0])
    assert shortlist(alone, here, own, seam=seam, most=2)[0].tolist() == [1, 2]
    assert shortlist(alone, here, own, seam=seam, keep=np.array([0]), most=3)[0].tolist() == [0, 1, 2]


def test_a_motion_that_nothing_goes_before_follows_no_other():
    """Motion 1 follows 0; 2 and 3 begin their clips and are cheaper, and 4, the last of all, may be danced before."""
    clip, start_s = np.array([0, 0, 1, 2, 3]), np.array([0.0, 0.5, 0.0, 0.0, 0.0])
    some = Motions(clip, np.zeros(5, np.int64), start_s, start_s + 0.5)
    here, own = [np.array([0, 4]), np.array([1, 2, 3])], [np.zeros(2), np.array([10.0, 0.0, 1.0])]
    assert shortlist(some, here, own, seam=np.zeros(5), most=2)[1].tolist() == [1, 2]


def test_a_step_without_any_motion_is_refused():
    none = np.zeros(0, np.int64)
    with pytest.raises(ValueError, match="step 1: want at least one motion"):
        shortlist(motions(), [*fits([0]), none], [np.zeros(4), np.zeros(0)], seam=np.zeros(8))


def test_pace_costs():
    assert warp_cost(0.5 / np.array([0.5]), PACE)[0] == 0
    assert warp_cost(0.55 / np.array([0.5]), PACE)[0] == pytest.approx(1.0)
    assert warp_cost(0.6 / np.array([0.5]), PACE)[0] > 5


def test_the_cheapest_sequence_without_repetition_priced():
    candidates = [np.array([0, 4]), np.array([1, 5])]
    choice, again, total = choose(
        candidates, [np.array([0.2, 0.0]), np.zeros(2)], [np.array([[0.0, 1.0], [1.0, 1.0]])], repetition_weight=0.0
    )
    assert choice.tolist() == [0, 0]
    assert total == pytest.approx(0.2)
    assert again.tolist() == [0, 0]


def test_the_same_recording_is_not_shown_over_and_over():
    candidates = [np.array([0, 2])] * 6
    own = [np.array([0.0, 0.1])] * 6
    between = [np.zeros((2, 2))] * 5
    choice, again, total = choose(candidates, own, between)
    assert set(choice.tolist()) == {0, 1}
    assert total == pytest.approx(float(again.sum()) + 0.1 * (choice == 1).sum())
    assert choose([np.array([3])] * 3, [np.zeros(1)] * 3, [np.zeros((1, 1))] * 2)[1].tolist() == [0, 1, 2]


def test_only_a_motion_that_starts_where_one_ends_in_its_own_clip_goes_on():
    start, end = np.array([0.0, 0.5, 1.1, 1.6]), np.array([0.5, 1.0, 1.6, 2.0])
    found = Motions(np.array([0, 0, 0, 1]), np.zeros(4, np.int64), start, end).following
    assert found.tolist() == [1, -1, -1, -1]  # a gap after the second, another clip after the third


def test_a_pace_is_easy_up_to_its_bounds_and_beyond_them_costs_more():
    length = np.ones(1)
    for span in (0.9, 1.1):
        assert warp_cost(span / length, PACE)[0] == pytest.approx((np.log(span) / np.log(1.1)) ** 2)
    for span in (0.899, 1.101):
        assert warp_cost(span / length, PACE)[0] == pytest.approx((np.log(span) / np.log(1.1)) ** 2 + HARD_COST)


def test_a_motion_shown_very_often_costs_no_more():
    candidates = [np.array([3])] * 7
    _, again, total = choose(candidates, [np.zeros(1)] * 7, [np.zeros((1, 1))] * 6, repetition_weight=0.5)
    assert again.tolist() == [0, 0.5, 1.0, 1.5, 2.0, 2.0, 2.0]
    assert total == 9


def test_a_run_is_told_from_what_comes_before_too():
    """Motion 1 goes on from motion 0; 2 and 3, though cheaper, follow nothing that the step before may show."""
    start = np.array([0.0, 0.5, 0.0, 0.0, 0.0])
    some = Motions(np.array([0, 0, 1, 2, 3]), np.zeros(5, np.int64), start, start + 0.5)
    here = [np.array([0, 4]), np.array([1, 2, 3])]
    found = shortlist(some, here, [np.zeros(2), np.array([9.0, 0.0, 1.0])], seam=np.zeros(5), most=2)
    assert found[1].tolist() == [1, 2]


def test_runs_longer_than_the_longest_that_counts_are_alike():
    start = 0.5 * np.arange(40)
    two = Motions(np.repeat([0, 1], [30, 10]), np.zeros(40, np.int64), start, start + 0.5)
    here = [np.array([k, k + 5]) for k in range(20)]  # from motion 0 and from motion 5 of one clip
    found = shortlist(two, here, [np.array([1.0, 0.0])] * 20, seam=np.zeros(40), most=2)
    assert all(len(step) == 2 for step in found)
    one = shortlist(two, [np.append(h, 39) for h in here], [np.array([2.0, 1.0, 0.0])] * 20, seam=np.zeros(40), most=2)
    assert one[0].tolist() == [5, 39]  # of the two runs the cheaper, and what is cheapest by itself


def random_song(seed, n_steps=6, n=4):
    rng = np.random.default_rng(seed)
    candidates = [np.sort(rng.choice(6, n, replace=False)) for _ in range(n_steps)]
    between = [rng.random((n, n)) for _ in range(n_steps - 1)]
    return candidates, [rng.random(n) for _ in range(n_steps)], between


def total_of(choice, candidates, own, between, weight):
    shown = [int(c[i]) for c, i in zip(candidates, choice, strict=True)]
    again = sum(min(shown[:i].count(m), 4) for i, m in enumerate(shown))
    seams = sum(b[i, j] for b, i, j in zip(between, choice, choice[1:], strict=False))
    return sum(o[i] for o, i in zip(own, choice, strict=True)) + seams + weight * again


@pytest.mark.parametrize("seed", range(8))
def test_no_single_step_exchanged_betters_what_was_chosen(seed):
    candidates, own, between = random_song(seed)
    choice, again, total = choose(candidates, own, between, repetition_weight=0.8)
    assert total == pytest.approx(total_of(choice, candidates, own, between, 0.8))
    assert again.sum() == pytest.approx(total - total_of(choice, candidates, own, between, 0.0))
    for step in range(len(own)):
        for other in range(4):
            changed = choice.copy()
            changed[step] = other
            assert total_of(changed, candidates, own, between, 0.8) >= total - 1e-9


def test_prices_rise_until_a_sequence_leaves_what_it_shows_again():
    """Pairs that must go together: no single exchange leads from one to the other."""
    pair = [np.array([0, 2]), np.array([1, 3])]
    together, free = np.array([[0.0, 9.0], [9.0, 0.0]]), np.zeros((2, 2))
    own = [np.array([0.0, dearer]) for dearer in (0.6, 0.6, 0.9, 0.9)]
    choice, again, total = choose([*pair, *pair], own, [together, free, together])
    assert choice.tolist() == [1, 1, 0, 0]
    assert again.sum() == 0
    assert total == pytest.approx(1.2)


def test_motions_of_clips_stand_clip_after_clip():
    whole = motions()
    each = [[column[whole.clip_index == c] for c in (0, 1)] for column in (whole.state, whole.start_s, whole.end_s)]
    each[0].insert(1, np.zeros(0, np.int64))
    each[1].insert(1, np.zeros(0))
    each[2].insert(1, np.zeros(0))
    found = motions_of_clips(*each)
    assert found.clip_index.tolist() == [0] * 4 + [2] * 4
    for name in ("state", "start_s", "end_s"):
        np.testing.assert_array_equal(getattr(found, name), getattr(whole, name))
