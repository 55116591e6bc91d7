"""Any moment of a dance can be asked where it is from, of the lake and of the stage alike."""

import json
import shutil

import polars as pl
import pytest

from pipelines.commands.dance_songs import dance_songs
from pipelines.commands.why import explain_dance
from pipelines.resources import NoProgress
from pipelines.studio.files import StudioError


def lineage(studio):
    return pl.read_parquet(studio / "lake" / "frame_lineage" / "beat|graph.parquet", glob=False)


def test_every_frame_is_answered_alike_by_lake_and_stage(built, tmp_path):
    stage = tmp_path / "sent_out.usdz"
    shutil.copy(built / "dances" / "beat" / "graph.usdz", stage)
    rows = lineage(built)
    for row in rows[:: max(len(rows) // 25, 1)].iter_rows(named=True):
        by_lake = explain_dance(built, "beat", at_s=row["time_s"]).facts
        by_stage = explain_dance(tmp_path / "no studio", str(stage), at_s=row["time_s"]).facts
        assert {**by_stage, "dance": ""} == {**by_lake, "dance": ""}
        assert by_lake["frame_index"] == row["frame_index"]
        assert by_lake["clip_id"] == row["clip_id"]
        assert by_lake["clip_time_s"] == pytest.approx(row["clip_time_s"], abs=1e-4)
        assert by_lake["blend"]["clip_id"] == row["blend_clip_id"]
        assert by_lake["blend"]["weight_ratio"] == pytest.approx(row["blend_weight_ratio"], abs=1e-4)
        assert (built / by_lake["path"]).is_file()
        assert by_lake["licence"] == "CC0-1.0"
        assert by_lake["step"]["song_start_s"] <= row["time_s"] + 1e-3 <= by_lake["step"]["song_end_s"] + 0.05


def test_a_report_for_a_person(built):
    seam = lineage(built).filter(pl.col("blend_clip_id").is_not_null())["time_s"][0]
    report = explain_dance(built, "beat.wav", at_s=seam).report
    assert f"beat|graph at {seam:.2f} s" in report
    assert "blend    " in report
    assert "licence  CC0-1.0" in report
    assert "why      the cheapest path" in report


def test_the_whole_dance(built):
    outcome = explain_dance(built, "beat|graph", at_s=None)
    steps = pl.read_parquet(built / "lake" / "choreography" / "beat|graph.parquet", glob=False)
    assert [s["clip_id"] for s in outcome.facts["steps"]] == steps["clip_id"].to_list()
    costs = sum(sum(s["costs"].values()) for s in outcome.facts["steps"])
    total = sum(steps[name].sum() for name in steps.columns if name.endswith("_cost"))
    assert costs == pytest.approx(total, abs=0.01)
    assert outcome.facts["licence"]["name"] == "CC0-1.0"
    assert outcome.report.count("\n") == 1 + 1 + steps["has_seam"].sum()
    json.dumps(outcome.facts)


def test_pins_are_told(studio):
    asked = {"frame_rate_hz": None, "out": None, "progress": NoProgress}
    pin = dance_songs(studio, ["beat"], pins=["4=kick"], **asked).facts["pins"][0]
    inside_s = (pin["from_s"] + pin["to_s"]) / 2
    facts = explain_dance(studio, "beat", at_s=inside_s).facts
    assert facts["pin"] == "4=kick"
    assert facts["label"] == "kick"
    assert explain_dance(studio, str(studio / "dances/beat/graph.usdc"), at_s=inside_s).facts["pin"] == "4=kick"


def test_what_is_not_there(built, tmp_path):
    with pytest.raises(StudioError, match="--at: want seconds within the dance, 0 to 1"):
        explain_dance(built, "beat", at_s=99.0)
    with pytest.raises(
        StudioError, match=r"beat\|matching: want a dance, got none of that name; it was danced as beat"
    ):
        explain_dance(built, "beat|matching", at_s=1.0)
    with pytest.raises(StudioError, match="tune: want a song of this studio"):
        explain_dance(built, "tune", at_s=1.0)
