"""One body, and only one: two dancers under one root are told by their second set of limbs."""

from __future__ import annotations

import re

import numpy as np

from kernels.health.body_in_motion import BodyInMotion
from kernels.health.verdicts import ClipFault
from kernels.skeleton import axes, canonical, naming
from kernels.types import Skeleton

_FEWEST_JOINTS = len(canonical.REQUIRED_JOINTS)
"""Of a second body, by definition of what the first must have."""

_LIKE_SIZE = 3.0
"""How much larger or smaller a second body may be that only its shape tells. Chosen by hand: a child too."""

_COPY = re.compile(r"(?:[#._\s-]\d+)+$")
"""What exporters put behind a name they have met before: ``_2``, ``.001``, ``#2``."""


def more_bodies(body: BodyInMotion) -> tuple[None, list[ClipFault]]:
    """Find a second body in the rig.

    Parameters
    ----------
    body : BodyInMotion

    Returns
    -------
    None, and the faults
        Refused, with the hips of both in the sentence; none where there is one body.
    """
    skeleton = body.clip.skeleton
    second = _second(skeleton, set(body.needed), axes.stature(skeleton, body.mapping.joint))
    if second is None:
        return None, []
    first = skeleton.joints[body.at["hips"]]
    said = (
        f"two bodies: want one, got the joints of a second, from {second!r}, beside those of {first!r}; "
        "export each dancer to a file of its own"
    )
    return None, [body.whole("body_count", "refused", said)]


def _second(skeleton: Skeleton, needed: set[int], height_m: float) -> str | None:
    """Name the hips of a second body; None where there is none."""
    tops = [k for k in range(1, len(skeleton.joints)) if k not in needed and int(skeleton.parent[k]) in needed]
    for branch in (_branch(skeleton, k) for k in tops):
        if len(branch) < _FEWEST_JOINTS:
            continue
        part = _cut(skeleton, branch)
        try:
            found = naming.map_joints(part)
        except ValueError:
            continue
        ratio = axes.stature(part, found.joint) / height_m if height_m > 0 else 1.0
        if found.family != "topology" or 1 / _LIKE_SIZE < ratio < _LIKE_SIZE:
            hips = part.joints.index(found.joint["hips"])
            return skeleton.joints[branch[hips]]
    return None


def _branch(skeleton: Skeleton, top: int) -> list[int]:
    """List a joint and all below it, in order."""
    below = {top}
    for k in range(top + 1, len(skeleton.joints)):
        if int(skeleton.parent[k]) in below:
            below.add(k)
    return sorted(below)


def _cut(skeleton: Skeleton, branch: list[int]) -> Skeleton:
    """Make a skeleton of a branch, its names without what marks them as copies where they stay apart."""
    names = tuple(_COPY.sub("", skeleton.joints[k]) for k in branch)
    if len(set(names)) < len(names):
        names = tuple(skeleton.joints[k] for k in branch)
    new = {k: i for i, k in enumerate(branch)}
    parent = np.array([new.get(int(skeleton.parent[k]), -1) for k in branch], np.int64)
    return Skeleton(names, parent, skeleton.offset_xyz_m[branch])
