"""How far one pose is from another: equations 17 and 18 of [Xu2015], and what stands for them on a device.

Conventions
-----------
A pose is a row of *features*, made so that the distance is a plain sum::

    d(i, j) = Σ_c (linear[i, c] − linear[j, c])² + Σ_k weight[k] · ‖log(q[j, k]⁻¹ q[i, k])‖²

Weights and time constants are inside ``linear`` already (as square roots), so both metrics, and every device, compute
the same formula: for ``"position"`` (equation 18) there are no quaternions, for ``"rotation"`` (equation 17) there are
both. √d obeys the triangle inequality. Joint weights sum to one: √d is a weighted root mean square over the joints, in
metres for ``"position"`` and in radians for ``"rotation"``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, Protocol, get_args

import numpy as np
from numpy.typing import NDArray

from kernels.types import Float, Int

Metric = Literal["position", "rotation"]

_TILE_ROWS, _TILE_COLUMNS = 32, 1024  # chosen so that two float64 tiles stay in a core's own cache


@dataclass(frozen=True, eq=False)
class PoseFeatures:
    """Poses as rows, ready for the distance.

    Parameters
    ----------
    metric : "position" or "rotation"
    linear : (N, D) float64
        Coordinates whose squared differences are summed: metres or radians times the square root of a weight.
    quaternion_wxyz : (N, K, 4) float64, unit
        Local joint rotations; K is 0 for "position".
    quaternion_weight : (K,) float64, >= 0

    Raises
    ------
    ValueError
        If the metric is unknown, a shape does not fit, a value is not finite, or a quaternion is not unit.
    """

    metric: Metric
    linear: Float
    quaternion_wxyz: Float
    quaternion_weight: Float

    def __post_init__(self) -> None:
        check_metric(self.metric)
        n, k = len(self.linear), len(self.quaternion_weight)
        if self.linear.ndim != 2 or self.quaternion_wxyz.shape != (n, k, 4) or self.quaternion_weight.shape != (k,):
            raise ValueError(
                "linear, quaternion_wxyz, quaternion_weight: want (N, D), (N, K, 4), (K,), got "
                f"{self.linear.shape}, {self.quaternion_wxyz.shape}, {self.quaternion_weight.shape}"
            )
        for name in ("linear", "quaternion_wxyz", "quaternion_weight"):
            if not np.isfinite(getattr(self, name)).all():
                raise ValueError(f"{name}: not finite; mend or refuse the clip where it is read")
        if not (self.quaternion_weight >= 0).all():
            raise ValueError(f"quaternion_weight: want >= 0, got {self.quaternion_weight.min()}")
        if n and k and np.abs(np.linalg.norm(self.quaternion_wxyz, axis=-1) - 1).max() > 1e-6:
            raise ValueError("quaternion_wxyz: want unit quaternions; normalise the rotations read")

    def __len__(self) -> int:
        return len(self.linear)

    def take(self, index: Int | slice) -> PoseFeatures:
        """Rows by index or slice, in that order."""
        return PoseFeatures(self.metric, self.linear[index], self.quaternion_wxyz[index], self.quaternion_weight)


class PairDistance(Protocol):
    """Distances of every row pose to every column pose: :func:`pose_distance`, or its twin on a device.

    The answer for a pair depends on the two poses alone, never on what else is in the call: rows can be computed in any
    portions, now or later, to the same bits. A backend may answer in float32; then √d is within :func:`error_bound` of
    the float64 reference, which is what lets :mod:`kernels.graph.transitions` choose the same edges on every backend.
    """

    def __call__(self, rows: PoseFeatures, columns: PoseFeatures) -> NDArray[np.floating]:
        """Distances (n, m) of n rows to m columns, >= 0."""
        ...


def check_metric(metric: str) -> None:
    """Raise ValueError unless the metric is one of the two known."""
    if metric not in get_args(Metric):
        raise ValueError(f"metric: want one of {', '.join(get_args(Metric))}, got {metric!r}")


def check_pair(rows: PoseFeatures, columns: PoseFeatures) -> None:
    """Raise ValueError unless the two sets of poses were made alike: metric, coordinates, weights."""
    if rows.metric != columns.metric:
        raise ValueError(f"columns: want the rows' metric {rows.metric!r}, got {columns.metric!r}")
    if rows.linear.shape[1] != columns.linear.shape[1]:
        raise ValueError(
            f"columns: want {rows.linear.shape[1]} coordinates as the rows have, got {columns.linear.shape[1]}; "
            "make both with the same joint weights"
        )
    if not np.array_equal(rows.quaternion_weight, columns.quaternion_weight):
        raise ValueError("columns: want the rows' quaternion_weight, got others; make both with the same joint weights")


def concatenate(parts: Iterable[PoseFeatures]) -> PoseFeatures:
    """Stack the poses of several clips.

    Parameters
    ----------
    parts : at least one, all made alike

    Returns
    -------
    PoseFeatures of all rows, in order

    Raises
    ------
    ValueError
        If there is no part, or two were made differently.
    """
    parts = list(parts)
    if not parts:
        raise ValueError("parts: want at least one, got none")
    for part in parts[1:]:
        check_pair(parts[0], part)
    return PoseFeatures(
        parts[0].metric,
        np.concatenate([part.linear for part in parts]),
        np.concatenate([part.quaternion_wxyz for part in parts]),
        parts[0].quaternion_weight,
    )


def pose_distance(rows: PoseFeatures, columns: PoseFeatures) -> Float:
    """Distances of every row to every column, the reference of every device's twin.

    Parameters
    ----------
    rows : PoseFeatures of n poses
    columns : PoseFeatures of m poses, made alike

    Returns
    -------
    (n, m) float64, square metres or square radians, >= 0
        Symmetric and zero on equal poses, to the bit. Empty when n or m is 0.

    Raises
    ------
    ValueError
        If the two were not made alike (metric, coordinates, weights).

    Notes
    -----
    Equations 17 and 18 of [Xu2015], with the velocities it allows in the sum. Terms are added one after another in
    a fixed order by element-wise operations: no matrix product, whose last bits would change with shapes and threads.
    """
    check_pair(rows, columns)
    distance = np.zeros((len(rows), len(columns)))
    (a, p), (b, q) = _by_coordinate(rows), _by_coordinate(columns)
    for r in range(0, len(rows), _TILE_ROWS):
        row = slice(r, r + _TILE_ROWS)
        for c in range(0, len(columns), _TILE_COLUMNS):
            column = slice(c, c + _TILE_COLUMNS)
            distance[row, column] = _sum(
                a[:, row, None], b[:, None, column], p[:, :, row, None], q[:, :, None, column], rows.quaternion_weight
            )
    return distance


def paired_distance(first: PoseFeatures, second: PoseFeatures) -> Float:
    """Distance of each pose to the one in the same row: the diagonal of :func:`pose_distance`, to the bit.

    Parameters
    ----------
    first, second : PoseFeatures of n poses each, made alike

    Returns
    -------
    (n,) float64, square metres or square radians, >= 0

    Raises
    ------
    ValueError
        If the two were not made alike or differ in length.
    """
    check_pair(first, second)
    if len(first) != len(second):
        raise ValueError(f"second: want {len(first)} poses as the first has, got {len(second)}")
    (a, p), (b, q) = _by_coordinate(first), _by_coordinate(second)
    return _sum(a, b, p, q, first.quaternion_weight)


def _by_coordinate(poses: PoseFeatures) -> tuple[Float, Float]:
    """Coordinates first, poses last: (D, N) and (K, 4, N), contiguous."""
    return np.ascontiguousarray(poses.linear.T), np.ascontiguousarray(poses.quaternion_wxyz.transpose(1, 2, 0))


def _sum(a: Float, b: Float, p: Float, q: Float, weight: Float) -> Float:
    """Sum the terms: a, b (D, ...) and p, q (K, 4, ...) broadcast against each other behind their feature axes."""
    total = np.zeros(np.broadcast_shapes(a.shape[1:], b.shape[1:]))
    term, near, far = np.zeros_like(total), np.zeros_like(total), np.zeros_like(total)
    for d in range(len(a)):
        np.subtract(a[d], b[d], out=term)
        np.multiply(term, term, out=term)
        np.add(total, term, out=total)
    for k in range(len(weight)):
        near[...], far[...] = 0.0, 0.0
        for c in range(4):  # the chord to q and to -q, which are the same rotation
            for chord, sign in ((near, np.subtract), (far, np.add)):
                sign(p[k, c], q[k, c], out=term)
                np.multiply(term, term, out=term)
                np.add(chord, term, out=chord)
        # angle = 4 arcsin(chord / 2): exact near zero, where arccos of the inner product is not
        np.sqrt(np.minimum(near, far, out=near), out=near)
        np.arcsin(np.minimum(near * 0.5, 1.0, out=near), out=near)
        np.multiply(near, near, out=near)
        np.multiply(near, 16.0 * weight[k], out=near)
        np.add(total, near, out=total)
    return total


def error_bound(features: PoseFeatures, dtype: np.dtype[np.floating]) -> tuple[float, float]:
    """Bound how far a backend's distance may be from the reference.

    Parameters
    ----------
    features : PoseFeatures, every pose that takes part
    dtype : float32 or float64, of the backend's answer

    Returns
    -------
    relative, absolute : float
        ``|√d_backend − √d| <= relative · √d + absolute``. Both 0 for float64, which is the reference itself.

    Raises
    ------
    ValueError
        If the type is neither.

    Notes
    -----
    With u = 2⁻²⁴: rounding a pose to float32 moves it by at most u·‖linear‖ and each angle by 6u (θ = 4 arcsin(s/2)
    has slope at most 2√2 in the chord, and two chord ends move by u each), so by the triangle inequality √d moves by
    2u·max‖linear‖ + 6u·√Σw. A sum of T non-negative terms of a few roundings each is within (T + 16)u of itself, its
    root within half of that. A factor of two covers second-order terms and the polynomial that stands for arcsin².
    """
    if dtype == np.float64:
        return 0.0, 0.0
    if dtype != np.float32:
        raise ValueError(f"dtype: want float32 or float64, got {dtype}")
    unit = 2.0**-24
    longest = float(np.sqrt(np.square(features.linear).sum(axis=1).max(initial=0.0)))
    spread = float(np.sqrt(features.quaternion_weight.sum()))
    terms = features.linear.shape[1] + len(features.quaternion_weight)
    return unit * (terms + 16), 2 * unit * (2 * longest + 6 * spread)
