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
    pairs : (block length, starts) or None
        The bound of all pairs of segment and clip: frames in a block, and how many neighbouring starts are bounded
        together (1, 2, 4 or 8). None: no bound, every candidate is scored.
    groups : (block length, starts) or None
        The bound of all groups of starts of the pairs that are left; None only without `pairs`.
    then : block lengths, at most two, falling
        Bounds of the single starts of the groups that are left, before they are scored.
    is_sparse : bool
        Leave out silent blocks of each segment (worth it for impulses), or take segments together (for the rest).
    """

    pairs: tuple[int, int] | None = None
    groups: tuple[int, int] | None = None
    then: tuple[int, ...] = ()
    is_sparse: bool = False

    def __post_init__(self) -> None:
        """Refuse what the kernels cannot do."""
        if (self.pairs is None) != (self.groups is None) or (self.then and self.groups is None) or len(self.then) > 2:
            raise ValueError(f"plan: want both first bounds or none, and at most two more with them, got {self}")
        if any(starts not in (1, 2, 4, 8) for _, starts in self.folded):
            raise ValueError(f"plan: want 1, 2, 4 or 8 starts bounded together, got {self}")

    def __str__(self) -> str:
        kind = "sparse " if self.is_sparse else ""
        if self.pairs is None:
            return f"{kind}all"
        folded = [f"{g}x{starts}" for g, starts in self.folded]
        return kind + ">".join([*folded, *map(str, self.then), "1"])

    @property
    def folded(self) -> tuple[tuple[int, int], ...]:
        """Tables of the largest sums of neighbouring starts that a search reads."""
        return tuple(dict.fromkeys(entry for entry in (self.pairs, self.groups) if entry))

    @property
    def dense(self) -> tuple[int, ...]:
        """Block lengths whose tables a search reads start by start."""
        return (1,) if self.pairs is None and self.is_sparse else self.then


BRUTE = Plan()
BRUTE_SPARSE = Plan(is_sparse=True)
PLANS = (
    Plan((25, 8), (10, 8), (10, 5)),
    Plan((25, 8), (10, 4), (5,)),
    Plan((25, 8), (5, 2), (5,)),
    Plan((10, 8), (5, 4), is_sparse=True),
    Plan((1, 8), (1, 4), is_sparse=True),
    BRUTE_SPARSE,
    BRUTE,
)
"""Plans that are tried, by blocks in frames and starts bounded together. Tuned on energy, rough and impulse data of the
benchmark (decision 0013)."""


def built(plan: Plan) -> tuple[int, ...]:
    """Block lengths whose rows must be summed for a plan, smaller before larger.

    Parameters
    ----------
    plan : Plan

    Returns
    -------
    tuple of int, rising; empty where no table is read
    """
    wanted = {*plan.dense, *(g for g, _ in plan.folded)}
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
    tables = [*plan.dense, *(g for g, _ in plan.folded)]
    return 4 * (1 + sum(len(rows(g, numerators)) for g in tables))
