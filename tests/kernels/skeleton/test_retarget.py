import numpy as np
import pytest

from kernels import rotation
from kernels.skeleton import canonical, kinematics, naming
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.contacts import FootContacts, find_contacts, foot_slide
from kernels.skeleton.grounding import ANKLES, TOES
from kernels.skeleton.retarget import _planted_pitch_rad, retarget
from kernels.synthetic import dancer, rigs
from kernels.types import Clip, Skeleton

MOVES = ("step", "bounce", "twist", "kick", "rock")
LIMBS = [
    (side + a, side + b)
    for side in ("left", "right")
    for a, b in (("UpperArm", "LowerArm"), ("LowerArm", "Hand"), ("UpperLeg", "LowerLeg"), ("LowerLeg", "Foot"))
]
COLLARS = [("leftShoulder", "leftUpperArm"), ("rightShoulder", "rightUpperArm")]
OTHER_BODY = {
    "leftLowerLeg": 1.1, "rightLowerLeg": 1.1, "leftFoot": 0.92, "rightFoot": 0.92, "leftUpperLeg": 1.3,
    "rightUpperLeg": 1.3, "leftLowerArm": 0.9, "chest": 1.2, "leftToes": 0.8, "rightToes": 0.8,
}  # fmt: skip


@pytest.fixture(scope="module", params=MOVES)
def motion(request):
    return dancer.take(request.param, n_beats=6).clip


@pytest.fixture(scope="module")
def step():
    return dancer.take("step", n_beats=6).clip


def bring_back(clip):
    return retarget(clip, naming.map_joints(clip.skeleton))


def assert_same(ours, clip, *, place_m=1e-3, turn_rad=0.01):
    np.testing.assert_allclose(ours.position_xyz_m, kinematics.place(clip)[0], atol=place_m)
    assert rotation.angle_between(ours.rotation_wxyz, clip.rotation_wxyz).max() < turn_rad


def limb_error_rad(clip, ours, bones):
    source = dict(zip(clip.skeleton.joints, np.moveaxis(kinematics.place(clip)[0], 1, 0), strict=True))
    here = dict(zip(JOINTS, np.moveaxis(ours.position_xyz_m, 1, 0), strict=True))
    turns = [rotation.between(source[b] - source[a], here[b] - here[a]) for a, b in bones]
    return max(rotation.angle_between(rotation.IDENTITY, turn).max() for turn in turns)


# Known answers ----------------------------------------------------------------------------------------------------


def test_the_canonical_skeleton_comes_back_as_it_was(motion):
    ours = bring_back(motion)
    assert_same(ours, motion, place_m=1e-4, turn_rad=1e-3)
    assert ours.scale_ratio == pytest.approx(1.0)


@pytest.mark.parametrize(
    "plan",
    [
        rigs.RigPlan(axes=rigs.a_pose()),
        rigs.RigPlan(axes=rigs.arms_forward()),
        rigs.RigPlan(axes=rigs.lying()),
        rigs.RigPlan(axes=rigs.splayed()),
        rigs.RigPlan(axes=rigs.along_bones()),
        rigs.RigPlan(axes=rigs.along_bones(), has_root=True),
        rigs.RigPlan(twisted=("leftLowerArm", "rightHand", "leftFoot", "rightLowerLeg")),
        rigs.RigPlan(has_root=True, names={"hips": "Hips"}),
        rigs.RigPlan(names={"leftHand": "leftLowerArm_end", "rightHand": "rightLowerArm_end"}),
    ],
    ids=["a-pose", "forward", "lying", "splayed", "along", "under a root", "twist joints", "root", "ends"],
)  # fmt: skip
def test_a_motion_on_another_rig_is_the_same_motion(motion, plan):
    assert_same(bring_back(rigs.author(motion, plan)), motion, turn_rad=np.radians(0.5))


def test_size_and_floor_do_not_matter(step):
    large = Skeleton(JOINTS, CANONICAL.parent, 1.3 * CANONICAL.offset_xyz_m)
    upstairs = 1.3 * step.root_xyz_m + np.array([0.0, 2.0, 0.0])
    ours = bring_back(Clip(large, step.frame_rate_hz, upstairs, step.rotation_wxyz))
    assert ours.scale_ratio == pytest.approx(1 / 1.3)
    assert_same(ours, step)


@pytest.mark.parametrize(
    "without", [("upperChest",), ("leftShoulder", "rightShoulder"), ("neck",), ("leftToes", "rightToes")]
)
def test_joints_without_a_source_rest_on_their_parents(step, without):
    still = step.rotation_wxyz.copy()
    still[:, [JOINTS.index(name) for name in ("spine", "chest", "upperChest", "neck", "head")]] = rotation.IDENTITY
    quiet = Clip(CANONICAL, step.frame_rate_hz, step.root_xyz_m, still)
    assert_same(bring_back(rigs.author(quiet, rigs.RigPlan(without=without))), quiet, turn_rad=0.02)


