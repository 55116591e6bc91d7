"""Made-up dancers for the search of a pulse: moves at given beats, even or not, salsa steps, and motion with no pulse.

Nothing here is recorded from anybody. :mod:`kernels.synthetic.dancer` makes takes of one move at an even tempo.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import scipy

from kernels.synthetic.dancer import MOVES, Figure, plan_foot, pose
from kernels.types import Clip, Float

_SALSA_LEFT = ((0.0, 0.24), (0.0, 0.24), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.03, 0.02), (0.0, 0.0), (0.0, 0.0))
_SALSA_RIGHT = ((0.0, 0.0), (-0.03, -0.02), (0.0, 0.0), (0.0, 0.0), (0.0, -0.24), (0.0, -0.24), (0.0, 0.0), (0.0, 0.0))
_SALSA_WEIGHT = (1, -1, 1, 1, -1, 1, -1, -1)
"""The basic step on one, three steps and a hold, forwards left, then back right, by convention. By count:
where each foot is, metres sideways and ahead of its place, and which foot carries (1 left)."""


def _salsa(beats: Float, size: float) -> Figure:
    """Step three times in four counts, two counts a beat, the weight on the foot that steps."""
    counts = 2.0 * beats
    n = int(np.ceil(counts[-1])) + 2
    number = np.arange(n) % 8
    base = MOVES["idle"](beats, 0.0)
    feet = [
        plan_foot(counts, _ground(np.array(way)[number] * size, x_m), lift_m=0.05)
        for way, x_m in ((_SALSA_LEFT, 0.10), (_SALSA_RIGHT, -0.10))
    ]
    side = np.array(_SALSA_WEIGHT, np.float64)[number]
    sway = plan_foot(counts, np.stack([0.06 * side, np.zeros(n), 0.0 * side], axis=1), lift_m=0.0)[:, 0]
    hips = base.hips_xyz_m.copy()
    hips[:, 0] += sway
    hips[:, 1] -= 0.02 + 0.015 * np.cos(2 * np.pi * counts)
    hips[:, 2] += (feet[0][:, 2] + feet[1][:, 2]) / 2
    arm = 0.35 * size * sway / 0.06
    return replace(
        base,
        hips_xyz_m=hips,
        foot_xyz_m=np.stack(feet),
        hip_turn=0.15 * sway / 0.06,
        chest_turn=-0.10 * sway / 0.06,
        swing=np.stack([-arm, arm]),
        elbow=np.full((2, len(beats)), 1.3),
    )


def _sway(beats: Float, size: float) -> Figure:
    """Shift the weight from foot to foot on every beat, feet where they are."""
    base = MOVES["idle"](beats, 0.0)
    way = np.cos(np.pi * beats)
    hips = base.hips_xyz_m.copy()
    hips[:, 0] += 0.09 * size * way
    hips[:, 1] -= 0.02 + 0.02 * np.abs(way)
    return replace(base, hips_xyz_m=hips, hip_turn=0.1 * way, chest_turn=-0.1 * size * way)


def _hit(beats: Float, size: float) -> Figure:
    """Throw the arms from pose to pose, quick and then still, each on its beat; the knees give on every one."""
    n = int(np.ceil(beats[-1])) + 2
    poses = np.array([[0.2, 1.4, 0.3], [1.5, 0.3, 1.2], [0.8, 0.8, 1.6], [1.4, 1.4, 0.2]])[np.arange(n) % 4]
    held = plan_foot(beats, poses * size, lift_m=0.0)
    base = MOVES["idle"](beats, 0.0)
    hips = base.hips_xyz_m.copy()
    hips[:, 1] -= 0.04 * size * (0.5 + 0.5 * np.cos(2 * np.pi * beats)) ** 2
    return replace(
        base,
        hips_xyz_m=hips,
        raised=np.stack([held[:, 0], held[:, 1]]),
        elbow=np.stack([held[:, 2], 1.8 - held[:, 2]]),
        chest_turn=0.2 * (held[:, 0] - held[:, 1]),
    )


STEPS: dict[str, Callable[[Float, float], Figure]] = {
    **{label: move for label, move in MOVES.items() if label != "idle"},
    "salsa": _salsa,
    "sway": _sway,
    "hit": _hit,
}
"""Moves by label that have a pulse, as :data:`kernels.synthetic.dancer.MOVES`."""


def danced(
    labels: Sequence[str],
    beat_s: Float,
    *,
    frame_rate_hz: float,
    duration_s: float,
    size: float = 1.0,
    looseness_beats: float = 0.0,
    distraction: float = 0.0,
    seed: int = 0,
) -> Clip:
    """Dance moves at given beats, a phrase of four or eight beats each.

    Parameters
    ----------
    labels : keys of :data:`STEPS`, at least one
        Each phrase is one of them, drawn by ``seed``.
    beat_s : (B,) float, seconds, increasing, B >= 2
        Before the first and after the last beat the dance goes on at the nearest interval.
    frame_rate_hz : float, > 0
    duration_s : float, seconds, > 0
    size : float, 0.5 to 1.2
    looseness_beats : float, >= 0
        Standard deviation, in beats, of how far trunk, arms and each foot are off the beat, each by itself.
    distraction : float, >= 0
        How much of :func:`aimless` is laid over it: 1 for as much as it has.
    seed : int

    Returns
    -------
    Clip on the canonical skeleton

    Raises
    ------
    ValueError
        If a label is not known or the beats do not increase.
    """
    if not labels or set(labels) - set(STEPS):
        raise ValueError(f"labels: want some of {', '.join(STEPS)}, got {', '.join(labels) or 'none'}")
    if len(beat_s) < 2 or (np.diff(beat_s) <= 0).any():
        raise ValueError(f"beat_s: want two or more, increasing, got {beat_s}")
    rng = np.random.default_rng(seed)
    time_s = np.arange(int(np.floor(duration_s * frame_rate_hz + 1e-9)) + 1) / frame_rate_hz
    number = np.interp(time_s, beat_s, np.arange(len(beat_s)))
    number += np.minimum(time_s - beat_s[0], 0.0) / (beat_s[1] - beat_s[0])
    number += np.maximum(time_s - beat_s[-1], 0.0) / (beat_s[-1] - beat_s[-2])
    number += 8 * np.ceil(max(-number[0], 0.0) / 8) + (8 if looseness_beats else 0)  # whole figures, none below 0
    clocks = [number + looseness_beats * _drift(time_s, rng, hz=1.0) for _ in range(4)] if looseness_beats else []
    length = 4 * int(rng.integers(1, 3))
    phrase = number / length
    drawn = rng.integers(0, len(labels), int(phrase[-1]) + 2)
    figure: Figure | None = None
    for k, label in enumerate(labels):
        part = np.clip((phrase - np.floor(phrase)) * length, 0.0, 1.0)
        before = drawn[np.maximum(np.floor(phrase).astype(int) - 1, 0)] == k
        share = np.where(drawn[np.floor(phrase).astype(int)] == k, 1.0, 0.0) * part + before * (1.0 - part)
        danced_by = _loosely(label, clocks or [number], size)
        figure = _weighed(danced_by, share) if figure is None else _mixed(figure, _weighed(danced_by, share), 1.0)
    assert figure is not None
    if distraction:
        figure = _mixed(figure, _wander(time_s, rng), distraction)
    return pose(figure, frame_rate_hz)


def aimless(duration_s: float, *, frame_rate_hz: float, seed: int, size: float = 1.0) -> Clip:
    """Move without a pulse: every angle and the weight wander by themselves, a foot is set now and then.

    Parameters
    ----------
    duration_s : float, seconds, > 0
    frame_rate_hz : float, > 0
    seed : int
    size : float, >= 0

    Returns
    -------
    Clip on the canonical skeleton
    """
    time_s = np.arange(int(np.floor(duration_s * frame_rate_hz + 1e-9)) + 1) / frame_rate_hz
    rng = np.random.default_rng(seed)
    still = MOVES["idle"](np.zeros(len(time_s)), 0.0)
    figure = _mixed(still, _wander(time_s, rng), size)
    at_s = np.cumsum(rng.uniform(0.25, 2.0, int(duration_s / 0.25) + 4))
    steps = np.interp(time_s, np.append(0.0, at_s), np.arange(len(at_s) + 1))
    feet = []
    for x_m in (0.10, -0.10):
        ways = np.where(rng.random((len(at_s) + 2, 1)) < 0.5, rng.normal(0, 0.08 * size, (len(at_s) + 2, 2)), 0.0)
        feet.append(plan_foot(steps, _ground(ways, x_m), lift_m=0.04))
    return pose(replace(figure, foot_xyz_m=np.stack(feet)), frame_rate_hz)


def uneven_beats(duration_s: float, *, interval_s: float, spread_ratio: float, seed: int) -> Float:
    """Lay beats of intervals that have nothing to do with each other.

    Parameters
    ----------
    duration_s, interval_s : float, seconds, > 0
    spread_ratio : float, >= 0
        Standard deviation of the logarithm of the intervals.
    seed : int

    Returns
    -------
    (B,) float64, seconds, increasing, past the end; B >= 2
    """
    n = int(2 * duration_s / interval_s) + 8
    drawn = interval_s * np.exp(np.random.default_rng(seed).normal(0.0, spread_ratio, n))
    beat_s = np.cumsum(np.maximum(drawn, 0.12))
    return np.asarray(beat_s[: max(int(np.searchsorted(beat_s, duration_s)) + 2, 2)], np.float64)


def breathing_beats(duration_s: float, *, interval_s: float, depth_ratio: float, first_s: float = 0.2) -> Float:
    """Lay beats whose tempo rises and falls once in sixteen beats.

    Parameters
    ----------
    duration_s, interval_s : float, seconds, > 0
    depth_ratio : float, 0 to 0.2
        How far an interval is from the mean at most, as a share of it.
    first_s : float, seconds

    Returns
    -------
    (B,) float64, seconds, increasing, up to the end; B >= 2
    """
    n = np.arange(int(duration_s / interval_s * 1.3) + 4)
    step_s = interval_s * (1.0 + depth_ratio * np.sin(2 * np.pi * n / 16))
    beat_s = first_s + np.append(0.0, np.cumsum(step_s))
    return np.asarray(beat_s[: max(int(np.searchsorted(beat_s, duration_s + 1e-9)), 2)], np.float64)


def _ground(offset_xz_m: Float, x_m: float) -> Float:
    """Places of an ankle, (n, 3), from offsets sideways and ahead of a standing foot."""
    height = np.full(len(offset_xz_m), 0.08)
    return np.stack([x_m + offset_xz_m[:, 0], height, offset_xz_m[:, 1]], axis=1)


def _drift(time_s: Float, rng: np.random.Generator, *, hz: float) -> Float:
    """Draw a wandering number of standard deviation about one, with nothing in it that is faster than ``hz``, (F,)."""
    knot_s = np.arange(-1.0, time_s[-1] + 2.0 / hz + 1.0, 0.5 / hz)
    drawn = rng.normal(0.0, 1.0, len(knot_s))
    moved = knot_s + rng.uniform(-0.15, 0.15, len(knot_s)) / hz
    return np.asarray(scipy.interpolate.make_interp_spline(moved, drawn, k=3)(time_s), np.float64)


def _wander(time_s: Float, rng: np.random.Generator) -> Figure:
    """Offsets from standing still of a body that moves about; feet stay."""

    def drawn(size: float) -> Float:
        return size * _drift(time_s, rng, hz=float(rng.uniform(0.25, 1.5)))

    f = len(time_s)
    hips = np.stack([drawn(0.04), drawn(0.012), drawn(0.04)], axis=1)
    pairs = [np.stack([drawn(0.35), drawn(0.35)]) for _ in range(3)]
    turns = drawn(0.15), drawn(0.2), drawn(0.08)
    return Figure(hips, np.zeros(f), *turns, np.zeros((2, f, 3)), np.zeros((2, f)), *pairs)


def _loosely(label: str, clocks: Sequence[Float], size: float) -> Figure:
    """Dance a move with trunk, arms and each foot by a clock of its own; by one clock where there is only one."""
    by = [STEPS[label](clock, size) for clock in clocks]
    if len(by) == 1:
        return by[0]
    feet, ways = (np.stack([getattr(by[2], n)[0], getattr(by[3], n)[1]]) for n in ("foot_xyz_m", "foot_heading"))
    arms = {name: getattr(by[1], name) for name in ("raised", "swing", "elbow", "chest_turn")}
    return replace(by[0], foot_xyz_m=feet, foot_heading=ways, **arms)


def _weighed(figure: Figure, share: Float) -> Figure:
    """Multiply every value of a figure by a share, (F,)."""
    shares = {"hips_xyz_m": share[:, None], "foot_xyz_m": share[:, None]}
    return Figure(**{name: value * shares.get(name, share) for name, value in figure.__dict__.items()})


def _mixed(figure: Figure, other: Figure, size: float) -> Figure:
    """Lay offsets over a figure."""
    return Figure(**{name: value + size * other.__dict__[name] for name, value in figure.__dict__.items()})
