"""What a director asks of a dance, brought onto the beats of a song and the nodes of the motion graph."""

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.graph.pins import Conflict, Pin, WayOut
from kernels.music.repeats import Repeat
from kernels.types import BeatGrid, Float
from schemas.pins import PinWish


class DirectionError(ValueError):
    """A pin names no place of this song; the message says which places there are."""


@dataclass(frozen=True, eq=False)
class Song:
    """The beats of a song as its dance counts them.

    Parameters
    ----------
    grid_s : (K + 1,) float64, seconds, the beats the dance covers, those before and after the song's own included
    beats : BeatGrid, the song's own
    duration_s : float, seconds, > 0
    intensity : (K,) float, how strong each interval of the grid is, or None where it is not known
    repeats : stretches of the grid that play earlier ones again
    """

    grid_s: Float
    beats: BeatGrid
    duration_s: float
    intensity: Float | None = None
    repeats: Sequence[Repeat] = ()

    @property
    def own(self) -> NDArray[np.int64]:
        """Place in the grid of each of the song's own beats."""
        return np.searchsorted(self.grid_s, self.beats.time_s - 1e-9)


@dataclass(frozen=True, eq=False)
class Nodes:
    """What pins can name of the nodes of a graph; (N,) texts each."""

    clip_id: NDArray[np.str_]
    label: NDArray[np.str_]
    style: NDArray[np.str_]

    def wished(self, wish: PinWish) -> NDArray[np.bool_]:
        """Find the nodes that a wish admits, (N,) bool."""
        if wish.clip:
            return np.asarray(self.clip_id == wish.clip)
        if wish.style:
            return np.asarray(self.style == wish.style)
        if wish.not_label:
            return np.asarray(self.label != wish.not_label)
        return np.asarray(self.label == wish.label)

    def labels(self) -> dict[str, NDArray[np.bool_]]:
        """Nodes of each label, in alphabetical order."""
        return {str(label): self.label == label for label in np.unique(self.label)}


def to_pin(wish: PinWish, song: Song, nodes: Nodes) -> Pin:
    """Bring one wish onto beats and nodes.

    Parameters
    ----------
    wish : PinWish
    song : Song
    nodes : Nodes

    Returns
    -------
    Pin
        Every beat interval that the stretch touches; where the wish names nothing there is, no node is admitted.

    Raises
    ------
    DirectionError
        If the place is not in the song, or its bars are not known.
    """
    first, last = stretch(wish, song)
    return Pin(wish.text, first, last, nodes.wished(wish))


def stretch(wish: PinWish, song: Song) -> tuple[int, int]:
    """Find the music intervals of a pin, first <= k < last.

    Raises
    ------
    DirectionError
        If the place is not in the song, or its bars are not known.
    """
    n = len(song.grid_s) - 1
    if wish.place:
        return (0, 1) if wish.place == "start" else (n - 1, n)
    if wish.beat:
        return _counted(wish, "beat", wish.beat, wish.until_beat or wish.beat + 1, np.arange(len(song.own)) + 1, song)
    if wish.bar:
        bars = song.beats.bar_number
        if not bars.any():
            raise DirectionError(
                f"{wish.text}: want a song whose bars are known, got none; pin seconds or beats instead"
            )
        return _counted(wish, "bar", wish.bar, (wish.until_bar or wish.bar) + 1, bars, song)
    until = wish.until if wish.until > 0 else wish.at
    if not until <= song.duration_s + 1e-6:
        raise DirectionError(f"{wish.text}: want seconds within the song, 0 to {song.duration_s:.2f}, got {until:g}")
    first = int(np.clip(np.searchsorted(song.grid_s, wish.at + 1e-9, side="right") - 1, 0, n - 1))
    last = int(np.searchsorted(song.grid_s, until - 1e-9, side="left")) if wish.until > 0 else first + 1
    return first, int(np.clip(last, first + 1, n))


