"""From where a foot or hand shall be to the rotations that put it there."""

from __future__ import annotations

import numpy as np

from kernels import rotation
from kernels.types import Float


def two_bone(
    start_xyz_m: Float, target_xyz_m: Float, *, upper_m: float, lower_m: float, pole: Float
) -> tuple[Float, Float, Float]:
    """Bend a limb of two bones so that its end meets a target.

    The bones hang along -Y at rest and bend towards ``pole`` (a knee: forward). Plane trigonometry by the law of
    cosines; a target out of reach is approached as far as the straight limb goes.

    Parameters
    ----------
    start_xyz_m, target_xyz_m : (F, 3) float, metres, world: hip and ankle
    upper_m, lower_m : float, metres, > 0
    pole : (F, 3) float
        Direction the middle joint points to; need not be perpendicular to the limb, must not be parallel to it.

    Returns
    -------
    upper_wxyz, lower_wxyz : (F, 4) float64, unit, world orientations of the two bones
    end_xyz_m : (F, 3) float64, metres, where the end came to lie

    Raises
    ------
    ValueError
        If a length is not > 0 or a target lies on its start.
    """
    if not (upper_m > 0 and lower_m > 0):
        raise ValueError(f"upper_m, lower_m: want > 0, got {upper_m}, {lower_m}")
    reach = target_xyz_m - start_xyz_m
    far = np.linalg.norm(reach, axis=-1, keepdims=True)
    if (far < 1e-9).any():
        raise ValueError("target_xyz_m: want a point away from the limb's start, got the start itself")
    along = reach / far
    distance = np.clip(far, abs(upper_m - lower_m) + 1e-6, upper_m + lower_m - 1e-6)
    cosine = (upper_m**2 + distance**2 - lower_m**2) / (2 * upper_m * distance)
    sine = np.sqrt(np.maximum(1 - cosine**2, 0.0))
    side = pole - along * np.sum(pole * along, axis=-1, keepdims=True)
    side = side / np.linalg.norm(side, axis=-1, keepdims=True)
    middle = start_xyz_m + upper_m * (cosine * along + sine * side)
    end = start_xyz_m + distance * along
    hinge = np.cross(-along, side)
    return _bone(start_xyz_m - middle, hinge), _bone(middle - end, hinge), end


def _bone(up: Float, hinge: Float) -> Float:
    """Orientation whose Y axis is ``up`` and whose X axis is ``hinge``."""
    y = up / np.linalg.norm(up, axis=-1, keepdims=True)
    return rotation.from_matrix(np.stack([hinge, y, np.cross(hinge, y)], axis=-1))
