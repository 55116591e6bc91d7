"""The most restrictive licence wins, and unknown ones stay in the house."""

import pytest

from assets.licences import Terms, is_allowed, terms_of, together


@pytest.mark.parametrize(
    ("licence", "words"),
    [
        ("CC0-1.0", []),
        ("cc0-1.0", []),
        ("MIT", []),
        ("CC-BY-4.0", ["attribution"]),
        ("CC-BY-SA-4.0", ["share alike", "attribution"]),
        ("CC-BY-NC-4.0", ["non commercial", "attribution"]),
        ("CC BY-NC-ND 4.0", ["no derivatives", "non commercial", "attribution"]),
        ("NC", ["non commercial", "attribution"]),
        ("studio", ["internal"]),
        ("", ["internal"]),
        ("Ask Bob", ["internal", "attribution"]),
    ],
)
def test_terms(licence, words):
    assert terms_of(licence).words() == words


def test_most_restrictive_wins():
    assert together(["CC0-1.0", "CC-BY-4.0", "CC0-1.0"]) == ("CC-BY-4.0", Terms(attribution=True))
    name, terms = together(["CC-BY-SA-4.0", "CC-BY-NC-4.0"])
    assert name == "CC-BY-NC-4.0"
    assert terms.words() == ["non commercial", "share alike", "attribution"]
    assert together(["", "CC-BY-NC-4.0"])[0] == "studio"
    assert together([]) == ("", Terms())
    assert together(["MIT", "CC0-1.0"])[0] == together(["CC0-1.0", "MIT"])[0]


def test_allowed():
    assert is_allowed("CC-BY-4.0", [])
    assert is_allowed("CC-BY-4.0", ["cc-by-4.0"])
    assert not is_allowed("CC-BY-NC-4.0", ["CC-BY-4.0"])
    assert not is_allowed("", ["CC0-1.0"])
    assert is_allowed("", ["studio"])
