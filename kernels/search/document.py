"""The encoder of [Ganbat2020], for comparison: frames x joints as an image, padded in front, trained to classify.

The article gives the shape of the input, four convolutions each with batch norm and rectifier, a dense layer to 512 and
training on class labels; kernel sizes, widths and strides are ours.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
from numpy.typing import NDArray

from kernels.search.augment import Augmentation, vary
from kernels.search.normalise import normalise
from kernels.types import Float, Int

N_FEATURE = 512
"""As in [Ganbat2020]."""

_WIDTHS = (16, 32, 64, 64)
"""Of the four convolutions of [Ganbat2020], who do not give them. Chosen by hand."""
_AXIS = "batch"


class DocumentEncoder(eqx.Module):
    """Four convolutions over frames and joints, then a dense layer; ``classes`` reads the feature while training."""

    convolution: list[eqx.nn.Conv2d]
    norm: list[eqx.nn.BatchNorm]
    dense: eqx.nn.Linear
    classes: eqx.nn.Linear
    is_masked: bool = eqx.field(static=True)

    def __init__(self, n_frames: int, n_joints: int, n_classes: int, *, is_masked: bool, key: jax.Array) -> None:
        keys = jax.random.split(key, 6)
        ins = (3, *_WIDTHS[:-1])
        self.convolution = [
            eqx.nn.Conv2d(a, b, 3, stride=2, padding=1, key=k) for a, b, k in zip(ins, _WIDTHS, keys[:4], strict=True)
        ]
        self.norm = [eqx.nn.BatchNorm(width, _AXIS, mode="batch") for width in _WIDTHS]
        n, j = n_frames, n_joints
        for _ in _WIDTHS:
            n, j = -(-n // 2), -(-j // 2)
        self.dense = eqx.nn.Linear(_WIDTHS[-1] * j * (1 if is_masked else n), N_FEATURE, key=keys[4])
        self.classes = eqx.nn.Linear(N_FEATURE, n_classes, key=keys[5])
        self.is_masked = is_masked

    def __call__(self, image: jax.Array, mask: jax.Array, state: eqx.nn.State) -> tuple[jax.Array, eqx.nn.State]:
        """Embed one clip: (T, J, 3) and (T,) to (512,)."""
        value = jnp.moveaxis(image, -1, 0)
        for convolution, norm in zip(self.convolution, self.norm, strict=True):
            value, state = norm(convolution(value), state)
            mask = mask[::2]
            value = jax.nn.relu(value) * (mask[None, :, None] if self.is_masked else 1.0)
        if self.is_masked:
            value = value.sum(axis=1) / mask.sum()
        return self.dense(value.reshape(-1)), state


@dataclass(frozen=True, eq=False)
class TrainedDocument:
    """A trained :class:`DocumentEncoder` with what its batch norms remember."""

    encoder: DocumentEncoder
    state: eqx.nn.State
    n_frames: int

    def embed(self, position_xyz_m: Sequence[Float]) -> NDArray[np.float32]:
        """Embed motions (T, 22, 3): (N, 512), of any length; to be compared by Euclidean distance."""
        encoder = eqx.nn.inference_mode(self.encoder)

        @eqx.filter_jit
        def run(image: Any, mask: Any) -> Any:  # noqa: ANN401 - arrays
            return jax.vmap(encoder, axis_name=_AXIS, in_axes=(0, 0, None), out_axes=(0, None))(
                image, mask, self.state
            )[0]

        image, mask = pad(position_xyz_m, self.n_frames, is_masked=encoder.is_masked)
        return np.asarray(run(image, mask), np.float32)


def pad(
    position_xyz_m: Sequence[Float], n_frames: int, *, is_masked: bool
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Bring motions to one length.

    Parameters
    ----------
    position_xyz_m : N motions (T, 22, 3), metres
    n_frames : int
        Longer ones lose their end.
    is_masked : bool
        False: copies of the first frame in front, as [Ganbat2020]. True: zeros behind, and a mask that says so.

    Returns
    -------
    (N, n_frames, 22, 3) float32, normalised, and (N, n_frames) float32 mask
    """
    image = np.zeros((len(position_xyz_m), n_frames, *position_xyz_m[0].shape[1:]), np.float32)
    mask = np.ones((len(position_xyz_m), n_frames), np.float32)
    for row, motion in enumerate(position_xyz_m):
        path = normalise(motion[:n_frames], is_sized=False)
        if is_masked:
            image[row, : len(path)] = path
            mask[row, len(path) :] = 0.0
        else:
            image[row, : n_frames - len(path)] = path[0]
            image[row, n_frames - len(path) :] = path
    return image, mask


def train_document(
    position_xyz_m: Sequence[Float],
    label: Int,
    *,
    n_frames: int,
    is_masked: bool = False,
    steps: int = 250,
    rows: int = 32,
    seed: int = 0,
    augmentation: Augmentation | None = None,
    progress: Callable[[], None] | None = None,
) -> TrainedDocument:
    """Train the encoder of [Ganbat2020] as a classifier.

    Parameters
    ----------
    position_xyz_m : N motions (T, 22, 3), metres, at :data:`~kernels.search.normalise.RATE_HZ`
    label : (N,) int
    n_frames : int, length all are brought to
    is_masked : bool
        Mask instead of padding by the first frame, and mean over time instead of every place in time for itself.
    steps, rows : batches, and motions in each, drawn evenly over labels
    seed : of weights and of what is drawn
    augmentation : how motions are varied; None leaves them as they are
    progress : function called after every step

    Returns
    -------
    TrainedDocument
        The same arguments give the same bytes on one machine.
    """
    rng = np.random.default_rng(seed)
    names, number = np.unique(label, return_inverse=True)
    made: Any = eqx.nn.make_with_state(DocumentEncoder)
    encoder, state = made(
        n_frames, position_xyz_m[0].shape[1], len(names), is_masked=is_masked, key=jax.random.PRNGKey(seed)
    )
    optimiser = optax.adam(optax.cosine_decay_schedule(1e-3, steps))
    memory = optimiser.init(eqx.filter(encoder, eqx.is_inexact_array))

    def loss(encoder: DocumentEncoder, state: eqx.nn.State, image: Any, mask: Any, of: Any) -> Any:  # noqa: ANN401 - arrays
        feature, state = jax.vmap(encoder, axis_name=_AXIS, in_axes=(0, 0, None), out_axes=(0, None))(
            image, mask, state
        )
        logit = jax.vmap(encoder.classes)(jax.nn.relu(feature))
        return optax.softmax_cross_entropy_with_integer_labels(logit, of).mean(), state

    @eqx.filter_jit
    def step(encoder: DocumentEncoder, state: Any, memory: Any, image: Any, mask: Any, of: Any) -> Any:  # noqa: ANN401
        slope: Any = eqx.filter_grad(loss, has_aux=True)
        gradient, state = slope(encoder, state, image, mask, of)
        update, memory = optimiser.update(gradient, memory, eqx.filter(encoder, eqx.is_inexact_array))
        return eqx.apply_updates(encoder, update), state, memory

    of_label = [np.flatnonzero(number == k) for k in range(len(names))]
    for _ in range(steps):
        chosen = [int(rng.choice(of_label[k])) for k in rng.integers(0, len(names), rows)]
        motions = [position_xyz_m[i] for i in chosen]
        if augmentation is not None:
            motions = [vary(motion, rng, augmentation, longest=n_frames) for motion in motions]
        encoder, state, memory = step(
            encoder, state, memory, *pad(motions, n_frames, is_masked=is_masked), number[chosen]
        )
        if progress:
            progress()
    return TrainedDocument(encoder, state, n_frames)
