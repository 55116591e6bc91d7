"""A dancer's pulse: tempo and beats of a clip from the stops of the body, or none where there is none (ours).

The parts of a body stop together on the beat, whatever the dance; :mod:`kernels.motion.stops` measures how plainly. The
row of stops that repeats best is found on a lattice of tempo and beat (:mod:`kernels.beat_lattice`), for the whole clip
at once, so a tempo may breathe by a few per cent and a beat may go without a stop. How sure that is, is a logistic
model of a few figures, fitted to made-up dancers and made-up motion without a pulse.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from kernels.beat_lattice import TempoPrior, best_path
from kernels.motion.motion_beats import check_position
from kernels.motion.pulse_confidence import (
    LEVEL_WEIGHTS,
    PULSE_WEIGHTS,
    level_figures,
    probability,
    pulse_figures,
)
from kernels.motion.stops import (
    BODY_PARTS,
    STOP_RATE_HZ,
    at_stop_rate,
    landing_strength,
    stop_strength,
)
from kernels.skeleton.canonical import JOINTS
from kernels.types import Float, Int

LEVELS = TempoPrior(slowest_bpm=58.0, fastest_bpm=185.0, usual_bpm=110.0, spread_octaves=0.6, weight_per_s=0.5)
"""Levels of a pulse. Chosen by hand for dances, 60 to 140 a minute at their counted level, by a weak preference: a body
that stops as plainly on every beat of a faster tempo is given that one."""

LEAST_STOP_PER_S2 = 80.0
"""Stops that 95 % of a clip stay below are measured by this where they are weaker. Chosen by hand: between people who
stand (at most 90, mostly 40) and real dances (above 300)."""

LEAST_LANDING_M_PER_S2 = 0.3
LANDING_SHARE = 0.6
"""Likewise of landings, and how much they count beside stops. Chosen by hand: a bounce needs 0.6 to be heard where it
is down, and couples part above 0.7."""

LEAST_FULL = 0.5
"""Strength below which an instant is no full stop, whatever is around it; 1 is what 5 % of the clip reach. Chosen by
hand, so that people who stand and sway have none."""

LEAST_WELCOME = 0.15
"""Mean welcome of the beats below which there is nothing to be sure of: nothing moves. Chosen by hand, a third of real
dances'."""

SURE_PROBABILITY = 0.45
"""From here on a clip has a pulse. Chosen by hand, below even odds: a dance lost is worse than one too many."""

EVENNESS = 5.0
"""How much rather beats are evenly spaced than on their stops. Chosen by hand: stops lie 30 ms off, a breathing tempo
changes by 13 ms from beat to beat, and this is their ratio squared."""


@dataclass(frozen=True, eq=False)
class DancePulse:
    """Tempo and beats of one clip.

    Parameters
    ----------
    time_s : (B,) float64, seconds from the first frame, increasing
        Empty without a pulse.
    tempo_bpm : float, beats a minute
        Of the best row of beats, pulse or not; 0 where there is no row at all.
    confidence_probability : float, 0 to 1
        That the tempo is the dancer's, up to an octave.
    slower_bpm, faster_bpm : float, beats a minute
        The other levels of the same pulse, half and twice as fast; 0 where they are out of bounds.
    level_probability : float, 0 to 1
        That the dancer counts at this level and at none of the others; 0 where there is no row.
    spread_ratio : float, >= 0
        Standard deviation of the intervals over their mean: how much the tempo breathes.
    row_s : (R,) float64, seconds
        The best row of beats, pulse or not, before it is cut to the clip.
    figures : (9,) float64
        What the confidence is made of, :func:`kernels.motion.pulse_confidence.pulse_figures`.
    """

    time_s: Float
    tempo_bpm: float
    confidence_probability: float
    slower_bpm: float
    faster_bpm: float
    level_probability: float
    spread_ratio: float
    row_s: Float
    figures: Float

    @property
    def has_pulse(self) -> bool:
        """Whether there are beats."""
        return len(self.time_s) > 0


NO_PULSE = DancePulse(np.zeros(0), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, np.zeros(0), np.zeros(9))
"""Of a clip without three beats, by definition."""


def beat_welcome(position_m: Float, frame_rate_hz: float, *, parts: Sequence[Sequence[int]] | None = None) -> Float:
    """Say how much each instant looks like a beat.

    Parameters
    ----------
    position_m : (F, J, 3) float, metres, world, Y up; joint 0 is the root; F >= 4
    frame_rate_hz : float, > 0
    parts : joints of each part, or None
        None: the parts of the canonical skeleton for 22 joints, else every joint for itself.

    Returns
    -------
    (N,) float64, 0 to 1, 60 a second
        1 on the plainest stop within a second or so.

    Raises
    ------
    ValueError
        As :func:`kernels.motion.stops.at_stop_rate`.
    """
    moved = at_stop_rate(position_m, frame_rate_hz)
    joints = moved.shape[1]
    chosen = parts or (BODY_PARTS if joints == len(JOINTS) else [[j] for j in range(joints)])
    stop, landing = stop_strength(moved, chosen), landing_strength(moved[:, 0, 1])
    usual = max(float(np.percentile(stop, 95)), LEAST_STOP_PER_S2)
    caught = landing / max(float(np.percentile(landing, 95)), LEAST_LANDING_M_PER_S2)
    strength = stop / usual + LANDING_SHARE * np.minimum(caught, 2.0)
    around = scipy.ndimage.maximum_filter1d(strength, int(2 * STOP_RATE_HZ))
    around = scipy.ndimage.gaussian_filter1d(around, STOP_RATE_HZ, mode="nearest")
    full = np.maximum(around, LEAST_FULL)
    return np.asarray(np.clip(strength / full, 0.0, 1.0), np.float64)


