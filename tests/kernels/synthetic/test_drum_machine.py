"""Made-up songs: their beats are where they say."""

from itertools import pairwise

import numpy as np
import pytest

from kernels.synthetic.drum_machine import CLICKS, beat_times, click_train, drum_machine_song


def test_steady_beats():
    np.testing.assert_allclose(beat_times(tempo_bpm=120, n_beats=4, start_s=0.25), [0.25, 0.75, 1.25, 1.75])
    assert len(beat_times(tempo_bpm=120, n_beats=0)) == 0
    assert beat_times(tempo_bpm=120, n_beats=1, start_s=1).tolist() == [1]


def test_ramp_goes_from_tempo_to_tempo():
    step = np.diff(beat_times(tempo_bpm=100, end_tempo_bpm=150, n_beats=41))
    assert step[0] == pytest.approx(0.6)
    assert step[-1] == pytest.approx(0.4)
    np.testing.assert_allclose(step[1:] / step[:-1], step[1] / step[0])


@pytest.mark.parametrize("click", CLICKS)
@pytest.mark.parametrize("rate", [8000, 22050, 48000])
def test_clicks_start_on_their_beats(click, rate):
    train = click_train(beat_times(tempo_bpm=97, n_beats=8, start_s=0.3), click=click, sample_rate_hz=rate)
    sound = np.abs(train.samples[:, 0])
    for beat in train.beat_s:
        at = round(beat * rate)
        assert sound[max(at - rate // 100, 0) : at].max() == 0
        assert sound[at : at + rate // 50].max() > 0.3


def test_dropped_beats_stay_beats():
    dropped = np.zeros(8, bool)
    dropped[3] = True
    train = click_train(beat_times(tempo_bpm=120, n_beats=8), is_dropped=dropped)
    assert len(train.beat_s) == 8
    assert np.abs(train.samples[int(1.4 * 22050) : int(1.9 * 22050)]).max() == 0


def test_swung_off_beats():
    train = click_train(beat_times(tempo_bpm=60, n_beats=3), off_beat_ratio=0.5, swing_ratio=2 / 3)
    sound = np.abs(train.samples[:, 0])
    starts = np.flatnonzero((sound[1:] > 0.1) & (sound[:-1] == 0)) + 1
    np.testing.assert_allclose(starts / 22050, [2 / 3, 1, 5 / 3, 2], atol=1e-3)


@pytest.mark.parametrize("beats_per_bar", [3, 4])
def test_drum_machine_plays_on_its_grid(beats_per_bar):
    song = drum_machine_song(tempo_bpm=100, end_tempo_bpm=130, n_bars=6, beats_per_bar=beats_per_bar, start_s=0.5)
    n = 6 * beats_per_bar
    assert len(song.beats.time_s) == n
    assert song.beats.time_s[0] == 0.5
    assert song.beats.beat_in_bar_number.tolist() == list(range(1, beats_per_bar + 1)) * 6
    place = np.interp(song.notes.start_s, song.beats.time_s, np.arange(n)) * 4
    inside = song.notes.start_s <= song.beats.time_s[-1]
    np.testing.assert_allclose(place[inside], np.rint(place[inside]), atol=1e-6)
    kicks = song.notes.start_s[song.notes.is_drum & (song.notes.key_number == 36)]
    assert np.isin(song.beats.time_s[song.beats.beat_in_bar_number == 1], kicks).all()


def test_same_seed_same_song():
    one, same, other = (drum_machine_song(seed=seed) for seed in (3, 3, 4))
    assert one.render(sample_rate_hz=8000).tobytes() == same.render(sample_rate_hz=8000).tobytes()
    assert not np.array_equal(one.notes.velocity, other.notes.velocity[: len(one.notes.velocity)])


def test_tempo_map_carries_the_beats():
    """Integrating the written tempo gives the beats back: lead-in of one bar, then the ramp."""
    song = drum_machine_song(tempo_bpm=90, end_tempo_bpm=120, n_bars=4, start_s=1.5)
    changes = [*song.tempo, (np.inf, 0.0)]
    quarter = [
        sum((min(t, until) - since) * bpm / 60 for (since, bpm), (until, _) in pairwise(changes) if since < t)
        for t in song.beats.time_s
    ]
    np.testing.assert_allclose(quarter, np.arange(16) + 4, atol=1e-6)


@pytest.mark.parametrize(
    ("make", "how"),
    [
        (beat_times, {"tempo_bpm": 0, "n_beats": 3}),
        (drum_machine_song, {"beats_per_bar": 5}),
        (drum_machine_song, {"n_bars": 0}),
    ],
)
def test_refusals(make, how):
    with pytest.raises(ValueError, match="want"):
        make(**how)
    with pytest.raises(ValueError, match="click"):
        click_train(np.array([0.0]), click="gong")
    with pytest.raises(ValueError, match="beat_s"):
        click_train(np.array([1.0, 0.5]))
