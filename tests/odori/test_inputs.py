"""Slips of a person are refused by the name of the argument, whatever kind was given."""

from pathlib import Path

import numpy as np
import pytest

import odori
from odori import inputs


@pytest.mark.parametrize("value", [None, 3, b"bytes", "", [], object()])
def test_paths_and_keys_that_are_none_are_refused(value):
    for check in (inputs.path, inputs.key):
        with pytest.raises(odori.InputError, match="song: want a"):
            check("song", value)


def test_paths_keys_and_texts_come_in_the_forms_people_use():
    song = odori.CatalogueSong("waltz", "songs/waltz.wav", "read", None)
    proposal = odori.PinProposal("label", "spin", "12=spin", 0.5)
    assert inputs.path("out", "a/b.usdz") == inputs.path("out", Path("a/b.usdz")) == Path("a/b.usdz")
    assert inputs.path("out", "~/b.usdz") == Path.home() / "b.usdz"
    assert inputs.key("song", "waltz") == inputs.key("song", song) == inputs.key("song", Path("waltz")) == "waltz"
    assert inputs.texts("pins", "12=spin") == inputs.texts("pins", proposal) == ["12=spin"]
    assert inputs.texts("pins", (pin for pin in [proposal, "13=kick"])) == ["12=spin", "13=kick"]
    assert inputs.texts("like", [song]) == ["waltz"]
    assert inputs.texts("pins", None) == inputs.texts("pins", ()) == []
    for slip in ([12], 12, [(12, 16, "spin")], [b"12=spin"], [None]):
        with pytest.raises(odori.InputError, match="pins: want text, as it is typed, got"):
            inputs.texts("pins", slip)


def test_counts_and_numbers_are_held_to_their_bounds():
    assert inputs.count("k", np.int64(3)) == 3
    assert inputs.count("seed", 0, least=0) == 0
    for slip in (0, -1, 1.5, "3", None, True, np.nan):
        with pytest.raises(odori.InputError, match="k: want a whole number >= 1, got"):
            inputs.count("k", slip)
    assert inputs.number("rate", 1, least=1, most=240) == 1.0
    assert inputs.number("rate", np.float32(240), least=1, most=240) == 240.0
    for slip in (0.99, 240.1, "30", None, True, np.nan, np.inf):
        with pytest.raises(odori.InputError, match="rate: want a number from 1 to 240, got"):
            inputs.number("rate", slip, least=1, most=240)
