"""Sound for training the pulse network: made-up songs through random instruments and rooms, and sounds without pulse.

``python benchmarks/pulse_songs.py SEED COUNT OUT.npz`` writes the features of COUNT half-minutes of music and of a
tenth as many without pulse, with their beats. Nothing in them is recorded: notes come from
``kernels.synthetic.arrangement``, sounds from ``kernels.music.preview``.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kernels.music.harmony import harmony_changes, key_levels
from kernels.music.notes import DRUM_CHANNEL_NUMBER, Notes
from kernels.music.onsets import band_levels
from kernels.music.preview import DRUMS, VOICES, Voice, drum_sound, play
from kernels.music.pulse import PULSE_RATE_HZ, pulse_features
from kernels.synthetic.arrangement import BASS_CHANNEL, CHORD_CHANNEL, MELODY_CHANNEL, Arrangement, arrange

Float = NDArray[np.float64]
Rng = np.random.Generator

RATE_HZ = 22050
LENGTH_S = 30.0
N_FRAMES = int(LENGTH_S * PULSE_RATE_HZ)
DISTORTED_PROGRAMS = (29, 30)


def log_uniform(rng: Rng, low: float, high: float) -> float:
    """Draw a positive number evenly in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def band_sound(rng: Rng, song: Arrangement) -> Float:
    """Play a song on instruments of chance, mix and master it; (n,) at RATE_HZ, peak 1."""
    voices = [_random_voice(rng, voice) for voice in VOICES]
    kit = _random_kit(rng)
    n = int((max(song.notes.end_s, float(song.beats.time_s[-1])) + 2.0) * RATE_HZ)
    mix = np.zeros(n)
    gains = {
        DRUM_CHANNEL_NUMBER: 1.0,
        BASS_CHANNEL: log_uniform(rng, 0.3, 1.5),
        CHORD_CHANNEL: log_uniform(rng, 0.1, 1.2),
        MELODY_CHANNEL: log_uniform(rng, 0.15, 1.5),
    }
    for channel, gain in gains.items():
        part = _only(song.notes, channel)
        if len(part.start_s) == 0:
            continue
        sound = play(part, sample_rate_hz=RATE_HZ, voices=voices, kit=kit)
        sound /= _loudness(sound)
        if channel == CHORD_CHANNEL and (part.program_number[0] in DISTORTED_PROGRAMS or rng.random() < 0.1):
            sound = np.tanh(sound * log_uniform(rng, 1.0, 8.0))
            sound /= _loudness(sound)
        m = min(len(sound), n)
        mix[:m] += 0.1 * gain * sound[:m]
    if rng.random() < 0.25:
        for _ in range(int(LENGTH_S * rng.uniform(0.3, 2.0))):  # breath and consonants, out of time
            length = int(log_uniform(rng, 0.04, 0.3) * RATE_HZ)
            at = int(rng.uniform(0, n - length))
            mix[at : at + length] += log_uniform(rng, 0.01, 0.15) * rng.standard_normal(length) * np.hanning(length)
    if rng.random() < 0.6:
        mix = mix + rng.uniform(0.0, 0.7) * _room(rng, mix)
    mix = _equalized(rng, mix)
    mix /= _loudness(mix)
    if rng.random() < 0.6:
        mix = np.tanh(mix * log_uniform(rng, 0.2, 2.0))
    mix /= np.abs(mix).max() + 1e-9
    return np.asarray(mix + rng.standard_normal(n) * 10 ** (rng.uniform(-80, -35) / 20), np.float64)


