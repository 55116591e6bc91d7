"""The shape of a rig: which branches of its tree are legs, arms, spine and head.

Conventions
-----------
Lengths are compared with each other only, so units and axes do not matter. Joints are indices into the skeleton.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from kernels.skeleton import kinematics
from kernels.types import Float, Skeleton

ARM = ("Shoulder", "UpperArm", "LowerArm", "Hand")
LEG = ("UpperLeg", "LowerLeg", "Foot", "Toes")
_MOST_PAIRS = 24
"""Pairs of like branches that are looked at for arms and legs. Chosen for time, by hand."""

# Where the joints of the canonical spine lie on the way from hips to neck, by definition of it.
SPINE = {"spine": 0.10 / 0.51, "chest": 0.23 / 0.51, "upperChest": 0.36 / 0.51}


def path_up(skeleton: Skeleton, joint: int) -> list[int]:
    """List the joint and all above it, up to the root.

    Parameters
    ----------
    skeleton : Skeleton
    joint : int, 0 to J - 1

    Returns
    -------
    list of int
        From the joint to the root; the root alone for itself.
    """
    path = [joint]
    while path[-1] > 0:
        path.append(int(skeleton.parent[path[-1]]))
    return path


def is_above(skeleton: Skeleton, upper: int, lower: int) -> bool:
    """Whether ``upper`` is an ancestor of ``lower``, or the same joint.

    Parameters
    ----------
    skeleton : Skeleton
    upper, lower : int, 0 to J - 1
    """
    while lower > upper:
        lower = int(skeleton.parent[lower])
    return lower == upper


def common_ancestor(skeleton: Skeleton, a: int, b: int) -> int:
    """Find the lowest joint above both, or one of them where it is above the other.

    Parameters
    ----------
    skeleton : Skeleton
    a, b : int, 0 to J - 1
    """
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

    The legs are a pair of branches alike at one joint, the arms a pair alike at a joint above it that carries one more
    branch, the head. Thigh and shin, upper and lower arm are the two longest bones in a row of their branch. Left and
    right are told by names; where these do not say, by the side they are on, seen from the hips looking where the feet
    point in the rest pose.

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
    tree = _Tree(skeleton)
    best: tuple[float, dict[str, int]] | None = None
    pairs = tree.pairs()
    for hips, legs in pairs:
        for top, arms in pairs:
            if top == hips or not is_above(skeleton, hips, top) or any(is_above(skeleton, leg, top) for leg in legs):
                continue
            body = _limbs(tree, hips, legs, top, arms)
            size = tree.reach[list(legs)].sum() + tree.reach[list(arms)].sum()
            if body is not None and (best is None or size > best[0]):
                best = (float(size), body)
    if best is None:
        return None
    told = _tell_sides(tree, best[1], sides)
    return None if told is None else {name: skeleton.joints[k] for name, k in told.items()}


class _Tree:
    """Children, bone lengths and reach (the longest way down) of each joint."""

    def __init__(self, skeleton: Skeleton) -> None:
        n = len(skeleton.joints)
        self.skeleton = skeleton
        self.rest = kinematics.rest_position(skeleton)
        self.length = np.linalg.norm(skeleton.offset_xyz_m, axis=-1)
        self.children = [[int(c) for c in np.flatnonzero(skeleton.parent == k)] for k in range(n)]
        self.reach = np.zeros(n)
        for k in range(n - 1, 0, -1):
            parent = int(skeleton.parent[k])
            self.reach[parent] = max(self.reach[parent], self.reach[k] + self.length[k])

    def chain(self, joint: int) -> list[int]:
        """List the joint and the longest way down from it, without joints of no length and twist joints."""
        chain = [joint]
        while self.children[chain[-1]]:
            chain.append(max(self.children[chain[-1]], key=lambda c: self.reach[c] + self.length[c]))
        first, *rest = chain
        names = self.skeleton.joints
        return [first, *(k for k in rest if self.length[k] > 1e-9 and not re.search("twist|roll", names[k].lower()))]

    def pairs(self) -> list[tuple[int, tuple[int, int]]]:
        """List joints with two branches alike, each of three joints or more, longest first."""
        found = []
        for joint, children in enumerate(self.children):
            for i, a in enumerate(children):
                for b in children[i + 1 :]:
                    one, other = self._bones(a), self._bones(b)
                    if len(one) == len(other) >= 2 and (np.abs(one - other) < 0.15 * one.max()).all():
                        found.append((joint, (a, b)))
        found.sort(key=lambda pair: -self.reach[pair[1][0]])
        return found[:_MOST_PAIRS]

    def _bones(self, joint: int) -> Float:
        return np.array([self.length[k] for k in self.chain(joint)[1:]])


def _limbs(tree: _Tree, hips: int, legs: tuple[int, int], top: int, arms: tuple[int, int]) -> dict[str, int] | None:
    """Canonical joints of a tree whose pairs are known, sides A and B as they come; None where it is no body."""
    body = {"hips": hips}
    for name, branches, parts in (("leg", legs, LEG), ("arm", arms, ARM[1:])):
        for side, branch in zip("AB", branches, strict=True):
            chain = tree.chain(branch)
            bone = np.array([tree.length[k] for k in chain[1:]])
            at = int(np.argmax(bone[:-1] + bone[1:])) if len(bone) > 1 else -1
            if at < 0 or bone[at : at + 2].min() < 0.5 * bone[at : at + 2].max():
                return None
            if name == "arm" and at == 0 and len(bone) > 2 and bone[0] < bone[1] < 2 * bone[2]:
                at = 1  # a long collar bone before the arm
            if name == "arm" and at > 0:
                body[side + "Shoulder"] = chain[at - 1]
            for part, k in zip(parts, chain[at:], strict=False):
                body[side + part] = k
    rest = [c for c in tree.children[top] if c not in arms]
    if not rest:
        return None
    head = tree.chain(max(rest, key=lambda c: tree.reach[c]))
    if tree.reach[head[0]] + tree.length[head[0]] > 0.9 * tree.reach[legs[0]]:
        return None
    fork = next((i for i, k in enumerate(head) if len(tree.children[k]) > 1), len(head) - 1)
    bones = [k for k in head[: fork + 1] if not re.search("(end|nub|tip)$", tree.skeleton.joints[k].lower())]
    return body | {"head": bones[-1]} if bones else None


def _tell_sides(tree: _Tree, body: dict[str, int], sides: Sequence[str]) -> dict[str, int] | None:
    """Names with left and right for sides A and B, legs and arms each; None where they cannot be told."""
    told = {name: k for name, k in body.items() if name[0] not in "AB"}
    for limb in (LEG, ARM):
        pairs = [(body["A" + part], body["B" + part]) for part in limb if "A" + part in body and "B" + part in body]
        named = {(sides[a], sides[b]) for a, b in pairs} - {("", "")}
        if named <= {("left", "right")} and named:
            is_left = True
        elif named <= {("right", "left")} and named:
            is_left = False
        else:
            seen = _is_left(tree, body, [pair[0] for pair in pairs], [pair[1] for pair in pairs])
            if named or seen is None:
                return None
            is_left = seen
        for part in limb:
            for side, is_a in (("left", is_left), ("right", not is_left)):
                if ("A" if is_a else "B") + part in body:
                    told[side + part] = body[("A" if is_a else "B") + part]
    return told


def _is_left(tree: _Tree, body: dict[str, int], one: list[int], other: list[int]) -> bool | None:
    """Whether ``one`` is left of ``other`` in the rest pose; None where that pose does not say."""
    if "AToes" not in body or "BToes" not in body:
        return None
    up = tree.rest[body["head"]] - tree.rest[body["hips"]]
    up = up / max(float(np.linalg.norm(up)), 1e-12)
    thigh = sum(tree.rest[body[s + "LowerLeg"]] - tree.rest[body[s + "UpperLeg"]] for s in "AB")
    ahead = sum(tree.rest[body[s + "Toes"]] - tree.rest[body[s + "Foot"]] for s in "AB")
    ahead = ahead - up * (up @ ahead)
    across = tree.rest[one].mean(axis=0) - tree.rest[other].mean(axis=0)
    left = np.cross(up, ahead)
    sharpness = float(left @ across) / max(float(np.linalg.norm(left) * np.linalg.norm(across)), 1e-12)
    is_standing = up @ thigh < -0.5 * np.linalg.norm(thigh)
    return sharpness > 0 if is_standing and abs(sharpness) > 0.5 else None
