"""The most restrictive licence wins, and unknown ones stay in the house."""

import pytest

from assets.dancing.licences import LicenceTerms, free_to_join, is_allowed, may_be_joined, report, terms_of, together


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
        ("CC-BY-NC-SA-2.0-FR", ["non commercial", "share alike", "attribution"]),
        ("by-nd", ["no derivatives", "attribution"]),
        ("Recorded by Anna, do not pass on", ["internal", "attribution"]),
        ("LicenseRef-by-Bob", ["internal", "attribution"]),
        ("CC-BY 4.0, no derivatives", ["internal", "attribution"]),
        ("studio-ND", ["internal", "no derivatives", "attribution"]),
        ("GPL-3.0-or-later", ["share alike", "attribution"]),
        ("MIT AND CC-BY-NC-4.0", ["non commercial", "attribution"]),
        ("CC-BY-NC-ND-4.0 OR CC-BY-4.0", ["attribution"]),
        ("(MIT OR studio) AND CC-BY-SA-4.0", ["share alike", "attribution"]),
        ("GPL-2.0-only WITH Classpath-exception-2.0", ["share alike", "attribution"]),
        ("MIT AND", ["internal"]),
        ("MIT AND (CC0-1.0", ["internal", "attribution"]),
    ],
)
def test_terms(licence, words):
    assert terms_of(licence).words() == words


def test_most_restrictive_wins():
    assert together(["CC0-1.0", "CC-BY-4.0", "CC0-1.0"]) == ("CC-BY-4.0", LicenceTerms(attribution=True))
    name, terms = together(["CC-BY-SA-4.0", "CC-BY-NC-4.0"])
    assert name == "CC-BY-NC-4.0"
    assert terms.words() == ["non commercial", "share alike", "attribution"]
    assert together(["", "CC-BY-NC-4.0"])[0] == "studio"
    assert together([]) == ("", LicenceTerms())
    assert together(["MIT", "CC0-1.0"])[0] == together(["CC0-1.0", "MIT"])[0]


def test_allowed():
    assert is_allowed("CC-BY-4.0", [])
    assert is_allowed("CC-BY-4.0", ["cc-by-4.0"])
    assert not is_allowed("CC-BY-NC-4.0", ["CC-BY-4.0"])
    assert not is_allowed("", ["CC0-1.0"])
    assert is_allowed("", ["studio"])


def test_joining_is_changing():
    assert may_be_joined("CC-BY-NC-4.0")
    assert may_be_joined("")
    assert not may_be_joined("CC-BY-ND-4.0")
    assert not may_be_joined("MIT AND CC-BY-ND-4.0")
    assert may_be_joined("MIT OR CC-BY-ND-4.0")


def test_a_report_names_what_rules_and_what_nobody_knows():
    free = report({"a": "CC0-1.0", "b": "MIT"})
    assert (free["name"], free["terms"], free["unknown"], free["sentence"]) == ("CC0-1.0", [], [], "free to use")
    told = report({"a": "CC-BY-NC-4.0", "b": "", "c": "Ask Bob", "d": "studio"})
    assert told["name"] == "Ask Bob"
    assert told["unknown"] == ["b", "c"]
    assert told["clips"] == {"CC-BY-NC-4.0": ["a"], "unknown": ["b"], "Ask Bob": ["c"], "studio": ["d"]}
    assert told["sentence"].startswith("not to leave the studio; not for sale")
    assert "2 of 4 clips have no licence that is known and count as the studio's own" in told["sentence"]
    assert "own terms" in report({"a": "CC-BY-SA-4.0", "b": "CC-BY-NC-4.0"})["sentence"]
    assert "own terms" not in report({"a": "CC-BY-SA-4.0", "b": "CC-BY-4.0"})["sentence"]
    assert "each want the whole" in report({"a": "CC-BY-SA-4.0", "b": "GPL-3.0-only"})["sentence"]


def test_pieces_are_made_of_what_may_be_changed():
    licence_of = {"a": "CC-BY-4.0", "b": "CC-BY-ND-4.0", "c": ""}
    assert free_to_join(licence_of, ()) == {"a", "c"}
    assert free_to_join(licence_of, ["CC-BY-4.0", "CC-BY-ND-4.0"]) == {"a"}
    assert free_to_join({}, ()) == set()
