"""What a studio holds, as Arrow, Polars and NumPy, before and after it is built."""

import numpy as np
import pyarrow.parquet as pq
import pytest

import odori
from pipelines.commands import demo_studio


def test_files_are_new_before_a_build_and_refused_ones_say_why(tmp_path):
    root = tmp_path / "studio"
    demo_studio.make(root)
    (root / "clips" / "ayame" / "broken.bvh").write_text("HIERARCHY", encoding="utf-8")
    studio = odori.open(root)
    assert {clip.state for clip in studio.clips} == {"new"}
    assert studio.clips["ayame-broken"].duration_s == 0
    assert studio.dances.keys() == []
    assert studio.table("clip").num_rows == 0
    with pytest.raises(odori.OdoriError, match="music_beat is not built"):
        studio.beats("drum_machine")
    with pytest.raises(odori.OdoriError, match=r"poses are not built|is not built"):
        studio.poses("ayame-step_01")
    with pytest.raises(odori.OdoriError, match="nothing of it is stored"):
        studio.scan("clip")


def test_tables_come_in_four_forms(shown):
    arrow = shown.table("music_beat", key="drum_machine")
    assert arrow.equals(pq.read_table(shown.root / "lake/music_beat/drum_machine.parquet"))
    assert shown.polars("music_beat", key="drum_machine")["time_s"].to_list() == arrow["time_s"].to_pylist()
    assert np.array_equal(shown.numpy("music_beat", key="drum_machine")["time_s"], arrow["time_s"].to_numpy())
    assert shown.scan("music_beat").collect().height == shown.table("music_beat").num_rows > arrow.num_rows
    assert shown.table("motion_graph_node").num_rows > 0  # stored whole, without a key
    frames = shown.numpy("dance_pose", key="drum_machine|graph")
    assert frames["position_xyz_m"].shape[1:] == (22, 3)


def test_tables_and_partitions_that_are_none_are_refused(shown):
    with pytest.raises(odori.OdoriError, match=r"beats: want a table, got none of that name; they are .*music_beat"):
        shown.table("beats")
    with pytest.raises(odori.OdoriError, match="want a table"):
        shown.scan("beats")
    with pytest.raises(odori.OdoriError, match="music_beat: want a partition that is stored, 'waltz' is not built"):
        shown.table("music_beat", key="waltz")


def test_poses_of_a_clip_are_those_of_its_table(shown):
    rows = shown.table("canonical_pose", key="kaede").to_pylist()
    rows = [row for row in rows if row["clip_id"] == "kaede-kick_02"]
    poses = shown.poses(shown.clips["kaede-kick_02"])
    np.testing.assert_array_equal(poses.position_xyz_m[5], rows[5]["position_xyz_m"])
    np.testing.assert_array_equal(poses.rotation_wxyz[5], rows[5]["rotation_wxyz"])
    assert poses.frame_rate_hz == 60
    assert poses.n_frames == len(rows)


def test_songs_are_found_by_key_file_and_stem(shown):
    beats = shown.beats("hidden_rules").time_s
    for name in ("hidden_rules.mid", "songs/hidden_rules.mid", shown.songs["hidden_rules"]):
        assert np.array_equal(shown.beats(name).time_s, beats)
    with pytest.raises(
        odori.OdoriError, match="hiden_rules: want a song, got none of that name; near are hidden_rules"
    ):
        shown.beats("hiden_rules")
    with pytest.raises(odori.OdoriError, match="want a clip, got none of that name; near are ayame-step_01"):
        shown.poses("ayame-step_1")
