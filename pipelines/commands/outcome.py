"""What a command came to."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

DONE, SOME_REFUSED, NOTHING_DONE = 0, 1, 2
"""Exit statuses, by convention: 0 is well."""


@dataclass(frozen=True)
class Outcome:
    """What a command came to.

    Parameters
    ----------
    status : exit status
    facts : what ``--json`` prints
    report : what a person reads on standard output
    troubles : refused inputs and failures, one line each, for standard error
    """

    status: int
    facts: dict[str, Any]
    report: str = ""
    troubles: Sequence[str] = field(default_factory=tuple)
