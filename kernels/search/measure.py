"""How good a search is, measured with labels: nearest neighbour, average precision, and splits that do not leak."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.types import Float, Int


@dataclass(frozen=True)
class Retrieval:
    """What queries came to.

    Parameters
    ----------
    first_ratio : share of queries whose first hit has their label
    mean_precision_ratio : mean over queries of average precision
    n_queries : queries that count: those whose label is in the catalogue at all
    """

    first_ratio: float
    mean_precision_ratio: float
    n_queries: int


def retrieval(distance: Float, query_label: Sequence[str], label: Sequence[str]) -> Retrieval:
    """Measure rankings against labels.

    Parameters
    ----------
    distance : (Q, N) float
        Ties are ranked by row of the catalogue.
    query_label, label : Q and N names

    Returns
    -------
    Retrieval
        Zeros where no query's label is in the catalogue.
    """
    order = np.argsort(distance, axis=1, kind="stable")
    is_hit = np.asarray(label)[order] == np.asarray(query_label)[:, None]
    is_hit = is_hit[is_hit.any(axis=1)] if is_hit.size else np.zeros((0, 1), bool)
    if not len(is_hit):
        return Retrieval(0.0, 0.0, 0)
    precision = np.cumsum(is_hit, axis=1) / np.arange(1, is_hit.shape[1] + 1)
    average = (precision * is_hit).sum(axis=1) / is_hit.sum(axis=1)
    return Retrieval(float(is_hit[:, 0].mean()), float(average.mean()), len(is_hit))


def joined(parts: Sequence[Retrieval]) -> Retrieval:
    """Average the measures of several splits, by queries."""
    n = sum(part.n_queries for part in parts)
    if not n:
        return Retrieval(0.0, 0.0, 0)
    first = sum(part.first_ratio * part.n_queries for part in parts) / n
    precision = sum(part.mean_precision_ratio * part.n_queries for part in parts) / n
    return Retrieval(first, precision, n)


def group_folds(group: Sequence[str], n_folds: int) -> list[NDArray[np.bool_]]:
    """Split rows so that no group is on both sides: for groups of subjects, styles or takes.

    Parameters
    ----------
    group : N names
    n_folds : int, >= 2

    Returns
    -------
    list of (N,) bool
        True where a row is held out; folds of about the same size, the largest groups dealt first. Fewer than
        ``n_folds`` where there are fewer groups.
    """
    names, number = np.unique(np.asarray(group), return_inverse=True)
    count = np.bincount(number, minlength=len(names))
    fold_of, load = np.zeros(len(names), np.int64), np.zeros(n_folds)
    for name in np.argsort(-count, kind="stable"):
        fold_of[name] = int(load.argmin())
        load[fold_of[name]] += count[name]
    folds = [fold_of[number] == k for k in range(n_folds)]
    return [fold for fold in folds if fold.any()]


def label_folds(label: Int, n_folds: int, rng: np.random.Generator) -> list[NDArray[np.bool_]]:
    """Split rows so that every label is spread evenly: (N,) int labels to folds as :func:`group_folds`."""
    fold = np.zeros(len(label), np.int64)
    offset = 0
    for name in np.unique(label):
        rows = rng.permutation(np.flatnonzero(label == name))
        fold[rows] = (np.arange(len(rows)) + offset) % n_folds
        offset += len(rows)
    folds = [fold == k for k in range(n_folds)]
    return [held for held in folds if held.any()]


@dataclass(frozen=True, eq=False)
class Confusion:
    """Labels of clips against those of their nearest others.

    Parameters
    ----------
    names : L labels, in order
    count : (L, L) int64
        How many clips of the row's label have a nearest other of the column's.
    """

    names: tuple[str, ...]
    count: Int

    @property
    def first_ratio(self) -> float:
        """Share of clips whose nearest other has their label; 0 for none."""
        return float(np.trace(self.count) / max(int(self.count.sum()), 1))


def confusions(distance: Float, query_label: Sequence[str], label: Sequence[str]) -> Confusion:
    """Count the label of each query's nearest clip.

    Parameters
    ----------
    distance : (Q, N) float, N >= 1
        Ties go to the earlier row of the catalogue.
    query_label, label : Q and N names

    Returns
    -------
    Confusion
        Of the labels that are asked for or found; none where Q is 0.
    """
    nearest = np.asarray(label, str)[distance.argmin(axis=1)]
    names, number = np.unique(np.concatenate([np.asarray(query_label, str), nearest]), return_inverse=True)
    count = np.zeros((len(names), len(names)), np.int64)
    np.add.at(count, (number[: len(nearest)], number[len(nearest) :]), 1)
    return Confusion(tuple(names.tolist()), count)


def leave_one_out(vector: NDArray[np.floating], label: Sequence[str]) -> Confusion:
    """Look every clip up among the others.

    Parameters
    ----------
    vector : (N, D) float, unit rows
    label : N names

    Returns
    -------
    Confusion
        Of labels with two clips or more, whose clips alone are looked up.
    """
    names, number = np.unique(np.asarray(label, str), return_inverse=True)
    count = np.bincount(number, minlength=len(names))
    found = np.zeros((len(names), len(names)), np.int64)
    if len(vector) > 1:
        for at in range(0, len(vector), 1024):
            likeness = vector[at : at + 1024].astype(np.float64) @ vector.T
            likeness[np.arange(len(likeness)), at + np.arange(len(likeness))] = -np.inf
            np.add.at(found, (number[at : at + 1024], number[likeness.argmax(axis=1)]), 1)
    kept = count >= 2
    found[~kept] = 0
    shown = kept | (found.sum(axis=0) > 0)
    return Confusion(tuple(names[shown].tolist()), found[np.ix_(shown, shown)])
