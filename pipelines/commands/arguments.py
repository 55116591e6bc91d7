"""What was asked of a command: which songs, which pins, by which method."""

import difflib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from assets.dancing.methods import USUAL
from assets.formats.errors import FormatError
from assets.sources.sources import SongFile, Sources
from pipelines.commands.search_motions import by_likeness
from pipelines.studio.files import StudioError
from pipelines.studio.folder import StudioFolder
from schemas.pins import parse_pin


def pin_texts(pins: Sequence[str], root: Path, progress: Callable[[], Any]) -> tuple[str, ...]:
    """Check pins of the command line, those by likeness turned into clips; StudioError says what a pin looks like."""
    named = [by_likeness(root, text, progress=progress) for text in pins]
    try:
        return tuple(dict.fromkeys(parse_pin(text).text for text in named))
    except ValueError as error:
        raise StudioError(f"--pin: {error}") from error


def briefed_method(studio: StudioFolder, song: SongFile) -> str:
    """Find the method a song's brief names; the usual one where the brief cannot be read (its song is refused)."""
    try:
        return studio.brief(song).method
    except FormatError:
        return USUAL


def wanted_songs(sources: Sources, wanted: Sequence[str], studio: StudioFolder) -> list[SongFile]:
    """Find songs by key, file name, stem or path; LookupError naming the nearest where there is none."""
    songs = {key: sources.song(key) for key in sources.songs_by_key()}
    if not songs:
        raise StudioError(f"{studio.root}: want a song under songs/, got none; put one there")
    if list(wanted) == ["all"]:
        return list(songs.values())
    found = []
    for text in wanted:
        name = Path(text).name
        hits = [
            s
            for s in songs.values()
            if text in (s.key, s.path)
            or name == Path(s.path).name
            or text == Path(s.path).stem
            or _same(studio, s, text)
        ]
        if not hits:
            near = difflib.get_close_matches(
                text, [*songs, *(Path(s.path).name for s in songs.values())], n=3, cutoff=0.3
            )
            raise StudioError(
                f"{text}: want a song of this studio, found none of that name; "
                f"{'near are ' + ', '.join(near) if near else 'there are ' + ', '.join(list(songs)[:10])}"
            )
        found.append(hits[0])
    return list(dict.fromkeys(found))


def _same(studio: StudioFolder, song: SongFile, text: str) -> bool:
    return Path(text).absolute() == studio.file(song.path)