def pulseless_sound(rng: Rng) -> Float:
    """Make half a minute without pulse: coloured noise, scattered blips, drones, mumbling; (n,) at RATE_HZ."""
    n = int(LENGTH_S * RATE_HZ)
    t = np.arange(n) / RATE_HZ
    sound = np.zeros(n)
    kind = int(rng.integers(5))
    if kind in (0, 1):
        hz = np.maximum(np.fft.rfftfreq(n, 1 / RATE_HZ), 20.0)
        sound += np.fft.irfft(np.fft.rfft(rng.standard_normal(n)) * hz ** -float(rng.choice([0.0, 0.5, 1.0])), n)
        sound *= 1.0 + 0.5 * np.sin(2 * np.pi * rng.uniform(0.02, 0.3) * t)
    if kind in (1, 2):
        for _ in range(int(rng.integers(3, 80))):
            length = int(log_uniform(rng, 0.003, 0.3) * RATE_HZ)
            at = int(rng.uniform(0, n - length))
            blip = np.sin(2 * np.pi * log_uniform(rng, 60, 5000) * t[:length]) * np.exp(
                -4.0 * np.arange(length) / length
            )
            sound[at : at + length] += log_uniform(rng, 0.2, 5.0) * (sound.std() + 1e-3) * blip
    if kind == 3:
        for _ in range(int(rng.integers(1, 6))):
            tone = np.sin(2 * np.pi * log_uniform(rng, 50, 2000) * t + rng.uniform(0, 6))
            sound += tone * (1.0 + 0.3 * np.sin(2 * np.pi * rng.uniform(0.05, 0.5) * t))
    if kind == 4:
        at_s = 0.0
        while at_s < LENGTH_S - 2:
            length, at = int(rng.uniform(0.05, 0.6) * RATE_HZ), int(at_s * RATE_HZ)
            hz = log_uniform(rng, 80, 400) * (1.0 + rng.uniform(-0.2, 0.2) * t[:length])
            voiced = np.sin(2 * np.pi * hz * t[:length]) + 0.2 * rng.random() * rng.standard_normal(length)
            sound[at : at + length] += np.hanning(length) * voiced
            at_s += rng.uniform(0.05, 1.5)
    sound /= np.abs(sound).max() + 1e-9
    return np.asarray(sound * log_uniform(rng, 0.05, 1.0) + 1e-4 * rng.standard_normal(n), np.float64)


def features(sound: Float) -> NDArray[np.float16]:
    """Describe half a minute for the network, (N_FRAMES, 16)."""
    level, centre_hz = band_levels(sound, RATE_HZ)
    keys = key_levels(sound, RATE_HZ, frame_rate_hz=PULSE_RATE_HZ)
    described = pulse_features(level, centre_hz, harmony_changes(keys, frame_rate_hz=PULSE_RATE_HZ))[:N_FRAMES]
    padded = np.zeros((N_FRAMES, described.shape[1]), np.float16)
    padded[: len(described)] = described
    return padded


def example(rng: Rng) -> tuple[NDArray[np.float16], Float, Float]:
    """Make one song: features, seconds of its beats, seconds of its downbeats."""
    song = arrange(rng, duration_s=LENGTH_S + 2.0)
    sound = band_sound(rng, song)
    cut = int(rng.uniform(0.0, 4.0) * RATE_HZ) if rng.random() < 0.7 else 0
    sound = sound[cut : cut + int(LENGTH_S * RATE_HZ)]
    beat_s = song.beats.time_s - cut / RATE_HZ
    inside = (beat_s >= 0) & (beat_s < len(sound) / RATE_HZ)
    return features(sound), beat_s[inside], beat_s[inside & (song.beats.beat_in_bar_number == 1)]


def _only(notes: Notes, channel: int) -> Notes:
    """Keep the notes of one channel."""
    kept = notes.channel_number == channel
    return Notes(
        notes.start_s[kept],
        notes.duration_s[kept],
        notes.key_number[kept],
        notes.velocity[kept],
        notes.channel_number[kept],
        notes.program_number[kept],
    )


def _loudness(sound: Float) -> float:
    return float(np.sqrt((sound**2).mean())) + 1e-9


