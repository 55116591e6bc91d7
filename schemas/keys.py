"""What a clip_id, session or song_id may look like, and how one is made from a path.

A key becomes a partition and a file name, so it is made legal here and nowhere else: lower-case letters, digits and
single underscores, parts joined by ``-``, at most 80 characters. A key depends on the path alone, never on content.
"""

from __future__ import annotations

import hashlib
import re
import unicodedata
from collections.abc import Sequence

LONGEST_KEY = 80
_LONGEST_SESSION = 32
_LONGEST_TAKE = LONGEST_KEY - _LONGEST_SESSION - 1
_PATTERN = re.compile(r"[a-z0-9]+(_[a-z0-9]+)*(-[a-z0-9]+(_[a-z0-9]+)*)*")


def is_key(text: str) -> bool:
    """Whether a text is a legal key."""
    return len(text) <= LONGEST_KEY and _PATTERN.fullmatch(text) is not None


def check_key(text: str) -> str:
    """Refuse a text that is no legal key.

    Parameters
    ----------
    text : str

    Returns
    -------
    str
        The text as it is.

    Raises
    ------
    ValueError
        If it is empty, too long, or has other signs.
    """
    if not is_key(text):
        raise ValueError(f"key: want lower-case letters, digits, '_' and '-', at most {LONGEST_KEY}, got {text!r}")
    return text


def _hash(text: str) -> str:
    """Hash a name, however its letters are put together: macOS writes ``が`` as two signs, other systems as one."""
    return hashlib.sha256(unicodedata.normalize("NFC", text).encode("utf-8", "surrogatepass")).hexdigest()[:8]


def slug(text: str, *, longest: int = LONGEST_KEY) -> str:
    """Make one part of a key from any name.

    Accents are dropped, everything else that is no letter or digit becomes ``_``. Where that loses letters (Japanese,
    say) or the name is too long, eight characters of its hash keep names apart.

    Parameters
    ----------
    text : any string, also empty
    longest : int, >= 16

    Returns
    -------
    str
        Of ``[a-z0-9]`` and single inner underscores, 1 to ``longest`` characters.
    """
    plain = "".join(c for c in unicodedata.normalize("NFKD", text) if not unicodedata.combining(c))
    part = re.sub(r"[^a-z0-9]+", "_", plain.lower()).strip("_")
    is_lossy = any(not c.isascii() and c.isalnum() for c in plain)
    if part and not is_lossy and len(part) <= longest:
        return part
    kept = part[: longest - 9].rstrip("_")
    return f"{kept}_{_hash(text)}" if kept else f"x{_hash(text)}"


def session_key(folders: Sequence[str]) -> str:
    """Key of a session from the names of its folders below ``clips/``; ``clips`` for that folder itself.

    Parameters
    ----------
    folders : names from the outermost on, any strings

    Returns
    -------
    str
        A legal key of at most 32 characters; a longer one is cut and ends in a hash of the folders.
    """
    key = "-".join(slug(name) for name in folders) or "clips"
    if len(key) <= _LONGEST_SESSION:
        return key
    return f"{key[: _LONGEST_SESSION - 9].rstrip('_-')}_{_hash('/'.join(folders))}"


def clip_key(folders: Sequence[str], stem: str) -> str:
    """Key of a clip: its folder's session key and its own name.

    Parameters
    ----------
    folders : as for :func:`session_key`
    stem : name of the file without its suffix

    Returns
    -------
    str
        A legal key.
    """
    return f"{session_key(folders)}-{slug(stem, longest=_LONGEST_TAKE)}"


_MIRRORED = "~mirrored"


def mirrored(clip_id: str) -> str:
    """Name of a clip's mirror image among the clips of a dance; tables say the clip and a flag instead."""
    return clip_id + _MIRRORED


def is_mirrored(name: str) -> bool:
    """Whether a name is that of a mirror image."""
    return name.endswith(_MIRRORED)


def source_clip(name: str) -> str:
    """Key of the clip that a name stands for, mirrored or not."""
    return name.removesuffix(_MIRRORED)


def seen_label(label: str, name: str) -> str:
    """Label of what a clip shows by the name it is danced under: mirrored, ``wave-right-hand`` is ``wave-left-hand``.

    Parameters
    ----------
    label : of the clip; the words ``left`` and ``right`` change places in a mirror, whatever letters they are in
    name : key of a clip, or of its mirror image
    """
    return _SIDE.sub(lambda word: _as(word[0], _OTHER[word[0].lower()]), label) if is_mirrored(name) else label


_OTHER = {"left": "right", "right": "left"}
_SIDE = re.compile(r"(?<![a-z])(left|right)(?![a-z])", re.IGNORECASE)


def _as(word: str, other: str) -> str:
    """Spell a word with capitals as another has them."""
    return other.upper() if word.isupper() else other.capitalize() if word[0].isupper() else other


def song_key(stem: str) -> str:
    """Key of a song from its file's name without suffix."""
    return slug(stem)


def part_key(session: str, part: int, n_parts: int) -> str:
    """Key of one part of a session too large for one partition.

    Parameters
    ----------
    session : key of the session
    part : int, 0 to ``n_parts`` - 1
    n_parts : int, >= 2
    """
    width = len(str(n_parts - 1))
    return f"{session}-part_{part:0{width}d}_of_{n_parts}"


def part_of(name: str, n_parts: int) -> int:
    """Find the part a clip belongs to, by a hash of its name: the same however many others come and go.

    Parameters
    ----------
    name : str
        Of the clip's file.
    n_parts : int, >= 1

    Returns
    -------
    int, 0 to ``n_parts`` - 1
    """
    return int(_hash(name), 16) % n_parts


_PART = re.compile(r"(?P<session>.+)-part_\d+_of_(?P<n_parts>\d+)")


def parts_in_use(session_keys: Sequence[str]) -> dict[str, int]:
    """Read back how many parts each split session has from the keys of its parts.

    Parameters
    ----------
    session_keys : of the sessions and parts of sessions there are

    Returns
    -------
    dict
        Number of parts by session; sessions in one piece are left out.
    """
    found = (_PART.fullmatch(key) for key in session_keys)
    return {m["session"]: int(m["n_parts"]) for m in found if m}


def base_method(method: str) -> str:
    """Find the method an alternative is one of: ``graph`` of ``graph_2``.

    Parameters
    ----------
    method : str, a method's name, or that of an alternative
    """
    return method.partition("_")[0]


def alternative_number(method: str) -> int:
    """Find which dance of its method it is: 1 for the best, 2 and on for alternatives.

    Parameters
    ----------
    method : str, a method's name, or that of an alternative
    """
    return int(method.partition("_")[2] or 1)
