"""A made-up performance by hidden rules: every motion is drawn from a known model, and so are the drums it calls.

Eight gestures leave a quiet stance and come back to it, one a beat. Which follows which, and which drums sound while
each is danced, is drawn from :class:`Rules`; so what a model learns from clip and song can be compared with what made
them. Nothing here is recorded from anybody.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from kernels.assembly.joins import ease
from kernels.music.notes import DRUM_CHANNEL_NUMBER, Notes, sorted_notes
from kernels.synthetic.dancer import Figure, pose
from kernels.synthetic.medley import sway
from kernels.types import BeatGrid, Clip, Float, Int

DRUM_KEYS: tuple[int, ...] = (36, 38, 42, 46, 49, 51, 45, 48, 39, 56, 54, 70)
"""Percussion keys [MMA1991] of the twelve symbols. Chosen by hand."""

HIT_AT = (0.0, 0.5, 0.75)
"""Where in a motion its drums are struck, as a share of it. Chosen by hand."""

REST = 0.08
"""Share of a motion that the body rests for at either end. Chosen by hand."""


SWAY = 0.12
"""Share of the slow sways of :func:`kernels.synthetic.medley.sway` that lies over the dance. Chosen by hand."""


@dataclass(frozen=True, eq=False)
class Rules:
    """A hidden Markov model, (K,), (K, K) and (K, M) float64, linear."""

    initial: Float
    transition: Float
    emission: Float


def hidden_rules(*, n_states: int = 8, n_symbols: int = 12, loyalty: float = 0.8, seed: int = 0) -> Rules:
    """Make up rules: each motion is followed by one of up to three, and has a drum of its own.

    Parameters
    ----------
    n_states : int, 3 to 8
    n_symbols : int, n_states to 12
    loyalty : float, 0 to 1
        Share of a motion's strokes that fall on its own drum, beside those by chance; at 0 the music tells nothing.
    seed : int

    Returns
    -------
    Rules

    Raises
    ------
    ValueError
        If an argument is out of range.
    """
    if not (3 <= n_states <= len(GESTURES) and n_states <= n_symbols <= len(DRUM_KEYS) and 0 <= loyalty <= 1):
        raise ValueError(f"n_states, n_symbols, loyalty: want 3 to 8, up to 12, 0 to 1, got {n_states}, {n_symbols}")
    rng = np.random.default_rng(seed)
    # A mixture of permutations, so that every motion is danced as often; the next in a round is always among them.
    transition = 0.5 * np.eye(n_states)[(np.arange(n_states) + 1) % n_states]
    for share in (0.3, 0.2):
        transition += share * np.eye(n_states)[rng.permutation(n_states)]
    emission = np.full((n_states, n_symbols), (1.0 - loyalty) / n_symbols)
    own = rng.permutation(n_symbols)[:n_states]
    emission[np.arange(n_states), own] += loyalty
    return Rules(np.full(n_states, 1.0 / n_states), transition, emission)


def draw_states(rules: Rules, n: int, *, seed: int) -> Int:
    """Draw n motions, (n,) int64, from rules."""
    rng = np.random.default_rng([seed, 1])
    state = np.zeros(n, np.int64)
    for i in range(n):
        state[i] = rng.choice(len(rules.initial), p=rules.transition[state[i - 1]] if i else rules.initial)
    return state


def draw_notes(rules: Rules, state: Int, *, interval_s: float, start_s: float = 0.0, seed: int) -> Notes:
    """Draw the drums of motions, three strokes each, and play them on channel 10.

    Parameters
    ----------
    rules : Rules
    state : (n,) int64
    interval_s : float, seconds, > 0, of each motion
    start_s : float, seconds, >= 0, of the first
    seed : int

    Returns
    -------
    :class:`kernels.music.notes.Notes`
        And one soft stroke of the hi-hat's pedal where the last motion ends, so that the song lasts as long.
    """
    rng = np.random.default_rng([seed, 2])
    rows = []
    for i, k in enumerate(state.tolist()):
        for part in HIT_AT:
            key = DRUM_KEYS[int(rng.choice(rules.emission.shape[1], p=rules.emission[k]))]
            rows.append(
                (start_s + (i + part) * interval_s, 0.1, key, int(rng.integers(70, 110)), DRUM_CHANNEL_NUMBER, 0)
            )
    rows.append((start_s + len(state) * interval_s, 0.1, 44, 20, DRUM_CHANNEL_NUMBER, 0))
    return sorted_notes(rows)


@dataclass(frozen=True, eq=False)
class SyntheticPerformance:
    """A clip, the song it was danced to, and what was hidden.

    Parameters
    ----------
    clip : Clip on the canonical skeleton; the song starts with its first frame
    notes : Notes
    beats : BeatGrid, a beat a motion
    state : (n,) int64, gesture of each motion
    edge_s : (n + 1,) float64, seconds, where motions meet
    """

    clip: Clip
    notes: Notes
    beats: BeatGrid
    state: Int
    edge_s: Float

    @property
    def tempo(self) -> tuple[tuple[float, float], ...]:
        """Tempo map as MIDI wants it."""
        return ((0.0, 60.0 / float(self.edge_s[1] - self.edge_s[0])),)


def perform(
    rules: Rules,
    *,
    n_motions: int,
    interval_s: float = 0.5,
    frame_rate_hz: float = 30.0,
    seed: int = 0,
    unsteady_s: float = 0.01,
) -> SyntheticPerformance:
    """Let the dancer dance by rules to the drums they call.

    Parameters
    ----------
    rules : Rules of at most eight states
    n_motions : int, >= 1
    interval_s : float, seconds, > 0
    frame_rate_hz : float, > 0
    seed : int
    unsteady_s : float, seconds, >= 0
        Standard deviation of the dancer's own timing.

    Returns
    -------
    SyntheticPerformance
    """
    state = draw_states(rules, n_motions, seed=seed)
    notes = draw_notes(rules, state, interval_s=interval_s, seed=seed)
    edge_s: Float = interval_s * np.arange(n_motions + 1, dtype=np.float64)
    clip = dance(state, edge_s=edge_s, frame_rate_hz=frame_rate_hz, seed=seed, unsteady_s=unsteady_s)
    number = np.arange(n_motions)
    beats = BeatGrid(edge_s[:-1], number // 4 + 1, number % 4 + 1, np.ones(n_motions))
    return SyntheticPerformance(clip, notes, beats, state, edge_s)


def dance(state: Int, *, edge_s: Float, frame_rate_hz: float, seed: int, unsteady_s: float = 0.0) -> Clip:
    """Dance gestures one after the other.

    Parameters
    ----------
    state : (n,) int64, gesture of each motion, index into :data:`GESTURES`
    edge_s : (n + 1,) float, seconds, increasing: where motions meet
    frame_rate_hz : float, > 0
    seed : int
        Of the size of each gesture, 0.85 to 1.15, and of the timing.
    unsteady_s : float, seconds, >= 0

    Returns
    -------
    Clip on the canonical skeleton
    """
    rng = np.random.default_rng([seed, 3])
    danced_s = edge_s + np.clip(rng.normal(0.0, 1.0, len(edge_s)), -2, 2) * unsteady_s
    size = rng.uniform(0.85, 1.15, len(state))
    time_s = np.arange(int(np.floor(edge_s[-1] * frame_rate_hz + 1e-9)) + 1) / frame_rate_hz
    motion = np.clip(np.searchsorted(danced_s, time_s, side="right") - 1, 0, len(state) - 1)
    part = (time_s - danced_s[motion]) / (danced_s[motion + 1] - danced_s[motion])
    turn = 2 * np.pi * ease(np.clip((part - REST) / (1 - 2 * REST), 0.0, 1.0))
    out, round_ = size[motion] * (1 - np.cos(turn)) / 2, size[motion] * np.sin(turn)
    figure = _stance(len(time_s))
    for index, gesture in enumerate(GESTURES.values()):
        here = (state[motion] == index).astype(np.float64)
        figure = gesture(figure, out * here, round_ * here)
    # No body comes back to quite the same pose.
    return sway(pose(figure, frame_rate_hz), seed=seed, share=SWAY)


def _stance(f: int) -> Figure:
    """Stand with bent knees and open arms."""
    zero = np.zeros(f)
    foot = np.zeros((2, f, 3))
    foot[..., 0], foot[..., 1] = np.array([[0.12], [-0.12]]), 0.08
    hips = np.tile([0.0, 0.90, 0.0], (f, 1))
    return Figure(
        hips,
        zero,
        zero,
        zero,
        zero,
        foot,
        np.zeros((2, f)),
        np.full((2, f), 0.3),
        np.zeros((2, f)),
        np.full((2, f), 0.5),
    )


def _pair(left: Float, right: Float) -> Float:
    return np.stack([left, right])


def _left_circle(f: Figure, out: Float, round_: Float) -> Figure:
    none = np.zeros_like(out)
    return replace(f, raised=f.raised + _pair(1.6 * out, none), swing=f.swing + _pair(0.8 * round_, none))


def _right_circle(f: Figure, out: Float, round_: Float) -> Figure:
    none = np.zeros_like(out)
    return replace(f, raised=f.raised + _pair(none, 1.6 * out), swing=f.swing + _pair(none, 0.8 * round_))


def _open(f: Figure, out: Float, round_: Float) -> Figure:
    return replace(f, raised=f.raised + 1.2 * _pair(out, out), swing=f.swing - 0.6 * _pair(round_, round_))


def _twist(f: Figure, out: Float, round_: Float) -> Figure:
    return replace(f, chest_turn=f.chest_turn + 1.1 * out, lean=f.lean + 0.55 * round_)


def _push(f: Figure, out: Float, round_: Float) -> Figure:
    hips = f.hips_xyz_m - 0.08 * out[:, None] * np.array([0.0, 1.0, 0.0])
    return replace(
        f, hips_xyz_m=hips, swing=f.swing + 1.4 * _pair(out, out), raised=f.raised + 0.7 * _pair(round_, round_)
    )


def _bow(f: Figure, out: Float, round_: Float) -> Figure:
    return replace(f, lean=f.lean + 0.9 * out, chest_turn=f.chest_turn - 0.45 * round_)


def _kick(f: Figure, out: Float, round_: Float, side: int) -> Figure:
    foot = f.foot_xyz_m.copy()
    foot[side] += out[:, None] * np.array([0.0, 0.12, 0.22])
    arm = np.eye(2)[side][:, None]
    return replace(f, foot_xyz_m=foot, raised=f.raised + 1.4 * arm * out, swing=f.swing - 0.7 * arm * round_)


def _left_kick(f: Figure, out: Float, round_: Float) -> Figure:
    return _kick(f, out, round_, 0)


def _right_kick(f: Figure, out: Float, round_: Float) -> Figure:
    return _kick(f, out, round_, 1)


GESTURES: dict[str, Callable[[Figure, Float, Float], Figure]] = {
    "left circle": _left_circle,
    "right circle": _right_circle,
    "open": _open,
    "twist": _twist,
    "push": _push,
    "bow": _bow,
    "left kick": _left_kick,
    "right kick": _right_kick,
}
"""Gestures by name: from the stance out and back, and round."""
