"""The made-up studio: the same bytes each time, and nothing of a user's own written over."""

import numpy as np
import pytest

from assets.formats import bvh, midi
from pipelines.commands import demo_studio
from pipelines.commands.check import check_stage
from pipelines.commands.dance_songs import dance_songs
from pipelines.resources import NoProgress
from pipelines.studio.files import StudioError


def files(root):
    return {str(p.relative_to(root)): p.read_bytes() for p in root.rglob("*") if p.is_file()}


def test_same_bytes_twice(tmp_path):
    demo_studio.make(tmp_path / "one")
    demo_studio.make(tmp_path / "two")
    assert files(tmp_path / "one") == files(tmp_path / "two")
    before = (tmp_path / "one" / "songs" / "drum_machine.wav").stat().st_mtime_ns
    demo_studio.make(tmp_path / "one")
    assert (tmp_path / "one" / "songs" / "drum_machine.wav").stat().st_mtime_ns == before


def test_nothing_is_written_over(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "precious.txt").write_text("x")
    with pytest.raises(StudioError, match="want a new folder"):
        demo_studio.make(tmp_path / "mine")
    (tmp_path / "file").write_text("x")
    with pytest.raises(StudioError, match="want a new folder"):
        demo_studio.make(tmp_path / "file")


def test_two_rigs_in_two_worlds(tmp_path):
    demo_studio.make(tmp_path)
    worlds = {d: bvh.to_clip(bvh.read(tmp_path / "clips" / d / "step_01.bvh")).world for d in ("ayame", "kaede")}
    assert (worlds["ayame"].up_axis, worlds["kaede"].up_axis) == ("Y", "Z")
    assert worlds["ayame"].metres_per_unit == pytest.approx(0.01)
    assert worlds["kaede"].metres_per_unit == pytest.approx(1.0)
    np.testing.assert_allclose(
        midi.read(tmp_path / "songs" / "drum_machine.mid").beats.time_s[:64], demo_studio.beats_s(), atol=2e-3
    )


@pytest.mark.slow
def test_demo_dances_on_the_known_beats(tmp_path):
    demo_studio.make(tmp_path / "demo")
    outcome = dance_songs(
        tmp_path / "demo", [demo_studio.SONG], method="graph", frame_rate_hz=None, out=None, progress=NoProgress
    )
    assert outcome.status == 0
    assert outcome.facts["quality"]["beat_f_ratio"] > 0.8
    assert outcome.facts["quality"]["beat_p_probability"] < 0.01
    assert check_stage(tmp_path / "demo" / "dances" / demo_studio.SONG / "graph.usdz").status == 0
