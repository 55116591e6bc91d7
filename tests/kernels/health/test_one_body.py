"""Two dancers in one rig."""

import numpy as np
import pytest

from kernels import rotation
from kernels.health.body_in_motion import BodyInMotion
from kernels.health.one_body import more_bodies
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.naming import map_joints
from kernels.types import Clip, Skeleton

NAMES = {
    "namespaces": ("Ann:{}", "Bob:{}"),
    "a number": ("{}", "{}_2"),
    "as Blender counts": ("{}", "{}.001"),
    "as repeated names are read": ("{}", "{}#2"),
    "longer names": ("one_{}", "two_{}"),
}


def couple(names, *, below_first=False):
    n = len(JOINTS)
    joints = ["World", *(names[0].format(j) for j in JOINTS), *(names[1].format(j) for j in JOINTS)]
    first = np.where(CANONICAL.parent < 0, 0, CANONICAL.parent + 1)
    second = np.where(CANONICAL.parent < 0, 1 if below_first else 0, CANONICAL.parent + 1 + n)
    offset = np.concatenate([np.zeros((1, 3)), CANONICAL.offset_xyz_m, CANONICAL.offset_xyz_m])
    skeleton = Skeleton(tuple(joints), np.concatenate([[-1], first, second]), offset)
    return Clip(skeleton, 30.0, np.zeros((5, 3)), np.tile(rotation.IDENTITY, (5, 2 * n + 1, 1)))


@pytest.mark.parametrize("below_first", [False, True])
@pytest.mark.parametrize("names", NAMES.values(), ids=list(NAMES))
def test_two_dancers_under_one_root_are_refused_and_both_named(names, below_first):
    clip = couple(names, below_first=below_first)
    righted, (fault,) = more_bodies(BodyInMotion(clip, map_joints(clip.skeleton)))
    assert righted is None
    assert (fault.kind, fault.verdict, fault.first, fault.last) == ("body_count", "refused", 0, 4)
    assert repr(names[0].format("hips")) in fault.reason
    assert repr(names[1].format("hips")) in fault.reason


def test_one_dancer_with_many_more_joints_is_one():
    hair = tuple(f"Hair{a}{b}" for a in "abc" for b in range(6))
    parent = [JOINTS.index("head") if k % 6 == 0 else 21 + k for k in range(18)]
    offset = np.concatenate([CANONICAL.offset_xyz_m, np.tile([0.01, 0.03, 0.0], (18, 1))])
    skeleton = Skeleton((*JOINTS, *hair), np.concatenate([CANONICAL.parent, parent]), offset)
    clip = Clip(skeleton, 30.0, np.zeros((2, 3)), np.tile(rotation.IDENTITY, (2, 40, 1)))
    assert more_bodies(BodyInMotion(clip, map_joints(skeleton))) == (None, [])
