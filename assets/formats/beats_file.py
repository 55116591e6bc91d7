"""Beats written by hand or by another program: one beat a line.

Conventions
-----------
``seconds [beat in bar]``, separated by blanks, a tab or a comma; ``#`` starts a comment. Seconds count from the first
decoded sample of the song. The second column counts from 1, the downbeat.
"""

import math
from pathlib import Path

import numpy as np

from assets.formats.errors import FormatError
from kernels.types import BeatGrid

LARGEST_BYTES = 16 * 2**20
"""Chosen by hand, far beyond any song's beats."""


def read(path: Path) -> BeatGrid:
    """Read a beats file.

    Parameters
    ----------
    path : UTF-8 text, at most 16 MiB

    Returns
    -------
    BeatGrid

    Raises
    ------
    FormatError
        If the file cannot be read as text, or see :func:`parse`.
    """
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise FormatError(str(path), 0, f"want at most {LARGEST_BYTES >> 20} MiB, got {path.stat().st_size} bytes")
        text = path.read_text("utf-8-sig")
    except OSError as error:
        raise FormatError(str(path), 0, f"want a readable file, got: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise FormatError(str(path), 0, f"want UTF-8 text, got byte {error.object[error.start]:#x}") from error
    return parse(text, name=str(path))


def parse(text: str, *, name: str = "beats") -> BeatGrid:
    """Read the text of a beats file.

    Parameters
    ----------
    text : str
        Blank lines and comments may stand anywhere; line ends of any system.
    name : str
        As the user knows the file, for messages.

    Returns
    -------
    BeatGrid
        Confidence 1. Bars are counted from 1 where the second column is there, a pick-up before the first downbeat
        being bar 1; without the column bars are 0, unknown.

    Raises
    ------
    FormatError
        With its line: a line that is not one or two numbers, a time that is negative, not finite or not after the one
        before, a beat in bar that neither follows the one before nor is 1, or a second column on some lines only.
        Without a line: fewer than two beats.
    """
    times: list[float] = []
    numbers: list[int] = []
    bars: list[int] = []
    for line, raw in enumerate(text.splitlines(), start=1):
        fields = raw.partition("#")[0].replace(",", " ").split()
        if not fields:
            continue
        if len(fields) > 2:
            raise FormatError(name, line, f"want 'seconds' or 'seconds beat-in-bar', got {len(fields)} columns")
        time_s = _number(fields[0], name, line, "seconds")
        if not (math.isfinite(time_s) and time_s >= 0):
            raise FormatError(name, line, f"want seconds >= 0, got {fields[0]}")
        if times and time_s <= times[-1]:
            raise FormatError(name, line, f"want a time after {times[-1]:g} s, got {fields[0]}; sort the beats")
        if times and (len(fields) == 2) != (numbers[-1] > 0):
            raise FormatError(name, line, "want the beat in bar on every line or on none; complete the second column")
        number = 0
        if len(fields) == 2:
            value = _number(fields[1], name, line, "a beat in bar")
            number = int(value) if math.isfinite(value) else 0
            if number != value or number < 1:
                raise FormatError(name, line, f"want a whole beat in bar from 1, got {fields[1]}")
            if numbers and number not in (1, numbers[-1] + 1):
                raise FormatError(name, line, f"want beat {numbers[-1] + 1} or 1 of a bar, got {number}")
        bars.append(0 if number == 0 else (bars[-1] + (number == 1) if bars else 1))
        times.append(time_s)
        numbers.append(number)
    if len(times) < 2:
        raise FormatError(name, 0, f"want at least two beats, got {len(times)}")
    return BeatGrid(
        time_s=np.array(times),
        bar_number=np.array(bars, np.int64),
        beat_in_bar_number=np.array(numbers, np.int64),
        confidence=np.ones(len(times)),
    )


def format(grid: BeatGrid) -> str:
    """Write beats as :func:`parse` reads them, to a tenth of a millisecond.

    Parameters
    ----------
    grid : BeatGrid

    Returns
    -------
    str
        The second column is left out unless every beat has a place in its bar. Empty without beats.
    """
    has_bars = bool((grid.beat_in_bar_number > 0).all())
    return "".join(
        f"{time_s:.4f}\t{number}\n" if has_bars else f"{time_s:.4f}\n"
        for time_s, number in zip(grid.time_s, grid.beat_in_bar_number, strict=True)
    )


def _number(text: str, name: str, line: int, what: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise FormatError(name, line, f"want {what}, got {text!r}") from None
