"""Recorded motions, their ends and their places, made up."""

import numpy as np
import pytest

from kernels.hmm.instances import Motions
from kernels.hmm.places import place
from kernels.hmm.seams import Ends


@pytest.fixture
def some_motions():
    def made(n_clips=2, n_each=3, length_s=0.5):
        start = np.tile(length_s * np.arange(n_each), n_clips)
        state = np.arange(n_clips * n_each) % 2
        return Motions(np.repeat(np.arange(n_clips), n_each), state, start, start + length_s)

    return made


@pytest.fixture
def some_ends():
    def made(motions, seed=0):
        n = len(motions.state)
        rng = np.random.default_rng(seed)
        zero = np.zeros(n)
        start, end = rng.normal(0, 0.1, (n, 4)), rng.normal(0, 0.1, (n, 4))
        one = np.ones(n)
        return Ends(start, end, np.zeros((n, 4, 5, 3)), np.zeros((n, 4, 5, 3)), zero, zero, zero, one * 1e9, zero, zero)

    return made


@pytest.fixture
def places_of():
    def made(motions, n=4, longest=2, seed=0):
        rng = np.random.default_rng(seed)
        grid = 0.25 * np.arange(n + longest)
        log_music = np.log(rng.uniform(0.1, 1, (n, 2)))
        return place(
            motions,
            grid,
            log_music,
            longest=longest,
            is_beat=np.arange(len(grid)) % 2 == 0,
            accent=rng.uniform(0, 1, len(motions.state)),
        )

    return made
