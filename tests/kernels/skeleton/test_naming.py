import numpy as np
import pytest

from kernels.skeleton import naming
from kernels.skeleton.canonical import CANONICAL, JOINTS, REQUIRED_JOINTS
from kernels.synthetic import dancer, rigs
from kernels.types import Skeleton

TRUNK = ["hips", "spine", "chest", "upperChest", "neck", "head"]
SIDE = ["Shoulder", "UpperArm", "LowerArm", "Hand", "UpperLeg", "LowerLeg", "Foot", "Toes"]


def spelled(trunk, left, right):
    """The rig's name of each canonical joint; None where the rig lacks it."""
    return dict(
        zip([*TRUNK, *("left" + s for s in SIDE), *("right" + s for s in SIDE)], trunk + left + right, strict=True)
    )


def both(trunk, form):
    """Names of both sides from one pattern each: ``{s}`` is l or r, ``{S}`` is L or R, ``{Side}`` and ``{side}``."""
    sides = [
        [f.format(s=side[0], S=side[0].upper(), Side=side.capitalize(), side=side) for f in form.split()]
        for side in ("left", "right")
    ]
    return spelled(trunk.split(), *sides)


STUDIOS = {
    "vrm": both(" ".join(TRUNK), " ".join("{side}" + s for s in SIDE)),
    "vroid": both(
        "J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Chest J_Bip_C_UpperChest J_Bip_C_Neck J_Bip_C_Head",
        "J_Bip_{S}_Shoulder J_Bip_{S}_UpperArm J_Bip_{S}_LowerArm J_Bip_{S}_Hand "
        "J_Bip_{S}_UpperLeg J_Bip_{S}_LowerLeg J_Bip_{S}_Foot J_Bip_{S}_ToeBase",
    ),
    "bandai": both(
        "Hips Spine Chest UpperChest Neck Head",
        "Shoulder_{S} UpperArm_{S} LowerArm_{S} Hand_{S} UpperLeg_{S} LowerLeg_{S} Foot_{S} Toes_{S}",
    ),
    "mixamo": both(
        "mixamorig:Hips mixamorig:Spine mixamorig:Spine1 mixamorig:Spine2 mixamorig:Neck mixamorig:Head",
        " ".join(
            "mixamorig:{Side}" + s for s in ("Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase")
        ),
    ),
    "mixamo1": both(
        "mixamorig1:Hips mixamorig1:Spine mixamorig1:Spine1 mixamorig1:Spine2 mixamorig1:Neck mixamorig1:Head",
        " ".join(
            "mixamorig1:{Side}" + s for s in ("Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase")
        ),
    ),
    "lafan1": both(
        "Hips Spine Spine1 Spine2 Neck Head",
        "{Side}Shoulder {Side}Arm {Side}ForeArm {Side}Hand {Side}UpLeg {Side}Leg {Side}Foot {Side}Toe",
    ),
    "humanik": both(
        "Bob:Hips Bob:Spine Bob:Spine1 Bob:Spine2 Bob:Neck Bob:Head",
        " ".join("Bob:{Side}" + s for s in ("Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase")),
    ),
    "character": both(
        "Alice_Hips Alice_Spine Alice_Spine1 Alice_Spine2 Alice_Neck Alice_Head",
        " ".join("Alice_{Side}" + s for s in ("Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase")),
    ),
    "rokoko": both(
        "Hips Spine1 Spine2 Spine3 Neck Head",
        "{Side}Shoulder {Side}Arm {Side}ForeArm {Side}Hand {Side}Thigh {Side}Shin {Side}Foot {Side}Toe",
    ),
    "xsens": both(
        "Pelvis L5 L3 T8 Neck Head",
        "{Side}Shoulder {Side}UpperArm {Side}ForeArm {Side}Hand {Side}UpperLeg {Side}LowerLeg {Side}Foot {Side}Toe",
    ),
    "mvn": both(
        "Hips Chest Chest2 Chest4 Neck Head",
        "{Side}Collar {Side}Shoulder {Side}Elbow {Side}Wrist {Side}Hip {Side}Knee {Side}Ankle {Side}Toe",
    ),
    "cgspeed": both(
        "hip abdomen waist chest neck head",
        "{s}Collar {s}Shldr {s}ForeArm {s}Hand {s}Thigh {s}Shin {s}Foot {s}Toe",
    ),
    "cmu asf": both(
        "root lowerback upperback thorax lowerneck head",
        "{s}clavicle {s}humerus {s}radius {s}wrist {s}femur {s}tibia {s}foot {s}toes",
    ),
    "smpl": both(
        "Pelvis Spine1 Spine2 Spine3 Neck Head",
        "{S}_Collar {S}_Shoulder {S}_Elbow {S}_Wrist {S}_Hip {S}_Knee {S}_Ankle {S}_Foot",
    ),
    "blender": both(
        "pelvis spine spine.001 spine.002 neck face",
        "shoulder.{S} upper_arm.{S} forearm.{S} hand.{S} thigh.{S} shin.{S} foot.{S} toe.{S}",
    ),
    "unreal": both(
        "pelvis spine_01 spine_02 spine_03 neck_01 head",
        "clavicle_{s} upperarm_{s} lowerarm_{s} hand_{s} thigh_{s} calf_{s} foot_{s} ball_{s}",
    ),
    "biped": spelled(
        ["Bip01 Pelvis", "Bip01 Spine", "Bip01 Spine1", "Bip01 Spine2", "Bip01 Neck", "Bip01 Head"],
        *(
            [
                f"Bip01 {s} {part}"
                for part in ("Clavicle", "UpperArm", "Forearm", "Hand", "Thigh", "Calf", "Foot", "Toe0")
            ]
            for s in "LR"
        ),
    ),
    "optitrack": both(
        "Hip Ab Ab2 Chest Neck Head",
        "{S}Shoulder {S}UArm {S}FArm {S}Hand {S}Thigh {S}Shin {S}Foot {S}Toe",
    ),
    "mmd": spelled(
        ["下半身", "上半身", "上半身1", "上半身2", "首", "頭"],
        *([side + part for part in ("肩", "腕", "ひじ", "手首", "足", "ひざ", "足首", "つま先")] for side in "左右"),
    ),
    "daz": both(
        "hip abdomenLower chestLower chestUpper neckLower head",
        "{s}Collar {s}ShldrBend {s}ForearmBend {s}Hand {s}ThighBend {s}Shin {s}Foot {s}Toe",
    ),
    "character creator": both(
        "CC_Base_Hip CC_Base_Waist CC_Base_Spine01 CC_Base_Spine02 CC_Base_NeckTwist01 CC_Base_Head",
        " ".join(
            "CC_Base_{S}_" + s for s in ("Clavicle", "Upperarm", "Forearm", "Hand", "Thigh", "Calf", "Foot", "ToeBase")
        ),
    ),
    "advanced skeleton": both(
        "Root_M Spine1_M Spine2_M Chest_M Neck_M Head_M",
        "Scapula_{S} Shoulder_{S} Elbow_{S} Wrist_{S} Hip_{S} Knee_{S} Ankle_{S} Toes_{S}",
    ),
    "smplx": both(
        "pelvis spine1 spine2 spine3 neck head",
        "{side}_collar {side}_shoulder {side}_elbow {side}_wrist {side}_hip {side}_knee {side}_ankle {side}_foot",
    ),
    "shouted": both(
        "HIPS SPINE CHEST UPPERCHEST NECK HEAD",
        "{S}_SHOULDER {S}_UPPERARM {S}_LOWERARM {S}_HAND {S}_UPPERLEG {S}_LOWERLEG {S}_FOOT {S}_TOES",
    ),
}


