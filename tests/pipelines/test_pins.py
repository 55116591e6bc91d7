"""Pins, alternatives and licences, from the command to the finished dance."""

import json
import shutil

import polars as pl
import pytest

from assets.formats import usd_read
from pipelines.commands.dance_songs import dance_songs
from pipelines.commands.status import studio_status
from pipelines.resources import NoProgress
from pipelines.studio.files import StudioError


@pytest.fixture
def dance(studio):
    """Dance the song of the small studio as it is asked for."""

    def run(**asked):
        return dance_songs(studio, ["beat"], frame_rate_hz=None, out=None, progress=NoProgress, **asked)

    return run


def labels_between(studio, from_s, to_s, method="graph"):
    lineage = pl.read_parquet(studio / "lake" / "frame_lineage" / f"beat|{method}.parquet", glob=False)
    clips = pl.concat([pl.read_parquet(p) for p in sorted((studio / "lake" / "clip").glob("*.parquet"))])
    rows = lineage.filter(pl.col("time_s").is_between(from_s, to_s)).join(clips, on="clip_id", how="left")
    return set(rows["label"])


def test_a_pin_is_kept_frame_by_frame(studio, dance):
    outcome = dance(pins=["3-5=step", "beat:14=not:step"])
    assert outcome.status == 0, outcome.troubles
    assert labels_between(studio, 3.0, 5.0) == {"step"}
    pins = outcome.facts["pins"]
    assert {p["pin"] for p in pins} == {"3-5=step", "beat:14=not:step"}
    assert all(p["is_kept"] for p in pins)
    assert pins[0]["from_s"] <= 3.0
    assert pins[0]["to_s"] >= 5.0
    without = dance()
    assert without.status == 0
    assert without.facts["pins"] == []


def test_conflicts_name_the_pins_and_ways_out(studio, dance):
    before = (studio / "dances" / "beat" / "graph.usdz").read_bytes()
    outcome = dance(pins=["2=setp", "8=step"])
    assert outcome.status == 2
    assert outcome.facts["conflict"] == ["2=setp"]
    assert outcome.facts["ways_out"] == ["2=step in place of 2=setp"]
    assert "labelled 'setp'" in outcome.facts["why"]
    assert (studio / "dances" / "beat" / "graph.usdz").read_bytes() == before
    both = dance(pins=["3=kick", "3=step"])
    assert both.status == 2
    assert both.facts["conflict"] == ["3=kick", "3=step"]
    assert studio_status(studio).status == 0
    assert dance().status == 0


def test_what_is_no_pin_is_refused_at_once(dance):
    with pytest.raises(StudioError, match="want PLACE=WISH"):
        dance(pins=["kick"])
    with pytest.raises(StudioError, match="--alternatives: want 1 to 5"):
        dance(alternatives=9)


def test_pins_and_licences_of_the_brief(studio, dance):
    brief = studio / "songs" / "beat.brief.toml"
    pins = '[[pin]]\nat = 4.0\nlabel = "rock"\n[[pin]]\nplace = "end"\nnot_label = "rock"\n'
    brief.write_text('allow = ["CC0-1.0"]\n' + pins)
    outcome = dance()
    assert outcome.status == 0, outcome.troubles
    pin = outcome.facts["pins"][0]
    assert labels_between(studio, pin["from_s"] + 0.01, pin["to_s"] - 0.01) == {"rock"}
    assert [p["pin"] for p in outcome.facts["pins"]] == ["4=rock", "end=not:rock"]
    brief.write_text('allow = ["MIT"]\n')
    assert "none has a licence of MIT" in "; ".join(dance().troubles)
    brief.write_text('pins = "soft"\n[[pin]]\nat = 4.0\nlabel = "no such thing"\n')
    soft = dance()
    assert soft.status == 0
    assert soft.facts["pins"] == [{**soft.facts["pins"][0], "is_kept": False}]


@pytest.mark.parametrize("method", ["graph", "matching"])
def test_clips_that_may_not_be_changed_are_not_blended(studio, dance, method):
    sheet = studio / "clips" / "ayame" / "clips.csv"
    sheet.write_text(sheet.read_text().replace("CC0-1.0", "CC-BY-ND-4.0"))
    outcome = dance(method=method)
    assert outcome.status == 0, outcome.troubles
    frames = pl.read_parquet(studio / "lake" / "frame_lineage" / f"beat|{method}.parquet", glob=False)
    blended = frames.filter(pl.col("blend_clip_id").is_not_null())
    assert len(blended)
    for column in ("clip_id", "blend_clip_id"):
        assert not [clip for clip in blended[column].unique() if clip.startswith("ayame")]
    steps = pl.read_parquet(studio / "lake" / "choreography" / f"beat|{method}.parquet", glob=False)
    seams = steps.with_row_index().filter("has_seam")["index"].to_list()
    around = {steps["clip_id"][k] for i in seams for k in (i - 1, i)}
    assert not [clip for clip in around if clip.startswith("ayame")]


