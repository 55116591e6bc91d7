"""Refusals of a dance: what is wrong, which pins conflict, and which would work."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


class RefusalError(ValueError):
    """A dance is refused; its text is the sentence for a person.

    Parameters
    ----------
    sentence : what is wrong and, where one is known, the remedy
    conflict : the fewest pins that cannot be kept together, as they were typed; None where no pin is to blame
    why : the sentence about the conflict alone, without the ways out; empty for none
    ways_out : what would work, as pins to type; None where no pin is to blame
    """

    def __init__(
        self,
        sentence: str,
        *,
        conflict: Sequence[str] | None = None,
        why: str = "",
        ways_out: Sequence[Any] | None = None,
    ) -> None:
        super().__init__(sentence)
        self.sentence = sentence
        self.conflict = None if conflict is None else list(conflict)
        self.why = why
        self.ways_out = None if ways_out is None else list(ways_out)

    @property
    def facts(self) -> Mapping[str, Any]:
        """Facts for machines: ``conflict``, ``why`` and ``ways_out``, each where it is known."""
        told: dict[str, Any] = {"conflict": self.conflict, "why": self.why or None, "ways_out": self.ways_out}
        return {name: value for name, value in told.items() if value is not None}
