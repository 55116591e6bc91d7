"""The encoder of [Ganbat2020]."""

from dataclasses import replace

import numpy as np
import pytest

from kernels.search.document import N_FEATURE, pad, train_document


def test_the_first_frame_fills_the_front(dance):
    image, mask = pad([dance[:20]], 32, is_masked=False)
    assert image.shape == (1, 32, 22, 3)
    np.testing.assert_array_equal(image[0, :12], np.repeat(image[0, 12:13], 12, axis=0))
    assert mask.min() == 1


def test_masked_motions_are_padded_behind(dance):
    image, mask = pad([dance[:20], dance[:40]], 32, is_masked=True)
    assert mask.sum(axis=1).tolist() == [20, 32]
    np.testing.assert_array_equal(image[0, 20:], 0)


@pytest.mark.parametrize("is_masked", [False, True])
def test_it_learns_and_repeats(dances, is_masked):
    motions, labels = dances
    number = np.unique(labels, return_inverse=True)[1]
    a, b = (
        train_document(motions, number, n_frames=64, is_masked=is_masked, steps=30, rows=16).embed(motions)
        for _ in range(2)
    )
    assert a.tobytes() == b.tobytes()
    assert a.shape == (16, N_FEATURE)
    apart = np.linalg.norm(a[:, None] - a[None], axis=-1) + np.diag(np.full(16, np.inf))
    assert np.mean(number[apart.argmin(axis=1)] == number) >= 0.75


def test_what_stands_behind_a_masked_motion_changes_nothing(dances):
    motions, labels = dances
    number = np.unique(labels, return_inverse=True)[1]
    trained = train_document(motions, number, n_frames=64, is_masked=True, steps=3, rows=8)
    few = [motion[:40] for motion in motions[:3]]
    np.testing.assert_allclose(replace(trained, n_frames=96).embed(few), trained.embed(few), atol=1e-5)
