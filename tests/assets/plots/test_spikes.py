"""Pictures of faults."""

from dataclasses import replace

import numpy as np
import pytest

from assets.plots.spikes import MOST_PICTURES, loud, spikes
from assets.tables import pack
from assets.tables.motion import from_clip_fault
from kernels import rotation
from kernels.health.verdicts import ClipFault
from kernels.synthetic import dancer
from schemas.motion import CLIP_FAULT

FLIP = ClipFault("flip", "head", 20, 20, "mended", "it flips by 57 degrees")
FAST = ClipFault("fast", "head", 20, 20, "fenced", "it turns fast")


@pytest.fixture(scope="module")
def clip():
    return dancer.take("step", n_beats=6).clip


@pytest.fixture(scope="module")
def flipped(clip):
    turned = clip.rotation_wxyz.copy()
    head = clip.skeleton.index("head")
    turned[20, head] = rotation.mul(turned[20, head], rotation.from_axis_angle(np.array([0.0, 1.0, 0.0]), 1.0))
    return replace(clip, rotation_wxyz=turned)


def test_a_fault_is_drawn_and_listed(clip, flipped):
    rows = from_clip_fault("a-x", [FLIP], flipped)
    shown = spikes(rows, {"a-x": clip})
    assert shown.startswith("![how fast joints turn around faults](data:image/png;base64,")
    assert "| a-x | flip | head |" in shown
    assert "it flips by 57 degrees" in shown
    assert spikes(rows, {"a-x": flipped}) != shown


def test_real_motion_is_listed_and_not_drawn(clip, flipped):
    rows = from_clip_fault("a-x", [FAST], flipped)
    assert loud(rows) == []
    shown = spikes(rows, {"a-x": clip})
    assert "image/png" not in shown
    assert "it turns fast" in shown


def test_no_fault_is_said_and_a_clip_that_is_not_there_is_not_drawn(flipped):
    assert spikes(CLIP_FAULT.empty(), {}) == "none"
    assert "image/png" not in spikes(from_clip_fault("a-x", [FLIP], flipped), {})


def test_so_many_clips_are_drawn_and_no_more(clip, flipped):
    names = [f"a-{i:02}" for i in range(MOST_PICTURES + 2)]
    parts = {name: from_clip_fault(name, [FLIP, FLIP], flipped) for name in names}
    few = spikes(pack.concat(CLIP_FAULT, [parts[n] for n in names[:MOST_PICTURES]]), dict.fromkeys(names, clip))
    many = spikes(pack.concat(CLIP_FAULT, [parts[n] for n in names]), dict.fromkeys(names, clip))
    assert many.partition("\n")[0] == few.partition("\n")[0]
