"""Places of a song, and candidates for them, against the dances they lead to."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from assets.dancing.asked import Direction
from assets.dancing.by_graph import GraphCatalogue, by_graph
from assets.dancing.proposals import place_of, propose, propose_at
from assets.dancing.refusal import RefusalError
from assets.dancing.wishes import DirectionError, Nodes
from assets.reading.songs import PlayedSong
from assets.tables.music import from_music_beat
from kernels.graph.nodes import beat_nodes
from kernels.music.repeats import Repeat
from kernels.types import BeatGrid, MotionGraph
from schemas.pins import parse_pin
from schemas.settings import PathSettings, Settings

# Without the price of repetition over the whole song the search is the program, and costs agree exactly.
PLAIN = Settings(path=PathSettings(repetition_weight=0.0))


@pytest.fixture
def song():
    time_s = np.arange(13) * 0.5
    number = np.arange(13)
    beats = BeatGrid(time_s, number // 4 + 1, number % 4 + 1, np.ones(13))
    return PlayedSong(time_s, beats, 6.0)


@pytest.fixture
def known():
    """Four clips of eight beats, each a little faster; ways from each to the next, one clip of its own."""
    beats = [np.arange(8) * interval for interval in (0.5, 0.48, 0.52, 0.5, 3.0)]
    nodes = beat_nodes(beats, [b[-1] + 1 for b in beats])
    rng = np.random.default_rng(1)
    pairs = sorted({tuple(rng.integers(0, 32, 2)) for _ in range(60)})
    pairs = [(s, t) for s, t in pairs if s // 8 != t // 8]
    source, target = np.array(pairs).T
    graph = MotionGraph(
        nodes.clip_index, nodes.time_s, nodes.next_node, source, target, rng.uniform(0.1, 1.0, len(pairs))
    )
    of = graph.clip_index
    label, style = np.array(["spin", "walk", "spin", "jump", "crawl"]), np.array(["hip", "", "hop", "hip", ""])
    names = tuple("abcde")
    return GraphCatalogue(graph, names, Nodes(np.array(names)[of], label[of], style[of]), np.ones(len(of), bool))


def test_places(song):
    at = place_of("bar:2", song)
    assert (at.first, at.last, at.from_s, at.to_s) == (4, 8, 2.0, 4.0)
    assert place_of("2.2", song).first == 4
    with pytest.raises(ValueError, match="want PLACE=WISH"):
        place_of("somewhere", song)
    with pytest.raises(DirectionError, match="seconds within the song"):
        place_of("7", song)


@pytest.mark.parametrize("place", ["2.2", "1-3", "bar:2", "end"])
@pytest.mark.parametrize("pins", [(), ("5=walk",)])
def test_extra_cost_is_what_the_pin_costs(known, song, place, pins):
    asked = Direction(tuple(parse_pin(pin) for pin in pins))
    best = by_graph(known, song, PLAIN, asked).metadata["cost"]
    found = propose(known, song, PLAIN, asked, place_of(place, song))
    assert found["best_cost"] == pytest.approx(best)
    rows = [row for kind in ("labels", "styles", "clips") for row in found[kind]]
    assert rows
    for row in rows:
        pinned = replace(asked, wishes=(*asked.wishes, parse_pin(row["pin"])))
        assert by_graph(known, song, PLAIN, pinned).metadata["cost"] - best == pytest.approx(row["extra_cost"])
    assert [row["extra_cost"] for row in found["clips"]] == sorted(row["extra_cost"] for row in found["clips"])
    assert found["out_of_reach"] == {"labels": ["crawl"], "styles": [], "clips": ["e"]}
    for kind, names in found["out_of_reach"].items():
        for name in names:
            wish = parse_pin(f"{place}={'clip:' if kind == 'clips' else ''}{name}")
            with pytest.raises(RefusalError):
                by_graph(known, song, PLAIN, replace(asked, wishes=(*asked.wishes, wish)))


def test_soft_pins_have_their_price(known, song):
    asked = Direction((parse_pin("5=walk"),), is_soft=True)
    best = by_graph(known, song, PLAIN, asked).metadata["cost"]
    found = propose(known, song, PLAIN, asked, place_of("1", song))
    assert found["best_cost"] == pytest.approx(best)


def test_what_licences_forbid_is_not_proposed(known, song):
    forbidden = replace(known, is_allowed=known.nodes.label != "walk")
    found = propose(forbidden, song, PLAIN, Direction(), place_of("1", song))
    assert "walk" not in {row["label"] for row in found["labels"]} | set(found["out_of_reach"]["labels"])
    nothing = replace(known, is_allowed=np.zeros(len(known.is_allowed), bool))
    assert propose(nothing, song, PLAIN, Direction(), place_of("1", song))["best_cost"] is None


def test_pins_that_conflict_are_refused(known, song):
    asked = Direction((parse_pin("5=crawl"),))
    with pytest.raises(RefusalError, match="5=crawl"):
        propose(known, song, PLAIN, asked, place_of("1", song))


def test_parts_that_come_again_are_those_of_the_dance(known, song):
    """With repeats as pins the prices are those of the dance that has them; where one is asked about, it is free."""
    song = replace(song, repeats=[Repeat(6, 12, 0, 0.9)])
    again = replace(PLAIN, path=replace(PLAIN.path, repeat="structure"))
    danced = by_graph(known, song, again, Direction())
    assert danced.metadata["parts_danced_again"] == 1
    plain = propose(known, song, PLAIN, Direction(), place_of("beat:1", song))
    held = propose(known, song, again, Direction(), place_of("beat:1", song))
    assert held["best_cost"] == pytest.approx(danced.metadata["cost"])
    assert held["best_cost"] > plain["best_cost"] + 1e-6
    for row in held["clips"]:
        pinned = by_graph(known, song, PLAIN, Direction((parse_pin(row["pin"]),)))
        assert row["extra_cost"] + held["best_cost"] >= pinned.metadata["cost"] - 1e-9
    for place in ("beat:3-5", "beat:9-11"):
        free = propose(known, song, again, Direction(), place_of(place, song))
        assert free["best_cost"] == pytest.approx(plain["best_cost"])


@pytest.mark.parametrize("n_beats", [0, 1])
def test_a_song_of_fewer_than_two_beats_cannot_be_danced(n_beats):
    number = np.zeros(n_beats, int)
    rows = from_music_beat("waltz", BeatGrid(np.full(n_beats, 0.5), number, number, np.ones(n_beats)))
    with pytest.raises(RefusalError, match="waltz: cannot be danced: it has no beats; name a beats file"):
        propose_at({"music_beat": SimpleNamespace(read=lambda song: rows)}, None, "waltz", "1")
