"""Train the pulse network on songs of ``benchmarks/pulse_songs.py`` and write ``kernels/music/pulse_weights.py``.

    python benchmarks/train_pulse.py SONGS.npz... [--epochs 20] [--hidden 20] [--out WEIGHTS.py]

Needs jax and optax, which odori itself does not. About an hour on two cores for 5,000 half-minutes. The last songs are
kept apart to watch the loss. The weights depend on versions and machine in their last bits.
"""

from __future__ import annotations

import argparse
import base64
import sys
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import optax

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from kernels.music.pulse import DILATIONS, N_TAPS, PULSE_RATE_HZ, layer_shapes

REPOSITORY = Path(__file__).resolve().parents[1]
BATCH, LEARNING_RATE, WEIGHT_DECAY, DROPOUT = 16, 5e-3, 1e-3, 0.1
N_KEPT_APART = 160
LINE = 110


def load(paths: list[Path]) -> tuple[np.ndarray, np.ndarray]:
    """Read features (N, F, 16) and make targets (N, F, 2): 1 in the frame of a beat, 1/2 in those beside it."""
    features, targets = [], []
    for path in paths:
        with np.load(path) as songs:
            x = songs["features"]
            y = np.zeros((*x.shape[:2], 2), np.float32)
            for column, name in enumerate(("beat", "down")):
                ends = np.cumsum(songs[f"{name}_count"])
                for i, times in enumerate(np.split(songs[f"{name}_s"], ends[:-1])):
                    frame = np.rint(times * PULSE_RATE_HZ).astype(int)
                    for offset, value in ((-1, 0.5), (1, 0.5), (0, 1.0)):
                        at = frame + offset
                        at = at[(at >= 0) & (at < x.shape[1])]
                        y[i, at, column] = np.maximum(y[i, at, column], value)
            features.append(x)
            targets.append(y)
    return np.concatenate(features), np.concatenate(targets)


def first_layers(key: jax.Array, n_hidden: int) -> list[jax.Array]:
    """Draw starting weights; the last biases start at the rarity of beats."""
    layers = []
    for shape in layer_shapes(n_hidden):
        key, used = jax.random.split(key)
        if len(shape) == 1:
            layers.append(jnp.zeros(shape))
        else:
            scale = (
                0.1
                if shape[-1] == 2
                else np.sqrt((0.3 if shape == (n_hidden, n_hidden) else 1.0) / np.prod(shape[:-1]))
            )
            layers.append(scale * jax.random.normal(used, shape))
    layers[-1] = jnp.array([-3.0, -4.0])
    return layers


def logits(layers: list[jax.Array], x: jax.Array, key: jax.Array | None = None) -> jax.Array:
    """Run the network on a batch, (N, F, 16) to (N, F, 2); with a key, channels drop out."""
    n = x.shape[1]
    state = jax.nn.elu(x @ layers[0] + layers[1])
    for i, dilation in enumerate(DILATIONS):
        taps, bias, mix, mix_bias = layers[2 + 4 * i : 6 + 4 * i]
        reach = dilation * (N_TAPS // 2)
        padded = jnp.pad(state, ((0, 0), (reach, reach), (0, 0)))
        heard = sum(padded[:, tap * dilation : tap * dilation + n] @ taps[tap] for tap in range(N_TAPS)) + bias
        heard = jax.nn.elu(heard)
        if key is not None:
            key, used = jax.random.split(key)
            kept = jax.random.bernoulli(used, 1 - DROPOUT, (x.shape[0], 1, heard.shape[2]))
            heard = heard * kept / (1 - DROPOUT)
        state = state + heard @ mix + mix_bias
    return state @ layers[-2] + layers[-1]


def loss(layers: list[jax.Array], x: jax.Array, y: jax.Array, key: jax.Array | None = None) -> jax.Array:
    """Mean binary cross-entropy of beats and downbeats."""
    return optax.sigmoid_binary_cross_entropy(logits(layers, x, key), y).mean()


def disturb(rng: np.random.Generator, x: np.ndarray) -> np.ndarray:
    """Scale and drop channels and add noise, so that no single one is trusted."""
    n, _, channels = x.shape
    x = x * np.exp(rng.normal(0.0, 0.2, (n, 1, channels)))
    x = x * (rng.random((n, 1, channels)) > 0.08)
    return (x + rng.normal(0.0, 0.02, x.shape)).astype(np.float32)


def format_weights(layers: list[jax.Array], n_hidden: int) -> str:
    """Write the weights as a Python module."""
    flat = np.concatenate([np.asarray(layer).ravel() for layer in layers]).astype("<f2")
    text = base64.b85encode(flat.tobytes()).decode()
    lines = "".join(f'    "{text[i : i + LINE]}"\n' for i in range(0, len(text), LINE))  # base 85 has no quotes
    head = (
        '"""Weights of the pulse network, made by ``benchmarks/train_pulse.py``: float16, little-endian, in base 85."""'
    )
    return f"{head}\n\nN_HIDDEN = {n_hidden}\n\nWEIGHTS = (\n{lines})\n"


def main() -> None:
    """Train and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("songs", nargs="+", type=Path)
    parser.add_argument("--epochs", type=int, default=20)
    parser.add_argument("--hidden", type=int, default=20)
    parser.add_argument("--out", type=Path, default=REPOSITORY / "kernels" / "music" / "pulse_weights.py")
    arguments = parser.parse_args()
    x, y = load(arguments.songs)
    order = np.random.default_rng(0).permutation(len(x))
    apart, used = order[:N_KEPT_APART], order[N_KEPT_APART:]
    x_apart, y_apart = jnp.array(x[apart], jnp.float32), jnp.array(y[apart])
    layers = first_layers(jax.random.PRNGKey(0), arguments.hidden)
    steps = arguments.epochs * (len(used) // BATCH)
    optimizer = optax.chain(
        optax.clip_by_global_norm(1.0),
        optax.adamw(optax.cosine_decay_schedule(LEARNING_RATE, steps), weight_decay=WEIGHT_DECAY),
    )
    state = optimizer.init(layers)

    @jax.jit
    def step(layers, state, x, y, key):  # noqa: ANN001, ANN202  # trees of arrays
        value, slope = jax.value_and_grad(loss)(layers, x, y, key)
        change, state = optimizer.update(slope, state, layers)
        return optax.apply_updates(layers, change), state, value

    rng = np.random.default_rng(1)
    key = jax.random.PRNGKey(1)
    for epoch in range(arguments.epochs):
        start, losses = time.perf_counter(), []
        mixed = rng.permutation(used)
        for i in range(0, len(mixed) - BATCH + 1, BATCH):
            batch = np.sort(mixed[i : i + BATCH])
            key, drawn = jax.random.split(key)
            layers, state, value = step(layers, state, disturb(rng, x[batch].astype(np.float32)), y[batch], drawn)
            losses.append(float(value))
        kept = float(loss(layers, x_apart, y_apart))
        print(
            f"epoch {epoch}: {np.mean(losses):.4f}, apart {kept:.4f}, {time.perf_counter() - start:.0f} s", flush=True
        )
        arguments.out.write_text(format_weights(layers, arguments.hidden), "utf-8")


if __name__ == "__main__":
    main()
