"""The nearest windows of a catalogue, exactly, and clips ranked by them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kernels.search.aligned import COPY_M, Alignment
from kernels.types import Float, Int

MOST_QUERY_WINDOWS = 16
"""Chosen for time, by hand."""

UNLIKE_WEIGHT = 0.5
"""How far a query moves away from what it is to be unlike, where 1 is all the way. Chosen by hand; [Rocchio1971] weighs
less what was not liked, too."""

_SPARE = 4
"""Rows looked at, as a multiple of the clips wanted: a clip may have several. Chosen by hand."""

_MOST_ALIGNED = 400
_CANDIDATES = 64
"""Clips that may be copies, and rows an approximate index names for them. Chosen for time, by hand."""

Vectors = NDArray[np.float32]
Candidates = Callable[[Vectors, int], Int]
"""Finds rows that may be near: of (Q, D) queries and a number for each, rows of the catalogue in order."""
Copies = Callable[[Int], Sequence[Alignment]]
"""Lays the query over clips, nearest first; of the first of them come back alignments, of as many as it can afford."""


@dataclass(frozen=True)
class Hit:
    """A clip found.

    Parameters
    ----------
    clip : index of the clip
    row : row of its window that is nearest to the query
    query_row : window of the query it is nearest to
    distance : mean over the query's windows of the distance to the clip's nearest window, 0 to 2
        Of a copy multiplied by how far the joints are off, as a share of :data:`~kernels.search.aligned.COPY_M`.
    copied : where the query lies in the clip, if the clip holds a copy of it
    """

    clip: int
    row: int
    query_row: int
    distance: float
    copied: Alignment | None = None


def distances(vector: Vectors, query: Vectors) -> NDArray[np.float32]:
    """Euclidean distances between unit vectors, to about 3e-4 near zero.

    Parameters
    ----------
    vector : (N, D) float32, unit rows; may be mapped from disk
    query : (Q, D) float32, unit rows

    Returns
    -------
    (Q, N) float32, 0 to 2
    """
    likeness = np.stack([vector @ q for q in query]) if len(query) else np.zeros((0, len(vector)), np.float32)
    return np.sqrt(np.maximum(2.0 - 2.0 * likeness, 0.0))


def nearest_clips(
    vector: Vectors,
    start: Int,
    query: Vectors,
    *,
    k: int,
    is_allowed: NDArray[np.bool_] | None = None,
    candidates: Candidates | None = None,
    copies: Copies | None = None,
) -> list[Hit]:
    """Rank clips by how near their windows are to those of a query.

    Parameters
    ----------
    vector : (N, D) float32, unit rows, the windows of a clip together; may be mapped from disk
    start : (C,) int, first row of each clip
    query : (Q, D) float32, unit rows, Q >= 1
        Of more than :data:`MOST_QUERY_WINDOWS`, that many evenly spread ones count.
    k : int, hits wanted
    is_allowed : (N,) bool, or None for all
        Windows that may be found.
    candidates : function, or None
        Names rows worth comparing; without it every row is compared.
    copies : function, or None
        Tells copies of the query from other takes of its action among the nearest clips, and puts them first.

    Returns
    -------
    list of Hit
        Nearest first, at most one a clip and at most k; ties by the clip's place. Empty where nothing is allowed.
    """
    if not len(vector) or not len(query) or k < 1:
        return []
    at = np.unique(np.linspace(0, len(query) - 1, min(len(query), MOST_QUERY_WINDOWS)).round().astype(int))
    query = query[at]
    end = np.append(start[1:], len(vector))
    if candidates is not None:
        rows = candidates(query, max(_SPARE * k, _CANDIDATES if copies else 0))
        clips = np.unique(np.searchsorted(start, rows, side="right") - 1)
        taken = np.concatenate([np.arange(start[c], end[c]) for c in clips]) if len(clips) else np.zeros(0, np.int64)
        if not len(taken):
            return []
        inner = np.append(0, np.cumsum((end - start)[clips]))[:-1]
        allowed = None if is_allowed is None else is_allowed[taken]
        inside = None if copies is None else lambda near: copies(clips[near])
        found = nearest_clips(np.asarray(vector[taken]), inner, query, k=k, is_allowed=allowed, copies=inside)
        return [
            replace(h, clip=int(clips[h.clip]), row=int(taken[h.row]), query_row=int(at[h.query_row])) for h in found
        ]
    distance = distances(vector, query)
    if is_allowed is not None:
        distance[:, ~is_allowed] = np.inf
    score = np.minimum.reduceat(distance, start, axis=1).mean(axis=0)
    best = _least(score, max(_SPARE * k, _MOST_ALIGNED if copies else 0))
    laid = dict(zip(best.tolist(), copies(best) if copies and len(best) else (), strict=False))
    share = {c: min(alignment.distance_m / COPY_M, 1.0) for c, alignment in laid.items()}
    found = []
    for i in np.argsort(score[best] * [share.get(c, 1.0) for c in best.tolist()], kind="stable")[: _SPARE * k].tolist():
        c = int(best[i])
        hit = _hit(vector, query, c, start[c], end[c], distance, at)
        is_copy = share.get(c, 1.0) < 1
        found.append(replace(hit, distance=hit.distance * share[c], copied=laid[c]) if is_copy else hit)
    return sorted(found, key=lambda h: (h.distance, h.clip))[:k]


def _least(score: NDArray[np.floating], n: int) -> Int:
    """Find the n least finite scores and their equals, in order."""
    n = min(n, len(score))
    near = np.flatnonzero((score <= np.partition(score, n - 1)[n - 1]) & np.isfinite(score))
    return near[np.argsort(score[near], kind="stable")][:n]


def _hit(vector: Vectors, query: Vectors, clip: int, a: int, b: int, coarse: Vectors, at: Int) -> Hit:
    """Measure one clip anew, in float64 and by differences: what is equal is at distance 0."""
    exact = np.linalg.norm(query[:, None].astype(np.float64) - vector[None, a:b].astype(np.float64), axis=-1)
    exact[~np.isfinite(coarse[:, a:b])] = np.inf
    q, row = np.unravel_index(int(exact.argmin()), exact.shape)
    return Hit(clip, a + int(row), int(at[q]), float(exact.min(axis=1).mean()))


def steer(query: Vectors, like: Vectors, unlike: Vectors) -> Vectors:
    """Move a query towards motions that are liked and away from those that are not.

    Relevance feedback as Rocchio has it [Rocchio1971].

    Parameters
    ----------
    query : (Q, D) float32, unit rows; Q = 0 where there are only wishes
    like, unlike : (A, D) and (B, D) float32, one row a wish

    Returns
    -------
    (Q', D) float32, unit rows; Q' = 1 where Q was 0
    """
    rows = query.astype(np.float64) if len(query) else like.astype(np.float64).mean(axis=0, keepdims=True)
    if len(query) and len(like):
        rows = rows + like.mean(axis=0)
    if len(unlike):
        rows = rows - UNLIKE_WEIGHT * unlike.mean(axis=0)
    size = np.linalg.norm(rows, axis=1, keepdims=True)
    return np.asarray(rows / np.where(size > 0, size, 1.0), np.float32)


@dataclass(frozen=True)
class Proposal:
    """A label proposed for a clip.

    Parameters
    ----------
    label : index of the label
    vote_ratio : its share of the votes
    nearest : index of the nearest labelled clip of that label
    distance : its distance
    """

    label: int
    vote_ratio: float
    nearest: int
    distance: float


def propose(distance: Float, label: Int, *, n_neighbours: int = 5, n_proposals: int = 3) -> list[list[Proposal]]:
    """Let the nearest labelled clips vote for a label.

    Parameters
    ----------
    distance : (Q, N) float, to labelled clips
    label : (N,) int, their labels
    n_neighbours, n_proposals : how many vote, and how many labels come back at most

    Returns
    -------
    list of Q lists of Proposal
        Most votes first; a vote weighs exp(-(d / d_nearest)^2). Empty where N is 0.
    """
    found = []
    for row in distance:
        near = np.argsort(row, kind="stable")[:n_neighbours]
        weight = np.exp(-((row[near] / max(float(row[near[0]]), 1e-9)) ** 2)) if len(near) else np.zeros(0)
        votes: dict[int, tuple[float, int]] = {}
        for n, w in zip(near.tolist(), weight.tolist(), strict=True):
            have, first = votes.get(int(label[n]), (0.0, n))
            votes[int(label[n])] = (have + w, first)
        total = float(weight.sum())
        ranked = sorted(votes.items(), key=lambda item: (-item[1][0], item[0]))[:n_proposals]
        found.append([Proposal(name, w / total, n, float(row[n])) for name, (w, n) in ranked])
    return found
