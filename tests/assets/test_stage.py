"""The song of a stage: decoded within the limits it was read with."""

from types import SimpleNamespace

import numpy as np
import pytest

from assets.formats import audio
from assets.formats.audio import Audio
from assets.formats.errors import FormatError
from assets.stage import _sound
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