def rig(names, **plan):
    still = dancer.take("idle", n_beats=2).clip
    return rigs.author(still, rigs.RigPlan(names=names, **plan)).skeleton


@pytest.mark.parametrize("studio", STUDIOS)
def test_joints_by_name(studio):
    mapping = naming.map_joints(rig(STUDIOS[studio]))
    assert dict(mapping.joint) == STUDIOS[studio]
    assert mapping.family not in ("topology", "user")


@pytest.mark.parametrize(
    ("studio", "family"), [("mixamo", "mixamo"), ("mvn", "mvn"), ("lafan1", "lafan1"), ("mmd", "mmd"), ("vrm", "vrm")]
)
def test_family_is_told(studio, family):
    assert naming.map_joints(rig(STUDIOS[studio])).family == family


def test_the_rest_pose_does_not_matter_to_names():
    for axes in (rigs.lying(), rigs.along_bones(), rigs.arms_forward()):
        assert dict(naming.map_joints(rig(STUDIOS["mixamo"], axes=axes)).joint) == STUDIOS["mixamo"]


def test_joints_the_rig_lacks_are_left_out():
    without = ("upperChest", "neck", "leftShoulder", "rightShoulder", "leftToes", "rightToes")
    joint = naming.map_joints(rig({}, without=without)).joint
    assert set(joint) == set(JOINTS) - set(without)


def test_ends_stand_in_for_hands_and_toes():
    names = {"leftHand": "leftLowerArm_end", "rightHand": "rightLowerArm_end", "leftToes": "leftFoot_end"}
    joint = naming.map_joints(rig(names)).joint
    assert {name: joint[name] for name in names} == names


