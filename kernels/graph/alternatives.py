"""Several dances of one song that differ: each pays for what the ones before it showed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kernels.graph.path import Path
from kernels.types import Float, MotionGraph

SAME_CLIP_SHARE = 0.5
"""Price of a stretch of a clip that was danced elsewhere, as a share of that of the very stretch. Chosen by hand."""

MOST_SAME_RATIO, MOST_DOUBLINGS = 0.5, 4
"""Dances that are alike for more of the song are copies; the price is doubled at most so often to part them. Chosen by
hand: half of the song, and sixteen times the price."""


def shown_price(graph: MotionGraph, dances: list[Path], *, diversity: float) -> Float:
    """Price of showing again what other dances of the song show.

    Parameters
    ----------
    graph : MotionGraph of N nodes
    dances : Paths through it
    diversity : float, >= 0
        Price of a stretch for each dance that shows it; its whole clip costs half of that.

    Returns
    -------
    (N,) float64, >= 0, by first node of the stretch; zeros without dances
    """
    price = np.zeros(len(graph.clip_index))
    n_clips = int(graph.clip_index.max(initial=-1)) + 1
    for path in dances:
        shown = np.zeros(len(price), bool)
        for node, count in zip(path.source_node.tolist(), path.motion_span.tolist(), strict=True):
            at = node
            for _ in range(count):
                shown[at] = True
                at = int(graph.next_node[at])
        in_clip = np.bincount(graph.clip_index[shown], minlength=n_clips) > 0
        price += diversity * ((1 - SAME_CLIP_SHARE) * shown + SAME_CLIP_SHARE * in_clip[graph.clip_index])
    return price


def find_alternatives(
    graph: MotionGraph, n: int, *, find: Callable[[Float], Path], diversity: float = 1.0
) -> list[Path]:
    """Find different dances, the best first.

    Parameters
    ----------
    graph : MotionGraph of N nodes
    n : int, >= 1
    find : solves the song with a price for each stretch, (N,): :func:`kernels.graph.path.find_path` with all else fixed
    diversity : float, >= 0, see :func:`shown_price`

    Returns
    -------
    list of n Paths
        The first as without alternatives; the k-th the cheapest when what the k − 1 before it show has its price,
        doubled while it shows the same as one of them for more than half of the song. Where the catalogue has nothing
        else, dances may be alike: their ``diversity_cost`` tells.

    Raises
    ------
    ValueError
        If n < 1 or the price is negative.
    """
    if n < 1 or not diversity >= 0:
        raise ValueError(f"n, diversity: want n >= 1 and diversity >= 0, got {n} and {diversity}")
    dances: list[Path] = []
    for _ in range(n):
        for doubling in range(MOST_DOUBLINGS + 1):
            found = find(shown_price(graph, dances, diversity=diversity * 2**doubling))
            if not diversity or all(same_ratio(found, other) <= MOST_SAME_RATIO for other in dances):
                break
        dances.append(found)
    return dances


def same_ratio(one: Path, other: Path) -> float:
    """Share of the song's beats at which two dances show the same step.

    Parameters
    ----------
    one, other : Paths over the same beats

    Returns
    -------
    float, 0 to 1; 0 for a dance without steps
    """
    mine, theirs = (
        np.stack([path.beat_index, path.beat_span, path.source_node, path.motion_span], axis=1) for path in (one, other)
    )
    same = (mine[:, None] == theirs[None]).all(axis=-1).any(axis=1)
    return float(one.beat_span[same].sum() / max(one.beat_span.sum(), 1))


def shared_ratio(graph: MotionGraph, one: Path, other: Path) -> float:
    """Share of the stretches of one dance that another shows too, 0 to 1; 0 for a dance without steps."""
    mine, theirs = (shown_price(graph, [path], diversity=1.0) >= 1.0 for path in (one, other))
    return float((mine & theirs).sum() / max(mine.sum(), 1))
