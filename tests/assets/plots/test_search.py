"""Pictures of motion search."""

import numpy as np
import pytest

from assets.plots import search as search_plots
from assets.tables import search as search_tables
from kernels.search.discriminant import unit
from kernels.search.measure import leave_one_out
from kernels.search.nearest import Proposal
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize("n", [0, 1, 2, 3, 12])
def test_every_clip_has_a_place(n):
    centre = unit(np.random.default_rng(0).normal(size=(n, 16))).astype(np.float32)
    place = search_plots.places(centre)
    assert place.shape == (n, 2)
    assert np.isfinite(place).all()
    np.testing.assert_array_equal(search_plots.places(centre), place)


def test_like_clips_lie_together():
    rng = np.random.default_rng(0)
    centre = np.repeat(np.eye(16)[:2], 10, axis=0) + 0.05 * rng.normal(size=(20, 16))
    place = search_plots.places(unit(centre).astype(np.float32))
    apart = np.linalg.norm(place[:10].mean(axis=0) - place[10:].mean(axis=0))
    assert apart > np.linalg.norm(place[:10] - place[:10].mean(axis=0), axis=1).max()


def test_map_names_labels_and_counts_the_rest():
    assert search_plots.catalogue_map(np.zeros((0, 2)), []) == "no clips"
    shown = search_plots.catalogue_map(np.random.default_rng(0).random((25, 2)), [f"label {i}" for i in range(25)])
    assert "data:image/png;base64," in shown
    assert "… and 5 labels in grey" in shown


def test_confusions_are_listed_most_first():
    vector = np.array([[1.0, 0.0], [0.9, 0.1], [0.0, 1.0], [0.8, 0.2]])
    shown = search_plots.confusion(leave_one_out(unit(vector), ["a", "a", "b", "b"]))
    assert "data:image/png;base64," in shown
    assert "| b | a | 1 |" in shown
    assert search_plots.confusion(leave_one_out(vector[:1], ["a"])) == "no label has two clips"


def test_proposals_are_listed():
    table = search_tables.from_proposals([[Proposal(0, 0.9, 0, 0.2)]], ["x"], ["a"], ["step"], far=0.5)
    assert "| x | step | 0.9 | a | yes |" in search_plots.proposals(table)
    assert search_plots.proposals(table.slice(0, 0)) == "every clip has a label"


def test_contact_sheet_grows_with_its_strips():
    body = np.repeat(kinematics.rest_position(CANONICAL)[None], 3, axis=0)
    one, two = (search_plots.contact_sheet([("strip", body, np.arange(3) / 30)] * n, n_figures=3) for n in (1, 2))
    heights = [int.from_bytes(data[20:24], "big") for data in (one, two)]
    assert one.startswith(PNG)
    assert heights[1] > 1.7 * heights[0]
    assert one == search_plots.contact_sheet([("strip", body, np.arange(3) / 30)], n_figures=3)
    assert search_plots.contact_sheet([("one frame", body[:1], np.zeros(1))]).startswith(PNG)
