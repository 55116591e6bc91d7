"""Which beats start bars."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Int = NDArray[np.int64]

METERS = (4, 3, 2, 5, 7)
LOG_PRIOR_PER_BEAT = (0.0, -0.03, -0.15, -0.12, -0.15)
"""Beats of a bar that are tried, and how usual each is, nats a beat. Chosen by hand: seldom ones must be heard
clearly."""

LOG_BREAK = -6.0
"""Nats for counting anew within a song. Chosen by hand."""

LEAST_PROBABILITY = 0.02
"""Probabilities nearer to 0 or 1 are not believed. Chosen by hand."""

LEAST_MARGIN = 0.02
"""Nats a beat by which counting must be better than the same one beat later. Chosen by hand."""


def count_bars(downbeat_probability: Float) -> tuple[Int, Int]:
    """Count beats into bars of one length.

    Parameters
    ----------
    downbeat_probability : (B,) float, 0 to 1
        How much each beat looks like the first of a bar.

    Returns
    -------
    bar_number : (B,) int64, from 1, a pick-up counting as bar 1
    beat_in_bar_number : (B,) int64, from 1
        Both 0 throughout where bars cannot be told: fewer than two bars, or no way to count is clearly better than
        the same way one beat later.

    Raises
    ------
    ValueError
        If a probability is out of range.

    Notes
    -----
    A hidden Markov model over the place in the bar for each meter (4, 3, 2, 5, 7 beats); counting may start anew at a
    small probability, as it does where a song has a bar of odd length.
    """
    n = len(downbeat_probability)
    if not ((downbeat_probability >= 0) & (downbeat_probability <= 1)).all():
        raise ValueError("downbeat_probability: want 0 to 1")
    unknown = np.zeros(n, np.int64), np.zeros(n, np.int64)
    paths = [_best_place(downbeat_probability, meter) for meter in METERS if n >= 2 * meter]
    if not paths:
        return unknown
    score = [path[1] / n + prior for path, prior in zip(paths, LOG_PRIOR_PER_BEAT, strict=False)]
    place, _, margin = paths[int(np.argmax(score))]
    if margin < LEAST_MARGIN:
        return unknown
    return np.maximum(np.cumsum(place == 0), 1), place + 1


def _best_place(probability: Float, meter: int) -> tuple[Int, float, float]:
    """Place of each beat in bars of one meter, from 0; its log-likelihood; how much worse shifts are, a beat."""
    n = len(probability)
    p = np.clip(probability, LEAST_PROBABILITY, 1.0 - LEAST_PROBABILITY)
    is_first = np.arange(meter) == 0
    log_emission = np.where(is_first, np.log(p)[:, None], np.log(1.0 - p)[:, None])  # (B, meter)
    score = log_emission[0] - np.log(meter)
    came = np.zeros((n, meter), np.int64)
    regular = (np.arange(meter) - 1) % meter
    for i in range(1, n):
        jump = int(score.argmax())
        stays = score[regular] >= score[jump] + LOG_BREAK
        came[i] = np.where(stays, regular, jump)
        score = np.maximum(score[regular], score[jump] + LOG_BREAK) + log_emission[i]
    place = np.zeros(n, np.int64)
    place[-1] = int(score.argmax())
    for i in range(n - 1, 0, -1):
        place[i - 1] = came[i, place[i]]
    chosen = float(log_emission[np.arange(n), place].sum())
    shifted = max(float(log_emission[np.arange(n), (place + k) % meter].sum()) for k in range(1, meter))
    return place, float(score.max()), (chosen - shifted) / n
