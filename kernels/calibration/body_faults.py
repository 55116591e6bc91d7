"""What is wrong with a recording as a body: labels exchanged, sides mirrored, rotations written another way.

Conventions
-----------
These rules look at cleaned arrays; those for single values are in :mod:`kernels.calibration.faults`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from kernels import rotation
from kernels.calibration.joints import PairSolution
from kernels.calibration.pairs import find_swap, pair_costs, pair_residuals, spanning_tree
from kernels.calibration.records import JOINTS, PARENT, SENSORS, Cleaned, RecordingFinding, Severity
from kernels.types import Float

_MOST_FRAMES = 2000
_LEAST_FRAMES = 200
"""Frames that are judged at most, for speed, and frames with every sensor good below which all are judged. Chosen by
hand."""

_ENOUGH_FRAMES = 240
_GOOD_FRAMES = 960
"""Frames of a joint. Measured on made-up recordings with 2 mm and 1 degree of noise: the median error of bone lengths
is 2.1 mm with 240 frames and 0.7 mm with 960, and with 120 some are off by any amount."""

_SWAP_RATIO = 0.8
"""Residual with two labels exchanged over that as given. Measured on made-up recordings: at most 0.61 where labels are
exchanged, at least 1.6 where they are right."""

_MOST_SWAPS = 4
"""Pairs of labels exchanged at the same time. Chosen by hand: with more, the sides are likelier to be exchanged."""

_TREE_RATIO = 3.0
_TREE_M = 0.010
"""How many times better another edge must fit, and how far the given one must be off. Chosen so that soft tissue of a
good made-up recording, up to 12 mm, gives no warning."""

_BETTER_RATIO = 0.5
"""Residual of rotations read another way over that as given. Measured on made-up recordings: right readings leave 3 to
11 mm, wrong ones 175 to 305 mm."""

_SIDE = 0.3
"""Mean cosine of hips and shoulders, and share of the bend of the knees, below minus which sides are exchanged.
Measured on made-up recordings: 0.87 to 0.98 where labels are right, the same negative where they are exchanged."""

_LOOSE_M = 0.030
_STRANGE_M = 0.060
"""Robust distance of a joint's two ends, an axis. Chosen by hand above what soft tissue does."""

ORDERS: dict[str, Callable[[Float], Float]] = {
    "inverted (world to sensor)": rotation.inv,
    "x y z w": lambda q: q[..., [3, 0, 1, 2]],
    "x y z w and inverted": lambda q: rotation.inv(q[..., [3, 0, 1, 2]]),
}
_MOVES: dict[str, str] = {
    "thorax": "bend forwards, sideways and twist the trunk on still hips",
    "head": "repeat head rolls: nod, tilt and turn",
    "shoulder": "shrug and roll the shoulders, forwards and back",
    "upper_arm": "circle the arms, large, forwards and back",
    "forearm": "bend the elbow and turn the palm up and down with it bent",
    "hand": "circle the hands at the wrist",
    "thigh": "swing and circle the leg from the hip",
    "shank": "bend the knee, and sitting turn the foot in and out with the thigh still",
    "foot": "circle the foot at the ankle",
}


def move_to_repeat(joint: str) -> str:
    """Say which movement shows a joint, in a performer's words.

    Parameters
    ----------
    joint : str, the child segment

    Returns
    -------
    str
    """
    return _MOVES[joint[2:] if joint[:2] in ("l_", "r_") else joint]


