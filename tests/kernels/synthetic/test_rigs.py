import numpy as np
import pytest

from kernels import rotation
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.synthetic import dancer, rigs


@pytest.fixture(scope="module")
def kick():
    return dancer.take("kick", n_beats=4).clip


def places(clip):
    return dict(zip(clip.skeleton.joints, np.moveaxis(kinematics.place(clip)[0], 1, 0), strict=True))


PLANS = {
    "same": rigs.RigPlan(),
    "a-pose": rigs.RigPlan(axes=rigs.a_pose()),
    "forward": rigs.RigPlan(axes=rigs.arms_forward()),
    "lying": rigs.RigPlan(axes=rigs.lying()),
    "splayed": rigs.RigPlan(axes=rigs.splayed()),
    "along bones": rigs.RigPlan(axes=rigs.along_bones()),
    "twisted": rigs.RigPlan(twisted=("leftLowerArm", "rightFoot")),
    "root": rigs.RigPlan(has_root=True),
    "without": rigs.RigPlan(without=("neck", "leftToes")),
}


@pytest.mark.parametrize("plan", PLANS)
def test_joints_are_where_the_canonical_ones_are(kick, plan):
    here = places(rigs.author(kick, PLANS[plan]))
    for name, xyz in places(kick).items():
        if name in here:
            np.testing.assert_allclose(here[name], xyz, atol=1e-9)


def test_names_and_hierarchy(kick):
    plan = rigs.RigPlan(names={"hips": "Becken"}, twisted=("leftHand",), has_root=True)
    skeleton = rigs.author(kick, plan).skeleton
    assert skeleton.joints[:2] == ("Root", "Becken")
    twist = skeleton.index("leftHandTwist")
    assert skeleton.joints[skeleton.parent[twist]] == "leftLowerArm"
    assert skeleton.parent[skeleton.index("leftHand")] == twist


def test_rest_poses(kick):
    def rest(axes):
        skeleton = rigs.author(kick, rigs.RigPlan(axes=axes)).skeleton
        return dict(zip(skeleton.joints, kinematics.rest_position(skeleton), strict=True))

    def bone(pose, a, b):
        along = pose[b] - pose[a]
        return along / np.linalg.norm(along)

    half = np.sqrt(0.5)
    np.testing.assert_allclose(bone(rest(rigs.a_pose()), "leftUpperArm", "leftHand"), [half, -half, 0], atol=1e-12)
    np.testing.assert_allclose(bone(rest(rigs.a_pose()), "rightUpperArm", "rightHand"), [-half, -half, 0], atol=1e-12)
    np.testing.assert_allclose(bone(rest(rigs.arms_forward()), "rightUpperArm", "rightHand"), [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(bone(rest(rigs.lying()), "hips", "head"), [0, 0, -1], atol=1e-12)
    assert bone(rest(rigs.splayed()), "leftUpperLeg", "leftFoot")[0] > 0.3
    folded = rest(rigs.along_bones())
    np.testing.assert_allclose(bone(folded, "leftUpperLeg", "leftFoot"), [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(bone(folded, "rightUpperArm", "rightHand"), [-1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(bone(folded, "hips", "head"), [1, 0, 0], atol=1e-12)


def test_stretched_bones(kick):
    clip = rigs.author(kick, rigs.RigPlan(stretch={"leftFoot": 1.5}))
    offset = clip.skeleton.offset_xyz_m[clip.skeleton.index("leftFoot")]
    np.testing.assert_allclose(offset, 1.5 * CANONICAL.offset_xyz_m[JOINTS.index("leftFoot")])


def test_orientations_differ_by_the_axes_alone(kick):
    clip = rigs.author(kick, rigs.RigPlan(axes=rigs.along_bones()))
    _, here = kinematics.place(clip)
    _, there = kinematics.place(kick)
    for k, name in enumerate(JOINTS):
        between = rotation.mul(rotation.inv(there[:, k]), here[:, clip.skeleton.index(name)])
        assert rotation.angle_between(between, rigs.along_bones()[name]).max() < 1e-6
