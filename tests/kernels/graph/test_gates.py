"""What a way through the graph is worth: bars on a made-up catalogue that no change may fall below.

Forty clips at the pace of the song, each as lively as it likes, joined at random; a song strong and weak by turns.
"""

from dataclasses import replace

import numpy as np
import pytest

from kernels.graph.costs import PathCosts, intensity_price
from kernels.graph.path import find_path
from kernels.graph.structure import node_of_interval
from kernels.ranks import rank_correlation

BEAT_S = 0.5 * np.arange(65)


@pytest.fixture(scope="module")
def music():
    """How strong each of 64 music intervals is: eight beats weak, eight strong, none quite even."""
    return np.repeat([0.2, 0.9] * 4, 8) + np.random.default_rng(0).uniform(0, 0.1, 64)


@pytest.fixture
def catalogue(make_graph):
    rng = np.random.default_rng(1)
    beats = [0.5 * np.arange(17) for _ in range(40)]
    pairs = {(int(a), int(b)) for a, b in rng.integers(0, 40 * 17, (3000, 2)) if b not in (a, a + 1)}
    graph = make_graph(beats, [(a, b, float(rng.uniform(0.2, 1.5))) for a, b in sorted(pairs)], both_ways=False)
    speed = np.repeat(rng.uniform(0.1, 2.0, 40), 17) * rng.uniform(0.8, 1.2, 40 * 17)
    return replace(graph, speed=speed)


def danced(catalogue, music, *, weight, **costs):
    price = intensity_price(music, catalogue, weight=weight)
    return find_path(catalogue, BEAT_S, costs=PathCosts(**costs), starts="any", interval_price=price)


def strength(catalogue, music, path):
    return rank_correlation(catalogue.speed[node_of_interval(path)], music)


def test_strong_music_is_danced_with_much_movement(catalogue, music):
    assert strength(catalogue, music, danced(catalogue, music, weight=4.0)) > 0.6
    assert strength(catalogue, music, danced(catalogue, music, weight=0.0)) < 0.3


def test_few_phrases_are_cut_short(catalogue):
    """Where the music turns every two beats, following it would cut most phrases; a price on short stays does not."""
    restless = np.resize(np.repeat([0.2, 0.9], 2), 64)

    def stays(stay):
        path = danced(catalogue, restless, weight=12.0, stay=stay, stay_beats=8, seam=0.1, transition=0.5)
        return np.diff(path.beat_index[path.has_transition], prepend=0)  # the song's end cuts none short

    calm = stays(12.0)
    assert np.median(calm) >= 6
    assert (calm < 3).mean() < 0.1
    assert np.median(stays(0.0)) <= 4


def test_little_is_shown_twice(catalogue, music):
    for rounds, most in ((3, 8), (0, 64)):
        price = intensity_price(music, catalogue, weight=4.0)
        path = find_path(catalogue, BEAT_S, starts="any", interval_price=price, rounds=rounds)
        shown = np.bincount(node_of_interval(path))
        assert int(np.maximum(shown - 1, 0).sum()) <= most


def test_a_song_at_the_pace_of_the_clips_is_danced_at_their_pace(catalogue, music):
    path = danced(catalogue, music, weight=4.0)
    assert not path.is_outside.any()
    assert (np.abs(path.warp_ratio - 1) < 0.1).mean() >= 0.95
