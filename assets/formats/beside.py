"""Files written beside their place and renamed: there is the old one or the new one, never half of one."""

from __future__ import annotations

import os
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

MARK = ".tmp-"
"""How the name of a file begins that is not finished: hidden, and never what anybody else writes."""


# What Windows says, by definition, of a file that another program holds open: access denied, sharing violation, mapped.
_HELD = (5, 32, 1224)

_PATIENCE_S = 2.0
"""How long such a file is waited for. Chosen by hand."""


def is_held(error: OSError) -> bool:
    """Whether another program holds the file open, which only Windows minds.

    Parameters
    ----------
    error : as the system raised it
    """
    return getattr(error, "winerror", None) in _HELD


@contextmanager
def written_beside(path: Any, *, suffix: str = "") -> Iterator[Any]:  # noqa: ANN401 - pathlib or universal path
    """Give a place to write, synced to disk and renamed to ``path`` at the end, removed where that fails.

    Parameters
    ----------
    path : pathlib.Path or universal path; folders are made
    suffix : str
        Of the place to write, for writers that go by it.

    Yields
    ------
    path of the same kind, in the same folder

    Raises
    ------
    OSError
        As the disk says it; what stood at ``path`` before still stands.
    """
    partial = path.with_name(f"{MARK}{uuid.uuid4().hex}{suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield partial
        if isinstance(path, Path):
            with partial.open("r+b") as file:
                os.fsync(file.fileno())
        _put(partial, path)
    finally:
        # Where even the folder is none, there is nothing to remove.
        with suppress(OSError):
            partial.unlink()


def _put(partial: Any, path: Any) -> None:  # noqa: ANN401 - pathlib or universal path
    """Rename a file over another; one that a reader holds open for a moment is waited for."""
    deadline_s = time.monotonic() + _PATIENCE_S
    while True:
        try:
            partial.replace(path) if isinstance(path, Path) else partial.rename(path)
            return
        except OSError as error:
            if not is_held(error) or time.monotonic() > deadline_s:
                raise
        time.sleep(0.05)


def sweep(folder: Any) -> int:  # noqa: ANN401 - pathlib or universal path
    """Delete what killed writers left in a folder and in the folders it holds.

    Parameters
    ----------
    folder : pathlib.Path or universal path; need not exist

    Returns
    -------
    int, how many files that were
    """
    found = [p for pattern in ("*", "*/*") for p in folder.glob(pattern)] if folder.is_dir() else []
    left = [p for p in found if p.name.startswith(MARK)]
    for path in left:
        path.unlink(missing_ok=True)
    return len(left)
