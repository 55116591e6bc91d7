"""A mannequin to look at: one rigid part a bone, built from a skeleton at rest.

Conventions
-----------
Parts know the canonical joint names and get the thickness of a human body there; any other joint gets a plain limb to
each of its children. Thicknesses are those of a body 1.72 m tall and grow with the skeleton's bones. The soles lie
2 cm below the lower of ankle and toes, which for the canonical skeleton is the floor.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from kernels.skeleton.canonical import CANONICAL
from kernels.skeleton.kinematics import rest_position
from kernels.types import Float, Int, Skeleton

# Joint, without its side: the joint its part reaches to, half widths in metres at both ends, depth over width. All
# chosen by hand, to look like a mannequin.
_LIMBS: dict[str, tuple[str, float, float, float]] = {
    "hips": ("spine", 0.160, 0.125, 0.70),
    "spine": ("chest", 0.125, 0.135, 0.70),
    "chest": ("upperChest", 0.135, 0.155, 0.70),
    "upperChest": ("neck", 0.165, 0.080, 0.66),
    "neck": ("head", 0.052, 0.050, 1.0),
    "Shoulder": ("UpperArm", 0.028, 0.056, 1.0),
    "UpperArm": ("LowerArm", 0.052, 0.040, 1.0),
    "LowerArm": ("Hand", 0.040, 0.028, 1.0),
    "UpperLeg": ("LowerLeg", 0.082, 0.058, 1.0),
    "LowerLeg": ("Foot", 0.058, 0.040, 1.0),
}
_PLAIN_RATIO = 0.12  # half width over length of a limb without a name, chosen by hand
_PLAIN_M = (0.008, 0.060)  # and its bounds, chosen by hand

_SOLE_M = 0.02
"""Of the canonical foot below its toes, by definition."""

_SECTIONS = 14
_ARC = 4
"""Corners of a limb's cross-section, and rings of a rounded end. Chosen by hand."""


@dataclass(frozen=True, eq=False)
class BodyMesh:
    """Triangles of a body at rest, each vertex carried by one joint.

    Parameters
    ----------
    point_xyz_m : (V, 3) float64, metres, world, at rest
    normal_xyz : (V, 3) float64, unit
    triangle : (T, 3) int64, vertex indices, counter-clockwise seen from outside
    joint_index : (V,) int64, index into the skeleton's joints
    side_index : (T,) int64, index into :data:`schemas.stage_contract.SIDES`
    """

    point_xyz_m: Float
    normal_xyz: Float
    triangle: Int
    joint_index: Int
    side_index: Int


def body(skeleton: Skeleton) -> BodyMesh:
    """Build the mannequin of a skeleton.

    Parameters
    ----------
    skeleton : Skeleton of J joints

    Returns
    -------
    BodyMesh
        At least one part; equal skeletons give equal arrays. Bones of no length get no part.
    """
    rest = rest_position(skeleton)
    scale = _scale(skeleton)
    parts = _parts(skeleton, rest, scale)
    n_points = [len(mesh.vertices) for _, mesh in parts]
    n_triangles = [len(mesh.faces) for _, mesh in parts]
    joint = np.array([joint for joint, _ in parts])
    side = np.array([_side(skeleton.joints[k], rest[k], scale) for k in joint])
    first = np.repeat(np.cumsum([0, *n_points[:-1]]), n_triangles)
    whole = trimesh.Trimesh(
        np.concatenate([mesh.vertices for _, mesh in parts]),
        np.concatenate([mesh.faces for _, mesh in parts]) + first[:, None],
        process=False,
    )
    return BodyMesh(
        point_xyz_m=np.array(whole.vertices),
        normal_xyz=np.array(whole.vertex_normals),
        triangle=np.array(whole.faces, np.int64),
        joint_index=np.repeat(joint, n_points),
        side_index=np.repeat(side, n_triangles),
    )


def _scale(skeleton: Skeleton) -> float:
    """Size against the canonical body: by the bones both have, else by the median bone; 1 where there is no length."""
    length_m = np.linalg.norm(skeleton.offset_xyz_m[1:], axis=-1)
    canonical_m = dict(zip(CANONICAL.joints[1:], np.linalg.norm(CANONICAL.offset_xyz_m[1:], axis=-1), strict=True))
    shared = [k for k, joint in enumerate(skeleton.joints[1:]) if joint in canonical_m]
    if len(shared) > len(canonical_m) // 2:
        scale = float(length_m[shared].sum() / sum(canonical_m[skeleton.joints[k + 1]] for k in shared))
    elif (length_m > 0).any():
        scale = float(np.median(length_m[length_m > 0]) / np.median(list(canonical_m.values())))
    else:
        scale = 1.0
    return scale or 1.0


