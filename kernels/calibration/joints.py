"""Where the joint between two sensors is: the least squares of [OBrien2000] in closed form, made robust and unbiased.

Conventions
-----------
For a joint c with parent sensor i and child sensor j, c_i and c_j are the joint in the two sensors' frames:
``R_i(t) c_i + p_i(t) = R_j(t) c_j + p_j(t)`` at every frame t. M is the mean of R_i^T R_j, with singular value
decomposition ``U diag(m) V^T``; 1 - m_k tells how well direction k of the joint is seen.

References
----------
[OBrien2000]; [Ehrig2006] (SCoRE: the same equations).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kernels import rotation
from kernels.calibration.records import PARENT, Bools, Cleaned
from kernels.types import Float, Int

UNSEEN = 1e-3
"""A direction with 1 - m_k below this, 2.6 degrees of movement, is not seen. Chosen between exact hinges, where 0 is
left after noise is taken out, and natural knees, measured on made-up recordings as 0.0019 to 0.0026."""

_ROUNDS = 5
"""Of reweighting. Chosen by hand."""

TUKEY = 6.4
"""Robust deviations from which Tukey's weights [Beaton1974] are 0. Chosen by hand, looser than the usual 4.7 of one
component, for residuals have three."""

NORM_3D = 1.538
"""Median length of a vector of three independent normal components, in their deviation, by definition: the square root
of the median of chi squared with three degrees of freedom."""

_SHRINK = 0.4
_LEVER_M = 0.1
"""How strongly soft tissue holds a direction that is seldom seen, over a lever so long. Tuned on made-up recordings: it
takes the tail of the errors under soft tissue, and changes nothing under noise alone."""


@dataclass(frozen=True, eq=False)
class PairSolution:
    """The joint between two sensors, as far as their motion shows it.

    Parameters
    ----------
    in_parent_m, in_child_m : (3,) float64, metres
    spread : (3,) float64
        1 - m_k, falling: how well each direction is seen.
    direction_parent, direction_child : (3, 3) float64
        The directions, in columns, in the two sensors' frames.
    rank : int, 0 to 3
    residual_m : (F,) float64, metres
    sigma_m : float, metres
        Robust standard deviation an axis of the residual.
    weight : (F,) float64, 0 to 1
    soft_m : float, metres
        Standard deviation an axis of what noise does not explain: soft tissue under the sensors.
    """

    in_parent_m: Float
    in_child_m: Float
    spread: Float
    direction_parent: Float
    direction_child: Float
    rank: int
    residual_m: Float
    sigma_m: float
    weight: Float
    soft_m: float = 0.0


def solve_pair(
    parent: tuple[Float, Float],
    child: tuple[Float, Float],
    is_good: Bools,
    *,
    rotation_noise_rad: tuple[float, float] = (0.0, 0.0),
    position_noise_m: tuple[float, float] = (0.0, 0.0),
) -> PairSolution:
    """Solve for the joint between two sensors.

    Parameters
    ----------
    parent, child : rotation matrices (F, 3, 3), sensor to world, and positions (F, 3), metres
    is_good : (F,) bool
        Frames to use.
    rotation_noise_rad, position_noise_m : of the two sensors, standard deviation an axis of what noise is left

    Returns
    -------
    PairSolution
        Of rank 0 at the midpoint of the sensors where no frame is good.

    Notes
    -----
    Rounds of Tukey's weights [Beaton1974] around the closed form. Orientation noise shortens the mean of R_i^T R_j, not
    the identity blocks (errors in variables): M and the right sides are lengthened again. Directions seen less than
    :data:`UNSEEN` leave the sum of the two places undetermined, and it is set to nothing: the joint lies midway between
    the feet of the two sensors on that axis. What residual neither noise explains is soft tissue, and shrinks weakly
    seen directions.
    """
    weight = is_good.astype(np.float64)
    solution = closed_form(parent, child, weight, rotation_noise_rad=rotation_noise_rad)
    for _ in range(_ROUNDS):
        if not weight.any():
            break
        weight = _tukey(solution, is_good)
        solution = closed_form(parent, child, weight, rotation_noise_rad=rotation_noise_rad)
    soft = _soft_tissue_m2(solution, rotation_noise_rad, position_noise_m)
    if soft > 0 and weight.any():
        solution = closed_form(parent, child, weight, rotation_noise_rad=rotation_noise_rad, soft_m2=soft)
    return replace(solution, soft_m=float(np.sqrt(soft)))


def closed_form(
    parent: tuple[Float, Float],
    child: tuple[Float, Float],
    weight: Float,
    *,
    rotation_noise_rad: tuple[float, float] = (0.0, 0.0),
    soft_m2: float = 0.0,
) -> PairSolution:
    """Solve one weighted round: three 2 x 2 systems along the singular directions of M.

    Parameters
    ----------
    parent, child, rotation_noise_rad : as :func:`solve_pair`
    weight : (F,) float, >= 0
    soft_m2 : float, square metres
        Variance of the residual that is soft tissue.

    Returns
    -------
    PairSolution
    """
    (R_i, p_i), (R_j, p_j) = parent, child
    n = max(float(weight.sum()), 1e-12)
    keep_i, keep_j = (1.0 - sigma**2 for sigma in rotation_noise_rad)
    d = p_j - p_i
    flat_i, flat_j = R_i.reshape(-1, 3), R_j.reshape(-1, 3)
    weighted_d = (weight[:, None] * d).reshape(-1)
    M = (flat_i * np.repeat(weight, 3)[:, None]).T @ flat_j / (n * keep_i * keep_j)
    b_i = flat_i.T @ weighted_d / (n * keep_i)
    b_j = -(flat_j.T @ weighted_d) / (n * keep_j)
    c_i, c_j, spread, U, V, rank = from_moments(M, b_i, b_j, soft_m2=soft_m2)
    apart = np.matvec(R_i, c_i) - np.matvec(R_j, c_j) - d
    residual = np.sqrt(np.sum(apart * apart, axis=-1))
    used = weight > 0
    if not used.any():  # no frame says anything of any direction
        return PairSolution(c_i, c_j, np.zeros(3), U, V, 0, residual, float("inf"), weight)
    sigma = float(np.median(residual[used])) / NORM_3D
    return PairSolution(c_i, c_j, spread, U, V, int(rank), residual, sigma, weight)


def from_moments(
    M: Float, b_i: Float, b_j: Float, *, soft_m2: float = 0.0
) -> tuple[Float, Float, Float, Float, Float, Int]:
    """Solve ``[I, -M; -M^T, I] [c_i; c_j] = [b_i; b_j]`` by the singular value decomposition of M.

    Parameters
    ----------
    M : (..., 3, 3) float
    b_i, b_j : (..., 3) float, metres
    soft_m2 : float, square metres

    Returns
    -------
    c_i, c_j : (..., 3) float64, metres
    spread : (..., 3) float64, falling
    U, V : (..., 3, 3) float64
        In the order of ``spread``.
    rank : (...) int64, 0 to 3
    """
    U, m, Vt = np.linalg.svd(M)
    U, V, spread = U[..., ::-1], Vt.mT[..., ::-1], 1.0 - m[..., ::-1]
    x, y = np.vecmat(b_i, U), np.vecmat(b_j, V)
    is_seen = spread > UNSEEN
    s = np.where(is_seen, (x + y) / np.where(is_seen, spread, 1.0), 0.0)
    s = s / (1.0 + 2.0 * _SHRINK**2 * soft_m2 / (np.maximum(spread, UNSEEN) * _LEVER_M**2))
    apart = (x - y) / (2.0 - spread)
    return np.matvec(U, s + apart) / 2.0, np.matvec(V, s - apart) / 2.0, spread, U, V, is_seen.sum(axis=-1)


def solve_joints(cleaned: Cleaned) -> list[PairSolution]:
    """Solve for the 16 joints of a suit.

    Parameters
    ----------
    cleaned : Cleaned of the 17 sensors in their order

    Returns
    -------
    list of 16 PairSolution
    """
    turned = rotation.to_matrix(np.moveaxis(cleaned.recording.rotation_wxyz, 1, 0))
    place = np.ascontiguousarray(np.moveaxis(cleaned.recording.position_xyz_m, 1, 0))
    is_good = ~cleaned.is_filled
    rotation_left = cleaned.rotation_noise_rad * np.sqrt(cleaned.noise_gain)
    position_left = cleaned.position_noise_m * np.sqrt(cleaned.noise_gain)
    return [
        solve_pair(
            (turned[i], place[i]),
            (turned[j], place[j]),
            is_good[:, i] & is_good[:, j],
            rotation_noise_rad=(float(rotation_left[i]), float(rotation_left[j])),
            position_noise_m=(float(position_left[i]), float(position_left[j])),
        )
        for j, i in enumerate(PARENT)
        if i >= 0
    ]


def _tukey(solution: PairSolution, is_good: Bools) -> Float:
    cut = max(TUKEY * solution.sigma_m, 1e-9)
    return np.where(is_good, np.maximum(1.0 - (solution.residual_m / cut) ** 2, 0.0) ** 2, 0.0)


def _soft_tissue_m2(
    solution: PairSolution, rotation_noise_rad: tuple[float, float], position_noise_m: tuple[float, float]
) -> float:
    """Variance of the residual that noise does not explain."""
    sizes = (solution.in_parent_m, solution.in_child_m)
    explained = sum(
        p**2 + 2.0 / 3.0 * r**2 * float(c @ c)
        for p, r, c in zip(position_noise_m, rotation_noise_rad, sizes, strict=True)
    )
    return max(0.0, solution.sigma_m**2 - 1.2 * explained)
