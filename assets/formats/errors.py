"""What a reader says of a file it refuses."""

from __future__ import annotations


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
