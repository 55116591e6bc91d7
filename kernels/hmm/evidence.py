"""Does the music tell anything of the motions? Measured on parts of the performances that were not learned from.

A motion is predicted from the one before it alone (the bigram), and with the music that sounds while it is danced. The
same is tried with music that is not its own: stretches of it in another order, each turned round itself. Where the
motion's own music predicts no better, it adds nothing, and the user is told.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kernels.hmm.model import Model, Performed, Smoothing, folds, learn, without
from kernels.types import Float, Int

N_SHUFFLES = 199
"""By convention one less than a round number: the least chance there is, counting the music itself, is 0.005."""

BLOCK = 8
"""Motions of one stretch: what changes more slowly (a verse, a chorus) is kept together when music is shuffled. Chosen
by hand."""

SURE_P, LEAST_GAIN = 0.01, 0.01
"""Chance below which, by convention, and natural log units a motion from which, chosen by hand, music is said to add
something."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """How well motions are predicted, mean log probabilities a motion held out.

    Parameters
    ----------
    with_music, bigram, shuffled : (P,) float64, by performance; NaN where nothing could be held out
    n_motions : (P,) int64, motions predicted
    p : float, 0 to 1
        Share of shuffles that predict at least as well over all performances, counting the music itself; 1 where
        nothing could be held out.
    """

    with_music: Float
    bigram: Float
    shuffled: Float
    n_motions: Int
    p: float

    @property
    def gain(self) -> float:
        """What the music adds over the bigram, natural log units a motion; 0 where nothing could be held out."""
        known = self.n_motions > 0
        if not known.any():
            return 0.0
        weight = self.n_motions[known] / self.n_motions[known].sum()
        return float(((self.with_music - self.bigram)[known] * weight).sum())

    @property
    def music_adds(self) -> bool:
        """Whether the music predicts motions, beyond chance and beyond the motion before."""
        return self.gain >= LEAST_GAIN and self.p < SURE_P


def shuffled_order(n: int, rng: np.random.Generator) -> Int:
    """Put n places into another order: blocks exchanged, each turned round itself by its own random amount."""
    blocks = np.split(np.arange(n), np.arange(BLOCK, n, BLOCK)) if n else []
    turned = [np.roll(block, int(rng.integers(len(block)))) for block in blocks]
    return np.concatenate([turned[i] for i in rng.permutation(len(turned))]) if turned else np.zeros(0, np.int64)


def measure(
    performances: Sequence[Performed],
    n_states: int,
    n_symbols: Sequence[int],
    *,
    smoothing: Smoothing,
    weight: Sequence[float] = (),
    seed: int = 0,
    n_shuffles: int = N_SHUFFLES,
) -> Evidence:
    """Predict held-out motions with their own music, without music, and with shuffled music.

    Parameters
    ----------
    performances : P of them
    n_states : int, K
    n_symbols : int, M, of each stream
    smoothing : Smoothing
    weight : float, >= 0, of each stream; 1 throughout where empty
    seed : int, of the shuffles
    n_shuffles : int, >= 1

    Returns
    -------
    Evidence
    """
    n_all = len(performances)
    total = np.zeros((n_all, 3))
    n_motions = np.zeros(n_all, np.int64)
    by_shuffle = np.zeros(n_shuffles)
    own = 0.0
    rng = np.random.default_rng(seed)
    parts = folds(performances)
    for held in parts if len(parts) > 1 else []:
        model = learn(without(performances, held), n_states, n_symbols, smoothing=smoothing, weight=weight)
        for i, a, b in held:
            one = performances[i]
            pair = np.flatnonzero((one.state[a : b - 1] >= 0) & (one.state[a + 1 : b] >= 0)) + a + 1
            if not len(pair):
                continue
            music = model.log_likelihood(one.part(a, b).heard)
            scores = [predicted(model, one.state, pair, music[pair - a]), _bigram(model, one.state, pair)]
            shuffles = np.array(
                [
                    predicted(model, one.state, pair, music[shuffled_order(b - a, rng)][pair - a])
                    for _ in range(n_shuffles)
                ]
            )
            total[i] += [*scores, shuffles.mean()]
            n_motions[i] += len(pair)
            by_shuffle += shuffles
            own += scores[0]
    mean = np.where(n_motions[:, None] > 0, total / np.maximum(n_motions, 1)[:, None], np.nan)
    p = (1 + int((by_shuffle >= own - 1e-9).sum())) / (1 + n_shuffles) if n_motions.any() else 1.0
    return Evidence(mean[:, 0], mean[:, 1], mean[:, 2], n_motions, p)


def predicted(model: Model, state: Int, at: Int, log_music: Float) -> float:
    """Log probability of motions given the ones before them and their music, summed.

    Parameters
    ----------
    model : Model of K states
    state : (n,) int64
    at : (m,) int64, places of the motions to predict, >= 1
    log_music : (m, K) float, log likelihood of each one's music in each state

    Returns
    -------
    float
    """
    joint = model.log_transition[state[at - 1]] + log_music
    top = joint.max(axis=1)
    norm = np.log(np.exp(joint - top[:, None]).sum(axis=1)) + top
    return float((joint[np.arange(len(at)), state[at]] - norm).sum())


def _bigram(model: Model, state: Int, at: Int) -> float:
    return float(model.log_transition[state[at - 1], state[at]].sum())
