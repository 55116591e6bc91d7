"""Pictures are made, hold what they should, and repeat to the byte."""

import base64
import re

import numpy as np
import pytest

from assets.plots import draw as plots
from assets.tables import pack as tables
from kernels.assembly.blend import assemble
from kernels.assembly.quality import Measure
from kernels.motion.beats import motion_beats
from kernels.skeleton.canonical import CANONICAL
from kernels.synthetic.dancer import place, take
from kernels.types import BeatGrid, Choreography
from schemas.motion import CLIP, MOTION_BEAT

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


def png_of(markdown):
    return base64.b64decode(re.search(r"data:image/png;base64,([A-Za-z0-9+/=]+)\)", markdown)[1])


def test_timeline_and_sheet_repeat_to_the_byte(danced):
    dance, steps = danced
    music = np.arange(0, 1.5, 0.5)
    first = plots.dance_timeline(dance, steps, music)
    assert first.startswith(PNG)
    assert first == plots.dance_timeline(dance, steps, music)
    sheet = plots.contact_sheet(dance, CANONICAL.parent.tolist())
    assert sheet.startswith(PNG)
    assert sheet == plots.contact_sheet(dance, CANONICAL.parent.tolist())


def test_session_shows_every_clip_refused_ones_with_their_reason():
    nothing = dict.fromkeys(CLIP.arrow.names, "") | {
        "frame_rate_hz": 30.0,
        "frame_count": 100,
        "duration_s": 8.0,
        "joint_count": 22,
        "is_labelled": False,
        "performed_offset_s": 0.0,
        "metres_per_unit": 1.0,
        "reason": None,
    }
    rows = [
        nothing | {"clip_id": "s-a", "path": "clips/s/a.bvh", "label": "step", "state": "read"},
        nothing | {"clip_id": "s-b", "path": "clips/s/b.bvh", "state": "refused", "reason": "want | less"},
    ]
    beats = tables.from_motion_beat("s-a", motion_beats(place(take("step")), 30.0), 30.0)
    shown = plots.session_beats(beats, tables.from_rows(CLIP, rows))
    assert png_of(shown).startswith(PNG)
    assert "| s-a | step |" in shown
    assert "want \\| less" in shown
    assert "| 120 |" in shown


def test_session_without_clips_is_a_table_without_a_picture():
    assert "base64" not in plots.session_beats(MOTION_BEAT.empty(), CLIP.empty())


def test_song_with_and_without_beats():
    time_s = np.arange(0, 10, 0.05)
    level = -20 + np.sin(time_s)
    number = np.arange(16)
    grid = BeatGrid(0.5 * number + 0.3, number // 4 + 1, number % 4 + 1, np.ones(16))
    none = BeatGrid(np.zeros(0), np.zeros(0, int), np.zeros(0, int), np.zeros(0))
    pictures = {png_of(plots.song_beats(g, time_s, level)) for g in (grid, none)}
    assert len(pictures) == 2
    assert png_of(plots.song_beats(none, np.zeros(0), np.zeros(0))).startswith(PNG)


def test_graph_of_nothing_is_drawn():
    assert png_of(plots.motion_graph(np.zeros(0), 2.0, np.zeros(0))).startswith(PNG)


def test_phrases_are_runs_between_seams(danced):
    _, steps = danced
    assert plots.phrases(steps) == [(0, 2), (2, 3)]
    table = plots.phrase_table(steps)
    assert "| 1 | 0.00 to 1.00 | s-a | 0.25 to 1.25 | 2 |" in table
    assert "| 2 | 1.00 to 1.50 | s-b |" in table


def test_measures_say_what_is_wanted():
    table = plots.measures([Measure("x_ratio", 0.5, "above 0.9", False), Measure("y_count", 3.0)])
    assert "| x_ratio | 0.5 | above 0.9 | **no** |" in table
    assert "| y_count | 3 |  |  |" in table


def test_long_tables_are_cut_with_a_word():
    table = plots.markdown(("a",), [(i,) for i in range(100)], longest=10)
    assert table.count("\n| ") == 9 + 1
    assert "and 90 more" in table
