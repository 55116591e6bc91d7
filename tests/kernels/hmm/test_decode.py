"""The cheapest dance in recordings, against every dance there is."""

import numpy as np
import pytest

from kernels.hmm import decode as decoding
from kernels.hmm.decode import FAR, Chain, decode, decode_varied
from kernels.hmm.instances import Motions
from kernels.hmm.links import Links, link
from kernels.hmm.places import Places, place
from kernels.hmm.viterbi import InfeasibleSpansError, viterbi


def some_model(seed):
    rng = np.random.default_rng(seed)
    return np.log(rng.dirichlet(np.ones(2))), np.log(rng.dirichlet(np.ones(2), 2))


def every_dance(places, motions, links, log_initial, log_transition, price, crowded):
    """All dances and their costs."""
    into = {}
    for j in range(len(motions.state)):
        for e in range(links.first[j], links.first[j + 1]):
            into[links.source[e], j] = links.cost[e], links.is_seam[e]

    def go(at, last, cost, steps):
        if at >= places.n_intervals:
            yield cost, steps
            return
        for d, (fits, prices) in enumerate(places.at[at], start=1):
            for m, p in zip(fits.tolist(), prices.tolist(), strict=True):
                if last is None:
                    enter = -log_initial[motions.state[m]]
                else:
                    far = FAR - log_transition[motions.state[last], motions.state[m]] + crowded[at]
                    near, is_seam = into.get((last, m), (np.inf, False))
                    enter = min(far, near + crowded[at] * is_seam)
                yield from go(at + d, m, cost + enter + p + price[m], [*steps, (m, at, d)])

    return list(go(0, None, 0.0, []))


@pytest.mark.parametrize("seed", range(12))
def test_no_dance_is_cheaper(seed, some_motions, some_ends, places_of):
    motions = some_motions(length_s=0.25 if seed % 2 else 0.5)
    log_initial, log_transition = some_model(seed)
    places = places_of(motions, seed=seed)
    links = link(motions, some_ends(motions, seed), log_transition, seam_weight=1.0)
    rng = np.random.default_rng(seed)
    price, crowded = rng.uniform(0, 1, 6), rng.uniform(0, 2, 6) * (seed % 3 == 0)
    found, cost = decode(motions, links, places, log_initial, log_transition, price=price, crowded=crowded)
    dances = every_dance(places, motions, links, log_initial, log_transition, price, crowded)
    least = min(dances, key=lambda dance: dance[0])
    assert cost == pytest.approx(least[0])
    steps = list(zip(found.motion.tolist(), found.start.tolist(), found.length.tolist(), strict=True))
    assert min(abs(c - cost) for c, s in dances if s == steps) < 1e-9


def test_with_one_recording_a_state_and_free_seams_it_is_the_plain_model(monkeypatch):
    monkeypatch.setattr(decoding, "FAR", 0.0)
    motions = Motions(np.array([0, 1]), np.array([0, 1]), np.zeros(2), np.full(2, 0.5))
    log_initial, log_transition = some_model(3)
    log_music = np.log(np.random.default_rng(3).uniform(0.1, 1, (9, 2)))
    grid = 0.5 * np.arange(10)
    places = place(motions, grid, log_music, longest=1, is_beat=np.zeros(10, bool), accent=np.ones(2))
    none = Links(np.zeros(3, np.int64), np.zeros(0, np.int64), np.zeros(0), np.zeros(0, bool))
    zero = np.zeros(10)
    found, cost = decode(motions, none, places, log_initial, log_transition, price=np.zeros(2), crowded=zero)
    path, log_p = viterbi(log_initial, log_transition, log_music)
    assert motions.state[found.motion].tolist() == path.tolist()
    assert cost == pytest.approx(-log_p)


def test_where_nothing_fits_it_is_told_from_where(some_motions, some_ends, places_of):
    motions = some_motions()
    places = places_of(motions)
    none = np.zeros(0, np.int64)
    empty = [(none, np.zeros(0))] * 2
    log_initial, log_transition = some_model(0)
    links = link(motions, some_ends(motions), log_transition, seam_weight=1.0)
    with pytest.raises(InfeasibleSpansError) as told:
        decode(
            motions,
            links,
            Places([places.at[0], places.at[1], empty, empty]),
            log_initial,
            log_transition,
            price=np.zeros(6),
            crowded=np.zeros(6),
        )
    assert told.value.interval == 2


def test_showing_the_same_again_is_priced(monkeypatch, some_motions):
    """Two clips that may be danced on end, the second a little dearer; the song has room for both."""
    motions = some_motions(n_clips=2, n_each=2)
    motions = Motions(motions.clip_index, np.zeros(4, np.int64), motions.start_s, motions.end_s)
    zero = np.zeros((1, 1))
    places = place(
        motions, 0.5 * np.arange(5), np.zeros((4, 1)), longest=1, is_beat=np.zeros(5, bool), accent=np.ones(4)
    )
    #             into motion 0: from 1, 3; into 1: from 0; into 2: from 1, 3; into 3: from 2
    links = Links(
        np.array([0, 2, 3, 5, 6]),
        np.array([1, 3, 0, 1, 3, 2]),
        np.array([1.0, 1.0, 0.0, 1.0, 1.0, 0.0]),
        np.array([True, True, False, True, True, False]),
    )
    monkeypatch.setattr(decoding, "WINDOW", 1)
    asked = {"price": np.array([0.0, 0.0, 0.2, 0.2]), "crowded": np.zeros(5)}
    plain, cost = decode(motions, links, places, np.zeros(1), zero, **asked)
    varied = decode_varied(motions, links, places, np.zeros(1), zero, repetition_weight=2.0, **asked)
    assert plain.motion.tolist() == [0, 1, 0, 1]
    assert cost == pytest.approx(1.0)
    assert sorted(varied.motion.tolist()) == [0, 1, 2, 3]
    free = decode_varied(motions, links, places, np.zeros(1), zero, repetition_weight=0.0, **asked)
    assert free.motion.tolist() == [0, 1, 0, 1]
    assert free.start.tolist() == [0, 1, 2, 3]


def test_a_motion_shown_very_often_costs_no_more(monkeypatch):
    """A repeated motion is left for another only while its price still rises."""
    monkeypatch.setattr(decoding, "WINDOW", 1)
    monkeypatch.setattr(decoding, "LOOK_AHEAD", 0)
    motions = Motions(np.arange(2), np.zeros(2, np.int64), np.zeros(2), np.full(2, 0.5))
    n = 12
    places = place(
        motions, 0.5 * np.arange(n + 1), np.zeros((n, 1)), longest=1, is_beat=np.zeros(n + 1, bool), accent=np.ones(2)
    )
    none = Links(np.zeros(3, np.int64), np.zeros(0, np.int64), np.zeros(0), np.zeros(0, bool))

    def shown(dearer):
        found = decode_varied(
            motions,
            none,
            places,
            np.zeros(1),
            np.zeros((1, 1)),
            price=np.array([0.0, dearer]),
            crowded=np.zeros(n + 1),
            repetition_weight=1.0,
        )
        return found.motion.tolist()

    assert shown(0.9)[:5] == [0, 0, 0, 0, 1]
    assert shown(1.1) == [0] * n  # four showings are the most that is priced


def test_a_dance_in_recordings_is_one_in_basic_motions(some_motions):
    spans = Chain(np.array([1, 2, 5]), np.array([0, 2, 3]), np.array([2, 1, 2])).spans(some_motions())
    assert (spans.state.tolist(), spans.start.tolist(), spans.length.tolist()) == ([1, 0, 1], [0, 2, 3], [2, 1, 2])