def _side(joint: str, rest_xyz_m: Float, scale: float) -> int:
    """Find the side by the name, else by the place at rest; an index into SIDES."""
    name = joint.lower()
    if "left" in name or "right" in name:
        return 1 if "left" in name else 2
    if abs(rest_xyz_m[0]) < 0.02 * scale:
        return 0
    return 1 if rest_xyz_m[0] > 0 else 2


def _parts(skeleton: Skeleton, rest: Float, scale: float) -> list[tuple[int, trimesh.Trimesh]]:
    """Each part with the index of the joint that carries it, in the order of the joints; a ball where there is none."""
    parts = [(k, mesh) for k in range(len(skeleton.joints)) for mesh in _part(skeleton, rest, k, scale)]
    return parts or [(0, _ball(rest[0], 0.05 * scale))]


def _part(skeleton: Skeleton, rest: Float, k: int, scale: float) -> Iterator[trimesh.Trimesh]:
    """Make what one joint carries."""
    joint = skeleton.joints[k]
    side = next((s for s in ("left", "right") if joint.startswith(s)), "")
    part = joint[len(side) :]
    at = {name: rest[i] for i, name in enumerate(skeleton.joints)}
    if part == "head":
        yield from _head(rest[k], scale)
    elif part == "Hand" and side + "LowerArm" in at:
        yield from _hand(at[side + "LowerArm"], rest[k], scale)
    elif part == "Foot" and side + "Toes" in at:
        yield from _foot(rest[k], at[side + "Toes"], scale)
    elif part == "Toes" and side + "Foot" in at:
        yield from _toes(at[side + "Foot"], rest[k], scale)
    elif part in _LIMBS and (side + _LIMBS[part][0]) in at:
        tip, start_m, end_m, depth_ratio = _LIMBS[part]
        yield from _limb(rest[k], at[side + tip], start_m * scale, end_m * scale, depth_ratio=depth_ratio)
    else:
        for child in np.flatnonzero(skeleton.parent == k):
            length = float(np.linalg.norm(rest[child] - rest[k]))
            width = float(np.clip(_PLAIN_RATIO * length, _PLAIN_M[0] * scale, _PLAIN_M[1] * scale))
            yield from _limb(rest[k], rest[child], width, 0.8 * width)


def _limb(
    start: Float, end: Float, start_m: float, end_m: float, *, depth_ratio: float = 1.0
) -> Iterator[trimesh.Trimesh]:
    """Make a capsule that tapers from one end to the other; none where the ends meet."""
    length = float(np.linalg.norm(end - start))
    if length < 1e-6:
        return
    # Half spheres over the ends, flattened where the limb is short against its width.
    cap = min(1.0, 0.6 * length / max(start_m, end_m))
    low = np.linspace(-np.pi / 2, 0, _ARC + 1)
    high = np.linspace(0, np.pi / 2, _ARC + 1)
    radius = np.concatenate([start_m * np.cos(low), end_m * np.cos(high)])
    height = np.concatenate([start_m * cap * np.sin(low), length + end_m * cap * np.sin(high)])
    radius[[0, -1]] = 0.0
    yield _lathe(radius, height, start, _frame(end - start), depth_ratio)


