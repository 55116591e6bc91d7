"""What goes into a stage: its song, and no clip in a blend that may not be changed."""

from types import SimpleNamespace

import dagster as dg
import numpy as np
import pyarrow as pa
import pytest

from assets.formats import audio
from assets.formats.audio import Audio
from assets.formats.errors import FormatError
from assets.stage import _sound, refuse_changed
from schemas.settings import Limits, Settings


def test_a_song_that_a_raised_limit_let_in_reaches_its_stage(tmp_path):
    length_s = audio.LONGEST_S + 1
    audio.write_wav(tmp_path / "long.wav", Audio(np.zeros((int(4000 * length_s), 1), np.float32), 4000))
    row = {"path": "long.wav", "kind": "audio"}

    def sound(longest_song_s):
        settings = Settings(limits=Limits(longest_song_s=longest_song_s))
        return _sound(row, SimpleNamespace(file=lambda path: tmp_path / path, settings=lambda: settings))

    assert sound(2000.0).duration_s == length_s
    with pytest.raises(FormatError, match="at most 1200 s"):
        sound(1200.0)


def test_a_blended_clip_that_may_not_be_changed_stops_the_stage():
    frames = pa.table({"clip_id": ["a", "a", "b"], "blend_clip_id": pa.array([None, "b", None], pa.string())})
    refuse_changed(frames, {"a": "CC-BY-4.0", "b": ""})
    refuse_changed(frames.slice(2), {"a": "CC-BY-4.0", "b": "CC-BY-ND-4.0"})
    for whole in ("a", "b"):
        with pytest.raises(dg.Failure, match=f"got {whole} in a blend"):
            refuse_changed(frames, {"a": "MIT", "b": "MIT"} | {whole: "CC-BY-NC-ND-4.0"})
