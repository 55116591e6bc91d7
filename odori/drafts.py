"""Dances chosen and priced in memory, from the lake as it stands: no Dagster, nothing written.

What was read stays in memory, so that asking again is quick; it is read anew where its file changed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import polars as pl
from threadpoolctl import threadpool_limits

from assets.dancing import proposals
from assets.dancing.asked import direction_of
from assets.dancing.assembled import assemble_steps
from assets.dancing.method import DanceOrder
from assets.dancing.methods import METHODS, USUAL, check_order
from assets.dancing.without_flips import choose_without_flips
from assets.tables.choreography import from_choreography, from_dance_pose, to_choreography
from assets.tables.music import to_music_beat
from odori.exceptions import DanceRefusedError, OdoriError, refused
from odori.made_dances import Draft, PinProposal, dance_poses
from pipelines.studio.folder import StudioFolder
from pipelines.studio.inventory import songs_found
from pipelines.studio.stored import RememberedTable, TableMemory, partitions_for
from schemas.settings import Brief


class DraftRoom:
    """A studio's tables, kept in memory for one who asks many times.

    Parameters
    ----------
    folder : StudioFolder
    """

    def __init__(self, folder: StudioFolder) -> None:
        self.folder = folder
        self._memory = TableMemory()

    def stored(self, name: str, song: str) -> RememberedTable:
        """Give a table as a method of dancing reads it.

        Parameters
        ----------
        name : of the table
        song : key; of tables of songs its partition alone
        """
        lake = self.folder.lake
        return RememberedTable(lake, name, partitions_for(lake, name, song), self._memory)

    def lacks(self, names: Sequence[str], song: str) -> list[str]:
        """Name the tables of which nothing is stored.

        Parameters
        ----------
        names : of tables
        song : key
        """
        return [name for name in names if not self.stored(name, song).keys]


def draft_song(
    room: DraftRoom,
    song: str,
    *,
    method: str | None = None,
    pins: Sequence[str] = (),
    frame_rate_hz: float | None = None,
    temperature: float | None = None,
    seed: int = 0,
) -> Draft:
    """Choose a dance and assemble its poses; see :meth:`odori.OpenStudio.draft`.

    Parameters
    ----------
    room : DraftRoom
    song : key
    method, pins, frame_rate_hz, temperature, seed : as there

    Raises
    ------
    OdoriError
        As there.
    """
    with refused(), threadpool_limits(limits=1):
        studio = room.folder
        settings = studio.settings()
        brief = _readable_brief(room, song)
        way = method or brief.method
        if way not in METHODS:
            raise OdoriError(f"method: want one of {', '.join(METHODS)}, got {way!r}")
        chosen = METHODS[way]
        asked = direction_of(studio, f"{song}|{way}", pins=_without_likeness(studio, pins))
        check_order(chosen, song, asked)
        names = ("song", "music_beat", "canonical_pose", *chosen.inputs)
        _make_where_lacking(room, names, song, way)
        beats = to_music_beat(room.stored("music_beat", song).read(song))
        if len(beats.time_s) < 2:
            raise DanceRefusedError(f"{song}: cannot be danced: it has no beats; name a beats file in its brief")
        duration_s = float(max(room.stored("song", song).read(song)["duration_s"].to_pylist()))
        order = DanceOrder(song, beats, duration_s, settings, asked, temperature, seed)
        rate_hz = frame_rate_hz or settings.dance.frame_rate_hz
        inputs = {name: room.stored(name, song) for name in chosen.inputs}
        danced = choose_without_flips(chosen, inputs, order, frame_rate_hz=rate_hz)
        rows = from_choreography(song, way, danced.steps, danced.costs, danced.pin_ids, danced.states)
        poses = room.stored("canonical_pose", song)
        dance = assemble_steps(
            to_choreography(rows),
            poses,
            settings.dance,
            frame_rate_hz=rate_hz,
        )
        moved = dance_poses(f"{song}|{way}", from_dance_pose(song, way, dance))
    return Draft(song, way, cast(pl.DataFrame, pl.from_arrow(rows)), moved)


def place_pins(room: DraftRoom, song: str, place: str, *, pins: Sequence[str] = ()) -> list[PinProposal]:
    """List what could be pinned at a place; see :meth:`odori.OpenStudio.propose`.

    Parameters
    ----------
    room : DraftRoom
    song : key
    place, pins : as typed

    Raises
    ------
    OdoriError
        As there.
    """
    with refused(), threadpool_limits(limits=1):
        _readable_brief(room, song)
        _make_where_lacking(room, proposals.INPUTS, song, USUAL)
        inputs = {name: room.stored(name, song) for name in proposals.INPUTS}
        texts = _without_likeness(room.folder, pins)
        facts = proposals.propose_at(inputs, room.folder, song, place, pins=texts)
    if facts["best_cost"] is None:
        raise DanceRefusedError(f"{song}: cannot be danced at all with the clips that 'allow' admits")
    found = []
    for kind in proposals.KINDS:
        rows = facts[f"{kind}s"]
        found += [
            PinProposal(kind, row[kind], row["pin"], row["extra_cost"], row["steps_outside_warp_bounds"])
            for row in rows
        ]
        found += [
            PinProposal(kind, name, proposals.pin_text(place, kind, name), float("inf"))
            for name in facts["out_of_reach"][f"{kind}s"]
        ]
    return sorted(found, key=lambda p: (not p.is_within_reach, p.steps_outside_warp_bounds, p.extra_cost))


def _readable_brief(room: DraftRoom, song: str) -> Brief:
    """Read a song's brief; a song whose file or brief is refused is refused by its own reason."""
    sources = room.folder.sources()
    brief = room.folder.brief(sources.song(song))
    for file in songs_found(sources, room.folder.lake):
        if file["key"] == song and file["reason"]:
            raise OdoriError(f"{song}: it was refused: {file['reason']}")
    return brief


def _make_where_lacking(room: DraftRoom, names: Sequence[str], song: str, method: str) -> None:
    """Build what is not there at all; what is there is taken as it stands."""
    lacking = room.lacks(names, song)
    if not lacking:
        return
    from pipelines.commands.session import Session
    from pipelines.resources import NoProgress

    report = Session(room.folder, NoProgress).run_before_dance(song, method)
    lacking = room.lacks(names, song)
    if lacking:
        raise OdoriError(f"{song}: want {', '.join(lacking)}, could not be built: {'; '.join(report.failed)}")


def _without_likeness(studio: StudioFolder, pins: Sequence[str]) -> Sequence[str]:
    """Write pins by likeness as pins of clips; the search loads what it needs only where one is."""
    if not any(":" in pin and pin.partition("=")[2].strip().startswith("like:") for pin in pins):
        return pins
    from pipelines.commands.search_motions import by_likeness
    from pipelines.resources import NoProgress

    return [by_likeness(studio.root, pin, progress=NoProgress) for pin in pins]
