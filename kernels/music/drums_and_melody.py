"""What is heard of a song beside its beats: drums as General MIDI names them, bands of onsets, the way a melody goes.

After [Kameda2009]: the 47 percussion sounds of General MIDI [MMA1991] are the symbols that a model of dancing emits.
Audio has no such names: its onsets are told apart by band, and a band stands for the drums that sound in it.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
import scipy

from kernels.music.notes import Notes
from kernels.music.onsets import FRAME_RATE_HZ, Samples, band_levels, flux
from kernels.types import Float, Int

FIRST_KEY, LAST_KEY = 35, 81
N_KEYS = LAST_KEY - FIRST_KEY + 1
"""Percussion keys of General MIDI [MMA1991]: 47 symbols, as in [Kameda2009]."""

NEAREST_KEY: dict[int, int] = {
    22: 42,  # edge of the closed hi-hat, electronic kits
    26: 46,  # edge of the open hi-hat
    24: 38,
    25: 38,  # snare roll
    27: 76,
    28: 39,  # slap
    29: 73,
    30: 73,  # scratches
    31: 37,  # sticks
    32: 37,
    33: 37,
    34: 53,  # clicks and the bell of a metronome
    82: 70,  # shaker
    83: 54,  # jingle bells
    84: 81,  # bell tree
    85: 75,  # castanets
    86: 41,
    87: 41,  # surdo
}
"""Percussion keys beyond General MIDI that kits use, and the sounds of it nearest to them. Chosen by hand, by what they
are called."""

KIT_KEYS = frozenset({22, 26, 36, 37, 38, 40, 42, 43, 44, 45, 46, 47, 48, 49, 50, 51, 52, 53, 55, 57, 58, 59})
"""Pads of an electronic kit, by convention of its makers; 58 is the rim of its third tom there, a vibraslap in General
MIDI."""

RIM_KEY, RIM_SOUND = 58, 43
"""That rim, and the tom of General MIDI it belongs to, by convention of the same kits."""

LOW, MIDDLE, HIGH = 36, 38, 42
"""Bass drum, snare and hi-hat [MMA1991] stand for the bands that audio is heard in."""

LOW_KEYS = frozenset({35, 36, 41, 43, 45, 64, 66})
HIGH_KEYS = frozenset({42, 44, 46, 49, 51, 52, 53, 54, 55, 57, 59, 69, 70, 71, 72, 74, 80, 81})
"""Which keys sound low and which high; the others are in the middle. Chosen by hand, by what they are called."""

BAND_OF_KEY: Int = np.array(
    [LOW if k in LOW_KEYS else HIGH if k in HIGH_KEYS else MIDDLE for k in range(FIRST_KEY, LAST_KEY + 1)], np.int64
)
BANDS_HZ: dict[int, tuple[float, float]] = {LOW: (0.0, 150.0), MIDDLE: (200.0, 2500.0), HIGH: (5000.0, 20000.0)}
"""Where audio is heard as each. Chosen by hand."""

CONTOUR = ("leap down", "step down", "same", "step up", "leap up")
"""How a melody goes from one note to the next: a leap is more than four semitones."""

LARGEST_STEP = 4
"""Semitones. Chosen by hand: a major third is a step yet."""

ONSET_WINDOW_S, LEAST_RISE = 0.1, 0.08
"""How near two onsets of a band may be, and its least rise in log level. Chosen by hand."""


@dataclass(frozen=True, eq=False)
class Hits:
    """Percussion of a song in order of time, then key; (n,) each.

    Parameters
    ----------
    time_s : float64, seconds
    key_number : int64, 35 to 81
    velocity : int64, 1 to 127
    """

    time_s: Float
    key_number: Int
    velocity: Int


@dataclass(frozen=True, eq=False)
class Drums:
    """Percussion of a MIDI song, and what became of keys that are none of General MIDI's.

    ``mapped`` and ``dropped`` count notes by the key in the file.
    """

    hits: Hits
    mapped: dict[int, int]
    dropped: dict[int, int]


def drum_hits(notes: Notes) -> Drums:
    """Take the percussion out of the notes of a song.

    Parameters
    ----------
    notes : Notes

    Returns
    -------
    Drums
        Empty where channel 10 is. Keys outside 35 to 81 become the nearest sound (:data:`NEAREST_KEY`) or are dropped;
        key 58 is the rim of a tom where nothing but the pads of an electronic kit sounds in the whole file.
    """
    drum = notes.is_drum
    keys = notes.key_number[drum].tolist()
    is_kit = bool(drum.all()) and set(keys) <= KIT_KEYS
    nearest = NEAREST_KEY | ({RIM_KEY: RIM_SOUND} if is_kit else {})
    mapped, dropped = Counter[int](), Counter[int]()
    rows = []
    for time_s, key, velocity in zip(notes.start_s[drum].tolist(), keys, notes.velocity[drum].tolist(), strict=True):
        sound = nearest.get(key, key)
        if not FIRST_KEY <= sound <= LAST_KEY:
            dropped[key] += 1
            continue
        if sound != key:
            mapped[key] += 1
        rows.append((time_s, sound, velocity))
    return Drums(_hits(rows), dict(sorted(mapped.items())), dict(sorted(dropped.items())))


def _hits(rows: list[tuple[float, int, int]]) -> Hits:
    ordered = sorted(rows)
    return Hits(
        np.array([r[0] for r in ordered], np.float64),
        np.array([r[1] for r in ordered], np.int64),
        np.array([r[2] for r in ordered], np.int64),
    )


def band_hits(samples: Samples, sample_rate_hz: float) -> Hits:
    """Hear onsets in three bands: low as bass drum, middle as snare, high as hi-hat.

    Parameters
    ----------
    samples : (n,) or (n, C) float, -1 to 1
    sample_rate_hz : float, > 0

    Returns
    -------
    Hits
        Peaks of the rise of a band's level that stand out of the second around them; velocity by their size. Empty in
        silence.

    Raises
    ------
    ValueError
        If a shape, a sample or the rate does not fit.
    """
    level, centre_hz = band_levels(samples, sample_rate_hz)
    rows: list[tuple[float, int, int]] = []
    rise = flux(level)
    for key, (lowest_hz, highest_hz) in BANDS_HZ.items():
        inside = (centre_hz >= lowest_hz) & (centre_hz < highest_hz)
        if not inside.any() or not len(rise):
            continue
        curve = rise[:, inside].mean(axis=1)
        around = scipy.ndimage.uniform_filter1d(curve, int(FRAME_RATE_HZ), mode="nearest")
        apart = max(round(ONSET_WINDOW_S * FRAME_RATE_HZ), 1)
        top = float(np.percentile(curve, 99)) if len(curve) else 0.0
        least = np.maximum(2.0 * around, max(0.2 * top, LEAST_RISE))
        peak = scipy.signal.find_peaks(curve, height=least, distance=apart)[0]
        loud = np.clip(np.rint(127 * curve[peak] / max(float(curve.max()), 1e-9)), 1, 127).astype(np.int64)
        rows += [(float(f / FRAME_RATE_HZ), key, int(v)) for f, v in zip(peak, loud, strict=True)]
    return _hits(rows)


@dataclass(frozen=True, eq=False)
class Contour:
    """How the melody goes, note by note, (n,) each.

    Parameters
    ----------
    time_s : float64, seconds, increasing: where the second note of each pair starts
    symbol : int64, index into :data:`CONTOUR`
    """

    time_s: Float
    symbol: Int


def contour(notes: Notes) -> Contour:
    """Follow the melody of a song: of the notes that start together, the highest; no percussion.

    Parameters
    ----------
    notes : Notes

    Returns
    -------
    Contour
        Empty for fewer than two notes.
    """
    tune = ~notes.is_drum
    start, key = notes.start_s[tune], notes.key_number[tune]
    if len(start) < 2:
        return Contour(np.zeros(0), np.zeros(0, np.int64))
    is_new = np.append(True, np.diff(start) > 0.03)
    first = np.flatnonzero(is_new)
    top = np.maximum.reduceat(key, first)
    moved = np.diff(top)
    size = np.where(np.abs(moved) > LARGEST_STEP, 2, 1) * np.sign(moved)
    return Contour(start[first][1:], (size + 2).astype(np.int64))


def heard_in(time_s: Float, symbol: Int, edge_s: Float, n_symbols: int, *, ahead_s: float = 0.0) -> Float:
    """Count which symbols sound in which interval.

    Parameters
    ----------
    time_s : (n,) float, seconds
    symbol : (n,) int64, 0 to n_symbols - 1
    edge_s : (K + 1,) float, seconds, increasing
    n_symbols : int, M
    ahead_s : float, seconds, >= 0
        Every interval begins and ends so much earlier: what sounds on its first beat, or just before it by a
        drummer's haste, is its own and not the one's before.

    Returns
    -------
    (K, M) float64, how often; what lies outside the edges is left out
    """
    counts = np.zeros((max(len(edge_s) - 1, 0), n_symbols))
    at = np.searchsorted(edge_s - ahead_s, time_s, side="right") - 1
    inside = (at >= 0) & (at < len(counts))
    np.add.at(counts, (at[inside], symbol[inside]), 1.0)
    return counts


def loudest_in(hits: Hits, edge_s: Float, *, ahead_s: float = 0.0) -> Float:
    """Keep one symbol an interval, as [Kameda2009] has it: the loudest, of equals the lowest key.

    Parameters
    ----------
    hits : Hits
    edge_s : (K + 1,) float, seconds, increasing
    ahead_s : float, seconds, see :func:`heard_in`

    Returns
    -------
    (K, 47) float64, one 1 a row, none where nothing sounds
    """
    counts = np.zeros((max(len(edge_s) - 1, 0), N_KEYS))
    at = np.searchsorted(edge_s - ahead_s, hits.time_s, side="right") - 1
    order = np.lexsort((hits.key_number, -hits.velocity, at))
    order = order[(at[order] >= 0) & (at[order] < len(counts))]
    interval, first = np.unique(at[order], return_index=True)
    counts[interval, hits.key_number[order[first]] - FIRST_KEY] = 1.0
    return counts


def spread_bands(counts: Float) -> Float:
    """Spread what was heard in a band over all its drums alike, (K, 47) to (K, 47): audio has the band alone."""
    out = np.zeros_like(counts)
    for band in (LOW, MIDDLE, HIGH):
        inside = np.equal(BAND_OF_KEY, band)
        out[:, inside] += counts[:, [band - FIRST_KEY]] / inside.sum()
    return out


def banded(log_emission: Float) -> Float:
    """Probabilities of hearing each drum's band, where only bands are heard.

    Parameters
    ----------
    log_emission : (N, 47) float, natural log

    Returns
    -------
    (N, 47) float64, at each key the log probability of all drums of its band together
    """
    out = np.zeros_like(log_emission, np.float64)
    for band in (LOW, MIDDLE, HIGH):
        inside = np.equal(BAND_OF_KEY, band)
        top = log_emission[:, inside].max(axis=1, keepdims=True)
        out[:, inside] = np.log(np.exp(log_emission[:, inside] - top).sum(axis=1, keepdims=True)) + top
    return out
