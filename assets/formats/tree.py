"""A folder of source files: listed in a stable order, hashed once per content."""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from assets.formats.beside import written_beside


@dataclass(frozen=True)
class File:
    """One file under a root.

    Parameters
    ----------
    path : str
        Relative to the root it was listed under, parts joined by ``/``.
    size : int, bytes
    modified_ns : int
        Time of last change, nanoseconds; never stored in data.
    """

    path: str
    size: int
    modified_ns: int

    @property
    def folders(self) -> tuple[str, ...]:
        """Names of the folders it lies in, below the root."""
        return tuple(self.path.split("/")[:-1])

    @property
    def name(self) -> str:
        """The file's own name."""
        return self.path.rsplit("/", 1)[-1]

    @property
    def stem(self) -> str:
        """The name without its last suffix."""
        return self.name.rsplit(".", 1)[0]

    @property
    def suffix(self) -> str:
        """The last suffix in lower case, with its dot; empty when there is none."""
        return "." + self.name.rsplit(".", 1)[1].lower() if "." in self.name else ""


LEFT_BY_WINDOWS = ("desktop.ini", "thumbs.db", "ehthumbs.db")
"""Files of Windows itself; those of macOS begin with a dot."""


def walk(root: Path, notes: list[str] | None = None) -> list[File]:
    """List the files under a folder, following links but no loop.

    Hidden names, what is no file, and what Windows leaves in folders that a person looked at are left out.

    Parameters
    ----------
    root : folder; a missing one lists nothing
    notes : takes a sentence for each folder that cannot be listed and each link that leads nowhere

    Returns
    -------
    list of File
        Sorted by path.
    """
    return sorted(_walk(root, root, "", frozenset(), [] if notes is None else notes), key=lambda f: f.path)


def _walk(root: Path, folder: Path, prefix: str, seen: frozenset[tuple[int, int]], notes: list[str]) -> Iterator[File]:
    try:
        here = folder.stat()
        entries = list(os.scandir(folder))
    except (FileNotFoundError, NotADirectoryError):
        return
    except OSError as error:
        notes.append(
            f"{root.name}/{prefix}: cannot be listed: {error.strerror or error}; see to the folder and its permissions"
        )
        return
    identity = (here.st_dev, here.st_ino)
    if identity in seen:
        return
    for entry in entries:
        if entry.name.startswith(".") or entry.name.lower() in LEFT_BY_WINDOWS:
            continue
        try:
            if entry.is_dir():
                yield from _walk(root, Path(entry.path), f"{prefix}{entry.name}/", seen | {identity}, notes)
            else:
                status = entry.stat()
                if stat.S_ISREG(status.st_mode):
                    yield File(f"{prefix}{entry.name}", status.st_size, status.st_mtime_ns)
        except OSError as error:
            if entry.is_symlink():
                what = f"is a link that leads nowhere: {error.strerror or error}"
                notes.append(f"{root.name}/{prefix}{entry.name}: {what}; mend or remove it")
            # else gone since it was listed


def sha256(path: Path) -> str:
    """Hash of a file's bytes, hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


class HashCache:
    """Hashes of files, remembered by size and time of change.

    A file whose time of change lies within two seconds of the look at it is hashed again next time: it may still be
    written to without its time moving.

    Parameters
    ----------
    store : Path
        JSON file that remembers; a missing or broken one is started anew.
    """

    _TRUST_AFTER_NS = 2_000_000_000

    def __init__(self, store: Path) -> None:
        self._store = store
        self._is_changed = False
        try:
            known = json.loads(store.read_bytes())
            self._known: dict[str, list[object]] = known if isinstance(known, dict) else {}
        except (OSError, ValueError):
            self._known = {}

    def sha256(self, root: Path, file: File, now_ns: int) -> str:
        """Hash a file's bytes, or remember them.

        Parameters
        ----------
        root : folder the file was listed under
        file : as it was listed
        now_ns : int
            Time of the look at it, nanoseconds.

        Returns
        -------
        str
            Hexadecimal, 64 characters.

        Raises
        ------
        OSError
            If it has to be read and cannot be.
        """
        entry = [file.size, file.modified_ns]
        known = self._known.get(f"{root.name}/{file.path}")
        if known is not None and known[:2] == entry and isinstance(known[2], str):
            return known[2]
        digest = sha256(root / file.path)
        if now_ns - file.modified_ns > self._TRUST_AFTER_NS:
            self._known[f"{root.name}/{file.path}"] = [*entry, digest]
            self._is_changed = True
        return digest

    def save(self) -> None:
        """Write what was learnt, beside and renamed; a read-only studio only loses the memory."""
        if not self._is_changed:
            return
        with suppress(OSError):
            with written_beside(self._store) as partial:
                partial.write_text(json.dumps(self._known, sort_keys=True), encoding="utf-8")
            self._is_changed = False
