"""What beats and bars of songs are worth: bars on made-up songs that no change may fall below.

Songs of a made-up band in four, three and five, straight and in triplets, sixteen seconds each. They had 0.97 to 0.99
for beats and 0.92 to 0.97 for first beats of bars; ``benchmarks/music_beats.py`` has the figures of real songs.
"""

import numpy as np
import pytest

from kernels.assembly.quality import f_measure
from kernels.music.beats import track_beats
from kernels.music.preview import render_preview
from kernels.synthetic.arrangement import arrange
from kernels.synthetic.grooves import GROOVES

RATE_HZ = 16000
SONGS = (("rock", 1), ("hip hop", 0), ("waltz", 0), ("rock in three", 1), ("jazz waltz", 0), ("five", 0))


@pytest.fixture(scope="module")
def heard():
    """The song as it was made and the beats found in it, by its style."""
    found = {}
    for style, seed in SONGS:
        groove = next(g for g in GROOVES if g.name == style)
        song = arrange(np.random.default_rng(seed), duration_s=16.0, groove=groove)
        sound = render_preview(song.notes, sample_rate_hz=RATE_HZ)
        found[style] = groove, song.beats, track_beats(sound, RATE_HZ)
    return found


def test_beats_of_made_up_songs_are_found(heard):
    scores = [f_measure(analysis.grid.time_s, beats.time_s) for _, beats, analysis in heard.values()]
    assert np.mean(scores) > 0.94
    assert min(scores) > 0.9


def test_beats_that_are_found_are_believed(heard):
    """Confidence tells songs with a plain pulse from noise, which is below 0.15."""
    assert np.mean([analysis.grid.confidence.mean() for _, _, analysis in heard.values()]) > 0.45


def test_first_beats_of_bars_of_made_up_songs_are_found(heard):
    scores = []
    for groove, beats, analysis in heard.values():
        assert analysis.grid.beat_in_bar_number.max() == groove.beats_per_bar
        first = analysis.grid.time_s[analysis.grid.beat_in_bar_number == 1]
        scores.append(f_measure(first, beats.time_s[beats.beat_in_bar_number == 1]))
    assert np.mean(scores) > 0.88
    assert min(scores) > 0.8


def test_the_tempo_of_made_up_songs_is_at_its_own_level(heard):
    for _, beats, analysis in heard.values():
        (chosen,) = (c for c in analysis.tempo_candidates if c.is_chosen)
        assert chosen.tempo_bpm == pytest.approx(60 / np.median(np.diff(beats.time_s)), rel=0.04)
