"""Pins of a director, brought onto the beats of a song and the nodes of the motion graph."""

import difflib
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from assets.reading.songs import PlayedSong
from kernels.graph.pin_conflicts import Conflict, Pin, WayOut
from schemas.pins import PinWish


class DirectionError(ValueError):
    """A pin names no place of this song; the message says which places there are."""


@dataclass(frozen=True)
class PartNames:
    """What a method makes dances of, as sentences call it: the parts, and a sequence of them."""

    many: str
    way: str


GRAPH_PARTS = PartNames("beats", "way through the motion graph")


@dataclass(frozen=True, eq=False)
class Nodes:
    """What pins can name of the nodes of a graph, or of recorded motions; (N,) texts each.

    ``is_whole``, (N,) bool or None for none, tells those of clips that are danced whole or not at all.
    """

    clip_id: NDArray[np.str_]
    label: NDArray[np.str_]
    style: NDArray[np.str_]
    is_whole: NDArray[np.bool_] | None = None

    def wished(self, wish: PinWish) -> NDArray[np.bool_]:
        """Find the nodes that a wish admits, (N,) bool."""
        if wish.clip:
            return np.isin(self.clip_id, wish.clips)
        if wish.pose:
            return np.ones(len(self.clip_id), bool)
        if wish.style:
            return np.asarray(self.style == wish.style)
        if wish.not_label:
            return np.asarray(self.label != wish.not_label)
        return np.asarray(self.label == wish.label)

    def instead_of(self, wish: PinWish) -> dict[str, NDArray[np.bool_]]:
        """List alternatives to a wish, as one would write them, and the nodes of each.

        Of the same kind: labels for a label or none, styles for a style, clips for a clip or a pose; what is spelt
        alike first, then what there is most of. After clips come labels.
        """
        clip = wish.clip or wish.pose_moment[0]
        kinds = {"clip:": self.clip_id} if clip else {"style:": self.style} if wish.style else {}
        wanted = clip or wish.style or wish.label
        found: dict[str, NDArray[np.bool_]] = {}
        for prefix, names in {**kinds, "": self.label}.items():
            known, count = np.unique(names[names != ""], return_counts=True)
            alike = difflib.get_close_matches(wanted, known.tolist(), n=5, cutoff=0.6)
            often = [str(name) for _, name in sorted(zip(-count, known, strict=True))]
            rest = often if prefix != "clip:" else []
            found |= {f"{prefix}{name}": names == name for name in [*alike, *rest]}
        return found


def to_pin(wish: PinWish, song: PlayedSong, nodes: Nodes) -> Pin:
    """Bring one wish onto beats and nodes.

    Parameters
    ----------
    wish : PinWish
    song : PlayedSong
    nodes : Nodes

    Returns
    -------
    Pin
        Every beat interval that the stretch touches; where the wish names nothing there is, no node is admitted. Poses
        are brought onto nodes by :mod:`assets.dancing.pose_pins`.

    Raises
    ------
    DirectionError
        If the place is not in the song, or its bars are not known.
    """
    first, last = stretch(wish, song)
    return Pin(wish.text, first, last, nodes.wished(wish))


def stretch(wish: PinWish, song: PlayedSong) -> tuple[int, int]:
    """Find the music intervals of a pin, first <= k < last.

    Raises
    ------
    DirectionError
        If the place is not in the song, or its bars are not known.
    """
    n = len(song.grid_s) - 1
    # A first or last interval of which the song has less than half is no moment of its own.
    seen = np.diff(np.clip(song.grid_s, 0.0, song.duration_s)) >= np.diff(song.grid_s) / 2
    whole = np.flatnonzero(seen) if seen.any() else np.arange(n)
    if wish.place:
        return (0, int(whole[0]) + 1) if wish.place == "start" else (int(whole[-1]), n)
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
    return min(first, int(whole[-1])), int(np.clip(max(last, int(whole[0]) + 1), first + 1, n))


