"""Files written whole or not at all, and what it means when a disk refuses."""

import errno
from collections.abc import Callable, Mapping
from typing import IO, Any

from assets.formats import beside


class LakeError(Exception):
    """The lake cannot be read or written; the message says which file, why, and what to do."""


class StudioError(Exception):
    """The studio folder cannot be used; the message says which, why, and what to do."""


_WHY: Mapping[int, str] = {
    errno.ENOSPC: "the disk is full; free some space and run it again",
    errno.EDQUOT: "the disk quota is used up; free some space and run it again",
    errno.EFBIG: "the disk does not take a file this large; free some space and run it again",
    errno.EROFS: "the disk is read-only; name a studio that can be written to",
    errno.EACCES: "writing is not allowed there; mend the folder's permissions",
    errno.EPERM: "writing is not allowed there; mend the folder's permissions",
}


def why(error: OSError) -> str:
    """Say what a refused write means and what to do about it."""
    if beside.is_held(error):
        return "another program has it open, or writing is not allowed there; close it or mend the folder's permissions"
    return _WHY.get(error.errno or 0, f"{error.strerror or error}; see to the disk and run it again")


def write_beside(path: Any, write: Callable[[IO[bytes]], object]) -> None:  # noqa: ANN401 - pathlib or universal path
    """Write a file beside its place and rename it, so that there is never half of one.

    Raises
    ------
    LakeError
        If the disk refuses; the old file, if any, stays.
    """
    try:
        with beside.written_beside(path) as partial, partial.open("wb") as file:
            write(file)
    except OSError as error:
        raise LakeError(f"{path}: cannot be written: {why(error)}") from error
