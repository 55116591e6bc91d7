"""How much a clip may be slowed down or sped up: the bounds that choosing, judging and drawing share, and its price.

A warp ratio is song time over clip time: 2 shows a clip at half its pace.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

EASY_WARP = (0.90, 1.10)
"""Ratios that are to go unnoticed; wanted of 95 steps in a hundred. Agreed for the product, not measured."""

HARD_WARP = (0.80, 1.25)
"""Ratios no step may leave. Agreed for the product."""

STEP = 1.1
"""The ratio whose price is 1, by definition: the easy bound."""


def stretch_price(ratio: NDArray[np.floating] | float) -> NDArray[np.float64]:
    """Price a warp ratio: ``(ln r / ln 1.1)²``, so that half the pace costs what twice the pace does.

    Parameters
    ----------
    ratio : (...) float, > 0

    Returns
    -------
    (...) float64, >= 0; 0 at a ratio of 1, 1 at 1.1 and at its inverse
    """
    return np.asarray((np.log(ratio) / np.log(STEP)) ** 2, np.float64)
