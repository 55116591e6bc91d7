"""From a stretch of motion to the vector it is searched by.

512 numbers of unit length in three parts: what the network makes of it, what tells the labels apart in its statistics,
and its statistics as they are. How much each part counts depends on whether there were labels to learn from.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.search import network
from kernels.search.describe import describe
from kernels.search.discriminant import Projection, unit
from kernels.search.normalise import channels, resample
from kernels.types import Float

N_DISCRIMINANT, N_PRINCIPAL = 128, 128
"""Values of these parts of a vector. Chosen so that all parts are 512 together, as many as [Ganbat2020] have."""
N_EMBEDDING = network.N_OUT + N_DISCRIMINANT + N_PRINCIPAL
PARTS = ("network", "discriminant", "principal")
_SIZES = dict(zip(PARTS, (network.N_OUT, N_DISCRIMINANT, N_PRINCIPAL), strict=True))
_PROJECTED = ("mean", "scale", "matrix")


@dataclass(frozen=True, eq=False)
class Encoder:
    """A trained encoder: arrays and nothing else.

    Parameters
    ----------
    share : of squared distance that each part of :data:`PARTS` has, by name; they sum to 1
    has_travel : whether the root's way counts
    principal : projection of statistics
    discriminant : projection of statistics, or None where there were no labels
    weights : of the network, or None where there is none
    """

    share: Mapping[str, float]
    has_travel: bool
    principal: Projection
    discriminant: Projection | None = None
    weights: Mapping[str, NDArray[np.float32]] | None = None

    def embed(self, position_xyz_m: Float, frame_rate_hz: float, window_s: Float) -> NDArray[np.float32]:
        """Embed windows of a clip.

        Parameters
        ----------
        position_xyz_m : (F, 22, 3) float, metres, canonical joints, F >= 1
        frame_rate_hz : float, > 0
        window_s : (W, 2) float, seconds of the clip

        Returns
        -------
        (W, N_EMBEDDING) float32, unit length

        Raises
        ------
        ValueError
            As :func:`kernels.search.normalise.normalise`.
        """
        rows = [
            self.embed_channels(
                channels(resample(position_xyz_m, frame_rate_hz, start_s, end_s), has_travel=self.has_travel)
            )
            for start_s, end_s in window_s.tolist()
        ]
        return np.stack(rows) if rows else np.zeros((0, N_EMBEDDING), np.float32)

    def embed_channels(self, channel: NDArray[np.float32]) -> NDArray[np.float32]:
        """Embed one stretch by its channels, (T, N_CHANNELS) to (N_EMBEDDING,) float32, unit length."""
        statistics = describe(channel)
        part = {name: np.zeros(size) for name, size in _SIZES.items()}
        part["principal"] = unit(self.principal(statistics))
        if self.discriminant is not None:
            part["discriminant"] = unit(self.discriminant(statistics))
        if self.weights is not None:
            part["network"] = network.forward(self.weights, *network.batch([channel]))[0].astype(np.float64)
        weighted = [np.sqrt(self.share.get(name, 0.0)) * part[name] for name in PARTS]
        return unit(np.concatenate(weighted)).astype(np.float32)

    def arrays(self) -> dict[str, NDArray[np.float32]]:
        """Everything it is made of, by name, float32: what is stored."""
        found = {
            "share": np.array([self.share.get(name, 0.0) for name in PARTS]),
            "has_travel": np.array([float(self.has_travel)]),
        }
        for name, projection in (("principal", self.principal), ("discriminant", self.discriminant)):
            if projection is not None:
                found |= {f"{name}.{field}": getattr(projection, field) for field in _PROJECTED}
        found |= {f"network.{name}": value for name, value in (self.weights or {}).items()}
        return {name: np.asarray(value, np.float32) for name, value in found.items()}


def from_arrays(arrays: Mapping[str, NDArray[np.float32]]) -> Encoder:
    """Build an encoder from what :meth:`Encoder.arrays` gave.

    Raises
    ------
    ValueError
        If an array is missing.
    """
    try:
        projections = {
            name: Projection(*(np.asarray(arrays[f"{name}.{field}"], np.float64) for field in _PROJECTED))
            for name in ("principal", "discriminant")
            if f"{name}.mean" in arrays or name == "principal"
        }
        share = dict(zip(PARTS, arrays["share"].astype(np.float64).tolist(), strict=True))
        has_travel = bool(arrays["has_travel"][0])
        weights = (
            {name: arrays[f"network.{name}"] for name in network.weight_shapes()} if "network.head" in arrays else None
        )
    except KeyError as error:
        raise ValueError(f"encoder: want the array {error.args[0]!r}, got none; train it anew") from error
    return Encoder(share, has_travel, projections["principal"], projections.get("discriminant"), weights)
