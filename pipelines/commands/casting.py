"""The character a person names on the command line: found, and looked at before anything is danced."""

import difflib
from pathlib import Path

from assets.dancing.characters import CharacterError, read_file
from assets.formats.usd_character import is_file, split
from assets.sources.sources import Sources
from pipelines.studio.files import StudioError
from pipelines.studio.folder import StudioFolder


def named(studio: StudioFolder, sources: Sources, text: str) -> str:
    """Bring what a person calls a character to what is remembered of it.

    Parameters
    ----------
    studio : StudioFolder
    sources : what the studio has
    text : key, path or file name of a clip, or a USD file with or without a skeleton's path; "" for none

    Returns
    -------
    str
        Key of the clip, or path of the file, relative to the studio where it lies inside.

    Raises
    ------
    StudioError
        If there is no such clip or file, or the file has no character that can dance.
    """
    if not text:
        return ""
    if is_file(text):
        return _file(studio, text)
    clips = {clip.key: clip for clip in sources.clips if not clip.problem}
    hits = [k for k, c in clips.items() if text in (k, c.path, Path(c.path).name, Path(c.path).stem)]
    if len(hits) == 1 or text in hits:
        return text if text in hits else hits[0]
    if hits:
        raise StudioError(f"--character: want one clip, {text!r} is {', '.join(hits)}; give its key")
    near = difflib.get_close_matches(text, clips, n=3, cutoff=0.3)
    known = f"near are {', '.join(near)}" if near else f"there are {', '.join(sorted(clips)[:10]) or 'none'}"
    raise StudioError(f"--character: want a clip of this studio or a USD file, got {text!r}; {known}")


def _file(studio: StudioFolder, text: str) -> str:
    name, prim = split(text)
    place = Path(name).absolute()
    if not place.is_file() and studio.file(name).is_file():
        place = studio.file(name)
    inside = place.relative_to(studio.root).as_posix() if place.is_relative_to(studio.root) else str(place)
    found = inside + (f":{prim}" if prim else "")
    try:
        read_file(studio, found)
    except CharacterError as error:
        raise StudioError(f"--character: {error}") from error
    return found
