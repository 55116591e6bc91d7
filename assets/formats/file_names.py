"""Names of files from keys: the one place that knows what Windows does not take for a name.

Keys are made of small letters, digits, ``_`` and ``-`` (:mod:`schemas.keys`); that of a dance has ``|`` between its
song and its method. All systems but Windows take them as they are.
"""

from __future__ import annotations

import os
import re
from typing import Any

WINDOWS = os.name == "nt"
"""Whether files are named for Windows."""
_BAR = "%7C"
# Names of devices, with any suffix. Keys end in no "_" and hold no "%": what is added cannot be a key's own.
_RESERVED = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(_?)")


def file_name(key: str, *, windows: bool = WINDOWS) -> str:
    """Name the file of a key, without its suffix.

    Parameters
    ----------
    key : a legal key, or ``<song>|<method>``
    windows : whether the file is for Windows

    Returns
    -------
    str
        The key itself; for Windows ``|`` is ``%7C``, and a key that is the name of a device ends in ``_``.
    """
    if not windows:
        return key
    return key.replace("|", _BAR) + ("_" if _RESERVED.fullmatch(key) else "")


def key_of(name: str, *, windows: bool = WINDOWS) -> str:
    """Read the key from a file's name without its suffix: the inverse of :func:`file_name`.

    Parameters
    ----------
    name : str
    windows : whether the file is of Windows
    """
    if not windows:
        return name
    key = name.replace(_BAR, "|")
    return key[:-1] if key.endswith("_") and _RESERVED.fullmatch(key) else key


def name_anew(folder: Any, suffix: str, *, windows: bool = WINDOWS) -> int:  # noqa: ANN401 - pathlib or universal path
    """Rename the files of a folder that came from Windows to the names this system has for them.

    The other way round there is nothing to do: a name with ``|`` never reaches a disk of Windows.

    Parameters
    ----------
    folder : pathlib.Path or universal path; need not exist
    suffix : of the files looked at, with its dot
    windows : whether this system is Windows

    Returns
    -------
    int, how many files were renamed
        A file whose own name is taken already is left.
    """
    moved = 0
    for path in sorted(folder.iterdir()) if not windows and folder.is_dir() else []:
        stem = path.name.removesuffix(suffix)
        own = path.with_name(key_of(stem, windows=True) + suffix)
        if path.name.endswith(suffix) and own.name != path.name and not own.exists():
            path.rename(own)
            moved += 1
    return moved
