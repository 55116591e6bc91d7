"""Exactly when sounds start: beats moved to the attacks beside them, to a millisecond or two."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

from kernels.music.onsets import Samples, to_mono

Float = NDArray[np.float64]

STEP_S = 0.002
WINDOW_S = 0.012
N_BANDS = 24
"""Windows an attack is looked for with, and bands of their spectrum. Chosen by hand."""

REACH_S = 0.040
"""How far a beat may move to its attack. Chosen by hand."""

WIDE_REACH_S, NEAR_S, ELSEWHERE_RATIO = 0.080, 0.030, 3.0
"""All beats move by one lag where attacks common to them, looked for so far, are so many times as strong there as so
near to the beats. Chosen by hand, for beeps whose sudden end is heard best."""

TRUST_S = 0.020
"""Standard deviation of where an attack lies about its beat. Chosen by hand."""

SPAN_STEPS = 10
LEAST_GAIN = 0.1
"""Steps before and after over which the sound must grow, and share that an attack keeps where it does not. Chosen by
hand."""

ATTACK_LAG_S = -0.0031
"""How early windows and bands show an attack. Measured on click trains of known times."""

STIFFNESS = 20.0
STRAY_S = 0.012
N_ROUNDS = 4
"""Price of a row's squared third differences, distance at which an attack counts half, and rounds of reweighting.
Chosen by hand; measured on click trains of five sounds, 60 to 180 a minute and ramps, the median error is under 1
ms."""


def attack_strength(samples: Samples, sample_rate_hz: float, centre_s: Float, *, reach_s: float) -> Float:
    """Measure how much sound sets in around given instants.

    Parameters
    ----------
    samples : (n,) or (n, C) float, -1 to 1
    sample_rate_hz : float, > 0
    centre_s : (B,) float, seconds
    reach_s : float, seconds, >= 0

    Returns
    -------
    (B, 2 n + 1) float64, >= 0
        Summed rise of the square roots of 24 bands, up to 10 kHz or half the rate, over 4 ms, in n steps of 2 ms from
        ``reach_s`` before to as much after; less where the sound as a whole does not grow over 20 ms.

    Raises
    ------
    ValueError
        If the samples' shape is another or one is not finite.
    """
    mono = to_mono(samples)
    window = max(round(WINDOW_S * sample_rate_hz), 8)
    n_fft = 1 << (window - 1).bit_length()
    hann = (np.hanning(window + 1)[:-1] / (window / 2)).astype(np.float32)
    bin_hz = np.arange(n_fft // 2 + 1) * (sample_rate_hz / n_fft)
    edge_hz = np.geomspace(60.0, min(10000.0, sample_rate_hz / 2), N_BANDS + 1)
    weight = ((bin_hz[:, None] >= edge_hz[:-1]) & (bin_hz[:, None] < edge_hz[1:])).astype(np.float32)
    n_steps = round(reach_s / STEP_S)
    n_around = n_steps + SPAN_STEPS + 1
    offset_s = np.arange(-n_around, n_around + 1) * STEP_S
    padded = np.pad(mono, (window, 2 * window))
    strength = np.zeros((len(centre_s), 2 * n_steps + 1))
    for i, time_s in enumerate(centre_s):
        start = np.rint((time_s + offset_s) * sample_rate_hz).astype(np.int64) + window - window // 2
        rows = padded[np.clip(start, 0, len(padded) - window)[:, None] + np.arange(window)] * hann
        size = np.abs(np.fft.rfft(rows, n_fft, axis=1)).astype(np.float32)
        level = np.sqrt(size @ weight)
        rise = np.maximum(level[2:] - level[:-2], 0.0).sum(axis=1)[SPAN_STEPS:-SPAN_STEPS]
        # an attack leaves more sound than there was; the click where a tone is cut off leaves less
        power = np.concatenate([[0.0], np.cumsum((size * size).sum(axis=1))])
        here = np.arange(SPAN_STEPS + 1, SPAN_STEPS + 1 + len(rise))
        after = power[here + SPAN_STEPS] - power[here]
        before = power[here] - power[here - SPAN_STEPS]
        grows = np.clip((after - before) / (after + before + 1e-12), 0.0, 1.0)
        strength[i] = rise * (LEAST_GAIN + (1.0 - LEAST_GAIN) * grows)
    return strength


def snap_to_attacks(beat_s: Float, samples: Samples, sample_rate_hz: float) -> Float:
    """Move beats to the attacks beside them, keeping the tempo smooth.

    Parameters
    ----------
    beat_s : (B,) float, seconds, increasing
    samples : (n,) or (n, C) float, -1 to 1
    sample_rate_hz : float, > 0

    Returns
    -------
    (B,) float64, seconds, increasing
        Fewer than four beats come back as they are, and so do all where the result would not increase.

    Notes
    -----
    Each beat is drawn to the strongest attack within 40 ms, nearer ones preferred, by how much it stands out of its
    surroundings; the third difference of the beats is held small, which
    leaves a steady change of tempo free; attacks that stray from the line so found lose
    their pull (iteratively reweighted least squares).
    """
    given_s = np.asarray(beat_s, np.float64)
    n = len(given_s)
    if n < 4:
        return given_s
    beat_s = given_s + _common_lag(given_s, samples, sample_rate_hz)
    strength = attack_strength(samples, sample_rate_hz, beat_s, reach_s=REACH_S)
    offset_s = (np.arange(strength.shape[1]) - strength.shape[1] // 2) * STEP_S
    near = strength * np.exp(-0.5 * (offset_s / TRUST_S) ** 2)
    best = np.argmax(near[:, 1:-1], axis=1) + 1
    row = np.arange(n)
    before, here, after = strength[row, best - 1], strength[row, best], strength[row, best + 1]
    bend = before - 2.0 * here + after
    part = np.where(bend < -1e-9, 0.5 * (before - after) / np.minimum(bend, -1e-9), 0.0)
    stands_out = here - np.median(strength, axis=1)
    typical = float(np.median(stands_out[stands_out > 0])) if (stands_out > 0).any() else 1.0
    pull = np.clip(stands_out / typical, 0.0, 2.0)
    found_s = beat_s + offset_s[best] + np.clip(part, -0.5, 0.5) * STEP_S - ATTACK_LAG_S
    attack_s = np.where(stands_out > 0, found_s, beat_s)
    line = np.asarray(beat_s, np.float64)
    for _ in range(N_ROUNDS):
        weight = pull / (1.0 + ((attack_s - line) / STRAY_S) ** 2) + 1e-3
        line = _smooth(attack_s, weight)
    return line if (np.diff(line) > 0).all() else given_s


def _common_lag(beat_s: Float, samples: Samples, sample_rate_hz: float) -> float:
    """Find out whether the attacks lie off all beats by one lag, in seconds, as with beeps whose end is heard best."""
    strength = attack_strength(samples, sample_rate_hz, beat_s, reach_s=WIDE_REACH_S)
    largest = strength.max(axis=1, keepdims=True)
    common = (strength / np.maximum(largest, 1e-12)).mean(axis=0)
    middle, near = len(common) // 2, round(NEAR_S / STEP_S)
    best = int(common.argmax())
    is_elsewhere = common[best] > ELSEWHERE_RATIO * common[middle - near : middle + near + 1].max()
    return (best - middle) * STEP_S if is_elsewhere else 0.0


def _smooth(value: Float, weight: Float) -> Float:
    """Minimise the weighted squared distance plus STIFFNESS times the squared third differences; B >= 4."""
    n = len(value)
    coefficient = np.array([-1.0, 3.0, -3.0, 1.0])
    band = np.zeros((4, n))  # upper form: band[3 - k, i] couples i - k and i
    band[3] = weight
    for i in range(4):
        for k in range(4 - i):
            band[3 - k, i + k : n - 3 + i + k] += STIFFNESS * coefficient[i] * coefficient[i + k]
    return np.asarray(solveh_banded(band, weight * value), np.float64)
