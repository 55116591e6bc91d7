"""The examination of clips."""

import pytest

from kernels.health.examine import examine
from kernels.skeleton.naming import map_joints
from kernels.synthetic import dancer


@pytest.mark.parametrize("move", ["step", "kick", "spin"])
def test_a_clean_dance_raises_nothing(move):
    clip = dancer.take(move, n_beats=6).clip
    found = examine(clip, map_joints(clip.skeleton))
    assert found.faults == ()
    assert found.is_fenced.shape == (clip.n_frames,)
    assert not found.is_fenced.any()