def _random_voice(rng: Rng, voice: Voice) -> Voice:
    return Voice(
        rolloff=max(voice.rolloff * log_uniform(rng, 0.6, 1.5), 0.3),
        even_ratio=voice.even_ratio,
        attack_s=voice.attack_s * log_uniform(rng, 0.5, 2.5),
        decay_s=voice.decay_s * log_uniform(rng, 0.5, 2.0),
        sustain_ratio=min(voice.sustain_ratio * log_uniform(rng, 0.7, 1.4), 1.0),
        release_s=voice.release_s * log_uniform(rng, 0.5, 2.0),
        gain=1.0,
    )


def _random_kit(rng: Rng) -> dict[int, Float]:
    kit = {}
    for keys, recipe in DRUMS:
        gain = log_uniform(rng, 0.5, 2.0)
        changed = replace(
            recipe,
            pitch_hz=recipe.pitch_hz * log_uniform(rng, 0.75, 1.35),
            bend_ratio=recipe.bend_ratio * log_uniform(rng, 0.4, 1.6),
            ring_s=recipe.ring_s * log_uniform(rng, 0.5, 2.0),
            noise_s=recipe.noise_s * log_uniform(rng, 0.5, 2.2),
            brightness=float(np.clip(recipe.brightness + rng.uniform(-0.3, 0.3), 0.0, 1.0)),
        )
        for key in keys:
            kit[key] = gain * drum_sound(changed, RATE_HZ, rng)
    return kit


def _equalized(rng: Rng, sound: Float) -> Float:
    """Tilt, bend and cut the spectrum."""
    n = 1 << (len(sound) - 1).bit_length()
    hz = np.fft.rfftfreq(n, 1 / RATE_HZ)
    octave = np.log2(np.maximum(hz, 20.0) / 1000.0)
    gain_db = rng.uniform(-1.5, 1.5) * octave
    for _ in range(2):
        gain_db = gain_db + rng.uniform(-9, 9) * np.exp(
            -0.5 * ((octave - rng.uniform(-5, 3)) / rng.uniform(0.5, 1.5)) ** 2
        )
    if rng.random() < 0.25:
        gain_db = gain_db - 24.0 * np.log2(np.maximum(hz / log_uniform(rng, 3000, 9000), 1.0))
    if rng.random() < 0.2:
        gain_db = gain_db - 18.0 * np.log2(np.maximum(log_uniform(rng, 60, 180) / np.maximum(hz, 20.0), 1.0))
    return np.asarray(np.fft.irfft(np.fft.rfft(sound, n) * 10 ** (gain_db / 20), n)[: len(sound)], np.float64)


def _room(rng: Rng, sound: Float) -> Float:
    """Reverberate in decaying noise."""
    t = np.arange(int(1.2 * RATE_HZ)) / RATE_HZ
    response = rng.standard_normal(len(t)) * np.exp(-t / log_uniform(rng, 0.05, 0.4))
    response[: int(RATE_HZ * rng.uniform(0.002, 0.03))] = 0.0
    response /= np.sqrt((response**2).sum())
    n = 1 << (len(sound) + len(response) - 1).bit_length()
    return np.asarray(np.fft.irfft(np.fft.rfft(sound, n) * np.fft.rfft(response, n), n)[: len(sound)], np.float64)


def main() -> None:
    """Make and save."""
    seed, count, out = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
    described, beat_s, down_s = [], [], []
    for i in range(count):
        x, beats, downs = example(np.random.default_rng([seed, i]))
        described.append(x)
        beat_s.append(beats)
        down_s.append(downs)
        if i % 100 == 99:
            print(i + 1, flush=True)
    for i in range(count // 10):
        described.append(features(pulseless_sound(np.random.default_rng([seed, count + i]))))
        beat_s.append(np.zeros(0))
        down_s.append(np.zeros(0))
    np.savez(
        out,
        features=np.array(described),
        beat_s=np.concatenate(beat_s),
        beat_count=np.array([len(b) for b in beat_s]),
        down_s=np.concatenate(down_s),
        down_count=np.array([len(d) for d in down_s]),
    )


if __name__ == "__main__":
    main()
