"""Whole songs, made up and real: beats where they are, none where there are none."""

import subprocess
import sys

import numpy as np
import pytest

from assets.formats import audio, beats_file
from kernels.music.beats import TRACKERS, _candidates, track_beats
from kernels.synthetic.drum_machine import CLICKS, beat_times, click_train, drum_machine_song

RATE = 22050


def f_measure(true_s, found_s, window_s=0.07):
    """Greedy one-to-one matching in order of time."""
    hits = i = 0
    for time_s in true_s:
        while i < len(found_s) and found_s[i] < time_s - window_s:
            i += 1
        if i < len(found_s) and found_s[i] <= time_s + window_s:
            hits += 1
            i += 1
    return 2 * hits / max(len(true_s) + len(found_s), 1)


@pytest.mark.parametrize("click", CLICKS)
@pytest.mark.parametrize("bpm", [72, 90, 128, 168])
def test_click_trains_to_five_milliseconds(click, bpm):
    train = click_train(beat_times(tempo_bpm=bpm, n_beats=30, start_s=0.7), click=click, sample_rate_hz=RATE)
    found = track_beats(train.samples, RATE).grid.time_s
    off_s = found[np.abs(found[:, None] - train.beat_s).argmin(axis=0)] - train.beat_s
    assert np.abs(off_s).max() < 0.005
    assert f_measure(train.beat_s, found) > 0.95


@pytest.mark.parametrize(
    ("how", "meter"),
    [
        ({"tempo_bpm": 120}, 4),
        ({"tempo_bpm": 92}, 4),
        ({"tempo_bpm": 172}, 4),
        ({"tempo_bpm": 140, "beats_per_bar": 3}, 3),
        ({"tempo_bpm": 100, "end_tempo_bpm": 135}, 4),
    ],
)
def test_drum_machine_beats_and_bars(how, meter):
    song = drum_machine_song(**how, n_bars=16)
    grid = track_beats(song.render(sample_rate_hz=RATE), RATE).grid
    assert f_measure(song.beats.time_s, grid.time_s) > 0.95
    assert grid.beat_in_bar_number.max() == meter
    down = song.beats.beat_in_bar_number == 1
    assert f_measure(song.beats.time_s[down], grid.time_s[grid.beat_in_bar_number == 1]) > 0.9
    assert (grid.confidence > 0.3).mean() > 0.8


def test_silence_before_and_after_has_no_beats():
    song = drum_machine_song(tempo_bpm=120, n_bars=10, start_s=4.0)
    sound = np.concatenate([song.render(sample_rate_hz=RATE)[:, 0], np.zeros(5 * RATE)])
    found = track_beats(sound, RATE).grid.time_s
    assert found[0] == pytest.approx(4.0, abs=0.02)
    assert found[-1] < song.notes.end_s + 1.6
    assert f_measure(song.beats.time_s, found) > 0.93


def test_beats_go_on_through_a_break():
    song = drum_machine_song(tempo_bpm=120, n_bars=16)
    sound = song.render(sample_rate_hz=RATE)[:, 0].copy()
    sound[14 * RATE : 17 * RATE] = 0
    found = track_beats(sound, RATE).grid.time_s
    assert f_measure(song.beats.time_s, found) > 0.95


def test_shift_in_time_shifts_the_beats():
    sound = drum_machine_song(tempo_bpm=110, n_bars=10).render(sample_rate_hz=RATE)[:, 0]
    one = track_beats(sound, RATE).grid.time_s
    other = track_beats(np.concatenate([np.zeros(int(0.73 * RATE)), sound]), RATE).grid.time_s
    assert len(one) == len(other)
    np.testing.assert_allclose(other - int(0.73 * RATE) / RATE, one, atol=0.004)


def test_rate_channels_and_gain_do_not_matter():
    song = drum_machine_song(tempo_bpm=110, n_bars=8)
    one = track_beats(song.render(sample_rate_hz=RATE), RATE).grid.time_s
    loud = song.render(sample_rate_hz=48000)
    other = track_beats(0.1 * np.tile(loud, (1, 3)), 48000).grid.time_s
    np.testing.assert_allclose(other, one, atol=0.004)


def test_the_same_again():
    sound = drum_machine_song(n_bars=6).render(sample_rate_hz=RATE)
    one, other = track_beats(sound, RATE), track_beats(sound, RATE)
    assert one.grid.time_s.tobytes() == other.grid.time_s.tobytes()
    assert one.tempo_candidates == other.tempo_candidates


def test_candidates_are_half_and_double_with_the_chosen_one_marked():
    candidates = track_beats(drum_machine_song(tempo_bpm=120).render(sample_rate_hz=RATE), RATE).tempo_candidates
    by_ratio = {candidate.level_ratio: candidate for candidate in candidates}
    assert {0.5, 1.0, 2.0} <= set(by_ratio)
    assert [c.level_ratio for c in candidates if c.is_chosen] == [1.0]
    assert by_ratio[1.0].tempo_bpm == pytest.approx(120, abs=0.5)
    assert by_ratio[0.5].tempo_bpm == pytest.approx(60, abs=0.3)
    assert max(c.score for c in candidates) == 0
    assert by_ratio[1.0].score > by_ratio[2.0].score
    assert [c.tempo_bpm for c in candidates] == sorted(c.tempo_bpm for c in candidates)


