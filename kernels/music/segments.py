"""Where a song's phrases begin: spans of a few beats, each danced with one piece of one clip.

Boundaries are looked for where the music before differs from the music after [Foote2000], on beats, best on the first
of a bar; between them a song is cut every 4 or 8 beats. One dynamic program weighs both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kernels.motion.motion_features import FEATURE_RATE_HZ
from kernels.music.harmony import key_levels
from kernels.music.onsets import FRAME_RATE_HZ, Samples, band_levels
from kernels.types import Float, Int

LONGEST_S = 8.0
"""No segment is longer: eight seconds are 960 values of a feature. Chosen for time, by hand."""

SHORTEST_S = 1.5
"""Shorter segments cost as much as the highest novelty. Chosen by hand."""

WANTED_S = 4.0
"""Segments of 8 beats where those are nearer to this, else of 4. Chosen as about a gesture phrase, and short enough for
clips of five seconds to be tried at every scale."""

KERNEL_BEATS = 8
"""Beats before and after that novelty [Foote2000] compares. Chosen by hand: two bars of four."""

NOVELTY_WEIGHT, OFF_BAR, OFF_LENGTH = 1.0, 0.7, 1.0
"""Gain of the highest novelty, and prices of a cut that is not on the first beat of a bar and of each doubling of the
wanted length. Chosen by hand."""


@dataclass(frozen=True, eq=False)
class Segments:
    """Spans of a song that follow each other without gaps, (S,) each.

    Parameters
    ----------
    start_s, end_s : float64, seconds
        Cut at beats; the first starts at 0, the last ends with the song.
    start_frame_index, frame_count : int64, at 120 Hz
        A segment is frames [start, start + count).
    novelty : float64, 0 to 1
        How much the music changes at the start, against its largest change.
    """

    start_s: Float
    end_s: Float
    start_frame_index: Int
    frame_count: Int
    novelty: Float


def beat_features(samples: Samples, sample_rate_hz: float, *, grid_s: Float) -> Float:
    """Average timbre and harmony between beats.

    Parameters
    ----------
    samples : (n,) or (n, C) float
    sample_rate_hz : float, > 0
    grid_s : (K + 1,) float, seconds, increasing

    Returns
    -------
    (K, D) float64
        Levels of mel bands in groups of five and of pitch classes, each group centred over the song and scaled to the
        same spread; zeros in silence.

    Raises
    ------
    ValueError
        If a shape, a sample or the rate does not fit.
    """
    level, _ = band_levels(samples, sample_rate_hz)
    keys = key_levels(samples, sample_rate_hz, frame_rate_hz=FRAME_RATE_HZ / 2)
    timbre = _between(level, grid_s, FRAME_RATE_HZ)
    timbre = np.stack([part.mean(axis=1) for part in np.array_split(timbre, max(timbre.shape[1] // 5, 1), axis=1)], 1)
    chroma = _between(keys.reshape(len(keys), -1, 12).sum(axis=1), grid_s, FRAME_RATE_HZ / 2)
    return np.concatenate([_same_spread(timbre), _same_spread(chroma)], axis=1)


def _between(values: Float, grid_s: Float, rate_hz: float) -> Float:
    """Mean of the frames between neighbouring beats, (K, D); the nearest frame where there is none between."""
    if len(values) == 0:
        return np.zeros((max(len(grid_s) - 1, 0), values.shape[1]))
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    edge = np.clip(np.rint(grid_s * rate_hz).astype(np.int64), 0, len(values) - 1)
    after = np.maximum(edge[1:], edge[:-1] + 1)
    return np.asarray((total[after] - total[edge[:-1]]) / (after - edge[:-1])[:, None], np.float64)


def _same_spread(values: Float) -> Float:
    centred = values - values.mean(axis=0) if len(values) else values
    spread = float(np.sqrt((centred**2).sum(axis=1).mean())) if len(values) else 0.0
    return centred / spread if spread > 1e-9 else np.zeros_like(centred)


def novelty(feature: Float, *, reach: int = KERNEL_BEATS) -> Float:
    """Measure how much the music after each beat differs from that before, by a tapered checkerboard kernel.

    Parameters
    ----------
    feature : (K, D) float, one row a beat interval
    reach : int, >= 1, beats on either side

    Returns
    -------
    (K + 1,) float64, 0 to 1, for every boundary between intervals and both ends
        Rises only, against the largest; 0 at the ends, and throughout where nothing changes.

    Notes
    -----
    Likeness is minus the distance, not the cosine: a loud and a quiet verse of one timbre differ.
    """
    k = len(feature)
    out = np.zeros(k + 1)
    if k < 2:
        return out
    for i in range(1, k):
        n = min(reach, i, k - i)
        taper = np.exp(-0.5 * ((np.arange(n) + 0.5) / (reach / 2)) ** 2)
        rows = np.arange(i - n, i + n)
        part = np.linalg.norm(feature[rows][:, None] - feature[rows][None, :], axis=-1)
        before, after = taper[::-1], taper
        across = before @ part[:n, n:] @ after
        within = (before @ part[:n, :n] @ before + after @ part[n:, n:] @ after) / 2
        out[i] = max(across - within, 0.0)
    largest = float(out.max())
    return out / largest if largest > 1e-9 else out


def cut_song(
    grid_s: Float, *, duration_s: float, beat_in_bar_number: Int, change: Float, longest_s: float = LONGEST_S
) -> Segments:
    """Cut a song into segments.

    Parameters
    ----------
    grid_s : (K + 1,) float, seconds, strictly increasing, the first at or before 0 and the last at or after the end
        Beats over the whole song, :func:`kernels.assembly.timing.cover`.
    duration_s : float, seconds, > 0
    beat_in_bar_number : (K + 1,) int, 1 on the first of a bar, 0 where not known
    change : (K + 1,) float, 0 to 1, of :func:`novelty`
    longest_s : float, seconds, > 0, at most 8

    Returns
    -------
    Segments
        Of at least one; where two neighbouring beats lie further apart than ``longest_s`` the time between is cut
        evenly.

    Raises
    ------
    ValueError
        If shapes differ, the grid does not cover the song, or a length is not as wanted.
    """
    if not (duration_s > 0 and 0 < longest_s <= LONGEST_S):
        raise ValueError(f"duration_s, longest_s: want > 0 and at most {LONGEST_S:g}, got {duration_s}, {longest_s}")
    if len(grid_s) < 2 or grid_s[0] > 1e-6 or grid_s[-1] < duration_s - 1e-6 or not (np.diff(grid_s) > 0).all():
        raise ValueError("grid_s: want rising beats from 0 to the end of the song; extend them first")
    if not len(beat_in_bar_number) == len(change) == len(grid_s):
        raise ValueError(f"want {len(grid_s)} places and changes, got {len(beat_in_bar_number)} and {len(change)}")
    place, number, new = _filled(grid_s, beat_in_bar_number, change, duration_s, longest_s - 1.0 / FEATURE_RATE_HZ)
    wanted = _wanted_beats(grid_s, beat_in_bar_number)
    cuts = _best_cuts(place, number, new, wanted, longest_s - 1.0 / FEATURE_RATE_HZ)
    start_s, end_s = place[cuts[:-1]], place[cuts[1:]]
    n_frames = int(np.floor(duration_s * FEATURE_RATE_HZ + 1e-6)) + 1
    edge = np.append(np.rint(start_s * FEATURE_RATE_HZ).astype(np.int64), n_frames)
    return Segments(start_s, end_s, edge[:-1], np.diff(edge), new[cuts[:-1]])


def _filled(grid_s: Float, number: Int, change: Float, duration_s: float, longest_s: float) -> tuple[Float, Int, Float]:
    """Places where a song may be cut: its ends, the beats between, and even parts of what is too long."""
    inside = (grid_s > 0.05) & (grid_s < duration_s - 0.05)
    place = np.concatenate([[0.0], grid_s[inside], [duration_s]])
    beat = np.concatenate([number[:1], number[inside], [0]])
    new = np.concatenate([[0.0], change[inside], [0.0]])
    parts = [np.arange(n) / n for n in np.maximum(np.ceil(np.diff(place) / longest_s - 1e-9).astype(int), 1)]
    filled = np.concatenate(
        [*(a + part * (b - a) for a, b, part in zip(place[:-1], place[1:], parts, strict=True)), place[-1:]]
    )
    is_first = np.append(np.concatenate([part == 0 for part in parts]), True)
    beats, news = np.zeros(len(filled), np.int64), np.zeros(len(filled))
    beats[is_first], news[is_first] = beat, new
    return filled, beats, news


def _wanted_beats(grid_s: Float, number: Int) -> int:
    """4 or 8 beats, or as many bars of another metre: whichever lasts nearer to what is wanted."""
    beat_s = float(np.median(np.diff(grid_s)))
    metre = int(number.max(initial=0)) or 4
    bar = metre if metre in (3, 5, 6, 7) else 4
    choices = [bar, 2 * bar] if bar >= 4 else [bar, 2 * bar, 4 * bar]
    return min(choices, key=lambda n: abs(np.log(n * beat_s / WANTED_S)))


def _best_cuts(place: Float, number: Int, change: Float, wanted: int, longest_s: float) -> list[int]:
    """Choose cuts by a dynamic program: changes of the music gained, odd lengths and cuts within bars paid."""
    n = len(place)
    has_bars = bool((number == 1).any())
    gain = NOVELTY_WEIGHT * change - np.where(has_bars & (number != 1), OFF_BAR, 0.0)
    best, before = np.full(n, -np.inf), np.zeros(n, np.int64)
    best[0] = 0.0
    for j in range(1, n):
        low = int(np.searchsorted(place, place[j] - longest_s - 1e-9))
        low = min(low, j - 1)
        from_ = np.arange(low, j)
        beats = j - from_
        price = OFF_LENGTH * np.abs(np.log2(beats / wanted)) + np.where(place[j] - place[from_] < SHORTEST_S, 1.0, 0.0)
        price += np.where(np.isin(beats, (wanted, wanted // 2, 2 * wanted)), 0.0, 0.3)
        total = best[from_] - price
        at = int(np.argmax(total))
        best[j], before[j] = total[at] + (gain[j] if j < n - 1 else 0.0), from_[at]
    cuts = [n - 1]
    while cuts[-1] > 0:
        cuts.append(int(before[cuts[-1]]))
    return cuts[::-1]
