"""Fitting to catalogues of every kind."""

from dataclasses import replace

import numpy as np
import pytest

from kernels.search.augment import mirror
from kernels.search.encoder_fit import _held_out, fit, mirrored_labels, statistics_of
from kernels.search.measure import leave_one_out
from kernels.search.normalise import channels
from kernels.search.train import Training

SHORT = Training(steps=30, rows=16)


def vectors(fitted, motions):
    return np.stack([fitted.encoder.embed_channels(channels(m)) for m in motions])


def test_labels_are_learnt_and_validated(dances):
    motions, labels = dances
    fitted = fit(motions, labels, how=SHORT)
    assert fitted.kind == "labelled"
    assert fitted.validation.n_queries >= 2
    assert fitted.confusion.count.sum() == fitted.validation.n_queries
    assert set(fitted.confusion.names) <= set(labels)
    assert 0 < fitted.steps <= 30
    assert leave_one_out(vectors(fitted, motions), labels).first_ratio == 1


@pytest.mark.parametrize("labels", [[""] * 16, ["one"] * 16, ["one", *[""] * 15], [str(i) for i in range(16)]])
def test_without_labels_to_tell_apart_it_learns_from_the_motions_alone(dances, labels):
    motions, truth = dances
    fitted = fit(motions, labels, how=SHORT)
    assert (fitted.kind, fitted.validation, fitted.encoder.discriminant) == ("unlabelled", None, None)
    assert leave_one_out(vectors(fitted, motions), truth).first_ratio >= 0.75


def test_a_label_of_one_clip_stands_beside_others(dances):
    motions, labels = dances
    fitted = fit(motions, ["alone", *labels[1:]], how=SHORT)
    assert fitted.kind == "labelled"
    assert np.isfinite(vectors(fitted, motions)).all()


def test_unlabelled_motions_are_left_out_of_learning(dances):
    motions, labels = dances
    half = [label if i % 2 else "" for i, label in enumerate(labels)]
    assert fit(motions, half, how=SHORT).kind == "labelled"


def test_one_motion_is_told_by_its_statistics(dance):
    fitted = fit([dance], ["a"], how=SHORT)
    assert fitted.kind == "untrained"
    assert np.isfinite(vectors(fitted, [dance])).all()


def test_no_motion_is_refused():
    with pytest.raises(ValueError, match="want a clip to learn from, got none"):
        fit([], [], how=SHORT)


def test_same_arguments_same_bytes(dances):
    motions, labels = dances
    a, b = (fit(motions, labels, how=SHORT).encoder.arrays() for _ in range(2))
    assert all(a[name].tobytes() == b[name].tobytes() for name in a)


def test_windows_of_one_take_are_held_out_together(dances):
    """One take for all: there is nothing to hold out, and training goes its whole way."""
    motions, labels = dances
    fitted = fit(motions, labels, take=["one"] * 16, how=SHORT)
    assert (fitted.steps, fitted.validation, fitted.confusion) == (30, None, None)


def test_too_short_a_training_to_look_in_between_claims_no_figure(dances):
    motions, labels = dances
    fitted = fit(motions, labels, how=replace(SHORT, steps=10))
    assert (fitted.kind, fitted.steps, fitted.validation) == ("labelled", 10, None)


def test_labels_that_mirror_each_other_are_found(dances):
    motions, labels = dances
    kicks = [m for m, label in zip(motions, labels, strict=True) if label == "wave"]
    others = [m for m, label in zip(motions, labels, strict=True) if label == "twist"]
    lean = np.zeros(22)
    lean[7:10] = 0.4  # the left arm held out to the front
    left = [m + lean[:, None] * np.array([0.0, 0.0, 1.0]) for m in kicks]
    both = [*left, *(mirror(m) for m in left), *others]
    number = np.repeat([0, 1, 2], [4, 4, 4])
    turned = mirrored_labels(both, number, statistics_of(both, has_travel=True), has_travel=True)
    assert turned[:8].tolist() == [1] * 4 + [0] * 4


def test_whole_takes_are_held_out_and_never_the_only_one_of_a_label():
    label = np.repeat([0, 1, 2], [12, 12, 2])
    take = np.concatenate([np.repeat(np.arange(6), 2), np.repeat(np.arange(6, 12), 2), [12, 12]])
    for seed in range(5):
        held = _held_out(label, take, seed)
        assert held.any()
        assert not held[24:].any()
        assert not set(take[held].tolist()) & set(take[~held].tolist())


def test_a_label_of_fewer_than_three_clips_mirrors_nothing(dances):
    motions, labels = dances
    few = [m for m, label in zip(motions, labels, strict=True) if label == "wave"][:2]
    others = [m for m, label in zip(motions, labels, strict=True) if label == "twist"]
    both = [*few, *others]
    turned = mirrored_labels(both, np.repeat([0, 1], [2, 4]), statistics_of(both, has_travel=True), has_travel=True)
    assert turned[:2].tolist() == [-1, -1]
    assert turned[2:].tolist() == [1] * 4
