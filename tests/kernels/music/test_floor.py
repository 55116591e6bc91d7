"""librosa's tracker through our signature."""

import numpy as np
import pytest

from kernels.music.floor import librosa_beats
from kernels.synthetic.drum_machine import beat_times, click_train


@pytest.mark.slow
def test_clicks_are_found_at_their_tempo():
    train = click_train(beat_times(tempo_bpm=120, n_beats=30, start_s=0.5), click="noise")
    found = librosa_beats(train.samples, train.sample_rate_hz)
    assert np.median(np.diff(found)) == pytest.approx(0.5, abs=0.02)


def test_silence_and_too_little():
    assert len(librosa_beats(np.zeros(22050 * 3), 22050)) == 0
    assert len(librosa_beats(np.ones(100), 22050)) == 0


def test_refusals():
    with pytest.raises(ValueError, match="sample_rate_hz"):
        librosa_beats(np.zeros(5), -1)
