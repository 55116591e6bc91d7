"""What is told of finished dances."""

import json

import pytest

from pipelines.commands import dance_report
from pipelines.commands.dance_songs import dance_songs
from pipelines.resources import NoProgress
from pipelines.studio.files import StudioError
from pipelines.studio.folder import StudioFolder


def test_facts_of_the_best_dance(built):
    facts = dance_report.facts_of(StudioFolder(built), "beat", "graph")
    assert facts["cost"] == pytest.approx(sum(facts["costs"].values()))
    assert facts["costs"]["transition"] > 0
    assert facts["licence"]["name"] == "CC0-1.0"
    assert facts["licence"] == json.loads((built / "dances" / "beat" / "graph.json").read_text())["licence"]
    assert "same_ratio" not in facts
    report = dance_report.report_of(facts)
    assert "cost " in report
    assert "licence CC0-1.0: free to use" in report
    assert facts["as_wanted"] is (facts["not_as_wanted"] == [])
    assert facts["quality"]["one_frame_flip_count"] == len(facts["not_as_wanted"])
    assert {*facts["missed"]} <= {*facts["quality"]}


def test_alternatives_say_what_they_share(studio):
    asked = {"frame_rate_hz": None, "out": None, "progress": NoProgress}
    outcome = dance_songs(studio, ["beat"], alternatives=3, **asked)
    assert outcome.status == 0, outcome.troubles
    for facts in outcome.facts["dances"][1:]:
        assert 0 <= facts["same_ratio"] <= facts["shared_ratio"] <= 1
        assert facts["same_ratio"] < 0.5
        assert set(facts["shared_clips"]) <= set(facts["clips"])
        assert bool(facts["costs"]["diversity"]) == bool(facts["shared_clips"])
    assert outcome.report.count("compared with the best dance") == 2


def test_copies_go_where_nothing_is_lost(tmp_path):
    with pytest.raises(StudioError, match=r"want a file ending in .usdz or .usdc"):
        dance_report.check_out(tmp_path / "a.mp4")
    (tmp_path / "a.wav").write_bytes(b"mine")
    with pytest.raises(StudioError, match="want room for the song"):
        dance_report.check_out(tmp_path / "a.usdc")


def test_one_dance_is_told_plainly_and_several_as_a_list():
    assert dance_report.dances_facts([{"a": 1}], [], 1) == {"a": 1}
    assert dance_report.dances_facts([], ["no", "no"], 1) == {"error": "no"}
    assert dance_report.dances_facts([{"a": 1}], ["no"], 2) == {"dances": [{"a": 1}], "troubles": ["no"]}


def test_a_dance_that_flips_is_not_as_wanted_and_says_where():
    flips = {
        "value": 1.0,
        "wanted": "0",
        "is_passed": False,
        "reasons": ["leftHand turns 149° … at 12.43 s, in a at 3 s"],
    }
    slides = {"value": 9.0, "wanted": "at most 1", "is_passed": False, "reasons": []}
    report = {"wanted": {"one_frame_flip_count": flips, "foot_slide": slides, "other": {"is_passed": True}}}
    assert dance_report.not_as_wanted(report) == flips["reasons"]
    assert dance_report.missed(report) == ["foot_slide", "one_frame_flip_count"]
    flips["reasons"] = []
    assert dance_report.not_as_wanted(report) == ["one_frame_flip_count is 1, wanted is 0"]
    flips["is_passed"] = True
    assert dance_report.not_as_wanted(report) == []
    assert dance_report.not_as_wanted({"wanted": {}}) == []
