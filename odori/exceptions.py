"""What odori refuses, as exceptions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any


class OdoriError(Exception):
    """Something that cannot be done as it was asked for; its text is one sentence for a person.

    Parameters
    ----------
    reason : str
        What was wanted, what came, and what would help.
    conflict : list of str
        The fewest pins that cannot be kept together, as they were typed; empty where no pin is to blame.
    ways_out : list
        What would work instead, as ``odori dance --json`` gives it; empty where none is known.

    Examples
    --------
    >>> import odori
    >>> try:
    ...     odori.open("no-such-folder")
    ... except odori.OdoriError as error:
    ...     print(error.reason.split(":")[0])
    no-such-folder

    See Also
    --------
    DanceRefusedError : with the pins that conflict
    """

    def __init__(self, reason: str, *, conflict: Sequence[str] = (), ways_out: Sequence[Any] = ()) -> None:
        super().__init__(reason)
        self.reason = reason
        self.conflict = list(conflict)
        self.ways_out = list(ways_out)


class InputError(OdoriError, ValueError):
    """An argument that cannot be meant: a wrong shape, NaN, milliseconds for seconds."""


class DanceRefusedError(OdoriError):
    """A dance that cannot be had as it was asked for; ``conflict`` and ``ways_out`` say which pins are to blame."""


@contextmanager
def refused() -> Iterator[None]:
    """Turn what the engine refuses into an :class:`OdoriError`.

    Raises
    ------
    OdoriError
        For whatever a person can mend: a folder, a file, a value, a full disk.
    """
    from assets.dancing.refusal import RefusalError
    from assets.formats.errors import FormatError
    from assets.sources.calibration import CalibrationError
    from pipelines.studio.files import LakeError, StudioError

    try:
        yield
    except OdoriError:
        raise
    except RefusalError as error:
        raise DanceRefusedError(error.sentence, conflict=error.conflict or (), ways_out=error.ways_out or ()) from error
    except (StudioError, LakeError, FormatError, CalibrationError, OSError) as error:
        raise OdoriError(str(error)) from error
    except LookupError as error:
        raise OdoriError(str(error.args[0]) if error.args else str(error)) from error
    except ValueError as error:
        raise InputError(str(error)) from error
