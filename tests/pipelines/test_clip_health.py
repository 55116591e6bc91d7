"""Broken clips in the whole pipeline: mended or fenced, said everywhere, and never danced where they are fenced."""

from dataclasses import replace

import dagster as dg
import numpy as np
import polars as pl
import pytest

from assets.formats import bvh
from assets.tables.motion import to_canonical_pose
from kernels import rotation
from kernels.health.turns import turn_rad_per_s
from kernels.skeleton.canonical import CANONICAL
from kernels.synthetic.dancer import take
from kernels.types import Clip
from pipelines import build as building
from pipelines.commands.list_clips import ClipFilter, list_clips
from pipelines.commands.status import studio_status
from pipelines.studio.folder import StudioFolder

BURST = slice(100, 130)


def broken(clip, frames, angle_rad):
    """Turn the right hand by an angle a frame."""
    turned, hand = clip.rotation_wxyz.copy(), clip.skeleton.index("rightHand")
    off = rotation.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.asarray(angle_rad))
    turned[frames, hand] = rotation.mul(turned[frames, hand], off)
    return replace(clip, rotation_wxyz=turned)


@pytest.fixture(scope="module")
def ill(built, tmp_path_factory):
    """The small studio with one flip, one burst, and the burst once more, answered for by the studio; built again."""
    import shutil

    from pipelines.commands.build_studio import build_studio
    from pipelines.resources import NoProgress

    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("DAGSTER_HOME", raising=False)
        root = shutil.copytree(built, tmp_path_factory.mktemp("ill") / "studio")
        clip = take("rock", n_beats=12, frame_rate_hz=30.0).clip
        wild = np.tile([2.2, -2.0, 2.4, -1.8, 2.1], 6)
        folder = root / "clips" / "ill"
        folder.mkdir()
        (folder / "flip.bvh").write_bytes(bvh.format(broken(clip, slice(60, 61), [2.5])))
        (folder / "burst.bvh").write_bytes(bvh.format(broken(clip, BURST, wild)))
        (folder / "mine.bvh").write_bytes(bvh.format(broken(clip, BURST, wild)))
        (folder / "clips.csv").write_text("file,label,health\nmine.bvh,mine,ok\n")
        assert build_studio(root, dances=False, progress=NoProgress).status == 0
        return root


def faults(root):
    listed = list_clips(root, None, ClipFilter()).facts["clips"]
    return {clip["clip_id"]: clip["faults"] for clip in listed}


def danced(root, clip_id):
    rows = StudioFolder(root).lake.table("canonical_pose", "ill", clip_ids=[clip_id])
    moved = to_canonical_pose(rows)
    return moved, Clip(CANONICAL, moved.frame_rate_hz, moved.root_xyz_m, moved.rotation_wxyz)


def test_a_flip_is_mended_a_burst_fenced_and_what_is_answered_for_left_alone(ill):
    found = faults(ill)
    assert {(f["fault_kind"], f["verdict"]) for f in found["ill-flip"]} == {("flip", "mended")}
    assert {f["verdict"] for f in found["ill-burst"]} == {"fenced"}
    assert found["ill-mine"] == []
    assert all(found[clip] == [] for clip in found if not clip.startswith("ill"))
    hand = "rightHand"
    assert turn_rad_per_s(danced(ill, "ill-flip")[1], hand).max() < np.radians(1350)
    assert turn_rad_per_s(danced(ill, "ill-mine")[1], hand).max() > np.radians(1350)


def test_fenced_frames_are_bridged_and_no_beat_lies_in_them(ill):
    moved, clip = danced(ill, "ill-burst")
    assert moved.is_fenced[BURST].all()
    assert moved.is_fenced.sum() < 50
    assert turn_rad_per_s(clip, "rightHand").max() < np.radians(1350)
    lake = StudioFolder(ill).lake
    beats = lake.table("motion_beat", "ill", clip_ids=["ill-burst"])
    assert beats.num_rows > 4
    assert not moved.is_fenced[beats["frame_index"].to_numpy()].any()
    node = pl.DataFrame(lake.table("motion_graph_node"))
    follows = node.filter((pl.col("clip_id") == "ill-burst") & (pl.col("next_node_index") >= 0))
    assert len(follows) > 4
    first, last = np.flatnonzero(moved.is_fenced)[[0, -1]] / moved.frame_rate_hz
    assert set(follows["is_of_pulse"]) == {True, False}
    next_s = node["time_s"].gather(follows["next_node_index"])
    assert not ((follows["time_s"] < first) & (next_s > last)).any()


def test_the_row_the_status_and_the_amber_check_say_so(ill):
    rows = {row["clip_id"]: row for row in StudioFolder(ill).lake.table("clip", "ill").to_pylist()}
    assert rows["ill-flip"]["danceability_ratio"] == 1.0
    assert 0.5 < rows["ill-burst"]["danceability_ratio"] < 1.0
    assert rows["ill-mine"]["health"] == "ok"
    told = {w["path"]: w["warning"] for w in studio_status(ill).facts["warnings"]}
    assert told["clips/ill/flip.bvh"].startswith("mended at ")
    assert told["clips/ill/burst.bvh"].startswith("fenced at ")
    assert "clips/ill/mine.bvh" not in told
    instance = building.open_instance(StudioFolder(ill))
    key = dg.AssetCheckKey(dg.AssetKey("clip_fault"), "whole")
    record = instance.event_log_storage.get_asset_check_execution_history(key, limit=1)[0]
    evaluation = record.event.dagster_event.event_specific_data
    assert not evaluation.passed
    assert evaluation.severity == dg.AssetCheckSeverity.WARN
    assert "ill-burst" in evaluation.metadata["ill"].value
    assert "data:image/png" in evaluation.metadata["pictures"].value
