"""How sure a pulse is: what tells it from a row of beats laid over motion that has none, as a probability (ours).

Logistic models of a few figures, fitted to made-up dancers, some of them loose, distracted or breathing, and to made-up
motion without a pulse; ``benchmarks/motion_pulse_fit.py`` fits them again and draws how well they hold on others.
"""

from __future__ import annotations

import numpy as np
import scipy

from kernels.beat_lattice import TempoPrior, intervals_between
from kernels.motion.stops import STOP_RATE_HZ
from kernels.types import Float

PULSE_WEIGHTS = (3.28, -14.24, 9.83, 0.95, 1.73, -68.56, 0.47, 5.3, 0.5)
LEVEL_WEIGHTS = (3.84, 5.63, 0.28, -5.53)
"""Of :func:`pulse_figures` and :func:`level_figures`. Tuned on made-up clips by ``benchmarks/motion_pulse_fit.py``,
as the module says, four dances to one clip without a pulse."""

RELATED_OCTAVES = 0.115
"""Tempi nearer than this to a tempo, or to its half, double or quarter, are the same pulse. Chosen by hand, 8 %."""


FOLDED_S = 12.0
"""Stretch of a clip laid on itself to compare tempi, at least, seconds. Chosen by hand: some twenty beats."""


def probability(figures: Float, weights: tuple[float, ...]) -> float:
    """Turn figures into a probability.

    Parameters
    ----------
    figures : (n,) float
    weights : n numbers

    Returns
    -------
    float, 0 to 1
    """
    return float(1.0 / (1.0 + np.exp(-np.clip(figures @ np.asarray(weights), -30.0, 30.0))))


def pulse_figures(welcome: Float, stop_s: Float, time_s: Float, *, score: float, levels: TempoPrior) -> Float:
    """Measure what tells a pulse.

    Parameters
    ----------
    welcome : (N,) float, 0 to 1, how much each instant looks like a beat, at the rate of stops
    stop_s, time_s : (B,) float, seconds, increasing: the stops of the row, and its beats; B >= 3
    score : float, nats, what the row earned
    levels : TempoPrior

    Returns
    -------
    (9,) float64
        1; mean welcome of the beats; the same less that between them; correlation of the welcome with itself one and
        two beats later; root mean square distance of stops and beats over the interval, at most 0.3; logarithm of the
        number of beats; how much better the welcome folds at the tempo than at any other, but for its octaves; score
        over the root of the duration.
    """
    n, at = np.arange(len(welcome)), time_s * STOP_RATE_HZ
    beat = np.interp(at, n, welcome)
    between = [np.interp(at[:-1] + part * np.diff(at), n, welcome) for part in (1 / 3, 1 / 2, 2 / 3)]
    # On a clock that ticks with the beats a tempo that breathes repeats itself as an even one does.
    fine = np.interp(np.arange(0, len(time_s) - 1 + 1e-9, 1 / 24), np.arange(len(time_s)), at)
    level = np.interp(fine, n, welcome)
    level = level - level.mean()
    power = max(float(level @ level), 1e-9)
    later = [float(level[k:] @ level[:-k]) / power * len(level) / max(len(level) - k, 1) for k in (24, 48)]
    step_s = float(np.mean(np.diff(time_s)))
    off = min(float(np.sqrt(np.mean((stop_s - time_s) ** 2))) / step_s, 0.3)
    margin = _margin(welcome, 60.0 / step_s, levels)
    evidence = score / np.sqrt(len(welcome) / STOP_RATE_HZ)
    return np.array(
        [1.0, beat.mean(), beat.mean() - np.mean(between), *later, off, np.log(len(time_s)), margin, evidence]
    )


def level_figures(welcome: Float, time_s: Float) -> Float:
    """Measure what tells whether a level is the one counted.

    Parameters
    ----------
    welcome, time_s
        As for :func:`pulse_figures`.

    Returns
    -------
    (4,) float64
        1; welcome midway between the beats over that on them; how far apart even and odd beats are, over both; octaves
        from 100 a minute.
    """
    n, at = np.arange(len(welcome)), time_s * STOP_RATE_HZ
    beat = np.interp(at, n, welcome)
    middle = np.interp(at[:-1] + 0.5 * np.diff(at), n, welcome)
    usual = max(float(beat.mean()), 1e-6)
    apart = abs(float(beat[::2].mean() - beat[1::2].mean())) / (2 * usual)
    octaves = abs(float(np.log2(60.0 / np.mean(np.diff(time_s)) / 100.0)))
    return np.array([1.0, float(middle.mean()) / usual, apart, octaves])


def _margin(welcome: Float, tempo_bpm: float, levels: TempoPrior) -> float:
    """Best fold of the welcome at a tempo or an octave of it, less the best at any other tempo."""
    x = scipy.ndimage.gaussian_filter1d(welcome - welcome.mean(), STOP_RATE_HZ / 30.0, mode="constant")
    interval = intervals_between(STOP_RATE_HZ, levels.slowest_bpm, levels.fastest_bpm)
    # Over a long clip a whole number of frames drifts off the tempo, and tempi breathe: stretch by stretch.
    n_parts = max(int(len(x) / STOP_RATE_HZ / FOLDED_S), 1)
    best = np.mean([[_fold(part, int(i)) for i in interval] for part in np.array_split(x, n_parts)], axis=0)
    octaves = np.log2(60.0 * STOP_RATE_HZ / interval / tempo_bpm)
    is_related = np.abs(octaves[:, None] - np.array([-2.0, -1.0, 0.0, 1.0, 2.0])).min(axis=1) < RELATED_OCTAVES
    return float(best[is_related].max(initial=0.0) - best[~is_related].max(initial=0.0))


def _fold(x: Float, interval: int) -> float:
    """Highest mean over whole intervals laid on each other, times the root of their number; 0 for fewer than two."""
    m = len(x) // interval
    return float(x[: m * interval].reshape(m, -1).mean(axis=0).max() * np.sqrt(m)) if m > 1 else 0.0
