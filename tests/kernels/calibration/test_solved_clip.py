from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.calibration import solved_clip as clip_module
from kernels.calibration.records import SENSORS, BodyPoses
from kernels.calibration.solved_clip import find_gauge, to_clip
from kernels.skeleton import kinematics
from kernels.skeleton.naming import map_joints
from kernels.skeleton.retarget import retarget


def test_the_rest_pose_is_found_in_the_opening(poses):
    gauge = find_gauge(poses, 120.0)
    assert 0 <= gauge.first_frame < gauge.end_frame <= 240
    assert gauge.end_frame - gauge.first_frame == 60


def test_joints_stay_where_they_were(poses):
    clip = to_clip(poses, 120.0)
    gauge = find_gauge(poses, 120.0)
    place, _ = kinematics.place(clip)
    np.testing.assert_allclose(place[:, :17], rotation.apply(gauge.up_wxyz, poses.position_xyz_m), atol=1e-9)


def test_at_rest_the_body_stands_upright_facing_z(poses, made):
    clip = to_clip(poses, 120.0)
    rest = kinematics.rest_position(clip.skeleton)
    at = {name: k for k, name in enumerate(clip.skeleton.joints)}
    left = rest[at["l_thigh"]] - rest[at["r_thigh"]]
    assert left[0] / np.linalg.norm(left) > 0.99
    assert rest[at["head"], 1] - rest[at["l_foot"], 1] > 1.0
    assert rest[at["l_hand"], 0] - rest[at["l_upper_arm"], 0] > 0.4
    assert rest[at["l_foot_end"], 2] > rest[at["l_foot"], 2] + 0.1


def test_ends_that_no_sensor_shows_lie_where_an_average_body_has_them(poses):
    skeleton = to_clip(poses, 120.0).skeleton
    offset = dict(zip(skeleton.joints, skeleton.offset_xyz_m, strict=True))
    for side in ("l_", "r_"):
        leg_m = np.linalg.norm(offset[side + "shank"]) + np.linalg.norm(offset[side + "foot"])
        np.testing.assert_allclose(offset[side + "foot_end"], np.array([0, -0.06, 0.15]) / 0.82 * leg_m)
        np.testing.assert_allclose(offset[side + "hand_end"], 0.7 * offset[side + "hand"])
    np.testing.assert_allclose(offset["head_end"], [0, np.linalg.norm(offset["head"]) / 2, 0])


@pytest.mark.parametrize("turn", [[1.0, 0, 0, 0], [0.5, 0.5, 0.5, 0.5], [0.0, 1.0, 0, 0]])
def test_any_world_is_stood_up(poses, turn):
    turned = replace(
        poses,
        position_xyz_m=rotation.apply(np.array(turn), poses.position_xyz_m),
        rotation_wxyz=rotation.mul(np.array(turn), poses.rotation_wxyz),
    )
    place, _ = kinematics.place(to_clip(turned, 120.0))
    assert (place[:, 2, 1] > place[:, SENSORS.index("l_foot"), 1]).all()


@pytest.mark.parametrize("heading_rad", [0.0, 0.5, np.pi / 2, 3.0, np.pi, -1e-9 - np.pi / 2, -3.0, 1e-6 - np.pi])
def test_a_body_that_faces_any_way_is_turned_to_z(poses, heading_rad):
    gauge = find_gauge(poses, 120.0)
    turn = rotation.mul(rotation.from_heading(heading_rad), gauge.up_wxyz)
    turned = replace(
        poses,
        position_xyz_m=rotation.apply(turn, poses.position_xyz_m),
        rotation_wxyz=rotation.mul(turn, poses.rotation_wxyz),
    )
    apart = rotation.angle_between(find_gauge(turned, 120.0).rest_wxyz, gauge.rest_wxyz)
    assert apart.max() < 1e-7


@pytest.mark.parametrize("angle_rad", [0.0, 1.0, 2.0, np.pi, -1.0, -2.0, 1e-9 - np.pi])
def test_the_turn_ahead_is_that_of_the_hip_lines_angle(angle_rad):
    found = clip_module._ahead(0.3 * np.cos(angle_rad), 0.3 * np.sin(angle_rad))
    np.testing.assert_allclose(found, rotation.from_heading(angle_rad), atol=4 * 2.0**-52)


def test_a_hip_line_that_stands_upright_turns_nothing():
    np.testing.assert_array_equal(clip_module._ahead(0.0, 0.0), rotation.IDENTITY)


def test_names_are_known_and_retargeting_goes_through(poses):
    clip = to_clip(poses, 120.0)
    mapping = map_joints(clip.skeleton)
    assert mapping.family == "suit"
    assert mapping.joint["leftLowerLeg"] == "l_shank"
    assert mapping.joint["rightToes"] == "r_foot_end"
    found = retarget(clip, mapping)
    assert np.isfinite(found.position_xyz_m).all()
    assert 0.7 < found.scale_ratio < 1.4


def test_no_frame_is_refused():
    none = BodyPoses(SENSORS, np.zeros((0, 17, 3)), np.zeros((0, 17, 4)), np.zeros((0, 16)), np.zeros((0, 16)))
    with pytest.raises(ValueError, match="at least one frame"):
        find_gauge(none, 120.0)


def test_ends_no_sensor_shows_are_in_proportion_to_the_bones_before_them(poses):
    clip = to_clip(poses, 120.0)
    at = {name: k for k, name in enumerate(clip.skeleton.joints)}
    offset = clip.skeleton.offset_xyz_m
    size = {name: np.linalg.norm(offset[k]) for name, k in at.items()}
    for side in ("l_", "r_"):
        leg_m = size[side + "shank"] + size[side + "foot"]
        np.testing.assert_allclose(offset[at[side + "foot_end"]], np.array([0, -0.06, 0.15]) * leg_m / 0.82)
        np.testing.assert_allclose(offset[at[side + "hand_end"]], 0.7 * offset[at[side + "hand"]])
    np.testing.assert_allclose(offset[at["head_end"]], [0, 0.5 * size["head"], 0])


def test_of_half_seconds_as_still_and_straight_the_first_is_the_rest_pose(poses):
    held = replace(
        poses,
        position_xyz_m=np.repeat(poses.position_xyz_m[:1], 200, axis=0),
        rotation_wxyz=np.repeat(poses.rotation_wxyz[:1], 200, axis=0),
    )
    gauge = find_gauge(held, 120.0)
    assert (gauge.first_frame, gauge.end_frame) == (0, 60)
    short = replace(held, position_xyz_m=held.position_xyz_m[:7], rotation_wxyz=held.rotation_wxyz[:7])
    assert (find_gauge(short, 120.0).first_frame, find_gauge(short, 120.0).end_frame) == (0, 7)


def test_a_body_that_moves_is_not_at_rest(poses):
    still = np.repeat(poses.position_xyz_m[:1], 200, axis=0)
    still[:100, :, 0] += 0.01 * np.arange(100)[:, None]  # walks at first, upright as after it
    still[100:, :, 0] += 0.99
    moved = replace(poses, position_xyz_m=still, rotation_wxyz=np.repeat(poses.rotation_wxyz[:1], 200, axis=0))
    assert find_gauge(moved, 120.0).first_frame >= 99
