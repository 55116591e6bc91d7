"""A short made-up clip, and its motion on the canonical skeleton."""

import pytest

from kernels.skeleton.canonical import CANONICAL
from kernels.skeleton.naming import map_joints
from kernels.skeleton.retarget import retarget
from kernels.synthetic.dancer import take


@pytest.fixture(scope="module")
def clip():
    return take("step", n_beats=4).clip


@pytest.fixture(scope="module")
def canonical(clip):
    return retarget(clip, map_joints(CANONICAL))
