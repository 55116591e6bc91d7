"""Whether a song can be danced by recorded motions that keep a director's pins, asked without prices."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from kernels.graph.pin_conflicts import Pin
from kernels.hmm.places import Places

Mask = NDArray[np.bool_]


class SpanReach:
    """What :func:`kernels.graph.pin_conflicts.find_conflict` asks, answered for dances by the model.

    Any motion may follow any other, at a price; so pins can be kept where motions that they admit cover the beats.

    Parameters
    ----------
    places : Places of I motions, without wishes
    parts : int, >= 1, intervals of the grid to an interval of music, in which pins count
    """

    def __init__(self, places: Places, *, parts: int) -> None:
        self._places, self._parts = places, parts
        self.n_intervals = -(-places.n_intervals // parts)
        self.is_danceable = self.keeps(())

    def keeps(self, pins: Sequence[Pin]) -> bool:
        """Whether some dance of the whole song keeps all of these.

        Parameters
        ----------
        pins : of I motions each, in any order
        """
        n = self._places.n_intervals
        reached = np.zeros(n + 1, bool)
        reached[0] = True

        @cache
        def admitted(touched: tuple[int, ...]) -> Mask:
            return np.asarray(np.logical_and.reduce([pins[i].nodes for i in touched]))

        for k in range(n):
            if not reached[k]:
                continue
            for d, (fits, _) in enumerate(self._places.at[k], start=1):
                touched = tuple(i for i, pin in enumerate(pins) if self._touches(pin, k, d))
                if len(fits) and (not touched or admitted(touched)[fits].any()):
                    reached[min(k + d, n)] = True
        return bool(reached[n])

    def fits(self, pin: Pin) -> bool:
        """Whether each interval of a pin lies under a motion that it admits, reached or not.

        Parameters
        ----------
        pin : Pin of I motions
        """
        covered = np.zeros(self._places.n_intervals, bool)
        for k in range(self._places.n_intervals):
            for d, (fits, _) in enumerate(self._places.at[k], start=1):
                if pin.nodes[fits].any():
                    covered[k : k + d] = True
        return bool(covered[pin.first * self._parts : pin.last * self._parts].all())

    def _touches(self, pin: Pin, start: int, length: int) -> bool:
        return start < pin.last * self._parts and start + length > pin.first * self._parts
