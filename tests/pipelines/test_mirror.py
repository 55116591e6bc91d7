"""Mirrored clips: twice the graph, danced and told as what they are."""

import numpy as np
import polars as pl
import pyarrow.parquet as pq

from assets.tables import pack
from assets.tables.motion import to_canonical_pose
from kernels.skeleton.canonical import JOINTS, mirror
from pipelines.commands.dance_songs import dance_songs
from pipelines.commands.propose import propose_pins
from pipelines.commands.why import explain_dance
from pipelines.resources import NoProgress


def rows(studio, table, part="all"):
    return pq.read_table(studio / "lake" / table / f"{part}.parquet")


def test_a_mirrored_catalogue_is_twice_as_large_and_its_dance_says_what_is_mirrored(studio):
    plain = rows(studio, "motion_graph_node").num_rows
    (studio / "odori.toml").write_text("[motion_graph]\nmirror = true\n")
    asked = {"method": "graph", "frame_rate_hz": None, "out": None, "progress": NoProgress}
    outcome = dance_songs(studio, ["beat"], pins=["3-5=step"], **asked)
    assert outcome.status == 0, outcome.troubles
    node = rows(studio, "motion_graph_node")
    assert node.num_rows == 2 * plain
    assert sum(node["is_mirrored"].to_pylist()) == plain
    lineage = pl.DataFrame(rows(studio, "frame_lineage", "beat|graph"))
    pinned = lineage.filter(pl.col("time_s").is_between(3.0, 5.0))
    assert all(clip.endswith("-step") for clip in pinned["clip_id"])
    assert lineage["is_mirrored"].any()
    alone = lineage.filter(pl.col("is_mirrored") & pl.col("blend_clip_id").is_null())
    frame = int(alone["frame_index"][len(alone) // 2])
    told = explain_dance(studio, "beat", at_s=frame / 30.0)
    assert told.facts["is_mirrored"]
    here = alone.filter(pl.col("frame_index") == frame).row(0, named=True)
    session = here["clip_id"].partition("-")[0]
    poses = pack.by_clip(rows(studio, "canonical_pose", session))[here["clip_id"]]
    moved = to_canonical_pose(poses)
    _, turned = mirror(moved.root_xyz_m, moved.rotation_wxyz)
    at = min(round(here["clip_time_s"] * moved.frame_rate_hz), len(turned) - 1)
    shown = pack.to_array(rows(studio, "dance_pose", "beat|graph")["rotation_wxyz"])[frame]
    arms = [JOINTS.index(f"{side}UpperArm") for side in ("left", "right")]
    unlike = [np.abs(np.abs((shown[arms] * q[at][arms]).sum(-1)) - 1).max() for q in (turned, moved.rotation_wxyz)]
    assert unlike[0] < 2e-3


def test_a_mirrored_clip_keeps_pins_by_what_it_shows(studio):
    """One clip leads to the left; pinned to the right and to the left, both are its work, and told as kept."""
    (studio / "odori.toml").write_text("[motion_graph]\nmirror = true\n")
    named = studio / "clips" / "ayame" / "clips.csv"
    named.write_text(named.read_text().replace("step.bvh,step,", "step.bvh,step-left,"))
    outcome = dance_songs(
        studio,
        ["beat"],
        pins=["2=step-right", "8=step-left"],
        method="graph",
        frame_rate_hz=None,
        out=None,
        progress=NoProgress,
    )
    assert outcome.status == 0, outcome.troubles
    assert [(pin["pin"], pin["clips"], pin["is_kept"]) for pin in outcome.facts["pins"]] == [
        ("2=step-right", ["ayame-step"], True),
        ("8=step-left", ["ayame-step"], True),
    ]
    lineage = pl.DataFrame(rows(studio, "frame_lineage", "beat|graph"))
    shown = {at: lineage.filter(pl.col("time_s") >= at)["is_mirrored"][0] for at in (2.0, 8.0)}
    assert shown == {2.0: True, 8.0: False}
    proposed = propose_pins(studio, "beat", "4", pins=["4=step-right"], progress=NoProgress)
    row = proposed.facts["clips"][0]
    assert (row["label"], row["is_mirrored"]) == ("step-right", True)
    assert "pose_pin" not in row
