"""Every pair of sensors at once: which could share a joint.

Conventions
-----------
All pair problems live in one Gram matrix of ``[R_1 .. R_S | p_1 .. p_S]``, rows (frame, world axis): it holds every
mean of R_i^T R_j, every right side and every squared distance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels.calibration.joints import NORM_3D, TUKEY, from_moments
from kernels.types import Float

_LEAST_RAD = 0.01
_LEAST_M = 0.001
"""Added to what is open between two sensors, so that logarithms stay finite. Chosen by hand at the noise of a suit."""

_TURNING = 2.0
"""How often turning counts in a pair's cost. Tuned on made-up recordings with 5 and 8 mm of soft tissue: 2 to 8 do
alike, 1 and 12 leave more wrong edges."""


def pair_residuals(rotation_matrix: Float, position_xyz_m: Float) -> Float:
    """Root mean square distance of the best common joint of every pair of sensors.

    Parameters
    ----------
    rotation_matrix : (S, F, 3, 3) float, sensor to world
    position_xyz_m : (S, F, 3) float, metres

    Returns
    -------
    (S, S) float64, metres
        Symmetric, infinite on the diagonal; 0 where F is 0.
    """
    return _all_pairs(rotation_matrix, position_xyz_m)[0]


def pair_costs(rotation_matrix: Float, position_xyz_m: Float) -> Float:
    """Measure how little of every sensor's movement another one explains through a common joint.

    Parameters
    ----------
    rotation_matrix : (S, F, 3, 3) float, sensor to world
    position_xyz_m : (S, F, 3) float, metres

    Returns
    -------
    (S, S) float64, nats
        Symmetric, infinite on the diagonal; smaller for sensors that may be neighbours.

    Notes
    -----
    The best tree joins the pairs that leave the least open [Chow1968]: what is open of a normal variable is half the
    logarithm of the determinant of its covariance. Open are where the joint's two ends lie apart, with Tukey's weights
    [Beaton1974], and how the two sensors turn against each other. Residuals alone take two collar bones for neighbours,
    5 cm apart and hardly turning, as soon as tissue slides by 5 mm; but each turns less against the thorax than against
    the other. Turning counts twice: tissue that slides by millimetres turns a sensor by few degrees.
    """
    residual, c_i, c_j, spread = _all_pairs(rotation_matrix, position_xyz_m)
    s = len(residual)
    # of 1 - m_k along three axes, each is half the sum of the variances about the two others
    variance = np.maximum(spread.sum(axis=-1, keepdims=True) - 2 * spread, _LEAST_RAD**2)
    turning = 0.5 * np.sum(np.log(variance), axis=-1)
    cost = np.full((s, s), np.inf)
    for i in range(s):
        for j in range(i + 1, s):
            R_i, R_j = rotation_matrix[i], rotation_matrix[j]
            apart = R_i @ c_i[i, j] + position_xyz_m[i] - R_j @ c_j[i, j] - position_xyz_m[j]
            weight = _weights(apart)
            sliding = [_open(np.vecmat(apart, R), weight) for R in (R_i, R_j)]
            cost[i, j] = cost[j, i] = sum(sliding) / 2 + _TURNING * turning[i, j]
    return cost


def _weights(apart: Float) -> Float:
    """Tukey's weights (F,) of residuals (F, 3)."""
    size = np.sqrt(np.sum(apart * apart, axis=-1))
    cut = max(TUKEY / NORM_3D * float(np.median(size)), 1e-9) if len(size) else 1.0
    weight: Float = np.maximum(1.0 - (size / cut) ** 2, 0.0) ** 2
    return weight


def _open(vector: Float, weight: Float) -> float:
    """Half the log determinant of the second moments of vectors (F, 3), weighted."""
    moments = (vector * weight[:, None]).T @ vector / max(float(weight.sum()), 1e-12)
    return 0.5 * float(np.linalg.slogdet(moments + _LEAST_M**2 * np.eye(3))[1])


