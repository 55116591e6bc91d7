"""What is fresh, stale or missing, of which partitions, on a real studio."""

import pytest

from pipelines.collection import freshness
from pipelines.studio.folder import StudioFolder


@pytest.fixture
def state(studio):
    return freshness(StudioFolder(studio))


def test_a_built_and_danced_studio_is_fresh(state):
    assert {(f.state, f.why) for f in state.findings()} == {("fresh", "")}
    assert state.keys("dance") == ["beat|graph"]
    assert state.keys("session") == ["ayame", "kaede"]
    assert state.keys("song") == ["beat"]
    assert state.keys("whole") == [""]


def test_what_only_another_method_needs_is_not_there_to_be_made(state):
    assert "match" not in state.needed_for("beat|graph")
    assert "match" in state.needed_for("beat|matching")
    assert "motion_graph_edge" not in state.needed_for("beat|matching")
    assert state.partitions("match") == []
    assert not state.is_used("hmm")


def test_a_prepared_dance_counts_here_and_is_not_remembered(state, studio):
    state.prepare("beat|matching")
    assert state.partitions("match") == ["beat"]
    assert state.state("match", "beat").state == "missing"
    assert StudioFolder(studio).requests().keys() == {"beat|graph"}
    assert freshness(StudioFolder(studio)).partitions("match") == []


def test_a_changed_setting_makes_stale_what_reads_it_and_says_so(studio):
    (studio / "odori.toml").write_text("[dance]\nframe_rate_hz = 24\n", encoding="utf-8")
    found = {(f.asset, f.key): f for f in freshness(StudioFolder(studio)).findings() if f.state != "fresh"}
    made_again = {"choreography", "dance_pose", "frame_lineage", "dance_quality", "usd_animation"}
    assert {asset for asset, _ in found} <= made_again
    assert found["choreography", "beat|graph"].state == "stale"  # steps are looked at as they will be, and chosen again
    assert "[dance.frame_rate_hz]" in found["choreography", "beat|graph"].why
    assert found["dance_pose", "beat|graph"].state == "waiting"


def test_a_lost_table_is_missing_and_what_reads_it_waits(studio):
    (studio / "lake" / "canonical_pose" / "kaede.parquet").unlink()
    state = freshness(StudioFolder(studio))
    assert state.state("canonical_pose", "kaede").state == "missing"
    assert state.state("canonical_pose", "ayame").state == "fresh"
    assert {f.state for f in state.findings() if f.asset == "motion_beat" and f.key == "kaede"} == {"waiting"}


def test_what_was_asked_changes_with_the_request_the_settings_and_the_sources(studio):
    folder = StudioFolder(studio)
    before = freshness(folder).asked_version(["choreography"], "beat|graph")
    assert freshness(folder).asked_version(["choreography"], "beat|graph") == before
    (studio / "odori.toml").write_text("[path]\nseam_cost = 2.0\n", encoding="utf-8")
    changed = freshness(folder).asked_version(["choreography"], "beat|graph")
    assert changed != before
    (studio / "odori.toml").unlink()
    assert freshness(folder).asked_version(["choreography"], "beat|graph") == before
