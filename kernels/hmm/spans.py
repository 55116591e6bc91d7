"""What the model says of spans: how long they may last, and what each one costs."""

from __future__ import annotations

import numpy as np

from kernels.hmm.durations import log_durations
from kernels.hmm.instances import Motions
from kernels.hmm.model import Model
from kernels.hmm.places import Places
from kernels.hmm.viterbi import Spans
from kernels.types import Float

LEAST_LOG = -12.0
"""Log probability of a length in which a recording can be danced, however seldom motions of its kind are so long.
Chosen by hand, far below any that is counted."""


def log_lasting(places: Places, motions: Motions, grid_s: Float, *, n_states: int) -> Float:
    """Log probabilities of how long basic motions last, where some recording of them may be danced.

    Parameters
    ----------
    places : Places of I motions on G intervals, each with D lengths; G >= 1
    motions : Motions of I, of N states
    grid_s : (G + D,) float, seconds, increasing
    n_states : int, N

    Returns
    -------
    (G, D, N) float64
        :func:`kernels.hmm.durations.log_durations`, at least :data:`LEAST_LOG`; -inf where no recording may be danced.
    """
    length_s = motions.end_s - motions.start_s
    of_state = [length_s[motions.state == k] for k in range(n_states)]
    found = log_durations(grid_s, of_state, longest=len(places.at[0]))
    there = np.array([[np.bincount(motions.state[fits], minlength=n_states) for fits, _ in row] for row in places.at])
    return np.where(there > 0, np.maximum(found, LEAST_LOG), -np.inf)


def span_costs(model: Model, log_music: Float, spans: Spans) -> tuple[Float, Float]:
    """Price each span by the model and by the music.

    Parameters
    ----------
    model : Model of N states
    log_music : (G, N) float, log likelihood of what is heard in each interval
    spans : Spans of S, in order, the first from interval 0

    Returns
    -------
    model_cost : (S,) float64, >= 0; minus the log probability of its state after the one before, or as the first
    music_cost : (S,) float64; minus the log likelihood of the intervals it lasts, as far as the song goes
    """
    before = np.append(0, spans.state[:-1])
    log_model = np.where(spans.start == 0, model.log_initial[spans.state], model.log_transition[before, spans.state])
    running = np.concatenate([np.zeros((1, model.n_states)), np.cumsum(log_music, axis=0)])
    end = np.minimum(spans.start + spans.length, len(log_music))
    return -log_model, running[spans.start, spans.state] - running[end, spans.state]


def shared_ratio(spans: Spans, other: Spans, n_intervals: int) -> float:
    """Share of the intervals in which two ways through the model are in the same state.

    Parameters
    ----------
    spans, other : Spans that cover the grid; what lies past it does not count
    n_intervals : int, >= 1

    Returns
    -------
    float, 0 to 1
    """
    each = [np.repeat(one.state, one.length)[:n_intervals] for one in (spans, other)]
    return float((each[0] == each[1]).mean())
