"""What any method of choosing steps hands over."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from assets.dancing.avoided import AvoidedSpan
from kernels.types import Choreography, Float, Int


class Markdown(str):
    """Text that is shown as Markdown: a table, or a picture."""

    __slots__ = ()


@dataclass(frozen=True, eq=False)
class ChosenSteps:
    """Steps a method chose, their costs by column (0 for the columns of other methods), and what to show of them.

    ``metadata`` are numbers, texts, :class:`Markdown`, and lists and mappings of these; ``states`` are basic motions by
    step, where the method has them; ``avoided`` what was not to be shown.
    """

    steps: Choreography
    costs: Mapping[str, Float]
    metadata: Mapping[str, Any]
    pin_ids: Sequence[str | None] = ()
    states: Int | None = None
    avoided: tuple[AvoidedSpan, ...] = ()
