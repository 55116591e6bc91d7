"""Linear projections learnt in closed form: principal components, and directions that tell labels apart.

Both are fitted with fixed signs, so that the same statistics give the same numbers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.types import Float, Int

_LEAST_SCALE = 1e-2
"""Added to the deviation of a value, so that one that never changes divides by something. Chosen by hand."""

_SHRINKAGE = 0.1
"""Share of the covariance that is made round. Chosen by hand; others were tried on the splits of the benchmark and make
no difference."""


@dataclass(frozen=True, eq=False)
class Projection:
    """An affine map of statistics: ``(x - mean) / scale @ matrix``.

    Parameters
    ----------
    mean, scale : (D,) float64, scale > 0
    matrix : (D, n) float64
    """

    mean: Float
    scale: Float
    matrix: Float

    def __call__(self, value: Float) -> Float:
        """Project (..., D) to (..., n)."""
        projected: Float = (value - self.mean) / self.scale @ self.matrix
        return projected


def principal(value: Float, n_out: int) -> Projection:
    """Fit principal components of standardised statistics, each brought to unit variance.

    Parameters
    ----------
    value : (N, D) float, N >= 1
    n_out : int
        Columns of the result; those beyond what N rows can tell are zero.

    Returns
    -------
    Projection to (..., n_out)
    """
    mean, scale = value.mean(axis=0), value.std(axis=0) + _LEAST_SCALE
    _, size, rows = np.linalg.svd((value - mean) / scale, full_matrices=False)
    n = min(n_out, int((size > 1e-6 * max(float(size[0]), 1e-12)).sum()))
    matrix = np.zeros((value.shape[1], n_out))
    # Half-whitened: small components count for more than their variance, and noise not for as much as movement.
    matrix[:, :n] = _signed(rows[:n].T) / np.sqrt(size[:n] / np.sqrt(max(len(value), 1)))
    return Projection(mean, scale, matrix)


def discriminant(value: Float, label: Int, n_out: int) -> Projection:
    """Fit the directions that tell labels apart: Fisher's discriminant [Fisher1936], covariance within labels shrunken.

    Parameters
    ----------
    value : (N, D) float
    label : (N,) int
        At least two different ones.
    n_out : int
        Columns of the result; those beyond the number of labels less one are zero.

    Returns
    -------
    Projection to (..., n_out)
        In the basis in which the covariance within labels is the identity.

    Raises
    ------
    ValueError
        If there are fewer than two labels.
    """
    names, number = np.unique(label, return_inverse=True)
    if len(names) < 2:
        raise ValueError(f"label: want two or more, got {len(names)}; label more clips in clips.csv")
    mean, scale = value.mean(axis=0), value.std(axis=0) + _LEAST_SCALE
    standard = (value - mean) / scale
    _, size, rows = np.linalg.svd(standard, full_matrices=False)
    basis = _signed(rows[size > 1e-6 * size[0]].T)
    inner = standard @ basis
    count = np.bincount(number)
    centre = np.stack([np.bincount(number, column) for column in inner.T], axis=1) / count[:, None]
    rest = inner - centre[number]
    within = rest.T @ rest / len(value)
    n = len(within)
    within = (1 - _SHRINKAGE) * within + _SHRINKAGE * np.trace(within) / n * np.eye(n)
    between = (centre * (count / len(value))[:, None]).T @ centre
    # The pair of matrices as one: in the basis in which `within` is the identity.
    inverse = np.linalg.inv(np.linalg.cholesky(within))
    strength, turned = np.linalg.eigh(inverse @ between @ inverse.T)
    direction = inverse.T @ turned
    kept = np.argsort(-strength, kind="stable")[: min(n_out, len(names) - 1)]
    matrix = np.zeros((value.shape[1], n_out))
    matrix[:, : len(kept)] = basis @ _signed(direction[:, kept])
    return Projection(mean, scale, matrix)


def unit(value: NDArray[np.floating]) -> Float:
    """Scale rows to unit length; a row of zeros stays."""
    size = np.linalg.norm(value, axis=-1, keepdims=True)
    return np.asarray(value / np.where(size > 0, size, 1.0), np.float64)


def _signed(columns: Float) -> Float:
    """Give each column the sign that makes its largest entry positive."""
    if not columns.size:
        return columns
    largest = columns[np.abs(columns).argmax(axis=0), np.arange(columns.shape[1])]
    return columns * np.where(largest < 0, -1.0, 1.0)