def _ball(center: Float, radius_m: float, *, stretch: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> trimesh.Trimesh:
    """Make an ellipsoid along the axes of the world."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 2 * _ARC + 1)
    radius = np.cos(angle)
    radius[[0, -1]] = 0.0
    mesh = _lathe(radius, np.sin(angle), np.zeros(3), _frame(np.array([0.0, 1.0, 0.0])), 1.0)
    return _mesh(np.asarray(mesh.vertices) * radius_m * np.array(stretch) + center, np.asarray(mesh.faces))


def _head(at: Float, scale: float) -> Iterator[trimesh.Trimesh]:
    """Make a skull and a nose, so that a still tells where the dancer looks."""
    yield _ball(at + np.array([0.0, 0.060, 0.012]) * scale, 0.110 * scale, stretch=(0.72, 1.0, 0.88))
    yield _ball(at + np.array([0.0, 0.045, 0.110]) * scale, 0.020 * scale, stretch=(0.8, 1.2, 1.2))


def _hand(elbow: Float, wrist: Float, scale: float) -> Iterator[trimesh.Trimesh]:
    """Make a flat palm along the forearm and a thumb on its front side."""
    frame = _frame(wrist - elbow)
    side, along = frame[:, 1], frame[:, 2]
    yield _box(
        wrist + along * 0.085 * scale, np.stack([frame[:, 0], side, along], 1), np.array([0.026, 0.080, 0.17]) * scale
    )
    root = wrist + (along * 0.03 + side * 0.035) * scale
    yield from _limb(root, root + (along * 0.05 + side * 0.035) * scale, 0.013 * scale, 0.010 * scale)


def _foot(ankle: Float, toes: Float, scale: float) -> Iterator[trimesh.Trimesh]:
    """Make a wedge from the heel to the ball of the foot, flat below."""
    ahead, sole = _walk(ankle, toes), min(ankle[1], toes[1]) - _SOLE_M * scale
    length = max(float((toes - ankle) @ ahead), 0.02 * scale)
    yield _wedge(
        ankle * np.array([1.0, 0.0, 1.0]),
        ahead,
        (-0.055 * scale, length),
        sole,
        (ankle[1] + 0.012 * scale, toes[1] + 0.022 * scale),
        (0.034 * scale, 0.046 * scale),
    )


def _toes(ankle: Float, toes: Float, scale: float) -> Iterator[trimesh.Trimesh]:
    """Make the front of the foot, flat below."""
    sole = min(ankle[1], toes[1]) - _SOLE_M * scale
    yield _wedge(
        toes * np.array([1.0, 0.0, 1.0]),
        _walk(ankle, toes),
        (0.004 * scale, 0.075 * scale),
        sole,
        (toes[1] + 0.020 * scale, toes[1] + 0.004 * scale),
        (0.046 * scale, 0.034 * scale),
    )


def _walk(ankle: Float, toes: Float) -> Float:
    """Horizontal direction of a foot; +Z where it points straight down."""
    ahead = (toes - ankle) * np.array([1.0, 0.0, 1.0])
    length = float(np.linalg.norm(ahead))
    return ahead / length if length > 1e-6 else np.array([0.0, 0.0, 1.0])


def _wedge(
    ground: Float,
    ahead: Float,
    reach_m: tuple[float, float],
    sole_m: float,
    top_m: tuple[float, float],
    half_width_m: tuple[float, float],
) -> trimesh.Trimesh:
    """Make a box along the ground, from a point at height 0, whose back and front differ in height and width."""
    left, up = np.cross(np.array([0.0, 1.0, 0.0]), ahead), np.array([0.0, 1.0, 0.0])
    corners = []
    for way in (-1.0, 1.0):
        for height_m in ((sole_m, sole_m), top_m):
            for end in (0, 1):
                corners.append(ground + ahead * reach_m[end] + left * way * half_width_m[end] + up * height_m[end])
    return _flat(np.array(corners))


def _box(center: Float, frame: Float, size_m: Float) -> trimesh.Trimesh:
    """Make a box along the columns of a frame."""
    half = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return _flat(center + (half * size_m) @ frame.T)


def _flat(corners: Float) -> trimesh.Trimesh:
    """Six flat sides over eight corners; corner 4x + 2y + z is at the low or high end of three right-handed axes."""
    sides = np.array(
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]],
    )
    first = 4 * np.arange(6)[:, None]
    return _mesh(
        corners[sides].reshape(-1, 3), np.concatenate([first + np.array(half) for half in ([0, 1, 2], [0, 2, 3])])
    )


def _lathe(radius: Float, height: Float, start: Float, frame: Float, depth_ratio: float) -> trimesh.Trimesh:
    """Revolve a profile about the third column of a frame, flattened along the second."""
    turned = trimesh.creation.revolve(np.stack([radius, height], -1), sections=_SECTIONS)
    local = np.asarray(turned.vertices) * np.array([1.0, depth_ratio, 1.0])
    return _mesh(start + local @ frame.T, np.asarray(turned.faces))


def _mesh(points: Float, triangles: NDArray[np.int64]) -> trimesh.Trimesh:
    """Make a mesh of the points in use, in their order."""
    used, triangles_used = np.unique(triangles, return_inverse=True)
    return trimesh.Trimesh(points[used], triangles_used.reshape(triangles.shape), process=False)


def _frame(along: Float) -> Float:
    """Right-handed columns: width, front, along; the front is as near to +Z as it can be, else to +Y."""
    axis = along / np.linalg.norm(along)
    front = next(hint for hint in np.eye(3)[[2, 1]] if abs(hint @ axis) < 0.95)
    front = front - axis * (front @ axis)
    front /= np.linalg.norm(front)
    return np.stack([np.cross(front, axis), front, axis], axis=1)
