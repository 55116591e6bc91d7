"""Folders for what libraries compile and remember, on machines where the usual one cannot be written.

PoCL offers no device, Numba refuses to compile and Matplotlib complains where the user's cache folder is not there and
cannot be made. Then all of them get a folder for temporary files.
"""

import os
import sys
import tempfile
from collections.abc import Iterable, MutableMapping
from contextlib import suppress
from pathlib import Path

FOLDERS = {
    "XDG_CACHE_HOME": "",
    "POCL_CACHE_DIR": "pocl",
    "NUMBA_CACHE_DIR": "numba",
    "MPLCONFIGDIR": "matplotlib",
}
"""What libraries read, and the folder of each inside ours."""


def settle(environment: MutableMapping[str, str] = os.environ) -> Path | None:
    """Find a cache folder that can be written, and point libraries at it where it is not the usual one.

    Parameters
    ----------
    environment : read, and changed where the usual folder cannot be written; what a person set there stays

    Returns
    -------
    Path or None
        The folder, which may not be there yet; None where nothing can be written, not even temporary files.
    """
    usual = usual_folder(environment)
    if usual is not None and is_writable(usual):
        return usual
    spare = _spare_folder()
    if spare is None:
        return None
    for name, folder in FOLDERS.items():
        if name == "XDG_CACHE_HOME" or name not in environment:
            environment[name] = str(spare / folder)
    return spare


def usual_folder(environment: MutableMapping[str, str], *, system: str = sys.platform) -> Path | None:
    """Name the cache folder of the user, as the system has it; None where there is no home.

    Parameters
    ----------
    environment : variables
    system : as ``sys.platform`` says it
    """
    if system == "win32":
        return Path(environment["LOCALAPPDATA"]) if environment.get("LOCALAPPDATA") else None
    if environment.get("XDG_CACHE_HOME"):
        return Path(environment["XDG_CACHE_HOME"])
    if environment.get("HOME"):
        home = Path(environment["HOME"])
    else:
        try:
            home = Path.home()
        except RuntimeError:  # no such user
            return None
    return home / ("Library/Caches" if system == "darwin" else ".cache")


def is_writable(folder: Path) -> bool:
    """Whether a folder, made where it is not there, takes files.

    Parameters
    ----------
    folder : Path
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"odori")
            file.flush()
    except OSError:
        return False
    return True


def _spare_folder() -> Path | None:
    """Find or make a folder of this user's own for temporary files."""
    owner = os.getuid() if hasattr(os, "getuid") else 0
    for parent in _temporary_folders():
        folder = parent / f"odori-cache-{owner}"
        with suppress(OSError):
            folder.mkdir(mode=0o700, exist_ok=True)
            # Never one that somebody else made, and could fill with code of theirs.
            if not folder.is_symlink() and _is_own(folder, owner) and is_writable(folder):
                return folder
    return None


def _temporary_folders() -> Iterable[Path]:
    with suppress(OSError):  # no folder for temporary files at all
        yield Path(tempfile.gettempdir())
    if sys.platform != "win32":
        yield from map(Path, ("/tmp", "/var/tmp", "/dev/shm"))  # checked to be our own


def _is_own(folder: Path, owner: int) -> bool:
    held = folder.stat()
    return sys.platform == "win32" or (held.st_uid == owner and not held.st_mode & 0o022)
