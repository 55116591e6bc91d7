"""Which recorded motion may follow which."""

import numpy as np
import pytest

from kernels.hmm import links as links_module
from kernels.hmm.instances import Motions
from kernels.hmm.links import link
from kernels.hmm.seams import seam_cost


def test_what_goes_on_in_its_clip_has_no_seam(some_motions, some_ends):
    motions = some_motions()
    links = link(motions, some_ends(motions), np.log(np.full((2, 2), 0.5)), seam_weight=1.0)
    into = {
        (int(links.source[e]), j): (float(links.cost[e]), bool(links.is_seam[e]))
        for j in range(6)
        for e in range(links.first[j], links.first[j + 1])
    }
    assert into[0, 1] == (pytest.approx(np.log(2)), False)
    assert into[0, 2][1]
    assert (3, 3) not in into


def many(n=90):
    """Motions of clips of their own, of two basic motions, the second rare."""
    state = (np.arange(n) % 9 == 0).astype(np.int64)
    return Motions(np.arange(n), state, np.zeros(n), np.full(n, 0.5))


def test_each_is_linked_to_the_cheapest_of_all_and_of_each_basic_motion(some_ends, monkeypatch):
    monkeypatch.setattr(links_module, "N_NEAREST", 5)
    monkeypatch.setattr(links_module, "N_EACH_STATE", 6)
    motions = many()
    ends = some_ends(motions)
    links = link(motions, ends, np.zeros((2, 2)), seam_weight=1.0)
    target = np.repeat(np.arange(90), np.diff(links.first))
    cost = seam_cost(ends, np.arange(90), np.arange(90))
    np.fill_diagonal(cost, np.inf)
    for motion in (0, 40, 89):
        wanted = set(np.argsort(cost[motion])[:5])
        for state in (0, 1):
            members = np.flatnonzero(motions.state == state)
            wanted |= set(members[np.argsort(cost[motion, members])[:3]])
        assert set(target[links.source == motion].tolist()) == wanted
    np.testing.assert_allclose(links.cost, cost[links.source, target])
    assert links.is_seam.all()


def test_where_a_motion_goes_on_no_seam_is_dearer_or_cheaper(some_motions, some_ends):
    motions = some_motions()
    log_transition = np.log(np.array([[0.9, 0.1], [0.3, 0.7]]))
    links = link(motions, some_ends(motions), log_transition, seam_weight=0.0)  # all seams are free as well
    target = np.repeat(np.arange(6), np.diff(links.first))
    pairs = list(zip(links.source.tolist(), target.tolist(), strict=True))
    assert len(pairs) == len(set(pairs))
    state = motions.state
    np.testing.assert_allclose(links.cost, -log_transition[state[links.source], state[target]])


def test_the_weight_of_seams_multiplies_them_alone(some_motions, some_ends):
    motions = some_motions()
    ends, log_transition = some_ends(motions), np.log(np.full((2, 2), 0.5))
    one, three = (link(motions, ends, log_transition, seam_weight=w) for w in (1.0, 3.0))
    np.testing.assert_allclose(three.cost - np.log(2), 3 * (one.cost - np.log(2)))
