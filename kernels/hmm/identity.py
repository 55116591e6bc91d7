"""Whose dance is this? By what follows what, and by what the body does: his own dances tell a dancer from another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from kernels.hmm.model import Model
from kernels.search.describe import describe
from kernels.search.normalise import channels, resample
from kernels.types import Float, Int


def likeness(state: Int, models: Sequence[Model]) -> Float:
    """Mean log probability of a dance's motions, each given the one before, under each dancer's model.

    Parameters
    ----------
    state : (n,) int64, basic motions of the dance; -1 for motions no model knows, which are passed over
    models : P models with the same states

    Returns
    -------
    (P,) float64, natural log, the music left out; 0 throughout for a dance without two known neighbours

    Raises
    ------
    ValueError
        If the models do not have the same number of states, or a state is beyond it.
    """
    if len({m.n_states for m in models}) > 1 or (len(state) and models and state.max() >= models[0].n_states):
        raise ValueError(f"models: want the same states throughout, got {[m.n_states for m in models]}")
    pair = (state[:-1] >= 0) & (state[1:] >= 0)
    if not pair.any():
        return np.zeros(len(models))
    return np.array([float(m.log_transition[state[:-1][pair], state[1:][pair]].mean()) for m in models])


def identify(state: Int, models: Sequence[Model]) -> int:
    """Judge whose dance it is: the model it is most like, of equals the first; arguments as :func:`likeness`."""
    return int(np.argmax(likeness(state, models)))


WINDOW_S, HOP_S = 2.0, 1.0
"""Stretches of a dance that are looked at, seconds: a few motions each. Chosen by hand."""


def pose_windows(position_xyz_m: Float, frame_rate_hz: float) -> Float:
    """Describe what the body does in each stretch of a dance, as motion search describes clips.

    Parameters
    ----------
    position_xyz_m : (F, 22, 3) float, metres, canonical joints, F >= 1
    frame_rate_hz : float, > 0

    Returns
    -------
    (n, D) float64
        Statistics of poses and velocities, free of place, heading and size, of :data:`WINDOW_S` every :data:`HOP_S`;
        one window for what is shorter.
    """
    last_s = (len(position_xyz_m) - 1) / frame_rate_hz
    start_s = np.arange(max(int((last_s - WINDOW_S) / HOP_S + 1e-9) + 1, 1)) * HOP_S
    parts = [resample(position_xyz_m, frame_rate_hz, at, at + WINDOW_S) for at in start_s.tolist()]
    return np.stack([describe(channels(part, has_travel=False)) for part in parts])


def nearest_dancer(dance: Float, known: Sequence[Float]) -> int:
    """Judge whose dance it is by the stretches of known dances that its own are nearest to.

    Parameters
    ----------
    dance : (n, D) float, of :func:`pose_windows`, n >= 1
    known : P arrays (m, D), m >= 1, of dances of each dancer
        As many stretches of each are looked at, evenly taken, so that nobody is nearest for being known longer.

    Returns
    -------
    int, the dancer whose stretches are nearest to most of the dance's; of equals the first

    Raises
    ------
    ValueError
        If there is no stretch of the dance or of a dancer.
    """
    if not len(dance) or not known or not all(len(k) for k in known):
        raise ValueError("dance, known: want at least one stretch of each, got none")
    least = min(len(k) for k in known)
    even = [k[np.linspace(0, len(k) - 1, least).astype(np.int64)] for k in known]
    every = np.concatenate(even)
    mean, scale = every.mean(axis=0), every.std(axis=0) + 1e-2
    apart = scipy.spatial.distance.cdist((dance - mean) / scale, (every - mean) / scale)
    votes = np.bincount(apart.argmin(axis=1) // least, minlength=len(known))
    return int(np.argmax(votes))


def chance_of(hits: int, n: int, *, n_dancers: int = 2) -> float:
    """Probability of at least so many hits by guessing.

    Parameters
    ----------
    hits, n : int, 0 <= hits <= n
    n_dancers : int, >= 1

    Returns
    -------
    float, 0 to 1
    """
    return float(scipy.stats.binom.sf(hits - 1, n, 1.0 / n_dancers))