def test_a_bend_is_shared_by_the_parts_of_the_spine(step):
    bent = np.tile(rotation.IDENTITY, (30, 22, 1))
    bent[:, JOINTS.index("spine")] = rotation.from_axis_angle(np.array([1.0, 0, 0]), 0.6)
    clip = rigs.author(
        Clip(CANONICAL, 30.0, np.tile(CANONICAL.offset_xyz_m[0], (30, 1)), bent),
        rigs.RigPlan(without=("chest", "upperChest")),
    )
    ours = bring_back(clip)
    _, world = kinematics.forward(CANONICAL, ours.root_xyz_m, ours.rotation_wxyz)
    np.testing.assert_allclose(
        rotation.angle_between(world[:, JOINTS.index("head")], rotation.from_axis_angle(np.array([1.0, 0, 0]), 0.6)),
        0, atol=1e-6,
    )  # fmt: skip


# Invariances ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def stranger():
    """A dancer of other proportions on a rig in A-pose."""
    plan = rigs.RigPlan(axes=rigs.a_pose(), stretch=OTHER_BODY)
    return rigs.author(dancer.take("rock", n_beats=8, turned_rad=0.4).clip, plan)


def test_turned_and_moved_about_the_vertical(stranger):
    turn, move = rotation.from_heading(1.1), np.array([2.0, 0.0, -3.0])
    local = stranger.rotation_wxyz.copy()
    local[:, 0] = rotation.mul(turn, local[:, 0])
    there = Clip(stranger.skeleton, 30.0, rotation.apply(turn, stranger.root_xyz_m) + move, local)
    ours, theirs = bring_back(stranger), bring_back(there)
    wanted = rotation.apply(turn, ours.position_xyz_m) + theirs.scale_ratio * move
    np.testing.assert_allclose(theirs.position_xyz_m, wanted, atol=1e-6)
    assert rotation.angle_between(theirs.rotation_wxyz[:, 1:], ours.rotation_wxyz[:, 1:]).max() < 1e-6


def test_played_backwards(stranger):
    back = Clip(stranger.skeleton, 30.0, stranger.root_xyz_m[::-1], stranger.rotation_wxyz[::-1])
    np.testing.assert_allclose(bring_back(back).position_xyz_m[::-1], bring_back(stranger).position_xyz_m, atol=1e-6)


def test_mirrored(stranger):
    # The rig is alike on both sides but for one arm; a mirrored rig has the other arm short.
    motion = dancer.take("rock", n_beats=8, turned_rad=0.4).clip
    mirrored = Clip(CANONICAL, 30.0, *canonical.mirror(motion.root_xyz_m, motion.rotation_wxyz))
    swap = {"leftLowerArm": "rightLowerArm"}
    plan = rigs.RigPlan(axes=rigs.a_pose(), stretch={swap.get(name, name): f for name, f in OTHER_BODY.items()})
    ours, theirs = bring_back(stranger), bring_back(rigs.author(mirrored, plan))
    root, local = canonical.mirror(ours.root_xyz_m, ours.rotation_wxyz)
    np.testing.assert_allclose(theirs.root_xyz_m, root, atol=1e-6)
    assert rotation.angle_between(theirs.rotation_wxyz, local).max() < 1e-6


def test_the_frame_rate_does_not_matter():
    plan = rigs.RigPlan(stretch=OTHER_BODY)
    slow, fast = (
        bring_back(rigs.author(dancer.take("step", n_beats=6, frame_rate_hz=rate).clip, plan)) for rate in (30.0, 120.0)
    )
    np.testing.assert_allclose(fast.position_xyz_m[::4][: len(slow.position_xyz_m)], slow.position_xyz_m, atol=0.012)


# Bodies of other proportions --------------------------------------------------------------------------------------


def test_limbs_point_where_the_sources_do(motion):
    clip = rigs.author(motion, rigs.RigPlan(axes=rigs.splayed(), stretch=OTHER_BODY, twisted=("leftHand",)))
    ours = bring_back(clip)
    assert limb_error_rad(clip, ours, LIMBS) < np.radians(3.0)
    assert limb_error_rad(clip, ours, [*LIMBS[:2], *LIMBS[4:6], *COLLARS]) < 1e-6


def test_planted_feet_stay_planted(motion):
    clip = rigs.author(motion, rigs.RigPlan(stretch=OTHER_BODY))
    ours = bring_back(clip)
    source = ours.scale_ratio * kinematics.place(clip)[0]
    here = ours.position_xyz_m
    found = find_contacts(here[:, ANKLES], here[:, TOES], frame_rate_hz=30.0)
    agree = 2 * (found.foot & ours.contacts.foot).sum() / (found.foot.sum() + ours.contacts.foot.sum())
    assert agree > 0.95
    slide = [foot_slide(p[:, ANKLES], p[:, TOES], ours.contacts, frame_rate_hz=30.0) for p in (source, here)]
    assert slide[1] - slide[0] < 0.2 * max(slide[0], 0.01)
    assert here[:, TOES, 1].min() > 0.0
    planted = here[:, TOES, 1][ours.contacts.toes]
    np.testing.assert_allclose(planted, 0.02, atol=0.035)
    assert abs(np.median(planted) - 0.02) < 0.003