def dance_pulse(position_m: Float, frame_rate_hz: float, *, parts: Sequence[Sequence[int]] | None = None) -> DancePulse:
    """Find a dancer's pulse.

    Parameters
    ----------
    position_m, frame_rate_hz, parts
        As :func:`beat_welcome`; F may be 0.

    Returns
    -------
    DancePulse
        Without beats where the confidence is below 0.45: people who stand, single gestures, motion at no tempo, and
        clips too short for two beats.

    Raises
    ------
    ValueError
        If the shape is not (F, J, 3) with J >= 1, a value is not finite, or the rate is not > 0.
    """
    check_position(position_m, frame_rate_hz)
    if len(position_m) < 4:
        return NO_PULSE
    welcome = beat_welcome(position_m, frame_rate_hz, parts=parts)
    path = best_path(gain_of(welcome), STOP_RATE_HZ, LEVELS)
    if len(path.frame) < 3:
        return NO_PULSE
    stop_s, weight = _stops_near(welcome, path.frame)
    time_s = even_out(stop_s, weight)
    tempo_bpm = 60.0 / float(np.polyfit(np.arange(len(time_s)), time_s, 1)[0])
    figures = pulse_figures(welcome, stop_s, time_s, score=path.score, levels=LEVELS)
    step_s = np.diff(time_s)
    found = DancePulse(
        time_s,
        tempo_bpm,
        probability(figures, PULSE_WEIGHTS) if figures[1] >= LEAST_WELCOME else 0.0,
        *other_levels(tempo_bpm),
        probability(level_figures(welcome, time_s), LEVEL_WEIGHTS),
        float(step_s.std() / step_s.mean()),
        time_s,
        figures,
    )
    if found.confidence_probability < SURE_PROBABILITY:
        return replace(found, time_s=np.zeros(0))
    last_s = (len(position_m) - 1) / frame_rate_hz
    inside = time_s[(time_s > -0.5 / STOP_RATE_HZ) & (time_s < last_s + 0.5 / STOP_RATE_HZ)]
    return replace(found, time_s=np.unique(np.clip(inside, 0.0, last_s)))


def gain_of(welcome: Float) -> Float:
    """Say what a beat on each instant earns: log-odds of how welcome it is, neither believed wholly.

    Parameters
    ----------
    welcome : (N,) float, 0 to 1

    Returns
    -------
    (N,) float64, nats
    """
    p = np.clip(welcome**WELCOME_POWER, *BELIEVED)
    return np.asarray(np.log(p / (1.0 - p)) - STOP_LOG_ODDS, np.float64)


WELCOME_POWER = 0.8
BELIEVED = (0.02, 0.92)
STOP_LOG_ODDS = 0.2
"""Chosen by hand: from 0.5 to 1, and from 0 to 0.8, made-up dancers and couples agree as well."""


def _stops_near(welcome: Float, frame: Int) -> tuple[Float, Float]:
    """Move beats to the plainest instant within 50 ms, between instants by a parabola: seconds, and how plain."""
    reach = int(0.05 * STOP_RATE_HZ)
    near = np.clip(frame[:, None] + np.arange(-reach, reach + 1), 1, len(welcome) - 2).astype(np.int64)
    at = np.take_along_axis(near, welcome[near].argmax(axis=1)[:, None], axis=1)[:, 0]
    before, here, after = welcome[at - 1], welcome[at], welcome[at + 1]
    bend = before - 2 * here + after
    shift = np.where(bend < -1e-9, 0.5 * (before - after) / np.minimum(bend, -1e-9), 0.0)
    is_top = (here >= before) & (here >= after)
    place = np.where(is_top, at + np.clip(shift, -0.5, 0.5), frame)
    return np.asarray(place / STOP_RATE_HZ, np.float64), np.where(is_top, here, 0.0)


def even_out(stop_s: Float, weight: Float) -> Float:
    """Draw beats near their stops whose intervals change little: least squares with a price on second differences.

    Parameters
    ----------
    stop_s : (B,) float, seconds, increasing, B >= 3
    weight : (B,) float, >= 0
        How much a stop counts; beats without one lie where the others put them.

    Returns
    -------
    (B,) float64, seconds
    """
    b = len(stop_s)
    bend = np.diff(np.eye(b), n=2, axis=0)
    system = np.diag(weight + 1e-3) + EVENNESS * bend.T @ bend
    return np.asarray(np.linalg.solve(system, (weight + 1e-3) * stop_s), np.float64)


def other_levels(tempo_bpm: float) -> tuple[float, float]:
    """Name the levels half and twice as fast as a tempo.

    Parameters
    ----------
    tempo_bpm : float, beats a minute

    Returns
    -------
    slower, faster : float, beats a minute
        0 where one is out of bounds.
    """
    slower, faster = (
        t if LEVELS.slowest_bpm <= t <= LEVELS.fastest_bpm else 0.0 for t in (tempo_bpm / 2, 2 * tempo_bpm)
    )
    return slower, faster
