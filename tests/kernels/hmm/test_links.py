"""Which recorded motion may follow which."""

import numpy as np
import pytest

from kernels.hmm.links import link


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