def _counted(
    wish: PinWish, unit: str, first: int, end: int, number: NDArray[np.int64], song: PlayedSong
) -> tuple[int, int]:
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
    conflict: Conflict,
    pins: Sequence[Pin],
    wishes: Sequence[PinWish],
    song: PlayedSong,
    nodes: Nodes,
    parts: PartNames = GRAPH_PARTS,
) -> list[str]:
    """Say which pins cannot be kept, why, and what would help.

    Parameters
    ----------
    conflict : Conflict of ``pins``
    pins, wishes : in the same order
    song, nodes : as the pins were made with
    parts : what the dance is made of

    Returns
    -------
    list of str
        The reason, then one line for each way out; last, whether there are more conflicts.
    """
    those = [wishes[i] for i in conflict.pin_index]
    names = ", ".join(w.text for w in those)
    reason = {
        "nothing": f"what is {_called(those[0])} may not be danced: its licence is not among those of 'allow'"
        if nodes.wished(those[0]).any() and not those[0].pose
        else f"no clip with {parts.many} is {_called(those[0])}{_near(those[0], nodes)}",
        "tempo": f"all {parts.many} it admits are too fast or too slow for the song there (warp beyond 0.80 to 1.25)"
        if not those[0].pose
        else "no clip shows such a pose near enough to the song's tempo there (warp 0.80 to 1.25)",
        "start": f"no {parts.way} leads there in time, or from there to the end of the song",
        "same_time": "each can be kept alone, but no clip is all of them at once",
        "path": f"each can be kept alone, but no {parts.way} keeps them all"
        + _within([pins[i] for i in conflict.pin_index]),
    }[conflict.reason]
    fixed = [
        w.text for w in those if nodes.is_whole is not None and nodes.is_whole[nodes.wished(w)].all() and not w.pose
    ]
    if fixed and conflict.reason in ("start", "path"):
        reason += f"; by its licence the clip of {' and '.join(fixed)} may not be changed and enters no blend"
    ways = [way_out(way, pins, wishes, song) for way in conflict.ways_out]
    more = ["other pins conflict too; mend these first"] if conflict.has_more else []
    leads = ["this would work", *["or"] * len(ways)]
    return [f"{names}: {reason}", *(f"{lead}: {way}" for lead, way in zip(leads, ways, strict=False)), *more]


def _within(pins: Sequence[Pin]) -> str:
    """Say how few beats lie between pins that cannot both be kept; "" where they do not follow each other."""
    ordered = sorted(pins, key=lambda pin: pin.first)
    gaps = [after.first - before.last for before, after in itertools.pairwise(ordered)]
    if not gaps or min(gaps) < 0:
        return ""
    between = ", ".join(str(gap) for gap in gaps)
    return f" ({between} beat{'s' * (gaps != [1])} between them)"


def way_out(way: WayOut, pins: Sequence[Pin], wishes: Sequence[PinWish], song: PlayedSong) -> str:
    """Write a way out as a person would type it: the pin first, then how it differs."""
    pin, wish = pins[way.pin_index], wishes[way.pin_index]
    if way.choice:
        return f"{wish.text.partition('=')[0]}={way.choice} in place of {wish.text}"
    n, wished = way.shift_beats, wish.text.partition("=")[2]
    beats = f"{abs(n)} beat{'s' * (abs(n) > 1)} {'later' if n > 0 else 'earlier'} than {wish.text}"
    first, last = song.grid_s[pin.first + n], song.grid_s[pin.last + n]
    if pin.last == pin.first + 1:
        return f"{min(max((first + last) / 2, 0.01), song.duration_s):.2f}={wished}, {beats}"
    # Rounded inwards: a hundredth too early would name another beat as well.
    from_s, to_s = max(np.ceil(100 * first) / 100, 0.0), np.floor(100 * min(last, song.duration_s)) / 100
    return f"{from_s:.2f}-{to_s:.2f}={wished}, {beats}"


def _called(wish: PinWish) -> str:
    clip = wish.clip or wish.pose_moment[0]
    kind = "clip" if clip else "style" if wish.style else "label"
    return {"clip": f"called {clip!r}", "style": f"of style {wish.style!r}"}.get(
        kind, f"labelled {wish.label!r}" if wish.label else f"labelled other than {wish.not_label!r}"
    )


def _near(wish: PinWish, nodes: Nodes) -> str:
    clip = wish.clip or wish.pose_moment[0]
    wanted = clip or wish.style or wish.label or wish.not_label
    known = np.unique(nodes.clip_id if clip else nodes.style if wish.style else nodes.label).tolist()
    near = difflib.get_close_matches(wanted, known, n=3, cutoff=0.4) or known[:8]
    return f"; there are {', '.join(near)}" if near else ""


def kept(pins: Sequence[Pin], song: PlayedSong, clip_of_interval: Mapping[int, str]) -> list[dict[str, object]]:
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
