"""Fitting an encoder to a catalogue: with its labels where there are some, without where there are none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kernels.search import train as training
from kernels.search.augment import mirror
from kernels.search.describe import describe
from kernels.search.discriminant import Projection, discriminant, principal, unit
from kernels.search.encoder import N_DISCRIMINANT, N_PRINCIPAL, Encoder
from kernels.search.measure import Confusion, Retrieval, confusions, label_folds, retrieval
from kernels.search.normalise import channels
from kernels.search.train import Trained, Training
from kernels.types import Float, Int

LABELLED = {"network": 0.10, "discriminant": 0.88, "principal": 0.02}
UNLABELLED = {"network": 0.1, "principal": 0.9}
"""Shares of the parts in a squared distance. Tuned on five style-disjoint and four take-disjoint splits of 325 clips:
by take they hardly matter, by style the network's may not be large."""

_VALIDATION_FOLDS = 6
"""Of the takes one part is held out to find the number of steps. Chosen by hand."""

_PATIENCE = 3
"""Looks without a better one after which training ends. Chosen by hand."""

_LEAST_OF_A_LABEL = 3
"""Mirrored clips of a label from which the label they fall on is believed. Chosen by hand."""


@dataclass(frozen=True)
class Fitted:
    """An encoder and what is known of it.

    Parameters
    ----------
    encoder : Encoder
    kind : "labelled", "unlabelled" or "untrained"
    steps : of the network's training
    validation : measured on clips held out while the number of steps was chosen; None without labels
    confusion : their labels against those of their nearest clips; None without labels
    """

    encoder: Encoder
    kind: str
    steps: int
    validation: Retrieval | None
    confusion: Confusion | None = None


def fit(
    position_xyz_m: Sequence[Float],
    label: Sequence[str],
    *,
    take: Sequence[str] = (),
    how: Training,
    progress: Callable[[], None] | None = None,
) -> Fitted:
    """Fit an encoder.

    Parameters
    ----------
    position_xyz_m : N motions (T, 22, 3), metres, at :data:`~kernels.search.normalise.RATE_HZ`, N >= 1
    label : N names; empty where a motion has none
        Those without are left out where two labels or more have two clips or more; else labels are not used.
    take : N names, or none
        Motions of one take are held out together; none: each is its own.
    how : Training
        Steps are the most there may be: a validation split says how many, then all clips are used.
    progress : function called after every step, at most ``2 * how.steps`` times

    Returns
    -------
    Fitted
        Untrained, that is of statistics alone, with fewer than two motions.

    Raises
    ------
    ValueError
        If there is no motion.
    """
    if not len(position_xyz_m):
        raise ValueError("encoder: want a clip to learn from, got none; add clips and run 'odori build'")
    statistics = statistics_of(position_xyz_m, has_travel=how.has_travel)
    spread = principal(statistics, N_PRINCIPAL)
    if len(position_xyz_m) < 2:
        return Fitted(Encoder({"principal": 1.0}, how.has_travel, spread), "untrained", 0, None)
    names, number = np.unique(np.asarray(label), return_inverse=True)
    is_labelled = np.asarray(label) != ""
    count = np.bincount(number[is_labelled], minlength=len(names))
    if (count >= 2).sum() < 2:
        weights = training.train(position_xyz_m, np.arange(len(position_xyz_m)), how=how, progress=progress)
        return Fitted(Encoder(UNLABELLED, how.has_travel, spread, None, weights), "unlabelled", how.steps, None)
    rows = np.flatnonzero(is_labelled)
    motions, of, told = [position_xyz_m[i] for i in rows.tolist()], number[rows], statistics[rows]
    turned = mirrored_labels(motions, of, told, has_travel=how.has_travel)
    takes = np.unique(np.asarray(take if len(take) else range(len(label))), return_inverse=True)[1][rows]
    held = _held_out(of, takes, how.seed)
    chosen = _choose_steps(motions, of, told, turned, how, spread, held, progress)
    steps = chosen.steps
    weights = training.train(motions, of, how=replace(how, steps=steps), mirrored_label=turned, progress=progress)
    telling = mirrored_discriminant(motions, of, told, turned, has_travel=how.has_travel)
    encoder = Encoder(LABELLED, how.has_travel, spread, telling, weights)
    if chosen.distance is None:
        return Fitted(encoder, "labelled", steps, None)
    asked, known = names[number[rows[held]]].tolist(), names[number[rows[~held]]].tolist()
    found = retrieval(chosen.distance, asked, known), confusions(chosen.distance, asked, known)
    return Fitted(encoder, "labelled", steps, *found)


