"""Which recording of each basic motion is danced."""

import numpy as np

from assets.dancing.recordings import choose_recordings
from kernels.hmm.instances import Motions
from kernels.hmm.places import place
from kernels.hmm.seams import Ends
from kernels.hmm.viterbi import Spans
from schemas.settings import HmmPathSettings


def test_a_dance_that_was_drawn_goes_on_in_the_recording_that_has_its_motions_on_end():
    """Two clips of three motions: the states 0, 1, 0 of the first are drawn; the second has 1, 0, 1."""
    start = np.tile([0.0, 0.5, 1.0], 2)
    motions = Motions(np.repeat([0, 1], 3), np.arange(6) % 2, start, start + 0.5)
    zero, one = np.zeros(6), np.ones(6)
    pose = np.random.default_rng(0).normal(0, 0.1, (6, 4))
    limbs = np.zeros((6, 4, 5, 3))
    ends = Ends(pose, pose[::-1], limbs, limbs, one, zero, zero, np.full(6, 1e9), zero, zero)
    grid_s, is_beat = 0.5 * np.arange(4), np.ones(4, bool)
    places = place(motions, grid_s, np.zeros((3, 2)), longest=1, is_beat=is_beat, accent=one)
    spans = Spans(np.array([0, 1, 0]), np.arange(3), np.ones(3, np.int64))
    chosen = choose_recordings(
        motions, ends, places, spans, None, np.zeros(4), is_beat=is_beat, grid_s=grid_s, settings=HmmPathSettings()
    )
    assert chosen.danced.tolist() == [0, 1, 2]
    assert not chosen.found.has_seam.any()
    for name in ("transition_cost", "warp_cost", "beat_cost", "repetition_cost"):
        np.testing.assert_allclose(chosen.costs[name], 0.0, atol=1e-9)
