import numpy as np
import pytest

from kernels import rotation
from kernels.graph.beat_features import STEP_S, BeatFeatures, beat_features, concatenate_beats, default_weight
from kernels.graph.distance import paired_distance, pose_distance
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.kinematics import forward

METRICS = ["position", "rotation"]


def one_joint(position_xyz_m, rotation_wxyz=None):
    f = len(position_xyz_m)
    if rotation_wxyz is None:
        rotation_wxyz = np.tile(rotation.IDENTITY, (f, 1))
    return rotation_wxyz[:, None], np.asarray(position_xyz_m, float)[:, None]


def test_height_and_velocity_of_a_rising_point():
    time_s = np.arange(61) / 60
    height = 1.0 + 2.0 * time_s
    q, p = one_joint(np.stack([0 * time_s, height, 0 * time_s], -1))
    got = beat_features(q, p, frame_rate_hz=60, time_s=np.array([0.5]), weight=np.ones(1), velocity_time_s=0.1)
    np.testing.assert_allclose(got.pose.linear, [[0, 2.0, 0, 0, 0.2, 0]], atol=1e-12)


def test_distance_of_velocities_is_scaled_by_the_time_constant():
    time_s = np.arange(61) / 60
    slow, fast = (
        beat_features(
            *one_joint(np.stack([speed * (time_s - 0.5), 1 + 0 * time_s, 0 * time_s], -1)),
            frame_rate_hz=60,
            time_s=np.array([0.5]),
            weight=np.ones(1),
            velocity_time_s=0.2,
        ).pose
        for speed in (1.0, 4.0)
    )
    np.testing.assert_allclose(pose_distance(slow, fast), [[(0.2 * 3.0) ** 2]], rtol=1e-9)


def test_local_distance_of_even_travel_is_that_of_height_only():
    time_s = np.arange(121) / 120
    q, p = one_joint(np.stack([3 * time_s, 0.6 * time_s, 0 * time_s], -1))
    got = beat_features(q, p, frame_rate_hz=120, time_s=np.array([0.0, 0.5, 1.0]), weight=np.ones(1))
    np.testing.assert_allclose(got.local_distance, (0.6 * 2 * STEP_S) ** 2, rtol=1e-6)


def test_turning_on_the_spot_leaves_the_pose_alone_but_has_angular_velocity():
    time_s = np.arange(121) / 120
    q, p = one_joint(np.tile([0.0, 1.0, 0.0], (121, 1)), rotation.from_heading(2.0 * time_s))
    got = beat_features(q, p, frame_rate_hz=120, time_s=np.array([0.3, 0.6]), metric="rotation", weight=np.ones(1))
    np.testing.assert_allclose(np.abs(got.pose.quaternion_wxyz[:, 0]), [[1, 0, 0, 0]] * 2, atol=1e-9)
    np.testing.assert_allclose(got.pose.linear[:, :3], [[0, 0.2, 0]] * 2, atol=1e-9)


def test_rotation_metric_sees_height_and_travel():
    still = np.tile([0.0, 1.0, 0.0], (31, 1))
    travel = np.stack([np.arange(31) / 30, np.full(31, 1.0), np.zeros(31)], -1)
    crouch = still - [0, 0.41, 0]

    def at(position):
        return beat_features(
            *one_joint(position), frame_rate_hz=30, time_s=np.array([0.5]), metric="rotation", weight=np.ones(1)
        ).pose

    np.testing.assert_allclose(pose_distance(at(still), at(crouch)), 0.25, rtol=1e-9)
    np.testing.assert_allclose(pose_distance(at(still), at(travel)), (0.1 / 0.82) ** 2, rtol=1e-9)


@pytest.mark.parametrize("metric", METRICS)
def test_heading_and_place_do_not_matter(make_dance, metric):
    time_s = np.array([0.0, 0.71, 2.0, 4.0])
    here = beat_features(*make_dance(), frame_rate_hz=120, time_s=time_s, metric=metric)
    there = beat_features(
        *make_dance(heading_rad=2.5, shift_m=(7, 0, -3)), frame_rate_hz=120, time_s=time_s, metric=metric
    )
    np.testing.assert_allclose(there.pose.linear, here.pose.linear, atol=1e-9)
    np.testing.assert_allclose(paired_distance(here.pose, there.pose), 0, atol=1e-15)
    np.testing.assert_allclose(there.local_distance, here.local_distance, atol=1e-12)


@pytest.mark.parametrize("metric", METRICS)
@pytest.mark.parametrize("frame_rate_hz", [30.0, 60.0, 240.0])
def test_frame_rate_does_not_matter(make_dance, metric, frame_rate_hz):
    time_s = np.array([0.0, 0.4, 1.11, 2.5, 3.9, 4.0])
    fine = beat_features(*make_dance(240.0), frame_rate_hz=240, time_s=time_s, metric=metric)
    other = beat_features(*make_dance(frame_rate_hz), frame_rate_hz=frame_rate_hz, time_s=time_s, metric=metric)
    far = np.sqrt(pose_distance(fine.pose, fine.pose)[0, 2])
    assert np.sqrt(paired_distance(fine.pose, other.pose)).max() < 0.05 * far
    np.testing.assert_allclose(np.sqrt(other.local_distance), np.sqrt(fine.local_distance), rtol=0.15)


@pytest.mark.parametrize("metric", METRICS)
def test_frozen_poses_are_alike_and_do_not_move(metric):
    q = np.tile(rotation.IDENTITY, (10, len(JOINTS), 1))
    p = forward(CANONICAL, np.tile([1.0, 0.94, 2.0], (10, 1)), q)[0]
    got = beat_features(q, p, frame_rate_hz=30, time_s=np.array([0.0, 0.13, 0.3]), metric=metric)
    np.testing.assert_allclose(pose_distance(got.pose, got.pose), 0, atol=1e-20)
    np.testing.assert_allclose(got.local_distance, 0, atol=1e-20)


