"""What is shown of a search, from facts."""

import pytest

from pipelines.commands.search_report import report


@pytest.fixture
def facts():
    hit = {"clip_id": "day-step_1", "start_s": 0.5, "end_s": 2.0, "distance": 0.25, "label": "step", "style": ""}
    copy = hit | {"clip_id": "day-step_10", "distance": 0.0125, "style": "shy", "copy_apart_m": 0.004}
    return {"query": "day-step_0", "like": [], "hits": [copy, hit | {"copy_apart_m": None}]}


def test_a_line_a_hit_and_where_the_query_is_laid_over_it_how_far_joints_are_off(facts):
    assert report(facts).splitlines() == [
        "most like day-step_0 (distance 0 to 2, clip, stretch, label):",
        "  0.013  day-step_10  0.50 to 2.00 s  step, shy, a copy: joints 0.4 cm apart",
        "  0.250  day-step_1   0.50 to 2.00 s  step",
    ]


def test_without_a_query_the_wishes_head_it(facts):
    assert report(facts | {"query": "", "like": ["a", "b"]}).startswith("most like a, b (")


def test_no_hit_is_said(facts):
    assert report(facts | {"hits": []}) == "no clip is left after these filters"
