"""How motions are named, and folders that hold nothing to search; the rest is told in test_search.py."""

import pytest

from pipelines.commands.search_catalogue import SearchCatalogue, parse
from pipelines.studio.files import StudioError


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("day-step", ("day-step", 0.0, float("inf"))),
        ("day-step@2.5-4", ("day-step", 2.5, 4.0)),
        ("a@b.bvh@.5-1.", ("a@b.bvh", 0.5, 1.0)),
        ("a@1-2.bvh", ("a@1-2.bvh", 0.0, float("inf"))),
    ],
)
def test_a_stretch_stands_behind_a_name(text, wanted):
    assert parse(text) == wanted


def test_a_stretch_that_ends_before_it_begins_is_refused():
    with pytest.raises(StudioError, match="want an end after its start, got 4 to 4 s"):
        parse("day-step@4-4")


def test_a_folder_that_is_not_there_is_said(tmp_path):
    with pytest.raises(StudioError, match="want a studio folder"):
        SearchCatalogue(tmp_path / "none")


def test_a_studio_never_searched_has_no_index(tmp_path):
    catalogue = SearchCatalogue(tmp_path)
    assert catalogue.index is None
    assert not catalogue.is_current()
    assert not catalogue.knows("day-step")