def test_licences_rule_the_export_and_matching_too(studio, dance):
    sheet = studio / "clips" / "kaede" / "clips.csv"
    sheet.write_text(sheet.read_text().replace("CC0-1.0", "CC-BY-NC-4.0", 1))
    brief = studio / "songs" / "beat.brief.toml"
    for method in ("graph", "matching"):
        brief.write_text('allow = ["cc-by-nc-4.0"]\n')
        outcome = dance(method=method)
        assert outcome.status == 0, outcome.troubles
        assert outcome.facts["licence"]["name"] == "CC-BY-NC-4.0"
        assert outcome.facts["licence"]["terms"] == ["non commercial", "attribution"]
        assert set(outcome.facts["clips"]) == {"kaede-rock"}
        told = usd_read.read_provenance(studio / "dances" / "beat" / f"{method}.usdc")["licence"]
        assert told["name"] == "CC-BY-NC-4.0"
        assert told["terms"] == ["non commercial", "attribution"]
        brief.write_text('allow = ["MIT"]\n')
        assert "none has a licence of MIT" in "; ".join(dance(method=method).troubles)


def test_alternatives_differ(studio, dance):
    outcome = dance(alternatives=2)
    assert outcome.status == 0, outcome.troubles
    first, second = outcome.facts["dances"]
    assert (first["method"], second["method"]) == ("graph", "graph_2")
    one, other = (
        pl.read_parquet(studio / "lake" / "frame_lineage" / f"beat|{method}.parquet", glob=False)
        for method in ("graph", "graph_2")
    )
    is_near = (one["clip_time_s"] - other["clip_time_s"]).abs() < 0.1
    same = (one["clip_id"] == other["clip_id"]) & is_near
    assert same.mean() < 0.7
    assert json.loads((studio / "dances" / "beat" / "graph_2.json").read_text())["method"] == "graph_2"
    shutil.rmtree(studio / "dances")
    assert dance(alternatives=2).status == 0
    assert (studio / "dances" / "beat" / "graph_2.usdz").exists()


def test_a_start_pose_and_an_end_pose(studio, dance):
    """The first and the last frame stand as the clips do at those moments, and so does a beat between."""
    asked = ["start=pose:kaede-rock@1.25", "5.25=pose:kaede-rock@2.25", "end=pose:ayame-step@3.25"]
    outcome = dance(pins=asked)
    assert outcome.status == 0, outcome.troubles
    told = outcome.facts["pins"]
    assert [pin["pin"] for pin in told] == asked
    assert all(pin["is_kept"] for pin in told)
    assert all(pin["distance_m"] < 0.02 for pin in told)
    assert [pin["shown_clip_id"] for pin in told] == ["kaede-rock", "kaede-rock", "ayame-step"]
    assert told[0]["at_s"] == 0.0
    assert told[2]["at_s"] == pytest.approx(13.5, abs=0.2)
    assert "cm from the pose on average" in outcome.report
    poses = {
        clip: pl.read_parquet(
            studio / "lake" / "canonical_pose" / f"{clip.partition('-')[0]}.parquet", glob=False
        ).filter(pl.col("clip_id") == clip)
        for clip in ("kaede-rock", "ayame-step")
    }
    frames = pl.read_parquet(studio / "lake" / "dance_pose" / "beat|graph.parquet", glob=False)
    for row, clip, at_s in ((0, "kaede-rock", 1.25), (-1, "ayame-step", 3.25)):
        wanted = poses[clip].filter((pl.col("time_s") - at_s).abs() < 0.51 / 30)["position_xyz_m"].to_list()[0]
        height = [joint[1] for joint in frames["position_xyz_m"].to_list()[row]]
        assert max(abs(h - joint[1]) for h, joint in zip(height, wanted, strict=True)) < 0.05


def test_poses_that_cannot_be_shown_are_refused_with_ways_out(dance):
    unknown = dance(pins=["4=pose:kaede-rok@1"])
    assert unknown.status == 2
    assert unknown.facts["conflict"] == ["4=pose:kaede-rok@1"]
    assert "called 'kaede-rok'" in unknown.facts["why"]
    assert unknown.facts["ways_out"] == ["4=clip:kaede-rock in place of 4=pose:kaede-rok@1"]
    late = dance(pins=["4=pose:kaede-rock@99"])
    assert late.status == 2
    assert "want a moment of kaede-rock" in "; ".join(late.troubles)
    both = dance(pins=["start=kick", "start=pose:ayame-wave@2"])
    assert both.status == 2
    assert both.facts["conflict"] == ["start=kick", "start=pose:ayame-wave@2"]
    assert "start=kick in place of start=pose:ayame-wave@2" in both.facts["ways_out"]
    assert "no clip is all of them at once" in both.facts["why"]


def test_poses_of_the_brief_hard_and_soft(studio, dance):
    brief = studio / "songs" / "beat.brief.toml"
    pose = '[[pin]]\nplace = "start"\npose = "kaede-kick@2.0"\n'
    brief.write_text(pose)
    hard = dance()
    assert hard.status == 0, hard.troubles
    assert hard.facts["pins"][0]["is_kept"]
    brief.write_text('pins = "soft"\n' + pose)
    soft = dance()
    assert soft.status == 0, soft.troubles
    assert soft.facts["costs"]["wish"] <= 1.0 + 1e-6
