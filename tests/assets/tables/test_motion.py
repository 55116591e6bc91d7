"""Skeletons, poses and motion beats into tables and back: nothing lost."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from assets.tables.motion import (
    from_canonical_pose,
    from_motion_beat,
    from_motion_tempo,
    from_motion_turn,
    from_pose,
    from_skeleton,
    to_canonical_pose,
    to_motion_tempo,
    to_pose,
    to_skeleton,
)
from kernels.motion.dance_pulse import dance_pulse
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


def test_turns_start_where_the_usable_frames_do_and_none_is_fenced():
    found = motion_beats(place(take("wave"))[6:], 30.0)
    is_fenced = np.zeros(400, bool)
    is_fenced[round(30 * (found.time_s[1] + 0.2))] = True
    table = from_motion_turn("s-a", found, 30.0, first_frame=6, is_fenced=is_fenced)
    np.testing.assert_allclose(table["time_s"].to_numpy(), np.delete(found.time_s, 1) + 0.2)
    assert table["turn_index"].to_pylist() == list(range(len(found.time_s) - 1))
    assert table["interval_s"][0].as_py() == pytest.approx(found.interval_s, abs=1e-6)


def test_tempo_of_a_pulse_and_of_none():
    found = dance_pulse(place(take("step", n_beats=24, interval_s=0.6)), 30.0)
    still = dance_pulse(np.zeros((90, 22, 3)), 30.0)
    table = pa.concat_tables(
        [from_motion_tempo("s-a", found, beat_count=24), from_motion_tempo("s-b", still, beat_count=0)]
    )
    assert table["tempo_bpm"].to_pylist()[0] == pytest.approx(100.0, rel=0.02)
    assert table["tempo_bpm"].to_pylist()[1] is None
    assert table["has_pulse"].to_pylist() == [True, False]
    assert table["beat_count"].to_pylist() == [24, 0]
    tempi = to_motion_tempo(table)
    assert tempi["s-a"].has_pulse
    assert not tempi["s-b"].has_pulse
    assert tempi["s-a"].level_probability == pytest.approx(found.level_probability, abs=1e-6)


def test_tempo_of_principal_components_names_its_levels():
    beats = motion_beats(place(take("step", n_beats=24, interval_s=0.8)), 30.0)
    row = from_motion_tempo("s-a", beats, beat_count=24).to_pylist()[0]
    assert row["tempo_bpm"] == pytest.approx(75.0, rel=0.02)
    assert row["slower_bpm"] is None
    assert row["faster_bpm"] == pytest.approx(150.0, rel=0.02)


def test_beats_of_a_pulse_have_no_shares_and_their_own_intervals():
    found = dance_pulse(place(take("step", n_beats=24, interval_s=0.6)), 30.0)
    table = from_motion_beat("s-a", found, 30.0)
    np.testing.assert_allclose(table["time_s"].to_numpy(), found.time_s)
    assert set(table["component_share_ratio"].to_pylist()) == {0.0}
    assert table["interval_s"][0].as_py() == pytest.approx(0.6, rel=0.02)
