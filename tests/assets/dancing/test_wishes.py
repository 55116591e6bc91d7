"""Pins on the beats of a song and the nodes of a graph."""

from dataclasses import replace

import numpy as np
import pytest

from assets.dancing.wishes import DirectionError, Nodes, kept, sentences, stretch, to_pin, way_out
from assets.reading.songs import PlayedSong
from kernels.graph.pin_conflicts import Conflict, WayOut
from kernels.types import BeatGrid
from schemas.pins import parse_pin


@pytest.fixture
def song():
    """Beats every half second from 0.5 to 8 s, a pick-up of one beat and bars of four; the dance begins at 0."""
    time_s = np.arange(1, 17) * 0.5
    number = np.arange(16)
    beats = BeatGrid(
        time_s=time_s, bar_number=(number + 3) // 4 + 1, beat_in_bar_number=(number + 3) % 4 + 1, confidence=np.ones(16)
    )
    return PlayedSong(np.arange(18) * 0.5, beats, 8.3)


@pytest.fixture
def nodes():
    return Nodes(
        np.array(["a", "a", "b", "c"]), np.array(["spin", "spin", "walk", "spin"]), np.array(["", "", "hip", "x"])
    )


@pytest.mark.parametrize(
    ("text", "first", "last"),
    [
        ("0=spin", 0, 1),
        ("0.5=spin", 1, 2),
        ("0.49=spin", 0, 1),
        ("1-2=spin", 2, 4),
        ("1.2-2.1=spin", 2, 5),
        ("8.3=spin", 16, 17),
        ("beat:1=spin", 1, 2),
        ("beat:3-5=spin", 3, 5),
        ("beat:16=spin", 16, 17),
        ("bar:1=spin", 1, 2),
        ("bar:2=spin", 2, 6),
        ("bar:2-3=spin", 2, 10),
        ("bar:5=spin", 14, 17),
        ("start=spin", 0, 1),
        ("end=spin", 16, 17),
    ],
)
def test_places(song, nodes, text, first, last):
    pin = to_pin(parse_pin(text), song, nodes)
    assert (pin.first, pin.last) == (first, last)
    assert pin.name == text


@pytest.mark.parametrize(
    ("wish", "admitted"),
    [
        ("spin", [1, 1, 0, 1]),
        ("not:spin", [0, 0, 1, 0]),
        ("clip:b", [0, 0, 1, 0]),
        ("style:x", [0, 0, 0, 1]),
        ("jump", [0] * 4),
    ],
)
def test_wishes(song, nodes, wish, admitted):
    np.testing.assert_array_equal(to_pin(parse_pin(f"1={wish}"), song, nodes).nodes, np.array(admitted, bool))


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("9=spin", "0 to 8.30, got 9"),
        ("beat:17=spin", "beat 1 to 16 of the song, got 17"),
        ("bar:5-6=spin", "bar 1 to 5"),
    ],
)
def test_places_that_are_not_there(song, nodes, text, word):
    with pytest.raises(DirectionError, match=word):
        to_pin(parse_pin(text), song, nodes)


def test_bars_that_are_not_known(song, nodes):
    none = np.zeros(16, int)
    plain = PlayedSong(song.grid_s, BeatGrid(song.beats.time_s, none, none, np.ones(16)), 8.3)
    with pytest.raises(DirectionError, match="pin seconds or beats"):
        to_pin(parse_pin("bar:1=spin"), plain, nodes)