def test_a_spine_of_many_joints_is_spread_by_length():
    names = ["hips", *(f"back{k}" for k in range(1, 7)), "neck", "head"]
    length = [0.0, 0.0, 0.10, 0.02, 0.11, 0.13, 0.02, 0.12, 0.1]
    rest = [*JOINTS[JOINTS.index("leftShoulder") :]]
    parent = [-1, *range(8)]
    offset = [[0.0, y, 0.0] for y in length]
    for name in rest:
        above = JOINTS[CANONICAL.parent[JOINTS.index(name)]]
        parent.append({"upperChest": 6, "hips": 0}.get(above, len(names) + rest.index(above) if above in rest else 0))
        offset.append(CANONICAL.offset_xyz_m[JOINTS.index(name)].tolist())
    joint = naming.map_joints(Skeleton((*names, *rest), np.array(parent), np.array(offset))).joint
    assert [joint[name] for name in ("spine", "chest", "upperChest", "neck")] == ["back2", "back4", "back5", "neck"]


def test_the_users_table_wins():
    mapping = naming.map_joints(rig({}), {"upperChest": "chest", "elsewhere": "spine"})
    assert mapping.joint["chest"] == "upperChest"
    odd = {"head": "Kopf", "leftUpperArm": "Arm 1"}
    mapping = naming.map_joints(rig(odd), {"Kopf": "head", "Arm 1": "leftUpperArm"})
    assert mapping.joint["head"] == "Kopf"
    assert mapping.joint["leftUpperArm"] == "Arm 1"
    every = {name: f"bone{k}" for k, name in enumerate(JOINTS)}
    mapping = naming.map_joints(rig(every, axes=rigs.along_bones()), {source: name for name, source in every.items()})
    assert mapping.family == "user"
    assert dict(mapping.joint) == every


def test_tables_that_name_no_joint_or_one_twice():
    with pytest.raises(ValueError, match="got 'wing' for 'hips'"):
        naming.map_joints(rig({}), {"hips": "wing"})
    with pytest.raises(ValueError, match="want one joint for 'head'"):
        naming.map_joints(rig({}), {"head": "head", "neck": "head"})


def test_no_body_lists_the_joints_and_the_way_out():
    chain = Skeleton(("base", "child1", "child2"), np.array([-1, 0, 1]), np.array([[0.0, 0, 0], [0, 5, 0], [0, 3, 0]]))
    with pytest.raises(naming.NoBodyError) as caught:
        naming.map_joints(chain)
    for word in ("base, child1, child2", "odori.toml", "[joints]", *REQUIRED_JOINTS):
        assert word in str(caught.value)


def test_names_that_do_not_hang_together_are_not_believed():
    twisted = {"leftLowerArm": "leftUpperArm", "leftUpperArm": "leftLowerArm"}
    mapping = naming.map_joints(rig(twisted))
    assert mapping.family == "topology"
    assert mapping.joint["leftUpperArm"] == "leftLowerArm"


@pytest.mark.parametrize(
    ("name", "side", "part"),
    [
        ("mixamorig:LeftUpLeg", "left", "upleg"),
        ("thigh.L", "left", "thigh"),
        ("Bip01 R Thigh", "right", "thigh"),
        ("ValveBiped.Bip01_R_Calf", "right", "calf"),
        ("m_avg_L_Hip", "left", "hip"),
        ("LHipJoint", "left", "hipjoint"),
        ("lShldr", "left", "shldr"),
        ("rhumerus", "right", "humerus"),
        ("leftupperarm", "left", "upperarm"),
        ("HandRight", "right", "hand"),
        ("LUArm", "left", "uarm"),
        ("左ひじ", "left", "ひじ"),
        ("spine.001", "", "spine001"),
        ("LowerBack", "", "lowerback"),
        ("root", "", "root"),
        ("Ribs", "", "ribs"),
        ("L", "", "l"),
        ("Head_M", "", "head"),
        ("C_Spine", "", "spine"),
        ("Hips#2", "", "hips2"),
        ("Left Hand", "left", "hand"),
    ],
)
def test_side_and_part(name, side, part):
    assert naming.side_and_part(name) == (side, part)


def test_a_rig_at_the_worlds_origin_is_no_hindrance():
    skeleton = rig(STUDIOS["bandai"], has_root=True)
    assert skeleton.joints[0] == "Root"
    assert naming.map_joints(skeleton).joint["hips"] == "Hips"


@pytest.mark.parametrize(("name", "told"), [("Mid", ("", "mid")), ("C", ("", "c")), ("J_Bip_C_Head", ("", "head"))])
def test_a_word_for_the_middle_is_left_out_unless_it_is_the_whole_name(name, told):
    assert naming.side_and_part(name) == told
