"""The numbers of a BVH file: fast where they are right, exact about the line where they are not."""

from __future__ import annotations

import re

import numpy as np
import pyarrow as pa

from assets.formats.errors import FormatError
from kernels.types import Float

_SPACE = b" \t\n\r\x0b\x0c"


def parse_values(block: bytes, n_frames: int, n_channels: int, *, path: str, first_line: int) -> Float:
    """Read the numbers after the frame time.

    Parameters
    ----------
    block : the file from there to its end, line ends as line feeds
    n_frames, n_channels : int, what the header promises
    path : for messages
    first_line : line of the file on which the block starts

    Returns
    -------
    (n_frames, n_channels) float64
        Each equal to Python's ``float`` of its text, bit for bit.

    Raises
    ------
    FormatError
        Where a word is no number or not finite, or where there are fewer or more values than promised: with the line,
        what was wanted and what came.

    Notes
    -----
    The text is squeezed free of white space, the places where words end become the offsets of an Arrow string array,
    and Arrow parses that with a correctly rounding algorithm [Lemire2021]. Anything Arrow does not take is read again
    word by word, which is slow and knows the line.
    """
    values, n_by_line = _parse_fast(block)
    if values is None:
        values = _parse_slow(block, path, first_line)
    if values.size != n_frames * n_channels or (
        np.count_nonzero(n_by_line) == n_frames and not (n_by_line[n_by_line > 0] == n_channels).all()
    ):
        raise _miscount(n_by_line, n_frames, n_channels, path, first_line)
    if not np.isfinite(values).all():
        _parse_slow(block, path, first_line)
    return values.reshape(n_frames, n_channels)


def _parse_fast(block: bytes) -> tuple[Float | None, np.ndarray[tuple[int], np.dtype[np.int64]]]:
    """Values, or None where Arrow finds a word that is no number; and how many words stand on each line."""
    letters = np.frombuffer(block, np.uint8)
    space = np.flatnonzero(letters <= 32)
    # Without its white space, the text before the k-th white byte is that byte's place less k.
    end = np.zeros(len(space) + 2, np.int32)
    end[1:-1] = space - np.arange(len(space))
    end[-1] = len(letters) - len(space)
    is_new = np.append(True, end[1:] != end[:-1])
    line_end = np.append(np.flatnonzero(letters == 10), len(letters))
    words_before = np.append(np.cumsum(is_new[1:-1]), np.count_nonzero(is_new) - 1)
    at = np.searchsorted(space, line_end)
    n_by_line = np.diff(words_before[at], prepend=0)
    end = end[is_new]
    squeezed = block.translate(None, _SPACE)
    if len(squeezed) != len(letters) - len(space):
        return None, n_by_line
    words = pa.StringArray.from_buffers(len(end) - 1, pa.py_buffer(end), pa.py_buffer(squeezed))
    try:
        return words.cast(pa.float64()).to_numpy(zero_copy_only=False), n_by_line
    except pa.ArrowInvalid:
        return None, n_by_line


def _parse_slow(block: bytes, path: str, first_line: int) -> Float:
    values: list[float] = []
    for number, line in enumerate(block.split(b"\n"), first_line):
        for word in line.split():
            try:
                value = float(word)
            except ValueError:
                value = None
            shown = repr(word[:40].decode("latin-1"))
            if value is None or b"_" in word:
                hint = "; write decimals with a point" if re.fullmatch(rb"-?\d+,\d+", word) else ""
                raise FormatError(path, number, f"want a number, got {shown}{hint}")
            if not np.isfinite(value):
                raise FormatError(path, number, f"want finite numbers, got {shown}; fill the gap or cut it out")
            values.append(value)
    return np.array(values, np.float64)


def _miscount(
    n_by_line: np.ndarray[tuple[int], np.dtype[np.int64]], n_frames: int, n_channels: int, path: str, first_line: int
) -> FormatError:
    got, wanted = int(n_by_line.sum()), n_frames * n_channels
    filled = np.flatnonzero(n_by_line)
    lines = filled + first_line
    odd = np.flatnonzero(n_by_line[filled] != n_channels)
    promise = f"{n_frames} frames of {n_channels} values"
    if got == 0:
        return FormatError(path, first_line, f"want {promise}, got none; the file is cut short")
    if got > wanted and len(odd) == 0:
        return FormatError(
            path, int(lines[n_frames]), f"want {promise}, got {len(lines)} frames; mend the number after Frames"
        )
    if len(odd) and (len(odd) < len(filled) or n_frames == len(filled)) and odd[0] < len(filled) - 1:
        line = int(lines[odd[0]])
        return FormatError(path, line, f"want {n_channels} values in a frame, got {n_by_line[filled][odd[0]]}")
    whole, left = divmod(got, n_channels)
    what = "the file is cut short" if got < wanted else "more values than the header promises"
    came = f"{whole} frames" + (f" and {left} values" if left else "")
    return FormatError(path, int(lines[-1]), f"want {promise}, got {came}; {what}")