def test_reports(song, nodes):
    wishes = [parse_pin("2=spni"), parse_pin("3-4=walk")]
    pins = [to_pin(w, song, nodes) for w in wishes]
    told = sentences(Conflict((0,), "nothing", (WayOut(0, 0, "spin"),)), pins, wishes, song, nodes)
    assert told == [
        "2=spni: no clip with beats is labelled 'spni'; there are spin",
        "this would work: 2=spin in place of 2=spni",
    ]
    assert way_out(WayOut(1, -2, ""), pins, wishes, song) == "2.00-3.00=walk, 2 beats earlier than 3-4=walk"
    fixed = replace(nodes, is_whole=nodes.wished(wishes[0]))
    told = sentences(Conflict((0,), "start", ()), pins, wishes, song, fixed)[0]
    assert told.endswith(f"by its licence the clip of {wishes[0].text} may not be changed and enters no blend")
    more = sentences(Conflict((0,), "tempo", (), has_more=True), pins, wishes, song, nodes)
    assert more[-1] == "other pins conflict too; mend these first"
    told = sentences(Conflict((0, 1), "path", ()), pins, wishes, song, nodes)[0]
    assert told.endswith("keeps them all (1 beat between them)")
    assert "at once" in sentences(Conflict((0, 1), "same_time", ()), pins, wishes, song, nodes)[0]
    forbidden = sentences(Conflict((1,), "nothing", ()), pins, wishes, song, nodes)[0]
    assert forbidden == "3-4=walk: what is labelled 'walk' may not be danced: its licence is not among those of 'allow'"
    assert kept(pins[1:], song, {6: "b", 7: "b"}) == [{"pin": "3-4=walk", "from_s": 3.0, "to_s": 4.0, "clips": ["b"]}]


@pytest.mark.parametrize("shift", [-3, -1, 1, 2])
@pytest.mark.parametrize("text", ["2.2=spin", "beat:5=spin", "3-4.6=walk", "bar:2=walk"])
def test_a_way_out_can_be_typed_as_it_stands(nodes, text, shift):
    """On beats that are no round seconds the shifted pin, typed, is the pin shifted."""
    grid_s = np.cumsum(np.random.default_rng(5).uniform(0.41, 0.44, 24)) - 0.5
    inside = grid_s[2:-2]
    number = np.arange(len(inside))
    beats = BeatGrid(inside, number // 4 + 1, number % 4 + 1, np.ones(len(inside)))
    song = PlayedSong(grid_s, beats, float(grid_s[-1]) - 0.1)
    wish = parse_pin(text)
    pin = to_pin(wish, song, nodes)
    typed = way_out(WayOut(0, shift, ""), [pin], [wish], song).partition(", ")[0]
    again = to_pin(parse_pin(typed), song, nodes)
    assert (again.first, again.last) == (pin.first + shift, pin.last + shift)


def test_what_could_be_wished_instead_is_of_the_same_kind(nodes):
    assert list(nodes.instead_of(parse_pin("1=spni"))) == ["spin", "walk"]
    assert list(nodes.instead_of(parse_pin("1=jump"))) == ["spin", "walk"]  # what there is most of
    assert list(nodes.instead_of(parse_pin("1=style:hop")))[:2] == ["style:hip", "style:x"]
    assert next(iter(nodes.instead_of(parse_pin("1=clip:a")))) == "clip:a"
    assert list(nodes.instead_of(parse_pin("1=not:spin"))) == ["spin", "walk"]


def test_the_start_and_the_end_are_moments_one_can_see(nodes):
    beats = BeatGrid(np.arange(1, 9) * 0.5, np.zeros(8, int), np.zeros(8, int), np.ones(8))
    song = PlayedSong(np.arange(10) * 0.5 - 0.4, beats, 4.2)
    start, end = (to_pin(parse_pin(f"{place}=spin"), song, nodes) for place in ("start", "end"))
    assert (start.first, start.last) == (0, 2)  # of the first interval the song has a fifth
    assert (end.first, end.last) == (8, 9)  # of the last most of it, from 3.6 to 4.1
    short = PlayedSong(np.arange(10) * 0.5 - 0.4, beats, 3.7)
    end = to_pin(parse_pin("end=spin"), short, nodes)
    assert (end.first, end.last) == (7, 9)


def test_a_moment_before_the_first_beat_is_that_of_the_beat():
    """Three milliseconds before a song's first beat are no moment of their own, nor are those after its last."""
    time_s = 0.003 + np.arange(8) * 0.5
    beats = BeatGrid(time_s, np.zeros(8, int), np.zeros(8, int), np.ones(8))
    song = PlayedSong(np.append(time_s[0] - 0.5, np.append(time_s, time_s[-1] + 0.5)), beats, float(time_s[-1]) + 0.004)
    assert stretch(parse_pin("0=spin"), song) == (0, 2)
    assert stretch(parse_pin("0.2=spin"), song) == (1, 2)
    assert stretch(parse_pin("3.505=spin"), song) == (7, 9)
    assert stretch(parse_pin("0-0.002=spin"), song) == (0, 2)
