"""Where the harmony of a song changes: levels of semitones, and how they differ before and after each instant."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kernels.music.onsets import FRAMES_AT_ONCE, Samples, to_mono

Float = NDArray[np.float64]

WINDOW_S = 0.1857
"""8192 samples at 44.1 kHz. Chosen by hand."""

LOWEST_KEY, N_KEYS = 33, 60
N_BASS_KEYS = 24
"""MIDI keys from 55 Hz on, five octaves, the lower two of which are bass. Chosen by hand. The weights of the pulse
network hold for these alone."""

BEFORE_AFTER_S = (0.3, 0.8)
"""Spans before and after an instant that are compared. Chosen by hand; the weights hold for these alone."""


def key_levels(samples: Samples, sample_rate_hz: float, *, frame_rate_hz: float) -> Float:
    """Measure log levels of semitones.

    Parameters
    ----------
    samples : (n,) or (n, C) float, -1 to 1
    sample_rate_hz : float, > 0
    frame_rate_hz : float, > 0

    Returns
    -------
    (F, 60) float64, >= 0, F = floor(n / rate * frame_rate) + 1, or 0 for no samples
        Keys 33 (55 Hz) to 92 (1661 Hz); those above the Nyquist frequency are 0.

    Raises
    ------
    ValueError
        If a shape, a sample or a rate does not fit.
    """
    if not (np.isfinite([sample_rate_hz, frame_rate_hz]).all() and sample_rate_hz > 0 and frame_rate_hz > 0):
        raise ValueError(f"sample_rate_hz, frame_rate_hz: want > 0, got {sample_rate_hz} and {frame_rate_hz}")
    mono = to_mono(samples)
    if len(mono) == 0:
        return np.zeros((0, N_KEYS))
    window = max(round(WINDOW_S * sample_rate_hz), 8)
    n_fft = 1 << (window - 1).bit_length()
    key_hz = 440.0 * 2.0 ** ((np.arange(LOWEST_KEY, LOWEST_KEY + N_KEYS) - 69) / 12.0)
    bin_hz = np.arange(1, n_fft // 2 + 1) * (sample_rate_hz / n_fft)
    # each bin gives to the keys around it by a triangle one semitone wide, or one bin where bins are wider
    off = np.abs(12.0 * np.log2(bin_hz[:, None] / key_hz))
    reach = np.maximum(1.0, 12.0 * np.log2(1.0 + (sample_rate_hz / n_fft) / key_hz))
    weight = np.maximum(1.0 - off / reach, 0.0).astype(np.float32)
    used = int(np.searchsorted(bin_hz, 2.0 * key_hz[-1]))
    n_frames = int(len(mono) / sample_rate_hz * frame_rate_hz) + 1
    start = np.rint(np.arange(n_frames) * (sample_rate_hz / frame_rate_hz)).astype(np.int64)
    padded = np.pad(mono, (window // 2, window))
    hann = (np.hanning(window + 1)[:-1] / (window / 2)).astype(np.float32)
    level = np.zeros((n_frames, N_KEYS))
    for i in range(0, n_frames, FRAMES_AT_ONCE // 2):
        frames = padded[start[i : i + FRAMES_AT_ONCE // 2, None] + np.arange(window)] * hann
        size = np.abs(np.fft.rfft(frames, n_fft, axis=1)[:, 1 : used + 1]).astype(np.float32)
        level[i : i + FRAMES_AT_ONCE // 2] = size @ weight[:used]
    loudest = float(level.max())
    return np.log1p(level * (100.0 / loudest)) if loudest > 1e-5 else np.zeros_like(level)


def harmony_changes(level: Float, *, frame_rate_hz: float) -> Float:
    """Compare the harmony after each instant with the harmony before it.

    Parameters
    ----------
    level : (F, 60) float, >= 0, of :func:`key_levels`
    frame_rate_hz : float, > 0

    Returns
    -------
    (F, 4) float64, 0 to 1
        One minus the cosine between averages after and before: pitch classes over 0.3 s and over 0.8 s, then the
        lowest two octaves over the same spans. 0 in silence.
    """
    folded = level.reshape(len(level), N_KEYS // 12, 12).sum(axis=1)
    out = np.zeros((len(level), 4))
    for i, part in enumerate((folded, level[:, :N_BASS_KEYS])):
        total = np.concatenate([np.zeros((1, part.shape[1])), np.cumsum(part, axis=0)])
        for j, span_s in enumerate(BEFORE_AFTER_S):
            span = max(round(span_s * frame_rate_hz), 1)
            here = np.arange(len(level))
            after = total[np.minimum(here + span, len(level))] - total[here]
            before = total[here] - total[np.maximum(here - span, 0)]
            size = np.linalg.norm(after, axis=1) * np.linalg.norm(before, axis=1)
            alike = np.where(size > 1e-9, (after * before).sum(axis=1) / np.maximum(size, 1e-9), 1.0)
            out[:, 2 * i + j] = np.clip(1.0 - alike, 0.0, 1.0)
    return out
