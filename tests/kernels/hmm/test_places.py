"""Where recorded motions may be danced, and what that costs."""

import numpy as np
import pytest

from kernels.hmm.places import (
    CROWDED,
    MISSED_BEAT,
    MotionWish,
    Places,
    crowded_cost,
    finishing,
    keep_wishes,
    missed_beats,
)
from kernels.hmm.viterbi import InfeasibleSpansError


def test_beats_passed_and_beats_ended_on():
    beat = np.array([True, False, True, False, True])
    found = missed_beats(beat, np.array([0, 0, 0]), np.array([1, 2, 4]), np.array([0.0, 0.25, 1.0]))
    np.testing.assert_allclose(found, [0.0, 0.75 * MISSED_BEAT, MISSED_BEAT])


def test_wishes_close_or_price_what_they_do_not_admit(some_motions, places_of):
    motions = some_motions()
    places = places_of(motions)
    wish = MotionWish(1, 3, np.arange(6) < 3)
    kept = keep_wishes(places, [wish])
    assert set(kept.at[1][1][0].tolist()) == {0, 1, 2}
    assert set(kept.at[3][1][0].tolist()) == set(range(6))
    soft = keep_wishes(places, [wish], price=0.5)
    np.testing.assert_allclose(soft.at[1][1][1] - places.at[1][1][1], np.where(np.arange(6) < 3, 0.0, 1.0))


def test_ends_of_the_song_are_crowded():
    np.testing.assert_allclose(
        crowded_cost(np.array([-0.1, 0.1, 1.0, 1.9, 2.1]), 2.0, blend_s=0.4),
        [CROWDED, CROWDED / 2, 0, CROWDED / 2, CROWDED],
    )


def test_what_nothing_can_follow_is_taken_out():
    one, none = (np.array([0]), np.zeros(1)), (np.zeros(0, np.int64), np.zeros(0))
    places = Places([[one, one], [none, none], [one, none]])
    kept = finishing(places)
    assert [[len(fits) for fits, _ in row] for row in kept.at] == [[0, 1], [0, 0], [1, 0]]
    with pytest.raises(InfeasibleSpansError) as told:
        finishing(Places([[one, one], [none, none], [none, none]]))
    assert told.value.interval == 2
