"""What a reader says of a file it refuses."""

from __future__ import annotations

from pathlib import Path


class FormatError(ValueError):
    """A file that cannot be read as its format.

    Parameters
    ----------
    path : str
        As the user knows the file.
    line : int
        From 1; 0 where lines mean nothing.
    what : str
        One sentence: what was wanted, what came, and the remedy where there is one.
    """

    def __init__(self, path: str, line: int, what: str) -> None:
        self.path, self.line, self.what = path, line, what
        super().__init__(f"{path}:{line}: {what}" if line else f"{path}: {what}")


def check_size(path: Path, *, max_bytes: int) -> int:
    """Refuse a recording that is too large before it is read.

    Parameters
    ----------
    path : file
    max_bytes : int

    Returns
    -------
    int, bytes of the file

    Raises
    ------
    FormatError
        If it is larger.
    OSError
        If it cannot be found.
    """
    size = path.stat().st_size
    if size > max_bytes:
        wanted = f"want at most {max_bytes / 1e6:.0f} MB, got {size / 1e6:.0f} MB"
        raise FormatError(str(path), 0, f"{wanted}; cut the recording into takes")
    return size
