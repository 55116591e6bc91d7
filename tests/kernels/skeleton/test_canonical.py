import numpy as np
import pytest

from kernels import rotation
from kernels.skeleton import canonical, kinematics

REST = dict(zip(canonical.JOINTS, kinematics.rest_position(canonical.CANONICAL), strict=True))


def test_twenty_two_joints_with_the_names_of_vrm():
    assert len(canonical.JOINTS) == 22
    assert canonical.JOINTS[0] == "hips"
    assert set(canonical.REQUIRED_JOINTS) <= set(canonical.JOINTS)


def test_it_stands_on_the_floor_facing_z_with_its_left_towards_x():
    assert min(xyz[1] for xyz in REST.values()) == pytest.approx(0.02)
    assert REST["leftFoot"][1] == pytest.approx(0.08)
    assert REST["leftHand"][0] > REST["leftLowerArm"][0] > REST["leftUpperArm"][0] > 0
    assert REST["leftToes"][2] > REST["leftFoot"][2]
    assert REST["head"][1] > REST["neck"][1] > REST["hips"][1]


def test_its_hips_are_over_the_origin_and_its_spine_is_upright():
    np.testing.assert_array_equal(REST["hips"], [0, 0.94, 0])
    for name in ("spine", "chest", "neck", "head"):
        assert abs(REST[name][0]) < 1e-12
        assert abs(REST[name][2]) < 0.05


def test_left_and_right_mirror_each_other():
    for name, xyz in REST.items():
        if name.startswith("left"):
            np.testing.assert_allclose(REST["right" + name[4:]], xyz * [-1, 1, 1], atol=1e-12)


def test_leg_length_is_thigh_and_shin():
    thigh = np.linalg.norm(REST["leftLowerLeg"] - REST["leftUpperLeg"])
    shin = np.linalg.norm(REST["leftFoot"] - REST["leftLowerLeg"])
    assert thigh + shin == pytest.approx(canonical.LEG_LENGTH_M)


def test_mirror_reflects_every_joint_and_undoes_itself():
    rng = np.random.default_rng(0)
    root, local = rng.normal(size=(5, 3)), rotation.normalize(rng.normal(size=(5, 22, 4)))
    position, _ = kinematics.forward(canonical.CANONICAL, root, local)
    mirrored, _ = kinematics.forward(canonical.CANONICAL, *canonical.mirror(root, local))
    swap = [
        canonical.JOINTS.index(name.replace("left", "RIGHT").replace("right", "left").replace("RIGHT", "right"))
        for name in canonical.JOINTS
    ]
    np.testing.assert_allclose(mirrored[:, swap], position * [-1, 1, 1], atol=1e-9)
    again = canonical.mirror(*canonical.mirror(root, local))
    np.testing.assert_allclose(again[0], root)
    np.testing.assert_allclose(again[1], local)
