"""Recordings and songs of a studio, their facts, the requests for dances, and versions of all three.

:mod:`assets.sources.scan` finds them.
"""

import hashlib
import json
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Protocol

from assets.formats import settings_file, suit, tree
from assets.formats.clips_csv import Facts
from assets.formats.errors import FormatError
from assets.sources.performances import DancedClip, NamedSong, pair
from schemas.settings import Brief, Settings

FilePath = Path
"""Place of a file of a studio, for those who hand it on and open nothing themselves."""


@dataclass(frozen=True)
class ClipFile:
    """A motion file of the studio.

    Parameters
    ----------
    key, session : its clip_id and the partition it lies in
    path : relative to the studio
    sha256 : of its bytes; empty where it was not read
    facts : label, style, subject, licence
    problem : why it is refused before it is opened; empty when it is not
    """

    key: str
    session: str
    path: str
    sha256: str
    facts: Facts
    problem: str = ""

    @property
    def kind(self) -> str:
        """Whether it is a ``"bvh"`` or the recording of a ``"suit"``."""
        return "suit" if self.path.lower().endswith(suit.SUFFIXES) else "bvh"


@dataclass(frozen=True)
class SongFile:
    """A music file of the studio; ``brief`` is its brief's path, empty when there is none."""

    key: str
    path: str
    sha256: str
    kind: str
    brief: str = ""
    problem: str = ""


@dataclass(frozen=True)
class Sources:
    """Everything found under one studio, and what was odd about the folder itself."""

    clips: tuple[ClipFile, ...]
    songs: tuple[SongFile, ...]
    notes: tuple[str, ...] = ()

    def sessions(self) -> dict[str, tuple[ClipFile, ...]]:
        """Clips by session, both in order."""
        found: dict[str, list[ClipFile]] = defaultdict(list)
        for clip in self.clips:
            found[clip.session].append(clip)
        return {session: tuple(found[session]) for session in sorted(found)}

    def song(self, key: str) -> SongFile:
        """Find the song of a key, the readable one where two files want the key.

        Parameters
        ----------
        key : str

        Returns
        -------
        SongFile

        Raises
        ------
        KeyError
            If there is none.
        """
        found = sorted((song for song in self.songs if song.key == key), key=lambda song: bool(song.problem))
        if not found:
            raise KeyError(key)
        return found[0]

    def songs_by_key(self) -> dict[str, tuple[SongFile, ...]]:
        """Songs by key: more than one where two files want it."""
        found: dict[str, list[SongFile]] = defaultdict(list)
        for song in self.songs:
            found[song.key].append(song)
        return {key: tuple(found[key]) for key in sorted(found)}

    @cached_property
    def performed_songs(self) -> frozenset[str]:
        """Keys of the songs that clips were danced to."""
        found, _ = pair(
            [
                DancedClip(c.key, c.path, c.facts.performed_to, c.facts.performed_offset_s)
                for c in self.clips
                if not c.problem
            ],
            [NamedSong(s.key, s.path, s.kind) for s in self.songs if not s.problem],
        )
        return frozenset(one.song_id for one in found)


@dataclass(frozen=True)
class Request:
    """A request for one dance, beside the brief; remembered, so that a nightly rebuild makes the same.

    Parameters
    ----------
    frame_rate_hz : frames a second of the stage; 0 for the setting
    pins : as on the command line; beside those of the brief
    character : clip or USD file whose body is danced with; "" for the brief's
    temperature : of a dance by the model; None for the setting
    seed : of what is drawn at random
    """

    frame_rate_hz: float = 0.0
    pins: tuple[str, ...] = ()
    character: str = ""
    temperature: float | None = None
    seed: int = 0


class Studio(Protocol):
    """What assets ask of a studio folder."""

    def sources(self) -> Sources:
        """List what is there, hashed."""
        ...

    def settings(self) -> Settings:
        """Read ``odori.toml``."""
        ...

    def brief(self, song: SongFile) -> Brief:
        """Read a song's brief; every default where it has none.

        Parameters
        ----------
        song : SongFile

        Raises
        ------
        FormatError
            If the brief cannot be read.
        """
        ...

    def file(self, path: str) -> Path:
        """Place of a source on disk."""
        ...

    def requests(self) -> Mapping[str, Request]:
        """List the requests for dances, by ``<song>|<method>``."""
        ...


