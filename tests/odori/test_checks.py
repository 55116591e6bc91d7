"""Slips of a person are refused by the name of the argument, whatever kind was given."""

from pathlib import Path

import numpy as np
import pytest

import odori
from odori import checks


@pytest.mark.parametrize("value", [None, 3, b"bytes", "", [], object()])
def test_paths_and_keys_that_are_none_are_refused(value):
    for check in (checks.path, checks.key):
        with pytest.raises(odori.InputError, match="song: want a"):
            check("song", value)


def test_paths_keys_and_texts_come_in_the_forms_people_use():
    song = odori.CatalogueSong("waltz", "songs/waltz.wav", "read", None)
    proposal = odori.PinProposal("label", "spin", "12=spin", 0.5)
    assert checks.path("out", "a/b.usdz") == checks.path("out", Path("a/b.usdz")) == Path("a/b.usdz")
    assert checks.path("out", "~/b.usdz") == Path.home() / "b.usdz"
    assert checks.key("song", "waltz") == checks.key("song", song) == checks.key("song", Path("waltz")) == "waltz"
    assert checks.texts("pins", "12=spin") == checks.texts("pins", proposal) == ["12=spin"]
    assert checks.texts("pins", (pin for pin in [proposal, "13=kick"])) == ["12=spin", "13=kick"]
    assert checks.texts("like", [song]) == ["waltz"]
    assert checks.texts("pins", None) == checks.texts("pins", ()) == []
    for slip in ([12], 12, [(12, 16, "spin")], [b"12=spin"], [None]):
        with pytest.raises(odori.InputError, match="pins: want text, as it is typed, got"):
            checks.texts("pins", slip)


def test_counts_and_numbers_are_held_to_their_bounds():
    assert checks.count("k", np.int64(3)) == 3
    assert checks.count("seed", 0, least=0) == 0
    for slip in (0, -1, 1.5, "3", None, True, np.nan):
        with pytest.raises(odori.InputError, match="k: want a whole number >= 1, got"):
            checks.count("k", slip)
    assert checks.number("rate", 1, least=1, most=240) == 1.0
    assert checks.number("rate", np.float32(240), least=1, most=240) == 240.0
    for slip in (0.99, 240.1, "30", None, True, np.nan, np.inf):
        with pytest.raises(odori.InputError, match="rate: want a number from 1 to 240, got"):
            checks.number("rate", slip, least=1, most=240)
