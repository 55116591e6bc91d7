"""A lattice of tempo and beat: the best row of beats under a curve that says how welcome a beat is at each instant.

The search of a bar pointer for bars of one beat [Krebs2015]: a path goes from beat to beat, the interval changes only
there. Ours: what a beat earns does not hang on the tempo, and a change of one frame is free, so that a tempo between
two whole numbers of frames costs nothing. It knows nothing of sound or bodies.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kernels.types import Float, Int

STEADINESS = 100.0
"""Price of a changed interval, nats for each time its length; by convention of trackers after [Krebs2015]."""

WIDEST_CHANGE_RATIO = 0.07
"""A larger change from one beat to the next is not looked for. Chosen by hand: it would cost seven nats."""


@dataclass(frozen=True)
class TempoPrior:
    """Which tempi are looked for, and how welcome each is.

    Parameters
    ----------
    slowest_bpm, fastest_bpm : float, beats a minute, 0 < slowest < fastest
    usual_bpm : float, > 0
        The most welcome one.
    spread_octaves : float, > 0
        How far off a tempo is half a weight less welcome.
    weight_per_s : float, nats a second, >= 0

    Raises
    ------
    ValueError
        If a value is out of bounds.
    """

    slowest_bpm: float
    fastest_bpm: float
    usual_bpm: float
    spread_octaves: float
    weight_per_s: float

    def __post_init__(self) -> None:
        if not 0 < self.slowest_bpm < self.fastest_bpm:
            raise ValueError(f"slowest_bpm: want 0 < slowest < fastest, got {self.slowest_bpm}, {self.fastest_bpm}")
        if not (self.usual_bpm > 0 and self.spread_octaves > 0 and self.weight_per_s >= 0):
            raise ValueError("usual_bpm, spread_octaves: want > 0; weight_per_s: want >= 0")

    def bonus(self, tempo_bpm: Float) -> Float:
        """Say how welcome tempi are: log-normal about the usual one.

        Parameters
        ----------
        tempo_bpm : (...) float, beats a minute, > 0

        Returns
        -------
        (...) float64, nats a second, <= 0
        """
        off = np.log2(np.asarray(tempo_bpm, np.float64) / self.usual_bpm) / self.spread_octaves
        return np.asarray(-0.5 * self.weight_per_s * off**2, np.float64)


@dataclass(frozen=True, eq=False)
class LatticePath:
    """A row of beats.

    Parameters
    ----------
    frame : (B,) int64, increasing
    score : float
        What its beats earn, less what its changes of tempo and its tempo cost; 0 when empty.
    """

    frame: Int
    score: float


def intervals_between(frame_rate_hz: float, slowest_bpm: float, fastest_bpm: float) -> Int:
    """List the whole numbers of frames between two tempi.

    Parameters
    ----------
    frame_rate_hz : float, > 0
    slowest_bpm, fastest_bpm : float, beats a minute, 0 < slowest <= fastest

    Returns
    -------
    (K,) int64, increasing, >= 2
        Empty where none lies there.
    """
    shortest = max(int(np.ceil(60.0 * frame_rate_hz / fastest_bpm - 1e-9)), 2)
    return np.arange(shortest, int(np.floor(60.0 * frame_rate_hz / slowest_bpm + 1e-9)) + 1)


def best_path(gain: Float, frame_rate_hz: float, prior: TempoPrior) -> LatticePath:
    """Find the best row of beats.

    Parameters
    ----------
    gain : (F,) float, nats
        What a beat on each frame earns: the log-odds that it is one.
    frame_rate_hz : float, > 0
    prior : TempoPrior

    Returns
    -------
    LatticePath
        From a beat in the first interval of the clip to one in its last. Empty when F holds no two beats. Of equal
        paths the one of shorter intervals.

    Raises
    ------
    ValueError
        If the shape is not (F,), a value is not finite, the rate is not > 0, or no interval lies between the tempi.

    Notes
    -----
    Beats a shortest interval apart do not depend on each other, so a block of frames that long is done at once: as many
    steps as the row has beats at its fastest.
    """
    if gain.ndim != 1 or not np.isfinite(gain).all():
        raise ValueError(f"gain: want (F,), finite, got {gain.shape}")
    if not frame_rate_hz > 0:
        raise ValueError(f"frame_rate_hz: want > 0, got {frame_rate_hz}")
    interval = intervals_between(frame_rate_hz, prior.slowest_bpm, prior.fastest_bpm)
    if not len(interval):
        raise ValueError(f"slowest_bpm, fastest_bpm: no whole number of frames between them at {frame_rate_hz} Hz")
    n, k, longest = len(gain), len(interval), int(interval[-1])
    nothing = LatticePath(np.zeros(0, np.int64), 0.0)
    if n <= interval[0]:
        return nothing
    worth = prior.bonus(60.0 * frame_rate_hz / interval) * interval / frame_rate_hz
    reach = int(np.ceil(WIDEST_CHANGE_RATIO * longest)) + 1
    change = np.abs(np.arange(-reach, reach + 1))
    price = STEADINESS * np.maximum(change - 1, 0) / interval[:, None]
    # Rows are frames, `longest` of them before the first; columns the interval that goes on from there.
    onward = np.full((n + longest, k), -np.inf)
    came = np.full((n, k), -1, np.int64)
    ended = np.full((n, k), -np.inf)
    column = np.arange(k)
    for start in range(0, n, int(interval[0])):
        frame = np.arange(start, min(start + int(interval[0]), n))
        before = frame[:, None] - interval
        # A first beat stands within one interval of the clip's start, its tempo is paid for from there.
        head = np.where(frame[:, None] < interval, gain[frame][:, None] + worth * (frame[:, None] / interval), -np.inf)
        ended[frame] = onward[before + longest, column] + worth + gain[frame][:, None]
        onward[frame + longest], came[frame] = _go_on(ended[frame], price)
        is_first = head > onward[frame + longest]
        onward[frame + longest] = np.where(is_first, head, onward[frame + longest])
        came[frame] = np.where(is_first, -1, came[frame])
    last = np.arange(max(n - longest, 0), n)
    missing = n - last[:, None]
    end = np.where(missing <= interval, ended[last] + worth * (missing / interval), -np.inf)
    row, j = divmod(int(end.argmax()), k)
    score = float(end[row, j])
    if not np.isfinite(score):
        return nothing
    t, frames = int(last[row]), []
    while j >= 0:
        frames.append(t)
        t -= int(interval[j])
        j = int(came[t, j])
    return LatticePath(np.array([t, *frames[::-1]], np.int64), score)


def _go_on(ended: Float, price: Float) -> tuple[Float, Int]:
    """Best way on from each frame by the interval that follows, (b, K), and the interval before, from those so near.

    ``price`` is (K, 2 reach + 1), for the interval that follows and the change from the one before.
    """
    k, wide = price.shape
    reach = wide // 2
    padded = np.full((len(ended), k + 2 * reach), -np.inf)
    padded[:, reach : reach + k] = ended
    found = np.lib.stride_tricks.sliding_window_view(padded, wide, axis=1) - price
    change = found.argmax(axis=2)
    best = np.take_along_axis(found, change[..., None], axis=2)[..., 0]
    return best, np.clip(np.arange(k) + change - reach, 0, k - 1)
