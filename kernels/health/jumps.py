"""Jumps: single frames that turn or move a joint in a way that the frames around them do not bear out.

Conventions
-----------
A *signal* is what one joint does against its parent: N of them side by side. The *step* of a signal from frame t to
t + 1 is a vector: axis times angle in degrees for turns, metres for places. A step is *sharp* where it differs from the
steps on both sides of it by more than any body can, and by several times what is usual around it. Sharp steps in a row
make a *burst*; a burst that comes back to where it began is an *excursion*: its frames are wrong and both sides right.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.types import Float

TURN_DEG = 25.0
"""Between the turns of a joint in two neighbouring steps at 30 Hz: tuned on 325 Bandai takes and 17 dances. Fast
strikes reach 20 on the way up or down, and seldom on both."""

TURN_LEAST_DEG = 5.0
"""The same at high rates, where noise and not the body sets the bound. Chosen by hand."""

PLACE_M = 0.05
"""Between two neighbouring steps of the hips at 30 Hz, on the canonical body: 45 m/s^2, twice what a landing gives.
Chosen by hand."""

PLACE_LEAST_M = 0.015
"""The same at high rates. Chosen by hand, several times the noise of marker systems."""

_POWER = 1.5
"""By which power of the rate the bounds fall. Chosen between 1 (a glitch keeps its size) and 2 (accelerations)."""

_CONTRAST = 5.0
"""How often a sharp step exceeds what is usual around it. Tuned on made-up faults in the Bandai takes."""

_SURELY = 2.5
"""How often a step exceeds the least difference that is sharp whatever is usual around it, as inside a long burst.
Chosen by hand: 62 degrees at 30 Hz, above the 52 of the quickest wave in 325 Bandai takes."""

_AROUND_S = 0.25
"""Length of the pieces by which it is told what is usual around. Chosen by hand, half a beat at 120 a minute."""

_BURST_S = 0.15
"""Between sharp steps of one burst. Chosen by hand."""

_PLATEAU_S = 1.0
"""Longest excursion between two lone sharp steps. Chosen by hand: longer, nobody knows which side is right."""

_BACK_RATIO = 0.35
"""How much of its sharpest step an excursion may end away from its beginning. Chosen by hand."""


@dataclass(frozen=True)
class Burst:
    """Frames ``first`` to ``last`` of signal ``signal`` that lie between sharp steps.

    Parameters
    ----------
    signal : int
    first, last : int, frames, both wrong; of a lone sharp step those on both sides of it, one of them wrong
    n_sharp : int, sharp steps
    size : float, largest of the steps, degrees or metres
    is_back : bool
        Whether the signal comes back to where it began, so that both sides are right.
    """

    signal: int
    first: int
    last: int
    n_sharp: int
    size: float
    is_back: bool


def bound(at_30_hz: float, least: float, frame_rate_hz: float) -> float:
    """Scale a bound between neighbouring steps from 30 Hz to another rate.

    Parameters
    ----------
    at_30_hz, least : float
    frame_rate_hz : float, > 0

    Returns
    -------
    float, >= least
    """
    return max(least, float(at_30_hz * (30.0 / frame_rate_hz) ** _POWER))


def find_bursts(
    step: Float, apart: Callable[[int, int, int], float], *, least: float, frame_rate_hz: float
) -> list[Burst]:
    """Find the bursts of signals.

    Parameters
    ----------
    step : (F - 1, N, 3) float, degrees or metres
    apart : signal and two frames to how far the signal is apart between them, in the steps' unit
    least : float, > 0
        Least difference of a sharp step from both its neighbours.
    frame_rate_hz : float, > 0

    Returns
    -------
    list of Burst
        By signal and frame; empty for fewer than three frames.
    """
    if len(step) < 2:
        return []
    size = np.linalg.norm(step, axis=-1)
    is_sharp, usual = sharp_steps(step, size, least=least, frame_rate_hz=frame_rate_hz)
    found: list[Burst] = []
    for signal in np.flatnonzero(is_sharp.any(axis=0)).tolist():
        sharp = np.flatnonzero(is_sharp[:, signal])
        gap = max(round(_BURST_S * frame_rate_hz), 3)
        groups = np.split(sharp, np.flatnonzero(np.diff(sharp) > gap) + 1)
        bursts = [_burst(signal, group, size, usual, apart) for group in groups]
        found.extend(_with_plateaus(bursts, usual[:, signal], apart, round(_PLATEAU_S * frame_rate_hz)))
    return found


def sharp_steps(step: Float, size: Float, *, least: float, frame_rate_hz: float) -> tuple[NDArray[np.bool_], Float]:
    """Mark the sharp steps, and tell what is usual around each.

    Parameters
    ----------
    step : (F - 1, N, 3) float, F >= 3
    size : (F - 1, N) float, their lengths
    least : float, > 0
    frame_rate_hz : float, > 0

    Returns
    -------
    is_sharp : (F - 1, N) bool
    usual : (F - 1, N) float64
        The larger of the median steps of this piece of time, of the one before and of the one after.
    """
    change = np.linalg.norm(np.diff(step, axis=0), axis=-1)
    before = np.concatenate([change[:1], change])
    after = np.concatenate([change, change[-1:]])
    usual = _usual(size, max(round(_AROUND_S * frame_rate_hz), 5))
    sharpness = np.minimum(before, after)
    enough = np.clip(_CONTRAST * usual, least, _SURELY * least)
    return (sharpness > enough) & (size > least / 2), usual


def _usual(size: Float, length: int) -> Float:
    n = len(size)
    n_pieces = max(round(n / length), 1)
    if n >= length:
        whole = size[: n_pieces * length] if n_pieces * length <= n else size[-n_pieces * length :]
        n_pieces = len(whole) // length
        pieces = np.median(whole[: n_pieces * length].reshape(n_pieces, length, -1), axis=1)
    else:
        pieces = np.median(size, axis=0)[None]
    median = np.concatenate([pieces[:1], pieces, pieces[-1:]])
    widest = np.maximum(np.maximum(median[:-2], median[1:-1]), median[2:])
    of = np.minimum(np.arange(n) // length, len(widest) - 1)
    return np.asarray(widest[of], np.float64)


def _burst(
    signal: int, sharp: NDArray[np.int64], size: Float, usual: Float, apart: Callable[[int, int, int], float]
) -> Burst:
    first, last = int(sharp[0]), int(sharp[-1])
    largest = float(size[sharp, signal].max())
    if first == last:
        return Burst(signal, first, first + 1, 1, largest, False)
    is_back = _is_back(apart(signal, first, last + 1), largest, float(usual[first, signal]), last - first)
    return Burst(signal, first + 1, last, len(sharp), largest, is_back)


def _is_back(apart: float, size: float, usual: float, n_frames: int) -> bool:
    return apart < _BACK_RATIO * size + usual * (n_frames + 1)


def _with_plateaus(
    bursts: list[Burst], usual: Float, apart: Callable[[int, int, int], float], longest: int
) -> list[Burst]:
    """Join two bursts that do not come back, each, but do together."""
    joined: list[Burst] = []
    for burst in bursts:
        if joined and not burst.is_back and not joined[-1].is_back and burst.first - joined[-1].last < longest:
            before = joined[-1]
            start = before.first if before.n_sharp == 1 else before.first - 1
            end = burst.last if burst.n_sharp == 1 else burst.last + 1
            size = min(before.size, burst.size)
            if apart(burst.signal, start, end) < _BACK_RATIO * size + float(usual[start]):
                n_sharp = before.n_sharp + burst.n_sharp
                joined[-1] = Burst(burst.signal, start + 1, end - 1, n_sharp, max(before.size, burst.size), True)
                continue
        joined.append(burst)
    return joined


def merged(bursts: list[Burst]) -> list[Burst]:
    """Join bursts of one signal that touch each other.

    Parameters
    ----------
    bursts : by signal and frame

    Returns
    -------
    list of Burst
        Joined ones are back only where all of them were.
    """
    out: list[Burst] = []
    for burst in bursts:
        if out and out[-1].signal == burst.signal and burst.first <= out[-1].last + 1:
            a = out[-1]
            both = max(a.last, burst.last), a.n_sharp + burst.n_sharp, max(a.size, burst.size)
            out[-1] = Burst(a.signal, a.first, *both, a.is_back and burst.is_back)
        else:
            out.append(burst)
    return out
