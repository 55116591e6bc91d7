"""The most probable way through a hidden Markov model, in log space, and ways sampled from it.

Conventions
-----------
``N`` states, ``T`` steps. With *spans* a state lasts several of ``K`` intervals of a grid, at most ``D``: the music
heard during a span is the sum over its intervals, and how long a state lasts has a probability of its own. With D = 1
and nothing said of lengths that is the plain model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from kernels.types import Float, Int


class InfeasibleSpansError(ValueError):
    """No sequence of spans covers the grid; ``interval`` is the first that none can be continued from."""

    def __init__(self, interval: int) -> None:
        super().__init__(f"spans: no state can last as long as the grid asks for from interval {interval} on")
        self.interval = interval


def viterbi(log_initial: Float, log_transition: Float, log_likelihood: Float) -> tuple[Int, float]:
    """Find the most probable states.

    Parameters
    ----------
    log_initial : (N,) float, natural log
    log_transition : (N, N) float, from row to column
    log_likelihood : (T, N) float, of what is observed at each step in each state

    Returns
    -------
    state : (T,) int64; of equal paths the one whose last state comes first, then the one before it, and so on
    log_probability : float, of observations and path together; 0 for no steps

    Raises
    ------
    ValueError
        If shapes do not fit.
    """
    _check(log_initial, log_transition, log_likelihood)
    n_steps, n = log_likelihood.shape
    if not n_steps:
        return np.zeros(0, np.int64), 0.0
    back = np.zeros((n_steps, n), np.int64)
    into = np.ascontiguousarray(log_transition.T)
    here = np.arange(n)
    score = log_initial + log_likelihood[0]
    for t in range(1, n_steps):
        reached = into + score[None]
        back[t] = reached.argmax(axis=1)
        score = reached[here, back[t]] + log_likelihood[t]
    state = np.zeros(n_steps, np.int64)
    state[-1] = int(score.argmax())
    for t in range(n_steps - 1, 0, -1):
        state[t - 1] = back[t, state[t]]
    return state, float(score[state[-1]])


def log_probability(log_initial: Float, log_transition: Float, log_likelihood: Float) -> float:
    """Log probability of the observations over all paths (the forward recursion); arguments as :func:`viterbi`."""
    _check(log_initial, log_transition, log_likelihood)
    if not len(log_likelihood):
        return 0.0
    score = log_initial + log_likelihood[0]
    for step in log_likelihood[1:]:
        score = scipy.special.logsumexp(score[:, None] + log_transition, axis=0) + step
    return float(scipy.special.logsumexp(score))


def _check(log_initial: Float, log_transition: Float, log_likelihood: Float) -> None:
    n = len(log_initial)
    if n < 1 or log_transition.shape != (n, n) or log_likelihood.ndim != 2 or log_likelihood.shape[1] != n:
        raise ValueError(
            f"want (N,), (N, N) and (T, N) with N >= 1, got {log_initial.shape}, {log_transition.shape} and "
            f"{log_likelihood.shape}"
        )


@dataclass(frozen=True, eq=False)
class Spans:
    """States and how long they last, (S,) int64 each.

    Parameters
    ----------
    state : state of each span
    start : interval it starts with, the first 0
    length : intervals it lasts, >= 1; the last may reach past the grid
    """

    state: Int
    start: Int
    length: Int

    def edge_s(self, grid_s: Float) -> Float:
        """Time where each span starts and, last, where the last one ends, (S + 1,) float64, seconds.

        Parameters
        ----------
        grid_s : (P,) float, seconds, of the points between intervals, as far as the last span reaches; S >= 1
        """
        return np.append(grid_s[self.start], grid_s[self.start[-1] + self.length[-1]])


def best_spans(
    log_initial: Float, log_transition: Float, log_likelihood: Float, log_duration: Float
) -> tuple[Spans, float]:
    """Find the most probable states with their lengths.

    Parameters
    ----------
    log_initial : (N,) float
    log_transition : (N, N) float
    log_likelihood : (K, N) float, of what is heard in each interval; K >= 1
    log_duration : (K, D, N) float
        Of a span that starts with an interval and lasts 1 to D of them; -inf where it must not. A span may reach past
        the last interval.

    Returns
    -------
    Spans, and the log probability of music and spans together

    Raises
    ------
    ValueError
        If shapes do not fit.
    InfeasibleSpansError
        If no sequence of spans covers the grid.
    """
    heard = _heard(log_initial, log_transition, log_likelihood, log_duration)
    k_all, n = log_likelihood.shape
    d_all = log_duration.shape[1]
    score = np.full((k_all + 1, n), -np.inf)
    came = np.zeros((k_all + 1, n), np.int64)
    length = np.zeros((k_all + 1, n), np.int64)
    before = np.full((k_all + 1, n), -1, np.int64)
    into = np.ascontiguousarray(log_transition.T)
    here = np.arange(n)
    for k in range(k_all):
        if k == 0:
            enter = log_initial
        elif np.isneginf(score[k]).all():
            continue
        else:
            reached = into + score[k][None]
            before[k] = reached.argmax(axis=1)
            enter = reached[here, before[k]]
        for d in range(1, d_all + 1):
            end = min(k + d, k_all)
            value = enter + log_duration[k, d - 1] + (heard[end] - heard[k])
            better = value > score[end]
            score[end][better] = value[better]
            came[end][better], length[end][better] = k, d
    if np.isneginf(score[k_all]).all():
        raise InfeasibleSpansError(_stuck(score))
    state = int(score[k_all].argmax())
    total, at = float(score[k_all, state]), k_all
    found: list[tuple[int, int, int]] = []
    while at > 0:
        start = int(came[at, state])
        found.append((state, start, int(length[at, state])))
        at, state = start, int(before[start, state])
    return _spans(found), total


def sample_spans(
    log_initial: Float,
    log_transition: Float,
    log_likelihood: Float,
    log_duration: Float,
    *,
    temperature: float = 1.0,
    rng: np.random.Generator,
) -> Spans:
    """Draw states with their lengths from the model, given the music.

    Parameters
    ----------
    log_initial, log_transition, log_likelihood, log_duration : as :func:`best_spans`
    temperature : float, > 0
        1 draws with the model's own probabilities, less keeps nearer to the most probable way, more strays farther.
    rng : Generator

    Returns
    -------
    Spans

    Raises
    ------
    ValueError
        If shapes do not fit or the temperature is not > 0.
    InfeasibleSpansError
        If no sequence of spans covers the grid.

    Notes
    -----
    Forward filtering, backward sampling: all log probabilities are divided by the temperature first.
    """
    if not temperature > 0:
        raise ValueError(f"temperature: want > 0, got {temperature}; take the most probable way for 0")
    first, step, length = log_initial / temperature, log_transition / temperature, log_duration / temperature
    heard = _heard(first, step, log_likelihood, length) / temperature
    k_all, n = log_likelihood.shape
    d_all = length.shape[1]
    score = np.full((k_all + 1, n), -np.inf)
    enter = np.full((k_all, n), -np.inf)
    enter[0] = first
    for k in range(k_all):
        if k:
            enter[k] = _log_sum(score[k][:, None] + step)
        for d in range(1, d_all + 1):
            end = min(k + d, k_all)
            score[end] = np.logaddexp(score[end], enter[k] + length[k, d - 1] + (heard[end] - heard[k]))
    if np.isneginf(score[k_all]).all():
        raise InfeasibleSpansError(_stuck(score))
    state, at = _draw(score[k_all], rng), k_all
    found: list[tuple[int, int, int]] = []
    while at > 0:
        ways = [
            (k, d)
            for k in range(max(at - d_all, 0), at)
            for d in (range(at - k, d_all + 1) if at == k_all else (at - k,))
        ]
        weight = np.array(
            [enter[k, state] + length[k, d - 1, state] + heard[at, state] - heard[k, state] for k, d in ways]
        )
        start, lasts = ways[_draw(weight, rng)]
        found.append((state, start, lasts))
        if start:
            state = _draw(score[start] + step[:, state], rng)
        at = start
    return _spans(found)


def _log_sum(values: Float) -> Float:
    """Sum of exponentials over the first axis, as a log; no warning where all are zero."""
    top = values.max(axis=0)
    safe = np.where(np.isneginf(top), 0.0, top)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.exp(values - safe).sum(axis=0)) + safe, np.float64)


def _draw(log_weight: Float, rng: np.random.Generator) -> int:
    reached = np.cumsum(np.exp(log_weight - log_weight.max()))
    return int(min(np.searchsorted(reached, rng.random() * reached[-1], side="right"), len(log_weight) - 1))


def _heard(log_initial: Float, log_transition: Float, log_likelihood: Float, log_duration: Float) -> Float:
    """Sum the likelihood up to each interval, (K + 1, N)."""
    _check(log_initial, log_transition, log_likelihood)
    k_all, n = log_likelihood.shape
    if k_all < 1 or log_duration.ndim != 3 or log_duration.shape[::2] != (k_all, n) or log_duration.shape[1] < 1:
        raise ValueError(f"log_duration: want ({max(k_all, 1)}, D, {n}) with D >= 1, got {log_duration.shape}")
    return np.concatenate([np.zeros((1, n)), np.cumsum(log_likelihood, axis=0)])


def _stuck(score: NDArray[np.float64]) -> int:
    """Find the last place that can be reached."""
    reached = np.flatnonzero(~np.isneginf(score).all(axis=1))
    return int(reached[-1]) if len(reached) else 0


def _spans(found: list[tuple[int, int, int]]) -> Spans:
    rows = np.array(found[::-1], np.int64).reshape(-1, 3)
    return Spans(rows[:, 0], rows[:, 1], rows[:, 2])
