"""Skeletons, poses and motion beats into tables and back: nothing lost."""

import numpy as np
import pyarrow.parquet as pq
import pytest

from assets.tables.motion import (
    from_canonical_pose,
    from_motion_beat,
    from_pose,
    from_skeleton,
    to_canonical_pose,
    to_pose,
    to_skeleton,
)
from kernels.motion.motion_beats import motion_beats
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.naming import map_joints
from kernels.synthetic.dancer import place, take
from kernels.types import Clip
from schemas.motion import CANONICAL_POSE, POSE


def stored(table, path):
    pq.write_table(table, path)
    return pq.read_table(path)


def test_skeleton_and_its_mapping(clip):
    mapping = map_joints(CANONICAL)
    rig, back = to_skeleton(from_skeleton("a-b", clip.skeleton, mapping))
    assert rig.joints == clip.skeleton.joints
    np.testing.assert_array_equal(rig.parent, clip.skeleton.parent)
    np.testing.assert_allclose(rig.offset_xyz_m, clip.skeleton.offset_xyz_m, atol=1e-7)
    assert dict(back.joint) == dict(mapping.joint)


def test_pose_with_and_without_moving_joints(clip, tmp_path):
    moved = np.zeros((clip.n_frames, 22, 3)) + 0.25
    for translation in (None, moved):
        one = Clip(clip.skeleton, clip.frame_rate_hz, clip.root_xyz_m, clip.rotation_wxyz, translation)
        rows = POSE.check(stored(from_pose("a-b", one), tmp_path / "pose.parquet"))
        back = to_pose(rows, clip.skeleton)
        np.testing.assert_allclose(back.rotation_wxyz, clip.rotation_wxyz, atol=1e-7)
        np.testing.assert_allclose(back.root_xyz_m, clip.root_xyz_m, atol=1e-6)
        assert back.frame_rate_hz == 30.0
        assert (back.translation_xyz_m is None) == (translation is None)


def test_canonical_pose_round_trip_through_parquet(canonical, tmp_path):
    table = stored(from_canonical_pose("a-b", 30.0, canonical), tmp_path / "x.parquet")
    table = CANONICAL_POSE.check(table)
    assert table.schema.metadata[b"joints"].decode().split(",") == list(JOINTS)
    back = to_canonical_pose(table)
    assert (back.clip_id, back.frame_rate_hz) == ("a-b", 30.0)
    np.testing.assert_allclose(back.position_xyz_m, canonical.position_xyz_m, atol=1e-6)


def test_motion_beats_start_where_the_usable_frames_do():
    made = take("wave")
    beats = motion_beats(place(made)[6:], 30.0)
    table = from_motion_beat("s-a", beats, 30.0, first_frame=6)
    np.testing.assert_allclose(table["time_s"].to_numpy(), beats.time_s + 0.2)
    np.testing.assert_array_equal(table["frame_index"].to_numpy(), np.round(30 * (beats.time_s + 0.2)))
    assert table["confidence"][0].as_py() == pytest.approx(beats.confidence, abs=1e-6)
