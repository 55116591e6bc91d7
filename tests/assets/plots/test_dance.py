"""Pictures of a dance are made, hold what they should, and repeat to the byte."""

import numpy as np
import pytest

from assets.plots.dance import contact_sheet, dance_timeline, measure_table, phrase_table, phrases
from kernels.assembly.blend import assemble
from kernels.assembly.quality import Measure
from kernels.skeleton.canonical import CANONICAL
from kernels.synthetic.dancer import take
from kernels.types import Choreography

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def danced():
    steps = Choreography(
        ("s-a", "s-a", "s-b"),
        np.array([0.0, 0.5, 1.0]),
        np.array([0.5, 1.0, 1.5]),
        np.array([0.25, 0.75, 0.75]),
        np.array([0.75, 1.25, 1.25]),
        np.array([False, False, True]),
        np.array([0.0, 0.0, 0.3]),
    )
    clips = {"s-a": take("step").clip, "s-b": take("wave").clip}
    return assemble(steps, clips, skeleton=CANONICAL, frame_rate_hz=30.0, duration_s=1.5), steps


def test_timeline_and_sheet_repeat_to_the_byte(danced):
    dance, steps = danced
    music = np.arange(0, 1.5, 0.5)
    first = dance_timeline(dance, steps, music)
    assert first.startswith(PNG)
    assert first == dance_timeline(dance, steps, music)
    sheet = contact_sheet(dance, CANONICAL.parent.tolist())
    assert sheet.startswith(PNG)
    assert sheet == contact_sheet(dance, CANONICAL.parent.tolist())


def test_phrases_are_runs_between_seams(danced):
    _, steps = danced
    assert phrases(steps) == [(0, 2), (2, 3)]
    table = phrase_table(steps)
    assert "| 1 | 0.00 to 1.00 | s-a | 0.25 to 1.25 | 2 |" in table
    assert "| 2 | 1.00 to 1.50 | s-b |" in table


def test_measures_say_what_is_wanted():
    table = measure_table([Measure("x_ratio", 0.5, "above 0.9", False), Measure("y_count", 3.0)])
    assert "| x_ratio | 0.5 | above 0.9 | **no** |" in table
    assert "| y_count | 3 |  |  |" in table
