"""Training of the network: motions of one label come together, those of others apart.

Supervised contrastive learning [Khosla2020]; without labels every clip is its own label, and two variations of it are
what comes together (SimCLR [Chen2020]).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
from numpy.typing import NDArray

from kernels.search import network
from kernels.search.augment import Augmentation, mirror, vary
from kernels.search.normalise import channels
from kernels.types import Float, Int

_TEMPERATURE = 0.1
"""As in [Khosla2020]."""

_LONGEST_FRAMES = 64
"""Of a batch's motions: 4.3 s. Chosen for time, by hand: about a window."""

_MOST_OF_A_LABEL = 20
"""Labels are drawn as the square root of their clips, of no more than so many. Chosen by hand, so that labels of few
clips are learned too."""

Trained = dict[str, NDArray[np.float32]]


@dataclass(frozen=True)
class Training:
    """How a network is trained.

    Parameters
    ----------
    steps : batches at most
    rows, rows_a_label : size of a batch, and how many variations of one label stand in it
    learning_rate, weight_decay : of AdamW; the rate rises over the first steps and falls to nothing
    seed : of the weights to start from, of what is drawn and of how it is varied
    augmentation : how motions are varied
    has_travel : whether the root's way counts
    """

    steps: int = 250
    rows: int = 64
    rows_a_label: int = 4
    learning_rate: float = 2e-3
    weight_decay: float = 1e-3
    seed: int = 0
    augmentation: Augmentation = field(default_factory=Augmentation)
    has_travel: bool = True


class EncoderNetwork(eqx.Module):
    """The network as Equinox and Optax see it."""

    weights: dict[str, jax.Array]

    def __call__(self, channel: jax.Array, mask: jax.Array) -> jax.Array:
        """Embed a batch; see :func:`kernels.search.network.forward`."""
        embedded: jax.Array = network.forward(self.weights, channel, mask, jnp)
        return embedded


def contrast(embedded: jax.Array, label: jax.Array) -> jax.Array:
    """Supervised contrastive loss of a batch: (B, D) unit rows and (B,) labels to one number.

    Equation 2 of [Khosla2020]: the mean over rows of minus the mean log-probability of the rows of the same label among
    all other rows.
    """
    n = len(label)
    itself = jnp.eye(n, dtype=bool)
    logit = jnp.where(itself, -jnp.inf, embedded @ embedded.T / _TEMPERATURE)
    log_probability = logit - jax.nn.logsumexp(logit, axis=1, keepdims=True)
    is_same = (label[:, None] == label[None]) & ~itself
    count = is_same.sum(axis=1)
    total = jnp.where(is_same, log_probability, 0.0).sum(axis=1)
    return -(total / jnp.maximum(count, 1)).sum() / jnp.maximum((count > 0).sum(), 1)


def train(
    position_xyz_m: Sequence[Float],
    label: Int,
    *,
    how: Training,
    mirrored_label: Int | None = None,
    watch: Callable[[int, Trained], bool] | None = None,
    progress: Callable[[], None] | None = None,
) -> Trained:
    """Train the network.

    Parameters
    ----------
    position_xyz_m : N motions (T, 22, 3), metres, at :data:`~kernels.search.normalise.RATE_HZ`
    label : (N,) int
        With every clip a label of its own it is trained without labels.
    how : Training
    mirrored_label : (N,) int, or None
        What a motion is when left and right change places; -1 where that is not known, and it is not mirrored.
    watch : function of steps done and weights, or None
        Asked now and then; True ends the training there.
    progress : function called after every step

    Returns
    -------
    dict of float32 arrays
        Weights of :func:`kernels.search.network.forward`. The same arguments give the same bytes on one machine.

    Raises
    ------
    ValueError
        If there are fewer than two motions.
    """
    if len(position_xyz_m) < 2:
        raise ValueError(f"training: want two motions or more, got {len(position_xyz_m)}; add clips")
    rng = np.random.default_rng(how.seed)
    encoder = EncoderNetwork({name: jnp.asarray(value) for name, value in network.initial_weights(rng).items()})
    warm_up = min(20, how.steps // 2)
    rate = optax.warmup_cosine_decay_schedule(0.0, how.learning_rate, warm_up, max(how.steps, warm_up + 1))
    optimiser = optax.adamw(rate, weight_decay=how.weight_decay)
    state = optimiser.init(eqx.filter(encoder, eqx.is_inexact_array))

    @eqx.filter_jit
    def step(encoder: EncoderNetwork, state: Any, channel: Any, mask: Any, label: Any) -> tuple[EncoderNetwork, Any]:  # noqa: ANN401 - pytrees
        gradient = eqx.filter_grad(lambda e: contrast(e(channel, mask), label))(encoder)
        update, state = optimiser.update(gradient, state, eqx.filter(encoder, eqx.is_inexact_array))
        return eqx.apply_updates(encoder, update), state

    draw = _Draw(position_xyz_m, label, mirrored_label, how, rng)
    for done in range(1, how.steps + 1):
        encoder, state = step(encoder, state, *draw())
        if progress:
            progress()
        if watch and done % 25 == 0 and watch(done, weights_of(encoder)):
            break
    return weights_of(encoder)


def weights_of(encoder: EncoderNetwork) -> Trained:
    """Weights as NumPy arrays."""
    return {name: np.asarray(value, np.float32) for name, value in encoder.weights.items()}


class _Draw:
    """Draws batches in which labels of few clips are not drowned by labels of many."""

    def __init__(
        self,
        position_xyz_m: Sequence[Float],
        label: Int,
        mirrored_label: Int | None,
        how: Training,
        rng: np.random.Generator,
    ) -> None:
        self._position, self._how, self._rng = position_xyz_m, how, rng
        self._mirrored = np.full(len(label), -1) if mirrored_label is None else mirrored_label
        self._rows = {int(name): np.flatnonzero(label == name) for name in np.unique(label)}
        # The other side of a label is drawn with it.
        self._turned = {
            int(name): np.flatnonzero(self._mirrored == name)
            for name in np.unique(self._mirrored)
            if name in self._rows
        }
        self._names = np.array(sorted(self._rows))
        weight = np.sqrt([min(len(self._rows[int(name)]), _MOST_OF_A_LABEL) for name in self._names])
        self._weight = weight / weight.sum()

    def __call__(self) -> tuple[NDArray[np.float32], NDArray[np.float32], Int]:
        how, rng = self._how, self._rng
        n_labels = how.rows // how.rows_a_label
        # As many labels at once as there are, so that a batch holds something to tell apart.
        named = rng.choice(self._names, n_labels, p=self._weight, replace=n_labels > len(self._names))
        found, label = [], []
        for name in named.tolist():
            for _ in range(how.rows_a_label):
                turned = self._turned.get(name, ())
                is_turned = len(turned) > 0 and rng.random() < 0.5
                row = int(rng.choice(turned if is_turned else self._rows[name]))
                motion = mirror(self._position[row]) if is_turned else self._position[row]
                varied = vary(motion, rng, how.augmentation, longest=_LONGEST_FRAMES)
                found.append(channels(varied, has_travel=how.has_travel))
                label.append(name)
        return (*network.batch(found, _LONGEST_FRAMES), np.array(label))
