"""Which clips can be danced to a song, as far as the lake knows."""

import pytest

from pipelines.studio.danceable import DancedSong, why_not
from pipelines.studio.folder import StudioFolder


def clip(name, **facts):
    return {"clip_id": name, "state": "read", "reason": None, "licence": "CC0-1.0", **facts}


@pytest.fixture(scope="module")
def lake(built):
    return StudioFolder(built).lake


def test_a_clip_that_may_not_be_changed_is_danced_whole_by_the_graph_alone(lake):
    found = why_not(lake, [clip("ayame-step", licence="CC-BY-ND-4.0")])["ayame-step"]
    assert found["matching"] == "its licence, CC-BY-ND-4.0, forbids to change it: it cannot be danced in pieces"
    assert "graph" not in found


def test_a_clip_without_beats_is_none_for_the_graph_and_one_without_rows_for_nothing(lake):
    found = why_not(lake, [clip("nobody")])["nobody"]
    assert found["graph"].startswith("no pulse was found in it")
    assert found["matching"] == "no features could be measured of it"


@pytest.mark.parametrize(("interval_s", "is_danced"), [(0.5, True), (1.0, True), (0.25, True), (0.35, False)])
def test_a_clip_is_danced_at_its_pace_at_half_or_at_double(lake, interval_s, is_danced):
    found = why_not(lake, [clip("ayame-step")], DancedSong("waltz", (), interval_s))["ayame-step"]
    assert ("graph" not in found) is is_danced
    if not is_danced:
        assert "would have to be danced at 0.71" in found["graph"]
        assert "0.80 to 1.25 are allowed" in found["graph"]
