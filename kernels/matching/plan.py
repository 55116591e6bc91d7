"""Ways of searching, the memory each needs, and which ones are worth a trial."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from kernels.matching.blocks import parent, rows


@dataclass(frozen=True)
class Plan:
    """One way of searching; every way gives the same answer.

    Parameters
    ----------
    first : int
        Frames in a block of the first bound, over 8 starts together; 0: no bound, every candidate is scored.
    then : block lengths of the bounds that follow, start by start, falling
    is_sparse : bool
        Leave out silent blocks of each segment (worth it for impulses), or take segments together (for the rest).
    """

    first: int
    then: tuple[int, ...] = ()
    is_sparse: bool = False

    def __str__(self) -> str:
        steps = [f"{self.first} by 8" if self.first else "", *map(str, self.then), "all" if not self.first else "exact"]
        return " > ".join(step for step in steps if step) + (" sparse" if self.is_sparse else "")

    @property
    def kept(self) -> tuple[int, ...]:
        """Block lengths whose tables a search reads start by start; the first bound has a table of its own."""
        return (1,) if not self.first and self.is_sparse else self.then


BRUTE = Plan(0)
BRUTE_SPARSE = Plan(0, is_sparse=True)
PLANS = (
    Plan(50, (25, 5)),
    Plan(25, (10, 5)),
    Plan(25, (5,)),
    Plan(10, (5,)),
    Plan(10, (5,), is_sparse=True),
    Plan(5, (), is_sparse=True),
    Plan(1, (), is_sparse=True),
    BRUTE_SPARSE,
    BRUTE,
)


def built(plan: Plan) -> tuple[int, ...]:
    """Block lengths whose rows must be summed for a plan, smaller before larger."""
    wanted = {*plan.kept, plan.first} - {0}
    while True:
        more = wanted | {parent(g) for g in wanted} - {0}
        if more == wanted:
            return tuple(sorted(wanted))
        wanted = more


def bytes_a_frame(plan: Plan, numerators: Sequence[int]) -> int:
    """Device memory of a plan for one frame of a clip: the frame itself and one number a row.

    Parameters
    ----------
    plan : Plan
    numerators : the scales times 50

    Returns
    -------
    int
        4 (1 + rows of all tables that are kept).
    """
    tables = [*plan.kept, *([plan.first] if plan.first else [])]
    return 4 * (1 + sum(len(rows(g, numerators)) for g in tables))
