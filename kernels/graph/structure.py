"""Where a song plays a part again, its dance is danced again: a first dance's own steps as pins on both parts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kernels.graph.path import Path
from kernels.graph.pin_conflicts import Pin, Reach
from kernels.music.repeats import Repeat
from kernels.types import Int

FREE_BEATS = 2
"""Intervals at both ends of a repeated part that stay free, for the way into it and out of it. Chosen by hand."""


def node_of_interval(path: Path) -> Int:
    """Node that each music interval is danced from.

    Parameters
    ----------
    path : Path of K music intervals

    Returns
    -------
    (K,) int64; steps over several intervals have their node in each
    """
    return np.repeat(path.source_node, path.beat_span)


def structure_pins(
    path: Path, repeats: Sequence[Repeat], reach: Reach, *, kept: Sequence[Pin] = ()
) -> tuple[list[Pin], int]:
    """Pin what a dance shows in parts that come again, in both places.

    Parameters
    ----------
    path : Path of the song
    repeats : in order
    reach : Reach of the song
    kept : the director's own pins; what they would have otherwise is left to them

    Returns
    -------
    list of Pin, int
        One pin an interval, and how many repeats they hold: those that can be danced again, one after the other. What
        is shown in both places is what the dance shows in the earlier one, or in the later one where only that is
        directed.
    """
    node = node_of_interval(path)
    found: list[Pin] = []
    n_held = 0
    for r in repeats:
        length = min(r.last, len(node)) - r.first
        is_directed = [any(p.first < at + length and p.last > at for p in kept) for at in (r.source, r.first)]
        for origin in (r.first, r.source) if is_directed == [False, True] else (r.source, r.first):
            pins = []
            for k in range(FREE_BEATS, length - FREE_BEATS):
                shown, places = node[origin + k], (r.source + k, r.first + k)
                if all(p.sources(at)[shown] for at in places for p in kept if p.first <= at < p.last):
                    nodes = np.arange(reach.n_nodes) == shown
                    pins += [Pin("structure", at, at + 1, nodes) for at in places]
            if pins and reach.keeps([*kept, *found, *pins]):
                found, n_held = [*found, *pins], n_held + 1
                break
    return found, n_held
