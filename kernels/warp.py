"""How much a clip may be slowed down or sped up: the bounds that choosing, judging and drawing share, and its price.

A warp ratio is song time over clip time: 2 shows a clip at half its pace.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

EASY_WARP = (0.90, 1.10)
"""Ratios that are to go unnoticed; wanted of 95 steps in a hundred. Agreed for the product, not measured."""

HARD_WARP = (0.80, 1.25)
"""Ratios no step may leave. Agreed for the product."""

STEP = 1.1
"""The ratio whose price is 1, by definition: the easy bound."""


@dataclass(frozen=True)
class WarpWeights:
    """What a method lets a warp cost, without unit, all >= 0.

    Parameters
    ----------
    pace : float, price of a ratio of 1.1
    leaving : float, added outside the easy bounds
    further : float, added once more at the hard bounds, in between and beyond by the part of the way in ln r
    easy, hard : (low, high), 0 < hard low < easy low < 1 < easy high < hard high
    """

    pace: float = 1.0
    leaving: float = 0.0
    further: float = 0.0
    easy: tuple[float, float] = EASY_WARP
    hard: tuple[float, float] = HARD_WARP


def warp_cost(ratio: NDArray[np.floating] | float, weights: WarpWeights) -> NDArray[np.float64]:
    """Price playing a clip faster or slower: the one formula of the column ``warp_cost``, whatever the method.

    Parameters
    ----------
    ratio : (...) float, > 0, song time ÷ clip time
    weights : WarpWeights

    Returns
    -------
    (...) float64, >= 0
        ``pace · (ln r / ln 1.1)²``, so that half the pace costs what twice the pace does; outside the easy bounds
        ``leaving + further · e`` more, with e the part of the way, in ln r, from the easy bound to the hard one.
    """
    stretch = np.log(np.asarray(ratio, np.float64))
    (easy_low, easy_high), (hard_low, hard_high) = np.log(weights.easy), np.log(weights.hard)
    excess = np.maximum((stretch - easy_high) / (hard_high - easy_high), (easy_low - stretch) / (easy_low - hard_low))
    smooth = weights.pace * (stretch / np.log(STEP)) ** 2
    return np.asarray(smooth + np.where(excess > 0, weights.leaving + weights.further * excess, 0.0), np.float64)


def is_easy(ratio: NDArray[np.floating] | float, *, slack: float = 1e-6) -> NDArray[np.bool_]:
    """Whether warp ratios are within the easy bounds.

    Parameters
    ----------
    ratio : (...) float, > 0
    slack : float, >= 0, by how much a ratio may be rounded past a bound

    Returns
    -------
    (...) bool
    """
    return np.asarray((np.asarray(ratio) >= EASY_WARP[0] - slack) & (np.asarray(ratio) <= EASY_WARP[1] + slack))
