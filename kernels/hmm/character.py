"""Whose dance is this? By what follows what: each dancer's own transitions tell his dances from another's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kernels.hmm.model import Model
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
    """Tell whose dance it is: the model it is most like, of equals the first; arguments as :func:`likeness`."""
    return int(np.argmax(likeness(state, models)))
