"""From bounds to the few pairs that may be among the k best clips of their segments."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from kernels.opencl.match_stages import Emitted, Stages

_PROBED = 64
"""Clips of which a group is scored for a first score to beat. Chosen by hand; changes no answer."""

_FEW = 0.5
"""Share of pairs that are refined in one turn, once there is a score to beat. Tuned on rough noise: with more turns
where bounds tell little a query took 4.9 in place of 5.7 CPU-seconds."""

_MOST = 2**20
"""Candidates written at a time. Chosen for memory, by hand; changes no answer."""


def finalists(stages: Stages, *, k: int, floor: NDArray[np.float32]) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Find every pair of segment and clip that may be among the k best of its segment.

    Parameters
    ----------
    stages : Stages
    k : int, >= 1
    floor : (S,) float32
        Scores known to be reached by k clips elsewhere, in the unit of the stages; -1 for none.

    Returns
    -------
    pairs : (N, 2) int32, segment and clip; by clip
    score : (N,) float32
        The best score of each pair, as the device found it.
    """
    value, place = stages.largest()
    slack = stages.margin[:, None]
    known = value if stages.is_exact else _refined(stages, value, place, k=k, floor=floor)
    least = np.maximum(_kth(known, k), floor)
    pairs = _pairs((known >= 0) & (known + slack >= least[:, None]))
    return pairs, known[pairs[:, 0], pairs[:, 1]]


def candidates(
    stages: Stages, pairs: NDArray[np.int32], score: NDArray[np.float32]
) -> Iterator[tuple[NDArray[np.int32], Emitted]]:
    """List the candidates that may be the best of each pair, some pairs at a time so that ties need no more memory.

    Parameters
    ----------
    stages : Stages
    pairs : (N, 2) int32, segment and clip
    score : (N,) float32
        Candidates whose score, with the margin, reaches this are listed.

    Yields
    ------
    pairs : (M, 2) int32
        Each pair lies in one portion; no pairs make one portion of none.
    Emitted
        Its ``pair`` counts within the portion.
    """
    waiting = [(pairs, score)]
    while waiting:
        some, least = waiting.pop()
        emitted = stages.emit(some, least, most=min(4 * len(some) + 1024, _MOST))
        if emitted is None:
            half = len(some) // 2
            waiting += [(some[half:], least[half:]), (some[:half], least[:half])]
        else:
            yield some, emitted


def _refined(
    stages: Stages,
    bound: NDArray[np.float32],
    place: NDArray[np.int32],
    *,
    k: int,
    floor: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Best scores of all pairs that may matter, -1 for the others."""
    n_clips = bound.shape[1]
    slack = stages.margin[:, None]
    known = np.full(bound.shape, -1, np.float32)
    # one group of each of the most promising clips gives a first score to beat
    probed = _pairs(_highest(bound, _PROBED))
    segment, clip = probed.T
    known[segment, clip] = stages.probe(probed, place[segment, clip])
    done = np.zeros(bound.shape, bool)
    n_first = k + 4
    while not done.all():
        least = np.maximum(_kth(known, k), floor)
        wanted = ~done & (bound >= 0) & (bound + slack >= least[:, None])
        # where bounds tell little, a better score to beat is worth one more turn
        is_last = n_first >= n_clips or (done.any() and wanted.sum() < _FEW * bound.size)
        chosen = wanted if is_last else wanted & _highest(bound, n_first)
        pairs = _pairs(chosen)
        segment, clip = pairs.T
        found = stages.best(pairs, np.maximum(least[segment], known[segment, clip]))
        known[segment, clip] = np.maximum(known[segment, clip], found)
        done |= chosen
        n_first *= 4
        if is_last:
            break
    return known


def _kth(known: NDArray[np.float32], k: int) -> NDArray[np.float32]:
    """Find the k-th largest of each row; -1 where there are fewer."""
    n = known.shape[1]
    return np.partition(known, n - k, axis=1)[:, n - k] if k <= n else np.full(len(known), -1, np.float32)


def _highest(bound: NDArray[np.float32], n: int) -> NDArray[np.bool_]:
    """Mark the n clips of highest bound of each segment, those without a candidate never."""
    marked = np.zeros(bound.shape, bool)
    if n >= bound.shape[1]:
        marked[:] = True
    else:
        np.put_along_axis(marked, np.argpartition(bound, -n, axis=1)[:, -n:], True, axis=1)
    return marked & (bound >= 0)


def _pairs(marked: NDArray[np.bool_]) -> NDArray[np.int32]:
    """List the marked pairs clip by clip, so that neighbours share tables in the cache."""
    clip, segment = np.nonzero(marked.T)
    return np.stack([segment, clip], 1).astype(np.int32)
