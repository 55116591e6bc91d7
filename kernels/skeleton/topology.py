"""The shape of a rig: which branches of its tree are legs, arms, spine and head.

Conventions
-----------
Lengths are compared with each other only, so units and axes do not matter. Joints are indices into the skeleton.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from kernels.types import Skeleton

ARM = ("Shoulder", "UpperArm", "LowerArm", "Hand")
LEG = ("UpperLeg", "LowerLeg", "Foot", "Toes")
# Where the joints of the canonical spine lie on the way from hips to neck.
SPINE = {"spine": 0.10 / 0.51, "chest": 0.23 / 0.51, "upperChest": 0.36 / 0.51}


def path_up(skeleton: Skeleton, joint: int) -> list[int]:
    """List the joint and all above it, up to the root."""
    path = [joint]
    while path[-1] > 0:
        path.append(int(skeleton.parent[path[-1]]))
    return path


def is_above(skeleton: Skeleton, upper: int, lower: int) -> bool:
    """Whether ``upper`` is an ancestor of ``lower``, or the same joint."""
    while lower > upper:
        lower = int(skeleton.parent[lower])
    return lower == upper


def common_ancestor(skeleton: Skeleton, a: int, b: int) -> int:
    """Find the lowest joint above both, or one of them where it is above the other."""
    while a != b:
        if a > b:
            a = int(skeleton.parent[a])
        else:
            b = int(skeleton.parent[b])
    return a


def trunk(skeleton: Skeleton, joint: Mapping[str, str]) -> tuple[list[int], list[int]]:
    """List the spine and the neck of a rig whose hips, head and arms are known.

    Parameters
    ----------
    skeleton : Skeleton
    joint : canonical name to the rig's name, with hips, head and both upper arms

    Returns
    -------
    spine : joints above the hips, up to the one that carries the arms, in order
        Empty when the arms hang from the hips.
    neck : joints above that one, up to and with the head, in order
    """
    at = {name: skeleton.joints.index(source) for name, source in joint.items()}
    first = {side: at.get(side + "Shoulder", at[side + "UpperArm"]) for side in ("left", "right")}
    top = common_ancestor(skeleton, first["left"], first["right"])
    base = common_ancestor(skeleton, at["hips"], top)
    up = path_up(skeleton, at["head"])
    fork = next((k for k in up if is_above(skeleton, k, top)), 0)
    spine = [
        k for k in reversed(path_up(skeleton, top)) if k > base and k != at["hips"] and is_above(skeleton, base, k)
    ]
    neck = [k for k in reversed(up) if k > fork and is_above(skeleton, fork, k)]
    return spine, neck


def spread_spine(skeleton: Skeleton, joint: Mapping[str, str]) -> dict[str, str]:
    """Name spine, chest, upperChest and neck among the joints between hips and head, by their place along the way.

    Parameters
    ----------
    skeleton : Skeleton
    joint : canonical name to the rig's name, with hips, head and both upper arms

    Returns
    -------
    dict
        ``joint`` with the trunk's joints added: with three or more, the nearest to each canonical joint's place, in
        order; with two, spine and chest; with one, spine.
    """
    spine, neck = trunk(skeleton, joint)
    named = {name: source for name, source in joint.items() if name not in (*SPINE, "neck")}
    if len(neck) > 1:
        named["neck"] = skeleton.joints[neck[0]]
    length = np.linalg.norm(skeleton.offset_xyz_m, axis=-1)
    end = neck[0] if neck else spine[-1] if spine else 0
    reach = np.cumsum(length[spine])
    whole = reach[-1] + length[end] if spine else 1.0
    place = reach / whole if whole > 0 else reach
    names = list(SPINE)[: len(spine)]
    first = 0
    for i, name in enumerate(names):
        last = len(spine) - (len(names) - i - 1)
        k = first + int(np.argmin(np.abs(place[first:last] - SPINE[name])))
        named[name] = skeleton.joints[spine[k]]
        first = k + 1
    return named


def find_body(skeleton: Skeleton, *, sides: Sequence[str]) -> dict[str, str] | None:
    """Find legs, arms and head by the shape of the tree.

    Parameters
    ----------
    skeleton : Skeleton
    sides : per joint ``"left"``, ``"right"`` or ``""``
        As far as names tell.

    Returns
    -------
    dict or None
        Canonical name to the rig's name; None when the tree is no body's, or left and right cannot be told.
    """
    return None
