"""Which recorded motion is danced for each basic motion of a path: smooth seams, own pace, not always the same one.

The model says which basic motion is danced when; of each there are many recordings. One goes best with those before and
after it: best of all one that simply goes on in the same clip.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kernels.matching.match_sequence import viterbi
from kernels.types import Float, Int
from kernels.warp import EASY_WARP, WarpWeights

HARD_COST = 4.0
"""Added where the pace is beyond the easy bounds: as much as several rough seams. Chosen by hand; cheaper was tried on
three songs of real clips and left."""

PACE = WarpWeights(leaving=HARD_COST, easy=(EASY_WARP[0] - 1e-9, EASY_WARP[1] + 1e-9))
"""What leaving a motion's own pace costs: 1 at a tenth, and more beyond the easy bounds, which rounding may touch.
Chosen by hand."""

LONGEST_RUN = 16
"""Longer runs are all alike: a dance is not to be one long quotation where it need not be. Motions, chosen by hand."""

MOST_PRICED, MOST_EXCHANGES = 4, 4
"""A motion shown more often than that costs no more; steps are gone through so often. Chosen by hand."""

MOST_LISTED = 128
"""Motions of a step among which the second program chooses. Chosen for speed, by hand."""


@dataclass(frozen=True, eq=False)
class Motions:
    """Recorded motions that may be danced, sorted by clip, then start; (I,) each.

    Parameters
    ----------
    clip_index, state : int64
    start_s, end_s : float64, seconds of the clip
    """

    clip_index: Int
    state: Int
    start_s: Float
    end_s: Float

    @property
    def following(self) -> Int:
        """Motion that goes on where each ends, in the same clip; -1 for none."""
        if not len(self.state):
            return np.zeros(0, np.int64)
        goes_on = (self.clip_index[1:] == self.clip_index[:-1]) & (np.abs(self.start_s[1:] - self.end_s[:-1]) < 1e-6)
        return np.where(np.append(goes_on, False), np.arange(len(self.state)) + 1, -1)


def motions_of_clips(state: Sequence[Int], start_s: Sequence[Float], end_s: Sequence[Float]) -> Motions:
    """Put the motions of clips in one row.

    Parameters
    ----------
    state, start_s, end_s : (n,) int64 and float, of each of C >= 1 clips; seconds of the clip

    Returns
    -------
    Motions
    """
    of = np.repeat(np.arange(len(state)), [len(each) for each in state])
    return Motions(of, np.concatenate(state), np.concatenate(start_s), np.concatenate(end_s))


def shortlist(
    motions: Motions,
    fits: Sequence[Int],
    own: Sequence[Float],
    *,
    seam: Float,
    keep: Int | None = None,
    most: int = MOST_LISTED,
) -> list[Int]:
    """Shorten what each step of a path may be danced with: what can be danced on end, and what is cheapest by itself.

    Parameters
    ----------
    motions : Motions
    fits : S arrays of motions, each increasing, none empty
    own : S arrays, what each of them costs by itself
    seam : (I,) float, >= 0
        What seams at both ends of a motion cost by the motion itself (:func:`kernels.hmm.seams.own_cost`).
    keep : (S,) int64, or None, a motion of each step that stays on its list
    most : int, >= 2

    Returns
    -------
    S arrays of motions, each increasing

    Raises
    ------
    ValueError
        If a step has no motion.
    """
    for step, here in enumerate(fits):
        if not len(here):
            raise ValueError(f"step {step}: want at least one motion, got none")
    after = motions.following
    before = np.full(len(after), -1, np.int64)
    before[after[after >= 0]] = np.flatnonzero(after >= 0)
    ahead = _runs(fits[::-1], after, len(after))[::-1]
    behind = _runs(fits, before, len(after))
    found = []
    for step, here in enumerate(fits):
        cost = own[step] + seam[here]
        by_run = np.lexsort((here, cost, -(ahead[step] + behind[step])))
        by_cost = np.lexsort((here, cost))
        first = [] if keep is None else np.flatnonzero(here == keep[step]).tolist()
        picked = dict.fromkeys([*first, *by_run[: most // 2].tolist(), *by_cost[:most].tolist()])
        found.append(np.sort(here[list(picked)[:most]]))
    return found


def _runs(fits: Sequence[Int], after: Int, n: int) -> list[Int]:
    """How many steps each motion of a step can go on without a seam, in the order in which steps come in."""
    out: list[Int] = []
    run = np.zeros(n + 1, np.int64)
    for here in fits:
        now = np.zeros(n + 1, np.int64)
        now[here] = np.minimum(run[after[here]] + 1, LONGEST_RUN)  # -1 reads the spare last place, always 0
        run = now
        out.append(now[here])
    return out


def choose(
    candidates: Sequence[Int],
    own: Sequence[Float],
    between: Sequence[Float],
    *,
    repetition_weight: float = 1.0,
    rounds: int = 12,
) -> tuple[Int, Float, float]:
    """Choose one motion a step: the cheapest sequence, with what is shown again priced.

    Parameters
    ----------
    candidates : S arrays of motions, S >= 1
    own : S arrays, cost of each candidate, >= 0
    between : S - 1 arrays (N_i, N_i+1), cost of each seam
    repetition_weight : float, >= 0
        Cost of every showing of a motion after its first.
    rounds : int, >= 0

    Returns
    -------
    choice : (S,) int64, candidate of each step
    repetition_cost : (S,) float64
    total_cost : float

    Notes
    -----
    Repetition is no sum over neighbours, so it is priced in rounds: motions shown more than once become dearer, and
    the best sequence found, by its true cost, is kept; then single steps are exchanged while that gains.
    """
    n = int(max(c.max() for c in candidates)) + 1
    price = np.zeros(n)
    best = np.inf, np.zeros(0, np.int64), np.zeros(0)
    for _ in range(rounds + 1 if repetition_weight > 0 else 1):
        choice = viterbi([o + price[c] for o, c in zip(own, candidates, strict=True)], between)
        shown = np.array([c[i] for c, i in zip(candidates, choice, strict=True)], np.int64)
        again = repetition_weight * _times_before(shown)
        total = _total(choice, own, between) + float(again.sum())
        if total < best[0] - 1e-9:
            best = total, choice, again
        uses = np.bincount(shown, minlength=n)
        price = price + 0.25 * repetition_weight * np.maximum(uses - 1, 0)
    choice = _exchange(best[1], candidates, own, between, repetition_weight) if repetition_weight > 0 else best[1]
    shown = np.array([c[i] for c, i in zip(candidates, choice, strict=True)], np.int64)
    again = repetition_weight * _times_before(shown)
    return choice, again, _total(choice, own, between) + float(again.sum())


def _total(choice: Int, own: Sequence[Float], between: Sequence[Float]) -> float:
    return float(
        sum(o[i] for o, i in zip(own, choice, strict=True))
        + sum(b[i, j] for b, i, j in zip(between, choice[:-1], choice[1:], strict=True))
    )


def _exchange(
    choice: Int, candidates: Sequence[Int], own: Sequence[Float], between: Sequence[Float], weight: float
) -> Int:
    """Change single steps while that makes the whole cheaper."""
    choice = choice.copy()
    uses = np.zeros(int(max(c.max() for c in candidates)) + 1, np.int64)
    np.add.at(uses, [c[i] for c, i in zip(candidates, choice, strict=True)], 1)
    for _ in range(MOST_EXCHANGES):
        changed = False
        for step, here in enumerate(candidates):
            now = int(choice[step])
            uses[here[now]] -= 1
            price = own[step] + weight * np.minimum(uses[here], MOST_PRICED)
            price = price + (between[step - 1][choice[step - 1]] if step else 0.0)
            price = price + (between[step][:, choice[step + 1]] if step + 1 < len(candidates) else 0.0)
            to = int(np.argmin(price))
            if price[to] < price[now] - 1e-9:
                choice[step], changed = to, True
            uses[here[int(choice[step])]] += 1
        if not changed:
            break
    return choice


def _times_before(shown: Int) -> Float:
    """Count how often each motion was shown before, as far as it is priced."""
    seen: dict[int, int] = {}
    out = np.zeros(len(shown))
    for i, motion in enumerate(shown.tolist()):
        out[i] = min(seen.get(motion, 0), MOST_PRICED)
        seen[motion] = seen.get(motion, 0) + 1
    return out