def find_body_faults(cleaned: Cleaned, pairs: list[PairSolution]) -> tuple[RecordingFinding, ...]:
    """Judge a recording by how its sensors move together.

    Parameters
    ----------
    cleaned : Cleaned of the 17 sensors in their order
    pairs : the 16 joints as first solved

    Returns
    -------
    tuple of RecordingFinding
        Rotations written another way come alone: nothing else can be judged then. So do exchanged labels.
    """
    chosen = _frames(cleaned)
    if len(chosen) < 2:
        return ()
    turned = np.moveaxis(cleaned.recording.rotation_wxyz[chosen], 1, 0)
    place = np.ascontiguousarray(np.moveaxis(cleaned.recording.position_xyz_m[chosen], 1, 0))
    matrices = rotation.to_matrix(turned)
    residual = pair_residuals(matrices, place)
    order = _rotation_order(turned, place, residual)
    if order:
        return order
    labels = _labels(residual)
    if labels:
        return (*labels, *_movement(pairs))
    tree = _tree(residual, spanning_tree(pair_costs(matrices, place)))
    is_in_metres = all(finding.sensor is not None for finding in cleaned.findings)
    loose = _loose(pairs) if is_in_metres else []
    return (*_sides(cleaned, pairs, chosen), *tree, *loose, *_movement(pairs))


