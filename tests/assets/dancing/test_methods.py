"""A method is a record; a fourth one is a file, and a word in a list."""

from pathlib import Path

import numpy as np
import pytest

from assets.choreography import choreography
from assets.dancing.asked import Direction
from assets.dancing.method import DanceOrder, Method
from assets.dancing.methods import ALTERNATIVES, METHODS, USUAL, check_order
from assets.dancing.refusal import RefusalError
from assets.dancing.without_flips import SEEN_SETTINGS
from assets.partitions import SESSION_TABLES
from kernels.types import BeatGrid
from pipelines.collection import ASSETS
from pipelines.freshness import nodes
from schemas import settings
from schemas.pins import parse_pin
from schemas.settings import Settings

REPOSITORY = Path(__file__).parents[3]


def test_methods_are_those_the_settings_name_in_their_order():
    assert tuple(METHODS) == settings.METHODS
    assert all(method.name == name for name, method in METHODS.items())
    assert settings.METHODS[0] == USUAL
    assert all(METHODS[name.partition("_")[0]].has_alternatives for name in ALTERNATIVES)


def test_choreography_reads_what_its_methods_read():
    read = {key.to_user_string() for key in choreography.keys_by_input_name.values()}
    assert read == {name for method in METHODS.values() for name in method.inputs} | {"music_beat", "song"}


def test_a_dance_is_made_from_the_inputs_settings_and_version_of_its_own_method():
    node = nodes(ASSETS)["choreography"]
    assert set(node.inputs_of("waltz|matching")) == {*METHODS["matching"].inputs, "music_beat", "song"}
    assert set(node.inputs_of("waltz|graph_2")) == {*METHODS["graph"].inputs, "music_beat", "song"}
    assert set(node.settings_of("waltz|hmm")) == {*METHODS["hmm"].settings, *SEEN_SETTINGS}
    assert node.code_version_of("waltz|hmm") == METHODS["hmm"].version


def test_tables_by_session_are_those_of_the_graph():
    assert set(SESSION_TABLES) == {node.name for node in nodes(ASSETS).values() if node.kind == "session"}


def order(*pins):
    wishes = tuple(parse_pin(text) for text in pins)
    return DanceOrder(
        "waltz",
        BeatGrid(np.array([0.5, 1.0]), *(np.zeros(2, int) for _ in range(2)), np.ones(2)),
        2.0,
        Settings(),
        Direction(wishes),
    )


def test_a_method_that_keeps_no_pins_refuses_them_and_names_those_that_do():
    with pytest.raises(RefusalError, match="pins are kept by the methods graph and hmm; dance it with --method graph"):
        check_order(METHODS["matching"], "waltz", order("1=spin").direction)
    check_order(METHODS["matching"], "waltz", order().direction)
    check_order(METHODS["graph"], "waltz", order("1=spin").direction)


def test_alternatives_are_the_second_to_fifth_of_the_methods_that_have_them():
    assert ALTERNATIVES == ("graph_2", "graph_3", "graph_4", "graph_5")


def test_a_method_draws_learns_and_has_alternatives_only_where_it_says_so():
    plain = Method(name="plain", version="1", inputs=(), settings=(), choose=lambda inputs, order: None)
    assert (plain.keeps_pins, plain.has_alternatives, plain.draws, plain.learns) == (True, False, False, False)
