"""The model by counting: which motion comes first, which follows which, what sounds while it is danced.

After [Kameda2009]: states are seen in training, so nothing has to be estimated by iteration. Unseen events get a share
by add-alpha smoothing, alpha chosen on performances held out.

Conventions
-----------
``K`` states. Music is heard in one or more *streams* (drums, melody), each of its own ``M`` symbols and weight. A
performance is ``state`` (n,) int64 and for each stream ``heard`` (n, M) float64, how often each symbol sounds during
each motion. Performances do not follow each other: what ends one is not counted as followed by what begins the next.
State -1 is a motion the model does not know; nothing is counted across it.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kernels.types import Float, Int

ALPHAS: tuple[float, ...] = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)
"""Counts added that are tried: by convention two a decade, around the one of Laplace."""

N_FOLDS = 5
"""Parts of the performances, each held out once, by convention."""

SETTLING_STEPS = 256
"""Steps over which the share of each motion is averaged. Chosen by hand, far more than a model needs to forget."""


@dataclass(frozen=True, eq=False)
class Performed:
    """One performance: its motions and what sounded during each.

    Parameters
    ----------
    state : (n,) int64, -1 for motions the model does not know
    heard : (n, M) float64, >= 0, of each stream

    Raises
    ------
    ValueError
        If shapes do not fit.
    """

    state: Int
    heard: tuple[Float, ...]

    def __post_init__(self) -> None:
        for stream in self.heard:
            if stream.ndim != 2 or len(stream) != len(self.state):
                raise ValueError(f"heard: want ({len(self.state)}, M), got {stream.shape}")

    def part(self, start: int, end: int) -> Performed:
        """Cut out the motions from ``start`` to before ``end``."""
        return Performed(self.state[start:end], tuple(stream[start:end] for stream in self.heard))


@dataclass(frozen=True, eq=False)
class Model:
    """A hidden Markov model of a dancer.

    Parameters
    ----------
    log_initial : (K,) float64, natural log
    log_transition : (K, K) float64, from row to column
    log_emission : (K, M) float64 of each stream
    weight : of each stream, >= 0: how much what it says counts

    Raises
    ------
    ValueError
        If shapes do not fit or a row of probabilities does not sum to 1.
    """

    log_initial: Float
    log_transition: Float
    log_emission: tuple[Float, ...]
    weight: tuple[float, ...]

    def __post_init__(self) -> None:
        k = len(self.log_initial)
        if self.log_transition.shape != (k, k) or any(e.shape[:1] != (k,) for e in self.log_emission):
            shapes = [self.log_transition.shape, *(e.shape for e in self.log_emission)]
            raise ValueError(f"model: want {k} states throughout, got {shapes}")
        if len(self.weight) != len(self.log_emission):
            raise ValueError(f"weight: want one for each of {len(self.log_emission)} streams, got {len(self.weight)}")
        for rows in (self.log_initial, self.log_transition, *self.log_emission):
            total = np.exp(rows).sum(axis=-1)
            if k and not np.allclose(total, 1.0, atol=1e-6):
                raise ValueError(f"model: want probabilities that sum to 1, got {total.min():.6f} to {total.max():.6f}")

    @property
    def n_states(self) -> int:
        """Number of states, K."""
        return len(self.log_initial)

    @property
    def entropy_rate(self) -> float:
        """How improbable the next motion is on average, natural log units a motion; 0 for no or one state.

        Of a motion longer than others, a dance needs fewer; what each pays is to be set against this, else the longest
        motions would always be the most probable.
        """
        if not self.n_states:
            return 0.0
        transition = np.exp(self.log_transition)
        # The share of each motion in the long run: the mean over many steps, whatever rounds it goes in.
        share, total = np.full(self.n_states, 1.0 / self.n_states), np.zeros(self.n_states)
        for _ in range(SETTLING_STEPS):
            share = share @ transition
            total += share
        return float(-(total / SETTLING_STEPS) @ (transition * self.log_transition).sum(axis=1))

    def log_likelihood(self, heard: Sequence[Float]) -> Float:
        """Log likelihood of what is heard, (n, M) of each stream, in each state: (n, K) float64.

        Every hit is a draw of its own: drums that sound together, or one after the other, multiply.
        """
        log_p = np.zeros((len(heard[0]) if heard else 0, self.n_states))
        for counts, log_emission, weight in zip(heard, self.log_emission, self.weight, strict=True):
            log_p += weight * (counts @ log_emission.T)
        return log_p


@dataclass(frozen=True, eq=False)
class Counts:
    """How often what was seen: (K,), (K, K) and of each stream (K, M) float64."""

    initial: Float
    transition: Float
    emission: tuple[Float, ...]


def count(performances: Sequence[Performed], n_states: int, n_symbols: Sequence[int]) -> Counts:
    """Count first motions, neighbouring motions and symbols; linear in the motions.

    Parameters
    ----------
    performances : any number
    n_states : int, K, >= 1
    n_symbols : int, M, >= 1, of each stream

    Returns
    -------
    Counts

    Raises
    ------
    ValueError
        If a state or the number of symbols does not fit.
    """
    initial, transition = np.zeros(n_states), np.zeros((n_states, n_states))
    emission = tuple(np.zeros((n_states, m)) for m in n_symbols)
    for one in performances:
        if [stream.shape[1] for stream in one.heard] != list(n_symbols):
            raise ValueError(f"performances: want {list(n_symbols)} symbols, got {[h.shape[1] for h in one.heard]}")
        if len(one.state) and not -1 <= one.state.min() <= one.state.max() < n_states:
            raise ValueError(f"performances: want states from -1 to {n_states - 1}, got {one.state.max()}")
        known = one.state >= 0
        if known.any():
            initial[one.state[np.argmax(known)]] += 1
        pair = known[:-1] & known[1:]
        np.add.at(transition, (one.state[:-1][pair], one.state[1:][pair]), 1.0)
        for table, stream in zip(emission, one.heard, strict=True):
            np.add.at(table, one.state[known], stream[known])
    return Counts(initial, transition, emission)


def smoothed(counts: Float, alpha: float) -> Float:
    """Log probabilities of counts along the last axis, with ``alpha`` added to each; uniform where nothing was seen.

    Parameters
    ----------
    counts : (..., n) float, >= 0
    alpha : float, > 0

    Returns
    -------
    (..., n) float64, natural log

    Raises
    ------
    ValueError
        If alpha is not > 0.
    """
    if not alpha > 0:
        raise ValueError(f"alpha: want > 0, got {alpha}; unseen events need a share")
    raised = counts + alpha
    return np.asarray(np.log(raised) - np.log(raised.sum(axis=-1, keepdims=True)), np.float64)


def folds(performances: Sequence[Performed]) -> list[list[tuple[int, int, int]]]:
    """Cut performances into parts to be held out in turn: (performance, start, end) of each part of each fold.

    Whole stretches, not single motions: neighbours are alike, and what is learned beside the test is no test.
    """
    parts: list[list[tuple[int, int, int]]] = [[] for _ in range(N_FOLDS)]
    for i, one in enumerate(performances):
        edges = np.rint(np.linspace(0, len(one.state), N_FOLDS + 1)).astype(int)
        for fold, (a, b) in enumerate(itertools.pairwise(edges.tolist())):
            if b > a:
                parts[(fold + i) % N_FOLDS].append((i, a, b))
    return [p for p in parts if p]


def without(performances: Sequence[Performed], held: Sequence[tuple[int, int, int]]) -> list[Performed]:
    """Take what is held out from the performances; what lay on either side does not become neighbours."""
    kept: list[Performed] = []
    for i, one in enumerate(performances):
        at = 0
        for _, a, b in sorted(h for h in held if h[0] == i):
            kept.append(one.part(at, a))
            at = b
        kept.append(one.part(at, len(one.state)))
    return [one for one in kept if len(one.state)]


@dataclass(frozen=True)
class Smoothing:
    """Which alphas were chosen for transitions and for each stream, and the held-out log-likelihood of each tried.

    ``tried`` has rows of alpha, score of transitions, score of each stream.
    """

    transition_alpha: float
    emission_alpha: tuple[float, ...]
    tried: tuple[tuple[float, ...], ...] = ()


def choose_smoothing(performances: Sequence[Performed], n_states: int, n_symbols: Sequence[int]) -> Smoothing:
    """Choose how much is added to counts: what makes held-out parts of the performances most likely.

    Parameters
    ----------
    performances : any number
    n_states : int, K
    n_symbols : int, M, of each stream

    Returns
    -------
    Smoothing
        1 throughout where there is too little to hold anything out.
    """
    parts = folds(performances)
    if len(parts) < 2:
        return Smoothing(1.0, (1.0,) * len(n_symbols))
    score = np.zeros((len(ALPHAS), 1 + len(n_symbols)))
    for held in parts:
        learned = count(without(performances, held), n_states, n_symbols)
        seen = count([performances[i].part(a, b) for i, a, b in held], n_states, n_symbols)
        both = [(learned.transition, seen.transition), *zip(learned.emission, seen.emission, strict=True)]
        for column, (before, after) in enumerate(both):
            score[:, column] += [(after * smoothed(before, alpha)).sum() for alpha in ALPHAS]
    # Of equal scores the larger alpha: nothing was heard, say, and then nothing is claimed.
    best = [ALPHAS[len(ALPHAS) - 1 - int(np.argmax(column[::-1]))] for column in score.T]
    tried = tuple((a, *row) for a, row in zip(ALPHAS, score.tolist(), strict=True))
    return Smoothing(best[0], tuple(best[1:]), tried)


def learn(
    performances: Sequence[Performed],
    n_states: int,
    n_symbols: Sequence[int],
    *,
    smoothing: Smoothing,
    weight: Sequence[float] = (),
) -> Model:
    """Make the model of counted performances.

    Parameters
    ----------
    performances : any number
    n_states : int, K, >= 1
    n_symbols : int, M, >= 1, of each stream
    smoothing : Smoothing
    weight : float, >= 0, of each stream; 1 throughout where empty

    Returns
    -------
    Model
        A state that nothing ever followed may be followed by any, all alike.
    """
    counts = count(performances, n_states, n_symbols)
    alphas = zip(counts.emission, smoothing.emission_alpha, strict=True)
    return Model(
        smoothed(counts.initial, smoothing.transition_alpha),
        smoothed(counts.transition, smoothing.transition_alpha),
        tuple(smoothed(table, alpha) for table, alpha in alphas),
        tuple(weight) or (1.0,) * len(n_symbols),
    )