@pytest.mark.parametrize("metric", METRICS)
def test_one_frame_and_no_beat(make_dance, metric):
    q, p = make_dance()
    one = beat_features(q[:1], p[:1], frame_rate_hz=30, time_s=np.array([0.0]), metric=metric)
    assert np.isfinite(one.pose.linear).all()
    np.testing.assert_array_equal(one.local_distance, 0)
    none = beat_features(q, p, frame_rate_hz=30, time_s=np.zeros(0), metric=metric)
    assert len(none.pose) == len(none.local_distance) == 0
    empty = beat_features(q[:0], p[:0], frame_rate_hz=30, time_s=np.zeros(0), metric=metric)
    assert len(empty.pose) == 0


@pytest.mark.parametrize("metric", METRICS)
def test_joints_without_weight_do_not_matter(make_dance, metric):
    q, p = make_dance()
    weight = default_weight(metric)
    unused = weight == 0
    other_q, other_p = q.copy(), p.copy()
    other_q[:, unused], other_p[:, unused] = rotation.IDENTITY, 9.0
    here, there = (
        beat_features(a, b, frame_rate_hz=120, time_s=np.array([1.0]), metric=metric)
        for a, b in ((q, p), (other_q, other_p))
    )
    np.testing.assert_array_equal(here.pose.linear, there.pose.linear)


@pytest.mark.parametrize("metric", METRICS)
def test_default_weights(metric):
    weight = dict(zip(JOINTS, default_weight(metric), strict=True))
    assert sum(weight.values()) == pytest.approx(1)
    assert all(weight[f"left{part}"] == weight[f"right{part}"] for part in ("Hand", "LowerLeg", "Foot", "UpperArm"))
    assert weight["hips"] == weight["leftLowerLeg"] == max(weight.values())
    assert weight["leftToes"] < 0.2 * weight["hips"]


def test_a_jump_in_the_recording_is_told_at_the_beats_within_reach_of_it(make_dance):
    q, p = make_dance(30.0, 20.0)
    p[300, 9] += [0.3, 0.0, 0.0]  # one wrist, one frame, at 10 s
    time_s = np.array([5.0, 9.6, 9.9, 10.0, 10.15, 10.4])
    ratio = beat_features(q, p, frame_rate_hz=30, time_s=time_s).jerk_ratio
    np.testing.assert_array_equal(ratio > 1.5, [False, False, True, True, True, False])
    assert ratio[0] <= 1


def test_roughness_is_of_the_clip_whatever_its_rate_and_size(make_dance):
    time_s = np.array([0.7, 2.0, 3.3])
    q, p = make_dance(120.0)
    one = beat_features(q, p, frame_rate_hz=120, time_s=time_s).jerk_ratio
    np.testing.assert_allclose(beat_features(q, 3 * p, frame_rate_hz=120, time_s=time_s).jerk_ratio, one, rtol=1e-6)
    np.testing.assert_allclose(
        beat_features(q, p, frame_rate_hz=60, time_s=2 * time_s).jerk_ratio.max(), one.max(), rtol=0.1
    )
    still = beat_features(q[:3], p[:3], frame_rate_hz=30, time_s=np.array([0.0]))
    np.testing.assert_array_equal(still.jerk_ratio, 0)


def test_beats_of_clips_in_a_row(make_dance):
    parts = [beat_features(*make_dance(30.0), frame_rate_hz=30, time_s=np.array(t)) for t in ([0.5, 1.0], [], [2.0])]
    whole = concatenate_beats(iter(parts))
    assert len(whole.pose) == len(whole.local_distance) == len(whole.jerk_ratio) == 3
    assert whole.jerk_ratio[2] == parts[2].jerk_ratio[0]
    unknown = BeatFeatures(parts[0].pose, parts[0].local_distance)
    assert concatenate_beats([unknown, parts[2]]).jerk_ratio is None
    with pytest.raises(ValueError, match="at least one"):
        concatenate_beats([])


def test_errors(make_dance):
    q, p = make_dance()
    good = {"frame_rate_hz": 120.0, "time_s": np.array([1.0])}
    for args, change, message in [
        ((q, p[:-1]), {}, "want .F, J, 4."),
        ((q, p), {"metric": "angle"}, "metric"),
        ((q, p), {"frame_rate_hz": 0.0}, "frame_rate_hz"),
        ((q, p), {"time_s": np.array([4.1])}, "within the clip, 0 to 4"),
        ((q, p), {"time_s": np.array([np.nan])}, "within the clip"),
        ((q[:0], p[:0]), {"time_s": np.array([0.0])}, "within the clip"),
        ((q, p), {"velocity_time_s": -1.0}, "velocity_time_s"),
        ((q, p), {"weight": np.zeros(22)}, "weight"),
        ((q, p), {"weight": np.ones(3)}, "weight"),
        ((q[:, :5], p[:, :5]), {}, "22 canonical joints"),
        ((np.where(q > 2, q, np.nan), p), {}, "not finite"),
    ]:
        with pytest.raises(ValueError, match=message):
            beat_features(*args, **(good | change))
    pose = beat_features(q, p, **good).pose
    with pytest.raises(ValueError, match="local_distance"):
        BeatFeatures(pose, np.zeros(2))
    with pytest.raises(ValueError, match="local_distance"):
        BeatFeatures(pose, np.array([-1.0]))
    with pytest.raises(ValueError, match="jerk_ratio"):
        BeatFeatures(pose, np.ones(1), np.array([np.nan]))
