"""Made-up motions at the rate of searching."""

import numpy as np
import pytest

from kernels.search.normalise import RATE_HZ, resample
from kernels.skeleton import kinematics
from kernels.synthetic.dancer import take

LABELS = ("step", "twist", "wave", "kick")


@pytest.fixture(scope="session")
def dances():
    """Four takes of each of four moves, at different paces: positions (T, 22, 3) and labels."""
    motions, labels = [], []
    for label in LABELS:
        for number in range(4):
            clip = take(label, n_beats=8, interval_s=0.45 + 0.05 * number).clip
            position, _ = kinematics.place(clip)
            motions.append(resample(position, clip.frame_rate_hz, 0.0, 4.0))
            labels.append(label)
    return motions, labels


@pytest.fixture(scope="session")
def dance(dances):
    """One motion, (T, 22, 3)."""
    return dances[0][0]


@pytest.fixture
def rng():
    return np.random.default_rng(0)


@pytest.fixture(scope="session")
def rate_hz():
    return RATE_HZ
