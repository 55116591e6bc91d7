"""Made-up songs with known beats: click trains, and a drum machine with bass and chords."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.music.notes import DRUM_CHANNEL_NUMBER, Notes, sorted_notes
from kernels.music.preview import render_preview
from kernels.types import BeatGrid

Float = NDArray[np.float64]

CLICKS = ("tick", "beep", "noise", "block", "kick")
KICK, SNARE, HAT, CRASH = 36, 38, 42, 49
"""Keys of General MIDI percussion [MMA1991]."""

BARS = {
    4: ("x.......x.x.....", "....x.......x...", "x.x.x.x.x.x.x.x."),
    3: ("x...........", "....x...x...", "x.x.x.x.x.x."),
}
"""Kick, snare and hat of a bar by its number of beats, four steps a beat. Chosen by hand."""

PROGRESSION = (0, 5, 3, 4)
"""Degrees of the chords, from 0. Chosen by hand."""

SCALE = (0, 2, 4, 5, 7, 9, 11)
"""Semitones of a major scale, by definition."""


@dataclass(frozen=True, eq=False)
class ClickTrain:
    """Clicks as sound.

    Parameters
    ----------
    samples : (n, 1) float32
    sample_rate_hz : int
    beat_s : (B,) float64, seconds
        Every beat, sounded or dropped: a click starts at its sample nearest to the beat.
    """

    samples: NDArray[np.float32]
    sample_rate_hz: int
    beat_s: Float


@dataclass(frozen=True, eq=False)
class SyntheticSong:
    """A song as notes and as sound.

    Parameters
    ----------
    notes : :class:`kernels.music.notes.Notes`
    beats : :class:`kernels.types.BeatGrid`
        Every beat with its bar; confidence 1.
    tempo : (time_s, tempo_bpm) of each change, as MIDI wants it
    beats_per_bar : int
    """

    notes: Notes
    beats: BeatGrid
    tempo: tuple[tuple[float, float], ...]
    beats_per_bar: int

    def render(self, *, sample_rate_hz: int = 44100) -> NDArray[np.float32]:
        """Play the song: its notes by :func:`kernels.music.preview.render_preview`.

        Parameters
        ----------
        sample_rate_hz : int, >= 8000

        Returns
        -------
        (n, 1) float32, at most 0.8 in size
            No samples without notes.

        Raises
        ------
        ValueError
            If the rate is below 8000.
        """
        return render_preview(self.notes, sample_rate_hz=sample_rate_hz)


def beat_times(*, tempo_bpm: float, n_beats: int, end_tempo_bpm: float | None = None, start_s: float = 0.0) -> Float:
    """Lay out beats at a steady or evenly changing tempo.

    Parameters
    ----------
    tempo_bpm : float, beats a minute, > 0
    n_beats : int, >= 0
    end_tempo_bpm : float, optional
        Tempo of the last interval; intervals change by an equal ratio.
    start_s : float, seconds, >= 0

    Returns
    -------
    (n_beats,) float64, seconds

    Raises
    ------
    ValueError
        If an argument is out of range.
    """
    end_bpm = tempo_bpm if end_tempo_bpm is None else end_tempo_bpm
    if not (tempo_bpm > 0 and end_bpm > 0 and n_beats >= 0 and start_s >= 0):
        raise ValueError(f"tempo_bpm, n_beats: want tempi > 0, n_beats and start_s >= 0, got {tempo_bpm}, {n_beats}")
    interval = 60.0 / np.geomspace(tempo_bpm, end_bpm, max(n_beats - 1, 1))
    return np.asarray(start_s + np.concatenate([[0.0], np.cumsum(interval)])[:n_beats], np.float64)


def click_train(
    beat_s: Float,
    *,
    click: str = "tick",
    sample_rate_hz: int = 22050,
    off_beat_ratio: float = 0.0,
    swing_ratio: float = 0.5,
    is_dropped: NDArray[np.bool_] | None = None,
    tail_s: float = 1.0,
    seed: int = 0,
) -> ClickTrain:
    """Sound clicks on beats.

    Parameters
    ----------
    beat_s : (B,) float, seconds, >= 0, increasing
    click : one of :data:`CLICKS`
    sample_rate_hz : int, >= 8000
    off_beat_ratio : float, 0 to 1
        Loudness of a second click between two beats; 0 leaves it out.
    swing_ratio : float, 0 to 1
        Where between the beats that click falls: 0.5 is straight, 2/3 a triplet.
    is_dropped : (B,) bool, optional
        Beats that are not sounded; they stay beats.
    tail_s : float, seconds, >= 0
        Silence after the last beat.
    seed : int
        Of the noise click.

    Returns
    -------
    :class:`ClickTrain`

    Raises
    ------
    ValueError
        If an argument is out of range.
    """
    if click not in CLICKS:
        raise ValueError(f"click: want one of {', '.join(CLICKS)}, got {click!r}")
    if sample_rate_hz < 8000 or (len(beat_s) and (beat_s[0] < 0 or (np.diff(beat_s) <= 0).any())):
        raise ValueError("beat_s, sample_rate_hz: want increasing seconds >= 0 and a rate >= 8000")
    sound = _click(click, sample_rate_hz, np.random.default_rng(seed))
    end_s = (float(beat_s[-1]) if len(beat_s) else 0.0) + tail_s
    mix = np.zeros(int(end_s * sample_rate_hz) + len(sound) + 1)
    heard = np.ones(len(beat_s), bool) if is_dropped is None else ~is_dropped
    hits = [(float(time_s), 0.7) for time_s in beat_s[heard]]
    if off_beat_ratio > 0:
        between = beat_s[:-1] + swing_ratio * np.diff(beat_s)
        hits += [(float(time_s), 0.7 * off_beat_ratio) for time_s in between[heard[:-1]]]
    for time_s, loud in hits:
        start = round(time_s * sample_rate_hz)
        mix[start : start + len(sound)] += loud * sound
    return ClickTrain(np.clip(mix, -1, 1).astype(np.float32)[:, None], sample_rate_hz, np.asarray(beat_s, np.float64))


def _click(kind: str, rate_hz: int, rng: np.random.Generator) -> Float:
    """Make one click, (n,), full scale, starting at once."""
    t = np.arange(int(0.12 * rate_hz)) / rate_hz
    fade = np.minimum(np.arange(len(t))[::-1] / (0.01 * rate_hz), 1.0)
    if kind == "tick":
        return np.asarray(np.cos(2 * np.pi * 3000.0 * t) * np.exp(-t / 0.002), np.float64)
    if kind == "beep":
        return np.asarray(np.sin(2 * np.pi * 1000.0 * t) * (t < 0.05), np.float64)
    if kind == "noise":
        return np.asarray(fade * np.clip(rng.standard_normal(len(t)), -2, 2) / 2 * np.exp(-t / 0.010), np.float64)
    if kind == "block":
        return np.asarray(np.sin(2 * np.pi * 800.0 * t) * np.exp(-t / 0.015), np.float64)
    bent = 2 * np.pi * (50.0 * t + 3.0 * (1 - np.exp(-t / 0.03)))
    return np.asarray(fade * np.sin(bent) * np.exp(-t / 0.05), np.float64)


def drum_machine_song(
    *,
    tempo_bpm: float = 120.0,
    end_tempo_bpm: float | None = None,
    n_bars: int = 16,
    beats_per_bar: int = 4,
    start_s: float = 0.0,
    seed: int = 0,
) -> SyntheticSong:
    """Program a drum machine, a bass and chords.

    Parameters
    ----------
    tempo_bpm : float, beats a minute, > 0
    end_tempo_bpm : float, optional
        Tempo at the end, reached evenly; steady when left out.
    n_bars : int, >= 1
    beats_per_bar : 3 or 4
    start_s : float, seconds, >= 0
        Silence before the first beat.
    seed : int
        Of the key, the fills and the velocities.

    Returns
    -------
    :class:`SyntheticSong`
        Notes start exactly on the grid of sixteenths between the beats.

    Raises
    ------
    ValueError
        If an argument is out of range.
    """
    if beats_per_bar not in BARS or n_bars < 1:
        raise ValueError(f"beats_per_bar, n_bars: want 3 or 4 and >= 1, got {beats_per_bar} and {n_bars}")
    n_beats = n_bars * beats_per_bar
    edge_s = beat_times(tempo_bpm=tempo_bpm, n_beats=n_beats + 1, end_tempo_bpm=end_tempo_bpm, start_s=start_s)
    n_steps = 4 * beats_per_bar
    step_s = np.interp(np.arange(n_beats * 4 + 1) / 4, np.arange(n_beats + 1), edge_s)
    rng = np.random.default_rng(seed)
    tonic = int(rng.integers(12))
    rows: list[tuple[float, float, int, int, int, int]] = []

    def add(step: int, steps: int, key: int, velocity: int, channel: int, program: int) -> None:
        start = float(step_s[step])
        end = float(step_s[min(step + steps, len(step_s) - 1)])
        rows.append((start, end - start, key, velocity + int(rng.integers(-6, 7)), channel, program))

    for bar in range(n_bars):
        first = bar * n_steps
        degree = PROGRESSION[bar % len(PROGRESSION)]
        is_fill = bar % 4 == 3
        for key, steps in zip((KICK, SNARE, HAT), BARS[beats_per_bar], strict=True):
            for step in range(n_steps):
                if steps[step] == "x":
                    add(first + step, 1, key, 104 if step % 4 == 0 else 84, DRUM_CHANNEL_NUMBER, 0)
        if is_fill:
            for step in range(n_steps - 4, n_steps):
                if rng.random() < 0.7:
                    add(first + step, 1, SNARE, 92, DRUM_CHANNEL_NUMBER, 0)
        if bar % 4 == 0:
            add(first, 1, CRASH, 100, DRUM_CHANNEL_NUMBER, 0)
        for step in range(0, n_steps, 2):
            add(first + step, 2, 36 + (tonic + SCALE[degree]) % 12, 96 if step % 4 == 0 else 80, 2, 33)
        for third in (0, 2, 4):
            octave, place = divmod(degree + third, 7)
            add(first, n_steps, 48 + tonic + SCALE[place] + 12 * octave, 76, 3, 48)
    number = np.arange(n_beats)
    beats = BeatGrid(
        time_s=edge_s[:-1],
        bar_number=number // beats_per_bar + 1,
        beat_in_bar_number=number % beats_per_bar + 1,
        confidence=np.ones(n_beats),
    )
    return SyntheticSong(sorted_notes(rows), beats, _tempo_map(edge_s, beats_per_bar), beats_per_bar)


def _tempo_map(edge_s: Float, beats_per_bar: int) -> tuple[tuple[float, float], ...]:
    """Write the tempo of each beat, repeats left out; silence before the first beat is one bar, so that bars agree."""
    start_s = float(edge_s[0])
    bpm = 60.0 / np.diff(edge_s)
    changes = [(0.0, 60.0 * beats_per_bar / start_s if start_s > 0 else float(bpm[0]))]
    for time_s, tempo_bpm in zip(edge_s[:-1], bpm, strict=True):
        if time_s > 0 and abs(tempo_bpm / changes[-1][1] - 1.0) > 1e-9:
            changes.append((float(time_s), float(tempo_bpm)))
    return tuple(changes)
