"""Recordings for a path: on end where they can be, near their pace, and not the same over and over."""

import numpy as np
import pytest

from kernels.hmm.instances import Motions, choose, shortlist, warp_cost


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


def test_a_step_without_any_motion_is_refused():
    none = np.zeros(0, np.int64)
    with pytest.raises(ValueError, match="step 1: want at least one motion"):
        shortlist(motions(), [*fits([0]), none], [np.zeros(4), np.zeros(0)], seam=np.zeros(8))


def test_pace_costs():
    assert warp_cost(0.5, np.array([0.5]))[0] == 0
    assert warp_cost(0.55, np.array([0.5]))[0] == pytest.approx(1.0)
    assert warp_cost(0.6, np.array([0.5]))[0] > 5


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
