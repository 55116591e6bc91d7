from dataclasses import replace

import numpy as np

from kernels.calibration.bundle import adjust
from kernels.calibration.cleaning import clean
from kernels.calibration.joints import solve_joints
from kernels.synthetic import suit_performer


def error_m(anchors, made):
    truth = np.concatenate([made.body.in_parent_sensor_m, made.body.in_child_sensor_m])
    return float(np.sqrt(np.mean(np.sum((np.concatenate(anchors) - truth) ** 2, axis=-1))))


def apart(pairs):
    return np.stack([one.in_parent_m for one in pairs]), np.stack([one.in_child_m for one in pairs])


def test_true_joints_stay(perfect):
    cleaned = clean(perfect.recording)
    pairs = [
        replace(one, in_parent_m=i, in_child_m=j)
        for one, i, j in zip(
            solve_joints(cleaned), perfect.body.in_parent_sensor_m, perfect.body.in_child_sensor_m, strict=True
        )
    ]
    assert error_m(adjust(cleaned, pairs), perfect) < 1e-3


def test_joints_moved_off_come_back(made, cleaned, pairs):
    rng = np.random.default_rng(0)
    moved = [replace(one, in_parent_m=one.in_parent_m + rng.normal(0, 0.005, 3)) for one in pairs]
    assert error_m(adjust(cleaned, moved, steps=6), made) < 0.25 * error_m(apart(moved), made)


def test_it_helps_where_tissue_wobbles():
    before, after = [], []
    for seed in (51, 52):
        made = suit_performer.made_up(seed, n_frames=4000, disturbance=suit_performer.Disturbance(wobble_m=0.006))
        cleaned = clean(made.recording)
        pairs = solve_joints(cleaned)
        before.append(error_m(apart(pairs), made))
        after.append(error_m(adjust(cleaned, pairs), made))
    assert sum(after) < sum(before)


def test_directions_that_are_not_seen_stay():
    made = suit_performer.made_up(3, n_frames=3000, hinged=("l_shank",))
    cleaned = clean(made.recording)
    pairs = solve_joints(cleaned)
    in_parent, in_child = adjust(cleaned, pairs)
    k = next(k for k, one in enumerate(pairs) if one.rank == 2)
    one = pairs[k]
    moved = (in_parent[k] - one.in_parent_m) @ one.direction_parent[:, -1]
    moved += (in_child[k] - one.in_child_m) @ one.direction_child[:, -1]
    assert abs(moved) < 1e-3
    assert np.abs(in_parent).max() < 0.6


def test_no_steps_change_nothing(cleaned, pairs):
    for got, expected in zip(adjust(cleaned, pairs, steps=0), apart(pairs), strict=True):
        np.testing.assert_array_equal(got, expected)


def test_without_a_frame_joints_stay_as_solved_one_by_one(cleaned, pairs):
    recording = cleaned.recording
    none = replace(
        recording,
        position_xyz_m=recording.position_xyz_m[:0],
        rotation_wxyz=recording.rotation_wxyz[:0],
        is_valid=recording.is_valid[:0],
    )
    nothing = replace(cleaned, recording=none, is_filled=cleaned.is_filled[:0])
    for got, expected in zip(adjust(nothing, pairs), apart(pairs), strict=True):
        np.testing.assert_array_equal(got, expected)