def _frames(cleaned: Cleaned) -> NDArray[np.intp]:
    """Frames to judge by: with every sensor good, where there are enough of them; spread over the recording."""
    whole = np.flatnonzero(~cleaned.is_filled.any(axis=1))
    if len(whole) < _LEAST_FRAMES:
        whole = np.arange(cleaned.recording.n_frames)
    return whole[:: max(len(whole) // _MOST_FRAMES, 1)]


def _median_edge(residual: Float) -> float:
    return float(np.median([residual[k, PARENT[k]] for k in range(1, len(PARENT))]))


def _rotation_order(turned: Float, place: Float, residual: Float) -> tuple[RecordingFinding, ...]:
    usual = _median_edge(residual)
    step = max(turned.shape[1] // 500, 1)
    for name, change in ORDERS.items():
        other = _median_edge(pair_residuals(rotation.to_matrix(change(turned[:, ::step])), place[:, ::step]))
        if other < _BETTER_RATIO * usual:
            sentence = (
                "recording: want quaternions w x y z from sensor to world, got what fits only as "
                f"{name}: joints are {1000 * usual:.0f} mm apart as given, {1000 * other:.0f} mm that way; "
                "reorder or invert qw qx qy qz"
            )
            return (RecordingFinding("error", None, None, sentence),)
    return ()


def _labels(residual: Float) -> tuple[RecordingFinding, ...]:
    """Find labels that are exchanged: two, and after those two others, as long as that helps."""
    found: list[RecordingFinding] = []
    order = np.arange(len(SENSORS))
    while len(found) < _MOST_SWAPS:
        a, b, ratio = find_swap(residual[np.ix_(order, order)], PARENT)
        if ratio >= _SWAP_RATIO:
            break
        one, other = SENSORS[a], SENSORS[b]
        sentence = (
            f"{one}, {other}: want each sensor on its own segment, got two that fit exchanged (joints {1 / ratio:.1f} "
            f"times closer); {'then ' if found else ''}exchange the labels {one} and {other}"
        )
        found.append(RecordingFinding("error", one, None, sentence))
        order[[a, b]] = order[[b, a]]
    return tuple(found)


def _sides(cleaned: Cleaned, pairs: list[PairSolution], chosen: NDArray[np.intp]) -> tuple[RecordingFinding, ...]:
    """Whole limbs on the wrong side fit as well as before; only the body's shape tells."""
    q = cleaned.recording.rotation_wxyz[chosen]
    p = cleaned.recording.position_xyz_m[chosen]

    def joint(name: str) -> Float:
        k = JOINTS.index(name)
        above = PARENT[k + 1]
        at: Float = p[:, above] + rotation.apply(q[:, above], pairs[k].in_parent_m)
        return at

    hips = joint("l_thigh") - joint("r_thigh")
    shoulders = joint("l_upper_arm") - joint("r_upper_arm")
    level = float(np.mean(np.sum(_unit(hips) * _unit(shoulders), axis=-1)))
    bent, most = 0.0, 0.0
    for side in ("l_", "r_"):
        knee = joint(side + "shank")
        across = np.cross(knee - joint(side + "thigh"), joint(side + "foot") - knee)
        bent += float(np.sum(across * _unit(hips)))
        most += float(np.sum(np.sqrt(np.sum(across * across, axis=-1))))
    knees = bent / max(most, 1e-12)
    legs, arms = "thigh, shank and foot", "shoulder, upper_arm, forearm and hand"
    if knees < -_SIDE and level > _SIDE:
        what, sensor, got = f"{arms}, {legs}", "l_shoulder", "both knees bending forwards, arms and legs alike"
    elif knees < -_SIDE:
        what, sensor, got = legs, "l_thigh", "both knees bending forwards and hips against the shoulders"
    elif level < -_SIDE:
        what, sensor, got = arms, "l_shoulder", "shoulders against the hips"
    else:
        return ()
    sentence = f"{sensor}: want left sensors on the left, got {got}; exchange l_ and r_ of {what}"
    if sensor == "l_shoulder" and legs in what:
        sentence += ", or, if the labels are right, set the tracker's hemisphere: every position is mirrored"
    return (RecordingFinding("error", sensor, None, sentence),)


def _tree(residual: Float, edges: list[tuple[int, int]]) -> tuple[RecordingFinding, ...]:
    found = []
    for k in range(1, len(PARENT)):
        if (PARENT[k], k) in edges:
            continue
        near = [j for i, j in edges if i == k] + [i for i, j in edges if j == k]
        best = min(near, key=lambda j: residual[k, j])
        given = residual[k, PARENT[k]]
        if given > max(_TREE_RATIO * residual[k, best], _TREE_M):
            sentence = (
                f"{SENSORS[k]}: want it to hang from {SENSORS[PARENT[k]]}, got a motion that fits {SENSORS[best]} "
                f"better ({1000 * residual[k, best]:.0f} against {1000 * given:.0f} mm); check labels and straps"
            )
            found.append(RecordingFinding("warning", SENSORS[k], None, sentence))
    return tuple(found)


def _loose(pairs: list[PairSolution]) -> list[RecordingFinding]:
    """Sensors that do not move with the body they are said to be on."""
    found = []
    for name, above, pair in zip(JOINTS, PARENT[1:], pairs, strict=True):
        if not pair.sigma_m > _LOOSE_M or not pair.weight.any():
            continue
        severity: Severity = "error" if pair.sigma_m > _STRANGE_M else "warning"
        sentence = (
            f"{name}: want a sensor that moves with {SENSORS[above]} about one point, got {1000 * pair.sigma_m:.0f} mm "
            f"between what the two say of it; check the straps and labels of {name} and {SENSORS[above]}, and record "
            "again"
        )
        found.append(RecordingFinding(severity, name, None, sentence))
    return found


def _movement(pairs: list[PairSolution]) -> list[RecordingFinding]:
    found = []
    for name, pair in zip(JOINTS, pairs, strict=True):
        n = int((pair.weight > 0).sum())
        degrees = np.degrees(np.sqrt(2 * np.maximum(pair.spread, 0.0)))
        if n < _ENOUGH_FRAMES:
            sentence = (
                f"{name}: want at least {_ENOUGH_FRAMES} frames with its two sensors good, got {n}; record longer"
            )
            found.append(RecordingFinding("error", name, None, sentence))
        elif pair.rank < 2:
            sentence = (
                f"{name}: want it moved about at least two axes, got {degrees[1]:.1f} degrees about the second: joint "
                f"{name} did not move enough; {move_to_repeat(name)}, then record again"
            )
            found.append(RecordingFinding("error", name, None, sentence))
        elif pair.rank == 2:
            sentence = (
                f"{name}: want it moved about every axis, got {degrees[2]:.1f} degrees about the weakest: its place "
                f"along the hinge is not seen and was set midway between the sensors; {move_to_repeat(name)}"
            )
            found.append(RecordingFinding("warning", name, None, sentence))
        elif n < _GOOD_FRAMES:
            sentence = (
                f"{name}: want {_GOOD_FRAMES} frames or more with its two sensors good, got {n}: lengths will be "
                "rough; record longer"
            )
            found.append(RecordingFinding("warning", name, None, sentence))
    return found


def _unit(vector: Float) -> Float:
    unit: Float = vector / np.maximum(np.sqrt(np.sum(vector * vector, axis=-1, keepdims=True)), 1e-12)
    return unit