def test_joints_that_move_by_translation(step):
    clip = rigs.author(step, rigs.RigPlan())
    moved = np.tile(clip.skeleton.offset_xyz_m, (clip.n_frames, 1, 1))
    hand = clip.skeleton.index("leftHand")
    moved[:, hand] += 0.1 * np.stack(
        [0 * np.arange(clip.n_frames), np.sin(np.arange(clip.n_frames) / 5), 0 * np.arange(clip.n_frames)], 1
    )
    clip = Clip(clip.skeleton, 30.0, clip.root_xyz_m, clip.rotation_wxyz, moved)
    assert limb_error_rad(clip, bring_back(clip), LIMBS) < np.radians(3.0)


# Limits -----------------------------------------------------------------------------------------------------------


def test_one_frame_and_none(step):
    one = Clip(CANONICAL, 30.0, step.root_xyz_m[:1], step.rotation_wxyz[:1])
    assert_same(bring_back(one), one)
    for axes in (rigs.a_pose(), rigs.along_bones()):
        back = bring_back(rigs.author(one, rigs.RigPlan(axes=axes)))
        np.testing.assert_allclose(back.position_xyz_m, kinematics.place(one)[0], atol=0.02)
    none = bring_back(Clip(CANONICAL, 30.0, step.root_xyz_m[:0], step.rotation_wxyz[:0]))
    assert none.position_xyz_m.shape == (0, 22, 3)
    assert none.rotation_wxyz.shape == (0, 22, 4)


def test_signs_are_continuous(motion):
    local = bring_back(rigs.author(motion, rigs.RigPlan(axes=rigs.lying()))).rotation_wxyz
    assert (local[0, :, 0] >= 0).all()
    assert (np.sum(local[1:] * local[:-1], axis=-1) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(local, axis=-1), 1.0)


def test_positions_are_those_of_the_rotations(motion):
    ours = bring_back(rigs.author(motion, rigs.RigPlan(stretch=OTHER_BODY)))
    position, _ = kinematics.forward(CANONICAL, ours.root_xyz_m, ours.rotation_wxyz)
    np.testing.assert_allclose(ours.position_xyz_m, position, atol=1e-9)


def test_mappings_that_do_not_fit(step):
    joint = {name: name for name in JOINTS}
    with pytest.raises(ValueError, match="want joints of the clip's rig, got tail"):
        retarget(step, naming.JointMapping(joint | {"head": "tail"}, "user"))
    flat = Skeleton(JOINTS, CANONICAL.parent, 0.0 * CANONICAL.offset_xyz_m)
    with pytest.raises(ValueError, match="want leftUpperLeg and rightUpperLeg apart"):
        retarget(Clip(flat, 30.0, step.root_xyz_m, step.rotation_wxyz), naming.JointMapping(joint, "user"))


@pytest.mark.parametrize("axes", [{}, rigs.along_bones()], ids=["t-pose", "along bones"])
@pytest.mark.parametrize("bone", ["leftHand", "rightLowerArm", "chest", "neck", "head", "leftToes", "leftUpperArm"])
def test_bones_of_no_length(step, axes, bone):
    ours = bring_back(rigs.author(step, rigs.RigPlan(axes=axes, stretch={bone: 0.0})))
    assert np.isfinite(ours.rotation_wxyz).all()
    legs = [k for k, name in enumerate(JOINTS) if name.endswith(("UpperLeg", "LowerLeg", "Foot"))]
    np.testing.assert_allclose(ours.position_xyz_m[:, legs], kinematics.place(step)[0][:, legs], atol=0.02)


def test_bodies_without_sides_or_up(step):
    narrow = rigs.RigPlan(stretch={"leftUpperLeg": 0.0, "rightUpperLeg": 0.0})
    with pytest.raises(ValueError, match="want leftUpperLeg and rightUpperLeg apart"):
        bring_back(rigs.author(step, narrow))
    flat = rigs.RigPlan(stretch=dict.fromkeys(("spine", "chest", "upperChest", "neck"), 0.0))
    with pytest.raises(ValueError, match="want hips and neck apart"):
        bring_back(rigs.author(step, flat))


def test_the_slope_of_feet_is_the_usual_one_while_ankle_and_toes_are_planted():
    ankle = np.tile([[0.1, 0.05, 0.0], [-0.1, 0.05, 0.0]], (3, 1, 1))
    toes = np.tile([[0.1, 0.0, 0.12], [-0.1, 0.0, 0.12]], (3, 1, 1))
    toes[2, :, 1] = 0.2  # tapping
    planted = np.array([[True, True], [True, True], [False, False]])
    contacts = FootContacts(planted, planted, 0.0, 0.05, 0.0)
    assert _planted_pitch_rad(ankle, toes, contacts) == pytest.approx(-np.arctan2(0.05, 0.12))
    assert _planted_pitch_rad(ankle, ankle, contacts) is None  # toes in the ankle's place
    never = FootContacts(~planted & False, planted, 0.0, 0.05, 0.0)
    assert _planted_pitch_rad(ankle, toes, never) is None
