"""What a motion graph looks like: how near its transitions are, and how many a beat has."""

from __future__ import annotations

import numpy as np

from assets.plots.draw import COOL, WARM, figure_of, picture, plain, png
from kernels.types import Float


def motion_graph_picture(weight: Float, threshold: float, degree: Float) -> str:
    """Show a motion graph: how close its transitions are, and how many each beat has.

    Parameters
    ----------
    weight : (E,) float, >= 0
        How far apart the beats of each transition are, no unit: see :mod:`kernels.graph.transitions`.
    threshold : float
        Up to which they are kept.
    degree : (N,) float
        Transitions from each beat.

    Returns
    -------
    str
        Markdown.
    """
    figure = figure_of(9, 2.6)
    left, right = figure.subplots(1, 2)
    left.hist(weight, bins=40, color=COOL)
    left.axvline(threshold, color=WARM, linewidth=1)
    left.set_xlabel("d(i,j) / (d(i) + d(j)), threshold red", fontsize=8)
    left.set_ylabel("transitions", fontsize=8)
    right.hist(np.minimum(degree, 60), bins=np.arange(62) - 0.5, color=COOL)
    right.set_xlabel("transitions from a beat, 60 and more together", fontsize=8)
    right.set_ylabel("beats", fontsize=8)
    for axes in (left, right):
        plain(axes)
    return picture(png(figure), "motion graph")
