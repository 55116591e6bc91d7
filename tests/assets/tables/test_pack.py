"""Arrays into Arrow and back: nothing lost, slices included."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from assets.tables import pack as tables
from kernels.assembly.blend import assemble
from kernels.motion.beats import motion_beats
from kernels.skeleton.canonical import CANONICAL, JOINTS
from kernels.skeleton.naming import map_joints
from kernels.skeleton.retarget import retarget
from kernels.synthetic.dancer import place, take
from kernels.types import BeatGrid, Choreography, Clip, MotionGraph
from schemas.keys import mirrored
from schemas.motion import CANONICAL_POSE, POSE, SKELETON
from schemas.music import MUSIC_BEAT


@pytest.fixture(scope="module")
def clip():
    return take("step", n_beats=4).clip


@pytest.fixture(scope="module")
def canonical(clip):
    return retarget(clip, map_joints(CANONICAL))


def stored(table, path):
    pq.write_table(table, path)
    return pq.read_table(path)


def test_skeleton_and_its_mapping(clip):
    mapping = map_joints(CANONICAL)
    rig, back = tables.to_skeleton(tables.from_skeleton("a-b", clip.skeleton, mapping))
    assert rig.joints == clip.skeleton.joints
    np.testing.assert_array_equal(rig.parent, clip.skeleton.parent)
    np.testing.assert_allclose(rig.offset_xyz_m, clip.skeleton.offset_xyz_m, atol=1e-7)
    assert dict(back.joint) == dict(mapping.joint)


def test_pose_with_and_without_moving_joints(clip, tmp_path):
    moved = np.zeros((clip.n_frames, 22, 3)) + 0.25
    for translation in (None, moved):
        one = Clip(clip.skeleton, clip.frame_rate_hz, clip.root_xyz_m, clip.rotation_wxyz, translation)
        rows = POSE.check(stored(tables.from_pose("a-b", one), tmp_path / "pose.parquet"))
        back = tables.to_pose(rows, clip.skeleton)
        np.testing.assert_allclose(back.rotation_wxyz, clip.rotation_wxyz, atol=1e-7)
        np.testing.assert_allclose(back.root_xyz_m, clip.root_xyz_m, atol=1e-6)
        assert back.frame_rate_hz == 30.0
        assert (back.translation_xyz_m is None) == (translation is None)


def test_canonical_pose_round_trip_through_parquet(canonical, tmp_path):
    table = stored(tables.from_canonical_pose("a-b", 30.0, canonical), tmp_path / "x.parquet")
    table = CANONICAL_POSE.check(table)
    assert table.schema.metadata[b"joints"].decode().split(",") == list(JOINTS)
    back = tables.to_canonical_pose(table)
    assert (back.clip_id, back.frame_rate_hz) == ("a-b", 30.0)
    np.testing.assert_allclose(back.position_xyz_m, canonical.position_xyz_m, atol=1e-6)


def test_clips_of_one_table_are_split_and_slices_unpack(canonical):
    parts = [tables.from_canonical_pose(name, 30.0, canonical) for name in ("s-a", "s-b", "s-c")]
    whole = tables.concat(CANONICAL_POSE, parts)
    found = tables.by_clip(whole)
    assert list(found) == ["s-a", "s-b", "s-c"]
    np.testing.assert_array_equal(
        tables.to_array(found["s-b"]["rotation_wxyz"]), tables.to_array(parts[1]["rotation_wxyz"])
    )
    np.testing.assert_array_equal(tables.to_array(found["s-c"]["root_xyz_m"]), tables.to_array(parts[2]["root_xyz_m"]))
    assert [c.clip_id for c in tables.to_canonical_poses(whole)] == ["s-a", "s-b", "s-c"]


def test_scattered_rows_are_refused(canonical):
    one, two = (tables.from_canonical_pose(name, 30.0, canonical) for name in ("s-a", "s-b"))
    with pytest.raises(ValueError, match="together"):
        tables.by_clip(pa.concat_tables([one, two, one]))


def test_nothing_packs_and_unpacks():
    assert tables.by_clip(POSE.empty()) == {}
    assert tables.concat(SKELETON, []).num_rows == 0
    assert tables.to_array(CANONICAL_POSE.empty()["rotation_wxyz"]).shape == (0, 0, 4)
    assert tables.to_array(CANONICAL_POSE.empty()["root_xyz_m"]).shape == (0, 3)


def test_frame_rates_are_read_back_from_times(clip):
    for rate_hz in (23.976, 24.0, 59.94, 120.0):
        one = Clip(clip.skeleton, rate_hz, clip.root_xyz_m, clip.rotation_wxyz)
        assert tables.frame_rate_hz(tables.from_pose("a-b", one)) == pytest.approx(rate_hz, abs=1e-6)


def test_motion_beats_start_where_the_usable_frames_do():
    made = take("wave")
    beats = motion_beats(place(made)[6:], 30.0)
    table = tables.from_motion_beat("s-a", beats, 30.0, first_frame=6)
    np.testing.assert_allclose(table["time_s"].to_numpy(), beats.time_s + 0.2)
    np.testing.assert_array_equal(table["frame_index"].to_numpy(), np.round(30 * (beats.time_s + 0.2)))
    assert table["confidence"][0].as_py() == pytest.approx(beats.confidence, abs=1e-6)


def test_music_beats_round_trip():
    grid = BeatGrid(np.array([0.5, 1.0, 1.5]), np.array([1, 1, 2]), np.array([1, 2, 1]), np.array([0.2, 0.5, 1.0]))
    back = tables.to_music_beat(MUSIC_BEAT.check(tables.from_music_beat("x", grid)))
    np.testing.assert_array_equal(back.time_s, grid.time_s)
    np.testing.assert_array_equal(back.beat_in_bar_number, [1, 2, 1])
    np.testing.assert_allclose(back.confidence, grid.confidence, atol=1e-7)


def test_graph_comes_back_pruned_and_renumbered():
    graph = MotionGraph(
        clip_index=np.array([0, 0, 0, 1, 1, 1]),
        time_s=np.array([0.0, 0.5, 1.0, 0.2, 0.7, 1.2]),
        next_node=np.array([1, 2, -1, 4, 5, -1]),
        source=np.array([1, 1, 4]),
        target=np.array([4, 5, 1]),
        weight=np.array([0.1, 0.2, 0.3]),
        accent=np.linspace(0, 1, 6),
    )
    kept = np.array([True, True, False, True, True, False])
    node = tables.from_motion_graph_node(graph, ["s-a", "s-b"], np.array([0, 1, 2, 0, 1, 2]), ["x", "y"], kept)
    edge = tables.from_motion_graph_edge(graph, ["s-a", "s-b"], np.array([1.0, 2.0, 3.0]))
    back, clips = tables.to_motion_graph(node, edge)
    assert clips == ("s-a", "s-b")
    assert back.next_node.tolist() == [1, -1, 3, -1]
    assert list(zip(back.source.tolist(), back.target.tolist(), strict=True)) == [(1, 3), (3, 1)]
    np.testing.assert_allclose(back.accent, graph.accent[kept], atol=1e-7)
    assert edge["target_clip_id"].to_pylist() == ["s-b", "s-b", "s-a"]


def test_mirrored_clips_are_a_clip_and_a_flag_in_tables_and_a_name_of_their_own_in_a_dance():
    image = mirrored("s-a")
    graph = MotionGraph(
        clip_index=np.array([0, 0, 1, 1]),
        time_s=np.array([0.2, 0.7, 0.2, 0.7]),
        next_node=np.array([1, -1, 3, -1]),
        source=np.array([1]),
        target=np.array([2]),
        weight=np.array([0.1]),
    )
    labels, index, kept = ["x", "x"], np.array([0, 1, 0, 1]), np.ones(4, bool)
    node = tables.from_motion_graph_node(graph, ["s-a", image], index, labels, kept)
    edge = tables.from_motion_graph_edge(graph, ["s-a", image], np.array([1.0]))
    assert node["clip_id"].to_pylist() == ["s-a"] * 4
    assert node["is_mirrored"].to_pylist() == [False, False, True, True]
    assert edge["target_clip_id"].to_pylist() == ["s-a"]
    back, clips = tables.to_motion_graph(node, edge)
    assert clips == ("s-a", image)
    assert back.clip_index.tolist() == [0, 0, 1, 1]
    two = np.array([0.0, 0.5])
    steps = Choreography(("s-a", image), two, two + 0.5, two, two + 0.5, np.array([False, True]), np.array([0, 0.25]))
    rows = tables.from_choreography("song", "graph", steps, {})
    assert rows["clip_id"].to_pylist() == ["s-a", "s-a"]
    assert rows["is_mirrored"].to_pylist() == [False, True]
    assert tables.to_choreography(rows).clip_id == steps.clip_id


def test_graph_of_nothing():
    none = MotionGraph(*(np.zeros(0, int),), np.zeros(0), *(np.zeros(0, int),) * 3, np.zeros(0))
    node = tables.from_motion_graph_node(none, [], np.zeros(0, int), [], np.zeros(0, bool))
    back, clips = tables.to_motion_graph(node, tables.from_motion_graph_edge(none, [], np.zeros(0)))
    assert clips == ()
    assert len(back.time_s) == 0


def test_dance_and_lineage_round_trip():
    steps = Choreography(
        ("a", "a", "b", "b"),
        np.array([0.0, 0.5, 1.0, 1.5]),
        np.array([0.5, 1.0, 1.5, 2.0]),
        np.array([0.25, 0.75, 0.75, 1.25]),
        np.array([0.75, 1.25, 1.25, 1.75]),
        np.array([False, False, True, False]),
        np.array([0.0, 0.0, 0.3, 0.0]),
    )
    clips = {"a": take("step").clip, "b": take("wave").clip}
    dance = assemble(steps, clips, skeleton=CANONICAL, frame_rate_hz=30.0, duration_s=2.0)
    costs = {f"{n}_cost": np.arange(4.0) for n in ("transition", "warp", "stride", "beat", "repetition")}
    rows = tables.from_choreography("x", "graph", steps, costs)
    back = tables.to_choreography(rows)
    assert back.clip_id == steps.clip_id
    np.testing.assert_allclose(back.blend_s, steps.blend_s, atol=1e-7)
    pose, line = tables.from_dance_pose("x", "graph", dance), tables.from_frame_lineage("x", "graph", dance, steps)
    assert line["frame_index"].to_pylist() == list(range(61))
    assert line["clip_id"].to_pylist() == ["a"] * 30 + ["b"] * 31
    blended = line["blend_clip_id"].to_pylist()
    assert blended[29] == "b"
    assert blended[30] == "a"
    assert blended[0] is None
    assert line["blend_time_s"].to_pylist()[0] is None
    assert line["blend_weight_ratio"].to_numpy().max() == pytest.approx(0.5)
    again = tables.to_dance(pose, line, back)
    np.testing.assert_allclose(again.position_xyz_m, dance.position_xyz_m, atol=1e-6)
    np.testing.assert_array_equal(again.lineage.step_index, dance.lineage.step_index)
    np.testing.assert_array_equal(again.lineage.blend_step_index, dance.lineage.blend_step_index)


def test_partners_are_found_again_in_blends_wider_than_a_step():
    length = np.array([0.5, 0.2, 0.2, 0.2, 0.2, 0.3, 0.5])
    end = np.cumsum(length)
    seam = np.array([False, False, True, False, False, True, False])
    ids = ("a", "a", "b", "b", "b", "a", "a")
    start = 1.0 + end - length
    steps = Choreography(ids, end - length, end, start, start + length, seam, np.where(seam, 0.6, 0.0))
    clips = {"a": take("step").clip, "b": take("wave").clip}
    dance = assemble(steps, clips, skeleton=CANONICAL, frame_rate_hz=60.0, duration_s=float(end[-1]))
    pose, line = tables.from_dance_pose("x", "graph", dance), tables.from_frame_lineage("x", "graph", dance, steps)
    again = tables.to_dance(pose, line, steps)
    assert set(dance.lineage.blend_step_index) == {-1, 1, 2, 4, 5}
    np.testing.assert_array_equal(again.lineage.blend_step_index, dance.lineage.blend_step_index)


def test_quaternions_one_a_row():
    values = np.arange(12.0).reshape(3, 4)
    np.testing.assert_array_equal(tables.to_array(tables.quaternion(values)), values)
