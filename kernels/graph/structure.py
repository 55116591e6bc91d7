"""Where a song plays a part again, its dance is danced again: a first dance's own steps as pins on both parts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kernels.graph.path import Path
from kernels.graph.pins import Pin, Reach
from kernels.music.repeats import Repeat
from kernels.types import Int

FREE_BEATS = 2
"""Intervals at both ends of a repeated part that stay free, for the way into it and out of it."""


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
    kept : the director's own pins; where one would have another thing danced than the part it repeats, it is left to it

    Returns
    -------
    list of Pin, int
        One pin an interval, and how many repeats they hold: those that can be danced again, one after the other.
    """
    node = node_of_interval(path)
    found: list[Pin] = []
    n_held = 0
    for r in repeats:
        pins = []
        for later in range(r.first + FREE_BEATS, min(r.last, len(node)) - FREE_BEATS):
            earlier = r.source + later - r.first
            if all(
                pin.sources(k)[node[earlier]] for k in (earlier, later) for pin in kept if pin.first <= k < pin.last
            ):
                nodes = np.arange(reach.n_nodes) == node[earlier]
                pins += [Pin("structure", k, k + 1, nodes) for k in (earlier, later)]
        if pins and reach.keeps([*kept, *found, *pins]):
            found, n_held = [*found, *pins], n_held + 1
    return found, n_held
