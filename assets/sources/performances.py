"""Which clips were danced to which songs of the studio: as ``clips.csv`` says, else by name."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

from schemas.keys import song_key

NO_SONG = "none"
"""What ``clips.csv`` says of a clip that has a song's name and was not danced to it."""


@dataclass(frozen=True)
class DancedClip:
    """A clip, and which song it was danced to by its facts."""

    clip_id: str
    path: str
    performed_to: str = ""
    offset_s: float = 0.0


@dataclass(frozen=True)
class NamedSong:
    """A song as a performance may name it."""

    song_id: str
    path: str
    kind: str


@dataclass(frozen=True)
class Performance:
    """A clip danced to a song; ``offset_s`` is the time of the song at the clip's first frame."""

    clip_id: str
    song_id: str
    offset_s: float
    paired_by: str


def pair(clips: Iterable[DancedClip], songs: Sequence[NamedSong]) -> tuple[list[Performance], list[str]]:
    """Pair clips with songs.

    Parameters
    ----------
    clips : every clip
    songs : every song

    Returns
    -------
    performances : in the order of the clips
        By the song ``clips.csv`` names (its key, file name or stem), else by a song of the clip's own stem. Where audio
        and MIDI have one stem, the MIDI: it tells its drums.
    troubles : one sentence for each clip whose song is not there
    """
    ordered = sorted(songs, key=lambda song: (song.kind != "midi", song.path))
    by_name: dict[str, NamedSong] = {}
    for name in (_file_name, lambda song: song.song_id, _stem):
        for song in ordered:
            by_name.setdefault(_spelt(name(song)), song)
    by_stem = {song_key(_stem(song)): song for song in reversed(ordered)}
    found, troubles = [], []
    for clip in clips:
        if clip.performed_to.lower() == NO_SONG:
            continue
        if clip.performed_to:
            named = by_name.get(PurePosixPath(_spelt(clip.performed_to).replace("\\", "/")).name)
            if named is None:
                troubles.append(
                    f"{clip.path}: performed to {clip.performed_to!r}, which is no song of this studio; "
                    "put it under songs/ or correct clips.csv"
                )
            else:
                found.append(Performance(clip.clip_id, named.song_id, clip.offset_s, "clips.csv"))
            continue
        own = by_stem.get(song_key(PurePosixPath(clip.path).stem))
        if own is not None:
            found.append(Performance(clip.clip_id, own.song_id, clip.offset_s, "name"))
    return found, troubles


def _spelt(name: str) -> str:
    """Spell a name as it is compared: in small letters, with accents put together."""
    return unicodedata.normalize("NFC", name.lower())


def _file_name(song: NamedSong) -> str:
    return PurePosixPath(song.path).name


def _stem(song: NamedSong) -> str:
    return PurePosixPath(song.path).stem
