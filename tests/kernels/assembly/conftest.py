"""Clips of the made-up dancer, and choreographies that dance them."""

import numpy as np
import pytest

from kernels.assembly.blend import assemble
from kernels.skeleton.canonical import CANONICAL
from kernels.synthetic.dancer import take
from kernels.types import Choreography


@pytest.fixture(scope="session")
def clips():
    """Four takes on the canonical skeleton, two of them the same move."""
    return {
        "step": take("step", interval_s=0.5).clip,
        "twist": take("twist", interval_s=0.55, turned_rad=1.0).clip,
        "wave": take("wave", interval_s=0.5, turned_rad=-2.0).clip,
        "rock": take("rock", interval_s=0.5, frame_rate_hz=60.0).clip,
    }


@pytest.fixture
def phrases():
    """Make a choreography from (clip, first clip time, steps, clip step, song step), one after the other."""

    def make(*parts, blend_s=0.3):
        ids, song, clip, seam = [], [0.0], [], []
        for name, start_s, n, clip_step_s, song_step_s in parts:
            for i in range(n):
                ids.append(name)
                song.append(song[-1] + song_step_s)
                clip.append((start_s + i * clip_step_s, start_s + (i + 1) * clip_step_s))
                seam.append(i == 0 and len(ids) > 1)
        clip, seam = np.array(clip).reshape(-1, 2), np.array(seam, bool)
        return Choreography(
            tuple(ids),
            np.array(song[:-1]),
            np.array(song[1:]),
            clip[:, 0],
            clip[:, 1],
            seam,
            np.where(seam, blend_s, 0.0),
        )

    return make


@pytest.fixture
def dance(clips):
    """Assemble at 60 frames a second."""

    def make(steps, others=None):
        duration_s = float(steps.song_end_s[-1])
        return assemble(steps, others or clips, skeleton=CANONICAL, frame_rate_hz=60.0, duration_s=duration_s)

    return make
