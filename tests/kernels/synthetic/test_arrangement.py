"""The made-up band keeps its own time."""

import os
import subprocess
import sys

import numpy as np
import pytest

from kernels.synthetic.arrangement import arrange
from kernels.synthetic.grooves import GROOVES


@pytest.mark.parametrize("groove", GROOVES, ids=lambda groove: groove.name)
def test_every_style_plays_about_its_beats(groove):
    """Notes gather on the grid of its steps, swing and human time aside, and bars fill the song."""
    off_grid = []
    for seed in range(4):
        song = arrange(np.random.default_rng(seed), duration_s=20, groove=groove, tempo_bpm=groove.slowest_bpm)
        beat_s = song.beats.time_s
        assert song.style == groove.name
        assert beat_s[-1] + 60.001 / groove.slowest_bpm >= 20
        np.testing.assert_allclose(np.diff(beat_s), 60 / groove.slowest_bpm)
        assert song.beats.beat_in_bar_number[-1] == groove.beats_per_bar
        place = np.interp(song.notes.start_s, beat_s, np.arange(len(beat_s))) * groove.steps_per_beat
        off_grid += np.abs(place - np.rint(place)).tolist()
    assert len(off_grid) > 100
    assert np.median(off_grid) < 0.2


def test_patterns_fit_their_bars():
    for groove in GROOVES:
        steps = groove.beats_per_bar * groove.steps_per_beat
        for pattern in (*groove.kick, *groove.snare, *groove.time, *(pattern for _, pattern in groove.extra)):
            assert steps % len(pattern) == 0, (groove.name, pattern)
            assert set(pattern) <= set(".oxX")


def test_tempo_stays_near_the_style():
    for seed in range(12):
        song = arrange(np.random.default_rng(seed))
        groove = next(g for g in GROOVES if g.name == song.style)
        bpm = 60 / np.median(np.diff(song.beats.time_s))
        assert 0.7 * groove.slowest_bpm < bpm < 1.4 * groove.fastest_bpm


def test_same_state_same_song():
    one, same = (arrange(np.random.default_rng(11)) for _ in range(2))
    assert one.notes.start_s.tobytes() == same.notes.start_s.tobytes()
    assert one.notes.start_s.tobytes() != arrange(np.random.default_rng(12)).notes.start_s.tobytes()


def test_the_same_song_in_every_process():
    """Whatever order a process gives to sets of names."""
    code = (
        "import numpy as np; from kernels.synthetic.arrangement import arrange; "
        "print([round(float(arrange(np.random.default_rng(i)).notes.start_s.sum()), 6) for i in range(10)])"
    )
    said = {
        subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "5")
    }
    assert len(said) == 1


@pytest.mark.parametrize("how", [{"duration_s": 0}, {"tempo_bpm": -1}])
def test_refusals(how):
    with pytest.raises(ValueError, match="want > 0"):
        arrange(np.random.default_rng(0), **how)
