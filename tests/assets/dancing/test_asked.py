from types import SimpleNamespace

import pytest

from assets.dancing import asked
from assets.dancing.asked import direction_of
from assets.dancing.refusal import RefusalError
from assets.sources.sources import Request
from schemas.pins import PinWish, parse_pin
from schemas.settings import Brief


@pytest.fixture
def studio(monkeypatch):
    """A studio whose brief and remembered request say something."""
    brief = Brief(pin=(parse_pin("1=spin"),), pins="soft", allow=("CC0-1.0",))
    monkeypatch.setattr(asked, "brief_of", lambda studio, song: brief)
    monkeypatch.setattr(asked, "request_of", lambda studio, key: studio.request)
    return SimpleNamespace(request=Request(pins=("2=kick", "1=spin")))


def test_pins_of_the_brief_come_first_and_each_counts_once(studio):
    found = direction_of(studio, "waltz|graph_3")
    assert [wish.text for wish in found.wishes] == ["1=spin", "2=kick"]
    assert all(isinstance(wish, PinWish) for wish in found.wishes)
    assert (found.is_soft, found.allow, found.alternative) == (True, ("CC0-1.0",), 3)


def test_pins_can_be_given_in_place_of_those_remembered(studio):
    assert [wish.text for wish in direction_of(studio, "waltz|graph", pins=["5=wave"]).wishes] == ["1=spin", "5=wave"]
    assert [wish.text for wish in direction_of(studio, "waltz|graph", pins=()).wishes] == ["1=spin"]


def test_a_remembered_pin_that_is_none_is_refused(studio):
    studio.request = Request(pins=("nonsense",))
    with pytest.raises(RefusalError, match="nonsense"):
        direction_of(studio, "waltz|graph")