def statistics_of(position_xyz_m: Sequence[Float], *, has_travel: bool) -> Float:
    """Describe motions: N of (T, 22, 3) to (N, N_STATISTICS)."""
    return np.stack([describe(channels(motion, has_travel=has_travel)) for motion in position_xyz_m])


def mirrored_labels(position_xyz_m: Sequence[Float], label: Int, statistics: Float, *, has_travel: bool) -> Int:
    """Find what each motion is when left and right change places.

    Mirrored motions of a label are looked up among all: where most fall on one label, and most of that label's fall
    back, the two mirror each other (often a label itself: a walk is a walk).

    Parameters
    ----------
    position_xyz_m : N motions (T, 22, 3), metres
    label : (N,) int, two different ones or more
    statistics : (N, D) float
    has_travel : bool

    Returns
    -------
    (N,) int64
        Label of each motion mirrored; -1 where it is not clear.
    """
    telling = discriminant(statistics, label, N_DISCRIMINANT)
    here = unit(telling(statistics))
    there = unit(telling(statistics_of([mirror(motion) for motion in position_xyz_m], has_travel=has_travel)))
    nearest = label[np.argmax(there @ here.T, axis=1)]
    most: dict[int, int] = {}
    for name in np.unique(label).tolist():
        found, count = np.unique(nearest[label == name], return_counts=True)
        if count.sum() >= _LEAST_OF_A_LABEL and count.max() > count.sum() / 2:
            most[name] = int(found[count.argmax()])
    return np.array([most[n] if most.get(most.get(n, -1), -2) == n else -1 for n in label.tolist()], np.int64)


def mirrored_discriminant(
    motions: Sequence[Float], label: Int, statistics: Float, turned: Int, *, has_travel: bool
) -> Projection:
    """Fit the discriminant to motions and, where that is known to be of a label, their mirror images.

    Parameters
    ----------
    motions : N motions (T, 22, 3), metres
    label, turned : (N,) int, labels, and those of the mirror images from :func:`mirrored_labels`
    statistics : (N, D) float
    has_travel : bool

    Returns
    -------
    Projection to (..., N_DISCRIMINANT)
    """
    known = np.flatnonzero(turned >= 0)
    if not len(known):
        return discriminant(statistics, label, N_DISCRIMINANT)
    other = statistics_of([mirror(motions[i]) for i in known.tolist()], has_travel=has_travel)
    both = np.concatenate([statistics, other])
    return discriminant(both, np.concatenate([label, turned[known]]), N_DISCRIMINANT)


def _held_out(label: Int, take: Int, seed: int) -> NDArray[np.bool_]:
    """Choose whole takes to hold out, evenly of every label, never the only take of one."""
    first = np.unique(take, return_index=True)[1]
    fold = label_folds(label[first], _VALIDATION_FOLDS, np.random.default_rng(seed))[0]
    is_spared = np.bincount(label[first], minlength=label.max() + 1)[label] < 2
    return np.isin(take, take[first][fold]) & ~is_spared


@dataclass(frozen=True, eq=False)
class _Chosen:
    """Steps to train for; and how good that was, with the distances from what was held out, where it was measured."""

    steps: int
    score: float = -1.0
    distance: Float | None = None


def _choose_steps(
    motions: Sequence[Float],
    label: Int,
    statistics: Float,
    turned: Int,
    how: Training,
    spread: Projection,
    held: NDArray[np.bool_],
    progress: Callable[[], None] | None,
) -> _Chosen:
    """Hold clips out, and find after how many steps the network finds their like best."""
    kept = ~held
    if not held.any() or len(np.unique(label[kept])) < 2:
        return _Chosen(how.steps)
    shown = [motions[i] for i in np.flatnonzero(kept).tolist()]
    telling = mirrored_discriminant(shown, label[kept], statistics[kept], turned[kept], has_travel=how.has_travel)
    best = _Chosen(how.steps)
    worse = 0

    def watch(done: int, weights: Trained) -> bool:
        nonlocal best, worse
        encoder = Encoder(LABELLED, how.has_travel, spread, telling, weights)
        vectors = np.stack([encoder.embed_channels(channels(m, has_travel=how.has_travel)) for m in motions])
        distance = np.sqrt(np.maximum(2 - 2 * vectors[held].astype(np.float64) @ vectors[kept].T, 0.0))
        found = retrieval(distance, label[held].tolist(), label[kept].tolist())
        score = found.first_ratio + found.mean_precision_ratio
        worse = 0 if score > best.score else worse + 1
        if score > best.score:
            best = _Chosen(done, score, distance)
        return worse >= _PATIENCE

    training.train(
        shown,
        label[kept],
        how=how,
        mirrored_label=turned[kept],
        watch=watch,
        progress=progress,
    )
    return best