def _counted(wish: PinWish, unit: str, first: int, end: int, number: NDArray[np.int64], song: Song) -> tuple[int, int]:
    """Intervals from the beat where a count begins to the one where another does."""
    n = len(song.grid_s) - 1
    counts = range(int(number[0]), int(number[-1]) + 1)
    if first not in counts or end - 1 not in counts:
        got = first if first not in counts else end - 1
        raise DirectionError(f"{wish.text}: want {unit} {counts[0]} to {counts[-1]} of the song, got {got}")
    begins = int(song.own[np.searchsorted(number, first)])
    after = int(np.searchsorted(number, end))
    ends = int(song.own[after]) if after < len(song.own) else n
    return min(begins, n - 1), min(max(ends, begins + 1), n)


def sentences(
    conflict: Conflict, pins: Sequence[Pin], wishes: Sequence[PinWish], song: Song, nodes: Nodes
) -> list[str]:
    """Say which pins cannot be kept, why, and what would help.

    Parameters
    ----------
    conflict : Conflict of ``pins``
    pins, wishes : in the same order
    song, nodes : as the pins were made with

    Returns
    -------
    list of str
        The reason, then one line for each way out.
    """
    those = [wishes[i] for i in conflict.pin_index]
    names = ", ".join(w.text for w in those)
    reason = {
        "nothing": f"no clip with beats is {_called(those[0])}{_near(those[0], nodes)}",
        "tempo": "what it wishes has no beats near enough to the song's tempo there (warp 0.80 to 1.25)",
        "start": "no way through the motion graph leads there in time, or from there to the end of the song",
        "path": "each of them can be kept, but no way through the motion graph keeps them all",
    }[conflict.reason]
    ways = [way_out(way, pins, wishes, song) for way in conflict.ways_out]
    return [f"{names}: {reason}", *(f"would do: {way}" for way in ways)]


def way_out(way: WayOut, pins: Sequence[Pin], wishes: Sequence[PinWish], song: Song) -> str:
    """Write a way out as a person would type it."""
    pin, wish = pins[way.pin_index], wishes[way.pin_index]
    if way.choice:
        return f"{wish.text.partition('=')[0]}={way.choice} in place of {wish.text}"
    first, last = song.grid_s[pin.first + way.shift_beats], song.grid_s[pin.last + way.shift_beats]
    beats = (
        f"{abs(way.shift_beats)} beat{'s' * (abs(way.shift_beats) > 1)} {'later' if way.shift_beats > 0 else 'earlier'}"
    )
    return f"{max(first, 0):.2f}-{last:.2f}={wish.text.partition('=')[2]}, {beats} than {wish.text}"


def _called(wish: PinWish) -> str:
    kind = "clip" if wish.clip else "style" if wish.style else "label"
    return {"clip": f"called {wish.clip!r}", "style": f"of style {wish.style!r}"}.get(
        kind, f"labelled {wish.label!r}" if wish.label else f"labelled other than {wish.not_label!r}"
    )


def _near(wish: PinWish, nodes: Nodes) -> str:
    wanted = wish.clip or wish.style or wish.label or wish.not_label
    known = np.unique(nodes.clip_id if wish.clip else nodes.style if wish.style else nodes.label).tolist()
    near = difflib.get_close_matches(wanted, known, n=3, cutoff=0.4) or known[:8]
    return f"; there are {', '.join(near)}" if near else ""


def kept(pins: Sequence[Pin], song: Song, clip_of_interval: Mapping[int, str]) -> list[dict[str, object]]:
    """Facts of pins that are kept, for machines: text, seconds, clips danced there."""
    return [
        {
            "pin": pin.name,
            "from_s": float(max(song.grid_s[pin.first], 0.0)),
            "to_s": float(min(song.grid_s[pin.last], song.duration_s)),
            "clips": list(
                dict.fromkeys(clip_of_interval[k] for k in range(pin.first, pin.last) if k in clip_of_interval)
            ),
        }
        for pin in pins
    ]