def fingerprint(facts: object) -> str:
    """Hash of anything JSON can hold: 16 hexadecimal characters.

    Parameters
    ----------
    facts : what JSON can hold; keys of mappings in any order

    Raises
    ------
    TypeError
        If JSON cannot hold it.
    """
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()[:16]


def session_version(clips: Iterable[ClipFile]) -> str:
    """Version a session's sources: which files, with which bytes, labelled how.

    Parameters
    ----------
    clips : of the session, in order

    Returns
    -------
    str
        16 hexadecimal characters, also for no clips.
    """
    return fingerprint([[c.path, c.sha256, asdict(c.facts), c.problem] for c in clips])


def song_version(songs: Iterable[SongFile]) -> str:
    """Version a song's sources.

    Parameters
    ----------
    songs : of one key, in order

    Returns
    -------
    str
        16 hexadecimal characters, also for no songs.
    """
    return fingerprint([[s.path, s.sha256, s.problem] for s in songs])


def read_brief(studio: Studio, song: SongFile) -> Brief:
    """Read the brief a song came with; every default where there is none.

    Parameters
    ----------
    studio : Studio
    song : SongFile

    Raises
    ------
    FormatError
        If the brief cannot be read.
    """
    return settings_file.read_brief(studio.file(song.brief)) if song.brief else Brief()


def brief_version(studio: Studio, songs: Iterable[SongFile]) -> str:
    """Version what the briefs of a song say of its beats, the beats file they name included.

    Parameters
    ----------
    studio : Studio
    songs : of one key, in order
        Of a brief that cannot be read the bytes count; songs without one add nothing.

    Returns
    -------
    str
        16 hexadecimal characters.

    Raises
    ------
    OSError
        If a brief, or the beats file it names, cannot be opened.
    """
    said = []
    for song in songs:
        if not song.brief:
            continue
        place = studio.file(song.brief)
        try:
            asked = settings_file.read_brief(place).beats
        except FormatError:
            said.append(tree.sha256(place))
            continue
        said.append(fingerprint(asdict(asked)))
        beats = asked.file
        beats_place = place.parent / beats
        if beats and beats_place.is_file():
            said.append(tree.sha256(beats_place))
    return fingerprint(said)


def request_of(studio: Studio, key: str) -> Request:
    """Find the request for a dance; an empty one where there is none.

    Parameters
    ----------
    studio : Studio
    key : ``<song>|<method>``
    """
    return studio.requests().get(key, Request())


def request_version(studio: Studio, key: str, sources: Sources | None = None) -> str:
    """Version the request for a dance, by the command and by the brief of its song.

    Whose body it is danced with comes later: :func:`assets.dancing.characters.character_version`.

    Parameters
    ----------
    studio : Studio
    key : ``<song>|<method>``
    sources : those known already; None to list them now

    Returns
    -------
    str
        16 hexadecimal characters.
    """
    brief = brief_of(studio, key.split("|")[0], sources)
    directed = {"pin": [pin.text for pin in brief.pin], "pins": brief.pins, "allow": sorted(brief.allow)}
    asked = {**asdict(request_of(studio, key)), "character": ""}
    return fingerprint([asked, directed])


def brief_of(studio: Studio, song: str, sources: Sources | None = None) -> Brief:
    """Read the brief of a song by its key; every default where it has none, or one that cannot be read.

    Parameters
    ----------
    studio : Studio
    song : key
    sources : those known already; None to list them now

    Returns
    -------
    Brief
        Where two files want the key, that of the first by path that is not refused and has one.
    """
    songs = [s for s in (sources or studio.sources()).songs_by_key().get(song, ()) if s.brief and not s.problem]
    try:
        return studio.brief(songs[0]) if songs else Brief()
    except FormatError:  # its song is refused for it
        return Brief()
