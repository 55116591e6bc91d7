"""odori dance --propose: a list, and no dance."""

import json

import pytest

from pipelines.commands.propose import propose_pins
from pipelines.resources import NoProgress
from pipelines.studio.files import StudioError


def test_a_list_to_choose_from(built):
    before = sorted((built / "lake" / "request").glob("*"))
    outcome = propose_pins(built, "beat", "4", progress=NoProgress)
    assert outcome.status == 0
    facts = outcome.facts
    labels = {row["label"]: row["extra_cost"] for row in facts["labels"]}
    assert set(labels) | set(facts["out_of_reach"]["labels"]) == {"step", "twist", "wave", "rock", "kick"}
    assert min(labels.values()) == pytest.approx(0.0, abs=1e-9)
    assert facts["from_s"] <= 4.0 <= facts["to_s"]
    assert facts["labels"][0]["pin"] == f"4={facts['labels'][0]['label']}"
    assert "what could be pinned there" in outcome.report
    assert sorted((built / "lake" / "request").glob("*")) == before
    json.dumps(facts)


def test_other_pins_count(built):
    plain = propose_pins(built, "beat", "4", progress=NoProgress).facts
    pinned = propose_pins(built, "beat", "4", pins=["4=kick"], progress=NoProgress).facts
    assert pinned["pins"] == ["4=kick"]
    assert [row["label"] for row in pinned["labels"]] == ["kick"]
    kick = next(row for row in plain["labels"] if row["label"] == "kick")
    assert pinned["best_cost"] == pytest.approx(plain["best_cost"] + kick["extra_cost"])


def test_what_cannot_be_proposed(built):
    refused = propose_pins(built, "beat", "4", pins=["8=nothing"], progress=NoProgress)
    assert refused.status == 2
    assert refused.facts["conflict"] == ["8=nothing"]
    with pytest.raises(StudioError, match="--propose: 99: want seconds within the song"):
        propose_pins(built, "beat", "99", progress=NoProgress)
    with pytest.raises(StudioError, match="--pin: "):
        propose_pins(built, "beat", "4", pins=["x"], progress=NoProgress)


def test_a_moment_that_is_proposed_can_be_pinned(built):
    """The pose of the cheapest clip costs what was said, with another pose kept beside it."""
    plain = propose_pins(built, "beat", "4", progress=NoProgress).facts
    row = plain["clips"][0]
    assert row["pose_pin"] == f"4=pose:{row['clip']}@{row['clip_time_s']:.3f}"
    pinned = propose_pins(built, "beat", "8", pins=[row["pose_pin"]], progress=NoProgress)
    assert pinned.status == 0
    assert pinned.facts["pins"] == [row["pose_pin"]]
    assert pinned.facts["best_cost"] == pytest.approx(plain["best_cost"] + row["extra_cost"], abs=0.05)
