"""Notes made audible: a plain synthesizer, so that a dance made from MIDI can be heard."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.music.notes import DRUM_CHANNEL_NUMBER, Notes

Float = NDArray[np.float64]

TABLE_SIZE = 2048
N_HARMONICS = 16
"""Samples of a stored cycle, and its harmonics. Chosen by hand."""

TAIL_S = 1.5
"""What rings on after the last note. Chosen by hand."""

PEAK = 0.8
"""Of the loudest sample; full scale is 1. Chosen by hand."""


@dataclass(frozen=True)
class Voice:
    """How an instrument sounds.

    Parameters
    ----------
    rolloff : float, >= 0
        Harmonic k has amplitude k ** -rolloff.
    even_ratio : float, 0 to 1
        What the even harmonics keep.
    attack_s, release_s : float, seconds, > 0
    decay_s : float, seconds, > 0
        Time constant of the fall from full to ``sustain_ratio``.
    sustain_ratio : float, 0 to 1
    gain : float
    """

    rolloff: float
    even_ratio: float
    attack_s: float
    decay_s: float
    sustain_ratio: float
    release_s: float
    gain: float


@dataclass(frozen=True)
class DrumRecipe:
    """How a percussion key sounds: a ringing sine and a burst of noise.

    Parameters
    ----------
    pitch_hz : float, Hz, >= 0
    bend_ratio : float, >= 0
        How much higher the pitch starts: 0 stays, 2.5 starts at 3.5 times and falls within 30 ms.
    second_ratio : float, >= 0
        Amplitude of a partial at 1.48 times the pitch, for metal.
    ring_s, noise_s : float, seconds, >= 0
        Time constants of the two; 0 leaves one out.
    brightness : float, 0 to 1
        0 is white noise, 1 its difference.
    """

    pitch_hz: float
    bend_ratio: float
    second_ratio: float
    ring_s: float
    noise_s: float
    brightness: float


VOICES = (
    Voice(1.6, 1.0, 0.004, 0.60, 0.00, 0.10, 1.0),  # piano
    Voice(2.2, 0.4, 0.002, 0.35, 0.00, 0.20, 0.9),  # bells, mallets
    Voice(1.2, 0.7, 0.010, 0.10, 0.90, 0.05, 0.6),  # organ
    Voice(1.3, 1.0, 0.003, 0.45, 0.05, 0.08, 0.9),  # guitar
    Voice(1.5, 0.8, 0.004, 0.50, 0.30, 0.06, 1.4),  # bass
    Voice(1.2, 1.0, 0.060, 0.50, 0.80, 0.15, 0.6),  # strings
    Voice(1.4, 1.0, 0.070, 0.50, 0.80, 0.20, 0.6),  # ensemble
    Voice(1.0, 1.0, 0.025, 0.20, 0.70, 0.08, 0.7),  # brass
    Voice(1.3, 0.3, 0.025, 0.20, 0.80, 0.06, 0.7),  # reed
    Voice(2.4, 0.6, 0.035, 0.20, 0.85, 0.08, 0.8),  # pipe
    Voice(1.0, 1.0, 0.008, 0.30, 0.70, 0.06, 0.6),  # synth lead
    Voice(1.6, 1.0, 0.120, 0.50, 0.85, 0.30, 0.5),  # synth pad
    Voice(1.5, 0.5, 0.050, 0.60, 0.60, 0.30, 0.5),  # synth effects
    Voice(1.3, 0.9, 0.004, 0.40, 0.05, 0.08, 0.8),  # plucked folk
    Voice(2.0, 0.5, 0.002, 0.15, 0.00, 0.10, 0.9),  # struck
    Voice(0.8, 1.0, 0.050, 0.50, 0.50, 0.20, 0.3),  # sound effects
)
"""One voice for each family of eight General MIDI programs [MMA1991]. Chosen by hand."""

_TOM, _METAL = (0.6, 0.0), (0.0, 0.6)
"""Bend and second partial of skins and of metal. Chosen by hand."""

DRUMS: tuple[tuple[tuple[int, ...], DrumRecipe], ...] = (
    ((35, 36), DrumRecipe(55.0, 2.5, 0.0, 0.090, 0.004, 0.5)),  # bass drum
    ((37,), DrumRecipe(1700.0, 0.0, 0.0, 0.010, 0.008, 0.7)),  # side stick
    ((38, 40), DrumRecipe(190.0, 0.0, 0.0, 0.050, 0.070, 0.6)),  # snare
    ((39,), DrumRecipe(0.0, 0.0, 0.0, 0.0, 0.060, 0.5)),  # clap
    ((41, 43), DrumRecipe(85.0, *_TOM, 0.120, 0.010, 0.3)),  # floor toms
    ((45, 47), DrumRecipe(130.0, *_TOM, 0.120, 0.010, 0.3)),  # toms
    ((48, 50), DrumRecipe(175.0, *_TOM, 0.110, 0.010, 0.3)),  # high toms
    ((42, 44), DrumRecipe(0.0, 0.0, 0.0, 0.0, 0.022, 1.0)),  # closed, pedal hi-hat
    ((46,), DrumRecipe(0.0, 0.0, 0.0, 0.0, 0.120, 1.0)),  # open hi-hat
    ((49, 52, 55, 57), DrumRecipe(0.0, 0.0, 0.0, 0.0, 0.250, 0.9)),  # crash
    ((51, 53, 59), DrumRecipe(3100.0, *_METAL, 0.150, 0.060, 1.0)),  # ride
    ((54, 58, 69, 70, 82), DrumRecipe(0.0, 0.0, 0.0, 0.0, 0.030, 1.0)),  # tambourine, shakers
    ((56,), DrumRecipe(560.0, *_METAL, 0.060, 0.0, 0.0)),  # cowbell
    ((60, 62, 65), DrumRecipe(380.0, *_TOM, 0.060, 0.006, 0.4)),  # high hand drums
    ((61, 63, 64, 66), DrumRecipe(240.0, *_TOM, 0.080, 0.006, 0.4)),  # low hand drums
    ((67, 68), DrumRecipe(800.0, *_METAL, 0.060, 0.0, 0.0)),  # agogo
    ((75, 76, 77), DrumRecipe(1100.0, 0.0, 0.0, 0.020, 0.003, 0.5)),  # claves, blocks
    ((80, 81), DrumRecipe(4200.0, *_METAL, 0.200, 0.0, 0.0)),  # triangle
)
"""How keys of General MIDI percussion [MMA1991] sound. Chosen by hand."""

OTHER_DRUM = DrumRecipe(1000.0, 0.0, 0.0, 0.012, 0.006, 0.6)
"""What any other key sounds like. Chosen by hand."""


def render_preview(notes: Notes, *, sample_rate_hz: int = 44100, seed: int = 0) -> NDArray[np.float32]:
    """Play notes on sines and noise.

    Parameters
    ----------
    notes : :class:`kernels.music.notes.Notes`
        Those on channel 10 sound as percussion by their General MIDI key.
    sample_rate_hz : int, >= 8000
    seed : int
        Of the noise in the drums.

    Returns
    -------
    (n, 1) float32, at most 0.8 in size
        From 0 s to 1.5 s after the last note ends; no samples without notes. The same for the same arguments.

    Raises
    ------
    ValueError
        If the rate is below 8000.
    """
    recipes = {key: recipe for keys, recipe in DRUMS for key in keys}
    rng = np.random.default_rng(seed)
    keys = sorted(set(notes.key_number[notes.is_drum].tolist()))
    kit = {key: drum_sound(recipes.get(key, OTHER_DRUM), sample_rate_hz, rng) for key in keys}
    mix = play(notes, sample_rate_hz=sample_rate_hz, voices=VOICES, kit=kit)
    loudest = float(np.abs(mix).max(initial=0.0))
    scale = PEAK / loudest if loudest > PEAK else 1.0
    return (mix * scale).astype(np.float32)[:, None]


def play(notes: Notes, *, sample_rate_hz: int, voices: Sequence[Voice], kit: Mapping[int, Float]) -> Float:
    """Add up the sounds of notes.

    Parameters
    ----------
    notes : :class:`kernels.music.notes.Notes`
    sample_rate_hz : int, >= 8000
    voices : 16, one for each family of eight programs
    kit : sound of each percussion key, (n,) float each
        Keys that are missing are silent.

    Returns
    -------
    (n,) float64
        From 0 s to 1.5 s after the last note ends; no samples without notes.

    Raises
    ------
    ValueError
        If the rate is below 8000 or the voices are not 16.
    """
    if sample_rate_hz < 8000:
        raise ValueError(f"sample_rate_hz: want >= 8000, got {sample_rate_hz}")
    if len(voices) != 16:
        raise ValueError(f"voices: want 16, got {len(voices)}")
    if len(notes.start_s) == 0:
        return np.zeros(0)
    mix = np.zeros(int((notes.end_s + TAIL_S) * sample_rate_hz) + 1)
    tables: dict[tuple[int, int], Float] = {}
    for i in range(len(notes.start_s)):
        key = int(notes.key_number[i])
        start = round(float(notes.start_s[i]) * sample_rate_hz)
        loud = (int(notes.velocity[i]) / 127.0) ** 1.5
        if notes.channel_number[i] == DRUM_CHANNEL_NUMBER:
            if key not in kit:
                continue
            sound = kit[key]
        else:
            family = int(notes.program_number[i]) // 8
            frequency_hz = 440.0 * 2.0 ** ((key - 69) / 12.0)
            n_harmonics = int(np.clip(0.45 * sample_rate_hz / frequency_hz, 1, N_HARMONICS))
            if (family, n_harmonics) not in tables:
                tables[family, n_harmonics] = _wave_table(voices[family], n_harmonics)
            table = tables[family, n_harmonics]
            sound = _tone(voices[family], table, frequency_hz, float(notes.duration_s[i]), sample_rate_hz)
        end = min(start + len(sound), len(mix))
        mix[start:end] += loud * sound[: end - start]
    return mix


def drum_sound(recipe: DrumRecipe, sample_rate_hz: int, rng: np.random.Generator) -> Float:
    """Make the sound of a percussion instrument.

    Parameters
    ----------
    recipe : :class:`DrumRecipe`
    sample_rate_hz : int, > 0
    rng : numpy.random.Generator
        Of the noise.

    Returns
    -------
    (n,) float64, loudest in its first milliseconds
    """
    n = int(sample_rate_hz * min(6.0 * max(recipe.ring_s, recipe.noise_s), TAIL_S))
    t = np.arange(n) / sample_rate_hz
    sound = np.zeros(n)
    if recipe.ring_s > 0:
        phase = 2 * np.pi * recipe.pitch_hz * (t + recipe.bend_ratio * 0.03 * (1.0 - np.exp(-t / 0.03)))
        sound += (np.sin(phase) + recipe.second_ratio * np.sin(1.48 * phase)) * np.exp(-t / recipe.ring_s)
    if recipe.noise_s > 0:
        noise = rng.standard_normal(n)
        hiss = np.diff(noise, prepend=0.0)
        colour = recipe.brightness * hiss + (1.0 - recipe.brightness) * noise
        sound += 0.35 * colour * np.exp(-t / recipe.noise_s)
    fade = np.minimum(np.arange(n)[::-1] / (0.005 * sample_rate_hz), 1.0)
    return np.asarray(sound * fade, np.float64)


def _wave_table(voice: Voice, n_harmonics: int) -> Float:
    """Make one cycle of a voice, (TABLE_SIZE,), peak 1; harmonics start at scattered phases to keep peaks low."""
    cycle = np.arange(TABLE_SIZE) / TABLE_SIZE
    wave = np.zeros(TABLE_SIZE)
    for k in range(1, n_harmonics + 1):
        amplitude = k**-voice.rolloff * (voice.even_ratio if k % 2 == 0 else 1.0)
        wave += amplitude * np.sin(2 * np.pi * (k * cycle + 0.19 * (k - 1) ** 2))
    return np.asarray(wave / np.abs(wave).max(), np.float64)


def _tone(voice: Voice, table: Float, frequency_hz: float, duration_s: float, rate_hz: int) -> Float:
    """Play a wave table under the voice's envelope."""
    held = max(duration_s, 0.03)
    n = int((held + 3.0 * voice.release_s) * rate_hz)
    sample = np.arange(n)
    t = sample / rate_hz
    wave = table[(sample * (frequency_hz / rate_hz * TABLE_SIZE)).astype(np.int64) & (TABLE_SIZE - 1)]
    level = voice.sustain_ratio + (1.0 - voice.sustain_ratio) * np.exp(-t / voice.decay_s)
    level *= np.minimum(t / voice.attack_s, 1.0)
    off = int(held * rate_hz)
    level[off:] *= np.exp(-(t[off:] - held) / voice.release_s)
    return np.asarray(0.25 * voice.gain * wave * level, np.float64)
