"""Listening to a song within the studio's limits."""

from types import SimpleNamespace

import numpy as np
import pytest

from assets.formats import midi
from assets.formats.errors import FormatError
from assets.music import listen
from assets.sources.sources import SongFile
from kernels.music.notes import sorted_notes
from schemas.settings import Brief, Limits, Settings


@pytest.fixture
def studio(tmp_path):
    """A studio with a MIDI song of twenty seconds."""
    notes = sorted_notes([(at_s, 0.5, 60, 100, 1, 0) for at_s in np.arange(0.0, 20.0, 0.5)])
    (tmp_path / "long.mid").write_bytes(midi.format(notes))
    return SimpleNamespace(file=lambda path: tmp_path / path, brief=lambda song: Brief())


@pytest.mark.parametrize(("limit_s", "is_read"), [(10.0, False), (30.0, True)])
def test_the_longest_song_counts_for_midi_too(studio, limit_s, is_read):
    song, settings = SongFile("long", "long.mid", "0", "midi"), Settings(limits=Limits(longest_song_s=limit_s))
    if is_read:
        assert listen(song, studio, settings).duration_s >= 20
    else:
        with pytest.raises(FormatError, match="want a song of at most 10 s, got 20 s"):
            listen(song, studio, settings)
