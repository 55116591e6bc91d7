import numpy as np
import pytest

from kernels.skeleton import naming, topology
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.synthetic import dancer, rigs
from kernels.types import Skeleton

NAMELESS = {name: f"bone{k}" for k, name in enumerate(JOINTS)}


def rig(**plan):
    return rigs.author(dancer.take("idle", n_beats=2).clip, rigs.RigPlan(**plan)).skeleton


def graft(skeleton, name, parent, offset):
    return Skeleton(
        (*skeleton.joints, name),
        np.append(skeleton.parent, skeleton.index(parent)),
        np.concatenate([skeleton.offset_xyz_m, [offset]]),
    )


@pytest.mark.parametrize(
    "axes",
    [{}, rigs.a_pose(), rigs.arms_forward(), rigs.lying(), rigs.splayed()],
    ids=["t-pose", "a-pose", "forward", "lying", "splayed"],
)
def test_a_body_without_names(axes):
    mapping = naming.map_joints(rig(names=NAMELESS, axes=axes))
    assert mapping.family == "topology"
    assert dict(mapping.joint) == NAMELESS


def test_scale_does_not_matter():
    small = rig(names=NAMELESS)
    large = Skeleton(small.joints, small.parent, 300 * small.offset_xyz_m)
    assert dict(naming.map_joints(large).joint) == NAMELESS


def test_without_collars_and_upper_chest():
    without = ("leftShoulder", "rightShoulder", "upperChest")
    joint = naming.map_joints(rig(names=NAMELESS, without=without)).joint
    assert dict(joint) == {name: bone for name, bone in NAMELESS.items() if name not in without}


def test_fingers_eyes_props_and_twist_joints_are_no_limbs():
    skeleton = rig(names=NAMELESS, twisted=("leftLowerArm", "rightLowerArm"))
    for side in ("left", "right"):
        for finger in range(5):
            hand = NAMELESS[side + "Hand"]
            x = (0.05 + 0.01 * finger) * (1 if side == "left" else -1)
            for part in range(3):
                skeleton = graft(skeleton, f"{side}f{finger}{part}", hand, [x, 0, 0.02 * (finger - 2)])
                hand = f"{side}f{finger}{part}"
    skeleton = graft(skeleton, "eye1", NAMELESS["head"], [0.03, 0.05, 0.08])
    skeleton = graft(skeleton, "eye2", NAMELESS["head"], [-0.03, 0.05, 0.08])
    skeleton = graft(skeleton, "prop", NAMELESS["hips"], [0.2, 0, 0])
    assert dict(naming.map_joints(skeleton).joint) == NAMELESS


def test_names_tell_left_and_right_where_the_rest_pose_cannot():
    folded = rig(names=NAMELESS, axes=rigs.along_bones())
    with pytest.raises(naming.NoBodyError):
        naming.map_joints(folded)
    named = {name: {"left": "l_", "righ": "r_"}.get(name[:4], "") + bone for name, bone in NAMELESS.items()}
    joint = naming.map_joints(rig(names=named, axes=rigs.along_bones())).joint
    assert dict(joint) == named


def test_left_is_left_of_where_the_feet_point():
    mirrored = CANONICAL.offset_xyz_m * [1, 1, -1]
    swapped = Skeleton(tuple(NAMELESS.values()), CANONICAL.parent, mirrored)
    joint = naming.map_joints(swapped).joint
    assert joint["leftHand"] == NAMELESS["rightHand"]
    assert joint["leftToes"] == NAMELESS["rightToes"]


def test_no_feet_no_sides():
    stumps = rig(names=NAMELESS, without=("leftToes", "rightToes"))
    assert topology.find_body(stumps, sides=[""] * len(stumps.joints)) is None


def test_trees_that_are_no_body():
    chain = Skeleton(tuple("abcdef"), np.arange(-1, 5), np.ones((6, 3)))
    star = Skeleton(tuple("abcdef"), np.array([-1, 0, 0, 0, 0, 0]), np.ones((6, 3)))
    one = Skeleton(("a",), np.array([-1]), np.zeros((1, 3)))
    for tree in (chain, star, one):
        assert topology.find_body(tree, sides=[""] * len(tree.joints)) is None
    four_legs = rig(names=NAMELESS)
    flat = four_legs.offset_xyz_m[:, [0, 2, 1]] * [1, 1, 1]
    for name in JOINTS:
        if name.endswith(("Leg", "Foot", "Toes", "Arm", "Hand")):
            flat[JOINTS.index(name)] = four_legs.offset_xyz_m[JOINTS.index(name)]
    dog = Skeleton(four_legs.joints, four_legs.parent, flat)
    assert topology.find_body(dog, sides=[""] * 22) is None


def test_a_forest_of_hair_takes_no_age():
    skeleton = rig(names=NAMELESS)
    names, parent, offset = list(skeleton.joints), list(skeleton.parent), skeleton.offset_xyz_m.tolist()
    for strand in range(60):
        above = skeleton.index(NAMELESS["head"])
        for part in range(3):
            names.append(f"hair{strand}_{part}")
            parent.append(above)
            offset.append([0.001 * strand, 0.03, 0.0])
            above = len(names) - 1
    hairy = Skeleton(tuple(names), np.array(parent), np.array(offset))
    assert dict(naming.map_joints(hairy).joint) == NAMELESS


def test_paths_and_ancestors():
    at = {name: k for k, name in enumerate(JOINTS)}
    assert topology.path_up(CANONICAL, at["chest"]) == [at["chest"], at["spine"], at["hips"]]
    assert topology.common_ancestor(CANONICAL, at["leftHand"], at["head"]) == at["upperChest"]
    assert topology.common_ancestor(CANONICAL, at["leftFoot"], at["rightFoot"]) == at["hips"]
    assert topology.common_ancestor(CANONICAL, at["chest"], at["neck"]) == at["chest"]
    assert topology.is_above(CANONICAL, at["hips"], at["leftToes"])
    assert topology.is_above(CANONICAL, at["hips"], at["hips"])
    assert not topology.is_above(CANONICAL, at["leftFoot"], at["rightToes"])


def test_trunk():
    spine, neck = topology.trunk(CANONICAL, {name: name for name in JOINTS})
    assert [JOINTS[k] for k in spine] == ["spine", "chest", "upperChest"]
    assert [JOINTS[k] for k in neck] == ["neck", "head"]


def test_what_is_longer_than_a_leg_is_no_head():
    skeleton = rig(names=NAMELESS)
    for name, length_m, is_head in (("crest", 0.2, True), ("mast", 0.8, False)):
        tree = graft(skeleton, name, NAMELESS["head"], [0, length_m, 0])
        assert (topology.find_body(tree, sides=[""] * len(tree.joints)) is not None) == is_head