def _noise(seed):
    return np.random.default_rng(seed).normal(0, 0.1, 15 * RATE)


@pytest.mark.parametrize(
    "samples",
    [
        np.zeros(0),
        np.ones(1),
        np.zeros(10 * RATE),
        np.full(10 * RATE, 0.5),
        0.5 * np.sin(np.arange(10 * RATE) * 0.1),
        _noise(0),
        _noise(1),
        1e-7 * _noise(2),
        np.eye(1, 3 * RATE, RATE)[0],
    ],
    ids=["none", "one", "silence", "constant", "tone", "noise", "other noise", "inaudible", "one click"],
)
def test_nothing_to_tap_to(samples):
    analysis = track_beats(samples, RATE)
    assert len(analysis.grid.time_s) == 0
    assert analysis.tempo_candidates == ()


@pytest.mark.parametrize(
    ("samples", "rate", "how", "said"),
    [
        (np.zeros((2, 2, 2)), RATE, {}, "samples"),
        (np.array([np.nan] * 100), RATE, {}, "finite"),
        (np.zeros(100), 0, {}, "sample_rate_hz"),
        (np.zeros(100), RATE, {"tracker": "ear"}, "tracker"),
    ],
)
def test_refusals(samples, rate, how, said):
    with pytest.raises(ValueError, match=said):
        track_beats(samples, rate, **how)


@pytest.mark.slow
def test_both_trackers_hear_a_drum_machine():
    song = drum_machine_song(tempo_bpm=120, n_bars=8)
    for tracker in TRACKERS:
        found = track_beats(song.render(sample_rate_hz=RATE), RATE, tracker=tracker).grid.time_s
        assert f_measure(song.beats.time_s, found) > 0.8


def test_default_path_leaves_numba_alone():
    """librosa's compiled parts cost seconds at their first use; our tracker must not load them."""
    code = "import sys, kernels.music.beats; sys.exit('numba' in sys.modules or 'librosa' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.slow
def test_real_songs(data_dir):
    """Of the collection's songs most beats are found; the page docs/music-beats.md has each song's figures."""
    scores = []
    for path in sorted((data_dir / "audio_beats").glob("*.beats")):
        song = next(p for p in sorted(path.parent.glob(path.stem + ".*")) if p.suffix in (".wav", ".ogg", ".mp3"))
        sound = audio.read(song)
        found = track_beats(sound.samples, sound.sample_rate_hz).grid.time_s
        scores.append(f_measure(beats_file.read(path).time_s, found))
    assert np.mean(scores) > 0.75


def pulses(tempo_bpm, seconds=20):
    """How much each hundredth of a second looks like a beat, for a plain pulse."""
    probability = np.full(int(seconds * 100), 0.02)
    probability[np.rint(np.arange(0.3, seconds, 60 / tempo_bpm) * 100).astype(int)] = 0.9
    return probability


@pytest.mark.parametrize(("tempo_bpm", "left_out"), [(60, 1 / 3), (45, 1 / 2), (170, 3.0), (230, 2.0)])
def test_tempi_that_nobody_taps_are_no_candidates(tempo_bpm, left_out):
    found = _candidates(pulses(tempo_bpm), float(tempo_bpm))
    assert left_out not in [c.level_ratio for c in found]
    assert all(25 <= c.tempo_bpm <= 450 * 1.08 for c in found)
    assert [c.level_ratio for c in found if c.is_chosen] == [1.0]


def test_thirds_are_candidates_only_where_half_or_double_is_no_better():
    straight = {c.level_ratio for c in _candidates(pulses(120), 120.0)}
    assert {0.5, 1.0, 2.0} <= straight
    for found in (_candidates(pulses(120), 120.0), _candidates(pulses(90), 90.0)):
        score = {c.level_ratio: c.score for c in found}
        least = min(score[r] for r in (0.5, 2.0) if r in score)
        assert all(score[r] >= least for r in score if r in (1 / 3, 3.0))
        assert max(score.values()) == 0


def test_a_song_too_short_for_two_beats_has_no_candidates():
    assert _candidates(np.full(10, 0.5), 120.0) == ()


def test_an_audible_click_alone_and_a_song_of_less_than_two_beats_have_no_grid():
    sound = drum_machine_song(tempo_bpm=120, n_bars=4).render(sample_rate_hz=RATE)[:, 0]
    assert len(track_beats(sound[: RATE // 10], RATE).grid.time_s) == 0
    assert len(track_beats(sound[: RATE // 100], RATE).grid.time_s) == 0