def _all_pairs(rotation_matrix: Float, position_xyz_m: Float) -> tuple[Float, Float, Float, Float]:
    """Solve every pair: residual (S, S), the joint in either frame (S, S, 3), and how well it is seen (S, S, 3)."""
    s, f = position_xyz_m.shape[:2]
    centred = position_xyz_m - position_xyz_m.mean(axis=0)
    Z = np.concatenate(
        [np.moveaxis(rotation_matrix, 0, 2).reshape(3 * f, 3 * s), np.moveaxis(centred, 0, 2).reshape(3 * f, s)], axis=1
    )
    G = Z.T @ Z / max(f, 1)
    M = G[: 3 * s, : 3 * s].reshape(s, 3, s, 3).transpose(0, 2, 1, 3)  # [i, j] = mean of R_i^T R_j
    Rp = G[: 3 * s, 3 * s :].reshape(s, 3, s).transpose(0, 2, 1)  # [i, j] = mean of R_i^T p_j
    pp = G[3 * s :, 3 * s :]
    own = Rp[np.arange(s), np.arange(s)]
    b_i = Rp - own[:, None]
    b_j = Rp.transpose(1, 0, 2) - own[None]
    c_i, c_j, spread = from_moments(M, b_i, b_j)[:3]
    d2 = np.diag(pp)[:, None] + np.diag(pp)[None] - 2 * pp
    square = d2 + np.sum(c_i**2 + c_j**2, axis=-1) - 2 * np.sum(c_i * np.matvec(M, c_j), axis=-1)
    square = square - 2 * np.sum(c_i * b_i + c_j * b_j, axis=-1)
    residual: Float = np.sqrt(np.maximum((square + square.T) / 2, 0.0))
    np.fill_diagonal(residual, np.inf)
    return residual, c_i, c_j, spread


def spanning_tree(cost: Float) -> list[tuple[int, int]]:
    """Join all sensors by the pairs of least cost [Prim1957], as a body's tree is found in [OBrien2000].

    Parameters
    ----------
    cost : (S, S) float, symmetric, S >= 1
        Only its order counts.

    Returns
    -------
    list of S - 1 pairs of indices, smaller first, sorted
        Of equal pairs, the one with the sensor that was joined first.
    """
    s = len(cost)
    is_in: NDArray[np.bool_] = np.arange(s) == 0
    best, near = cost[0].copy(), np.zeros(s, np.int64)
    edges = []
    for _ in range(s - 1):
        k = int(np.argmin(np.where(is_in, np.inf, best)))
        edges.append((min(k, int(near[k])), max(k, int(near[k]))))
        is_in[k] = True
        closer = cost[k] < best
        best, near = np.where(closer, cost[k], best), np.where(closer, k, near)
    return sorted(edges)


def find_swap(residual_m: Float, parent: tuple[int, ...]) -> tuple[int, int, float]:
    """Find the two labels whose exchange would help a tree most.

    Parameters
    ----------
    residual_m : (S, S) float, symmetric
    parent : S >= 2 indices, the root's -1

    Returns
    -------
    one, other : int, indices, smaller first
        Whose exchange leaves the least sum of residuals over the tree; the first of equal pairs.
    ratio : float
        Sum over the edges that the exchange touches, after over before: well below 1 where the labels are exchanged.
    """
    s = len(parent)
    child, above = np.arange(1, s), np.array(parent[1:])
    total = residual_m[child, above].sum()
    best, found = np.inf, (0, 1, np.inf)
    for a in range(s):
        for b in range(a + 1, s):
            order = np.arange(s)
            order[[a, b]] = b, a
            # an edge between the two stays the same pair
            touched = (child == a) | (child == b) | (above == a) | (above == b)
            touched &= ~(((child == a) & (above == b)) | ((child == b) & (above == a)))
            before = residual_m[child[touched], above[touched]].sum()
            after = residual_m[order[child[touched]], order[above[touched]]].sum()
            if total - before + after < best:
                best, found = total - before + after, (a, b, after / max(before, 1e-12))
    return found
