"""How good a dance is, measured on the finished motion.

Each measure says what is wanted of it. Beat measures use an observer that knows nothing of the plan (minima of joint
speed), and chance is measured on the same dance: raw beat alignment near 0.25 is what chance gives.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kernels.assembly.blend import Dance
from kernels.motion.velocity import kinematic_beats, speed_between
from kernels.ranks import rank_correlation
from kernels.types import Choreography, Float
from kernels.warp import EASY_WARP, HARD_WARP


@dataclass(frozen=True)
class Measure:
    """One figure of a dance: its name ends in its unit; ``is_passed`` is None where it is only reported.

    ``reasons`` are sentences on what is not as wanted: when, and of which clip.
    """

    name: str
    value: float
    wanted: str = ""
    is_passed: bool | None = None
    reasons: tuple[str, ...] = ()


LONGEST_BEAT_S = 20.0
"""Chosen so that no music is refused and milliseconds are: 3 beats a minute, against beats 200 to 2000 apart."""


LATEST_BEAT_S = 30_000.0
"""Latest beat, seconds: the bound that mir_eval has, by convention."""


def check_beats(name: str, time_s: Float) -> None:
    """Refuse times that cannot be beats in seconds.

    Parameters
    ----------
    name : of the argument, for the message
    time_s : (B,) float

    Raises
    ------
    ValueError
        If the shape is another, a time is not finite or negative, times do not rise, or beats lie so far apart that
        milliseconds, samples or frames must be meant.
    """
    if np.ndim(time_s) != 1:
        raise ValueError(f"{name}: want (B,) seconds, got {np.shape(time_s)}")
    if not np.isfinite(time_s).all():
        raise ValueError(f"{name}: want finite seconds, got {time_s[~np.isfinite(time_s)][0]}")
    if len(time_s) and np.min(time_s) < 0:
        raise ValueError(f"{name}: want seconds >= 0, got {np.min(time_s):g}")
    if len(time_s) and np.max(time_s) > LATEST_BEAT_S:
        raise ValueError(f"{name}: want seconds, got a beat at {np.max(time_s):g}; were they given in milliseconds?")
    step_s = np.diff(time_s)
    if not (step_s > 0).all():
        at = int(np.flatnonzero(step_s <= 0)[0])
        raise ValueError(
            f"{name}: want rising times, got {time_s[at]:g} before {time_s[at + 1]:g}; sort them and drop repeats"
        )
    if len(step_s) and np.median(step_s) > LONGEST_BEAT_S:
        raise ValueError(
            f"{name}: want seconds, got beats {np.median(step_s):g} apart; were they given in milliseconds?"
        )


def f_measure(found_s: Float, wanted_s: Float, *, tolerance_s: float = 0.07) -> float:
    """Share of beats met, both ways, one to one: the F-measure of [Davies2009], as mir_eval computes it.

    Parameters
    ----------
    found_s, wanted_s : (n,), (m,) float, seconds, increasing
    tolerance_s : float, seconds

    Returns
    -------
    float, 0 to 1
        0 when either is empty. The greedy walk in order of time is a largest matching on a line.

    Raises
    ------
    ValueError
        If either cannot be beats in seconds, :func:`check_beats`.

    Examples
    --------
    >>> import numpy as np
    >>> from kernels.assembly.quality import f_measure
    >>> f_measure(np.array([0.5, 1.0, 1.5]), np.array([0.52, 1.01, 1.9]))
    0.6666666666666666

    See Also
    --------
    beat_alignment : how near, instead of whether
    beat_measures : of a dance, with the level of chance
    """
    check_beats("found_s", found_s)
    check_beats("wanted_s", wanted_s)
    return _f(found_s, wanted_s, tolerance_s)


def _f(found_s: Float, wanted_s: Float, tolerance_s: float = 0.07) -> float:
    if len(found_s) == 0 or len(wanted_s) == 0:
        return 0.0
    i = j = hits = 0
    while i < len(found_s) and j < len(wanted_s):
        gap = found_s[i] - wanted_s[j]
        if abs(gap) <= tolerance_s + 1e-9:
            i, j, hits = i + 1, j + 1, hits + 1
        elif gap < 0:
            i += 1
        else:
            j += 1
    return 2 * hits / (len(found_s) + len(wanted_s))


def beat_alignment(motion_s: Float, music_s: Float, *, sigma_s: float = 0.05) -> float:
    """Beat alignment score: how near the closest motion beat is to each music beat.

    Mean of exp(-d^2 / 2 sigma^2) over music beats [Siyao2022], in seconds. Chance level for regular beats half a second
    apart is 0.25.

    Parameters
    ----------
    motion_s, music_s : (n,), (m,) float, seconds, increasing
    sigma_s : float, seconds

    Returns
    -------
    float, 0 to 1; 0 when either is empty

    Raises
    ------
    ValueError
        If either cannot be beats in seconds, :func:`check_beats`.

    Examples
    --------
    >>> import numpy as np
    >>> from kernels.assembly.quality import beat_alignment
    >>> beat_alignment(np.array([0.5, 1.0]), np.array([0.5, 1.0, 9.0])).__round__(3)
    0.667

    See Also
    --------
    f_measure : share of beats met
    """
    check_beats("motion_s", motion_s)
    check_beats("music_s", music_s)
    return _aligned(motion_s, music_s, sigma_s)


def _aligned(motion_s: Float, music_s: Float, sigma_s: float = 0.05) -> float:
    if len(motion_s) == 0 or len(music_s) == 0:
        return 0.0
    after = (
        np.clip(np.searchsorted(motion_s, music_s), 1, len(motion_s) - 1)
        if len(motion_s) > 1
        else np.zeros(len(music_s), int)
    )
    near = np.minimum(np.abs(motion_s[after] - music_s), np.abs(motion_s[after - 1] - music_s))
    return float(np.mean(np.exp(-(near**2) / (2 * sigma_s**2))))


def block_shifted(beat_s: Float, duration_s: float, *, rng: np.random.Generator, block_s: float = 4.0) -> Float:
    """Shift every block of beats round itself by its own random amount.

    Keeps how many beats there are and how they follow each other, and destroys where they fall. One shift for the
    whole song would prove nothing: at a steady tempo every whole-beat shift fits again.

    Parameters
    ----------
    beat_s : (B,) float, seconds
    duration_s : float, seconds
    rng : Generator
    block_s : float, seconds

    Returns
    -------
    (B,) float64, seconds, sorted
    """
    block = np.floor(beat_s / block_s).astype(int)
    shift = rng.uniform(0.0, block_s, int(np.ceil(duration_s / block_s)) + 1)
    length = np.minimum(block_s, np.maximum(duration_s - block * block_s, 1e-9))
    return np.sort(block * block_s + np.mod(beat_s - block * block_s + shift[block], length))


def beat_measures(dance: Dance, music_beat_s: Float, *, seed: int = 0, n_shifts: int = 1000) -> list[Measure]:
    """Judge the beats of a dance by an independent observer.

    Parameters
    ----------
    dance : Dance
    music_beat_s : (B,) float, seconds, as heard: not the ones added to cover the song
    seed : int
    n_shifts : int
        Random block shifts that measure chance.

    Returns
    -------
    list of Measure
        Beat F at 70 ms and alignment corrected for chance, each with its chance level and its p-value (share of shifts
        at least as good, counting the dance itself).
    """
    duration_s = float(dance.time_s[-1]) if len(dance.time_s) else 0.0
    moved_s = kinematic_beats(dance.position_xyz_m, dance.frame_rate_hz) / dance.frame_rate_hz
    music_s = music_beat_s[(music_beat_s >= 0) & (music_beat_s <= duration_s)]
    score, f = _aligned(moved_s, music_s), _f(moved_s, music_s)
    rng = np.random.default_rng(seed)
    by_chance = np.zeros((n_shifts, 2))
    if len(moved_s) and len(music_s):
        for i in range(n_shifts):
            shifted_s = block_shifted(moved_s, duration_s, rng=rng)
            by_chance[i] = _aligned(shifted_s, music_s), _f(shifted_s, music_s)
    chance = by_chance[:, 0]
    p, f_p = (
        (1 + int(np.sum(level >= got))) / (1 + n_shifts) for level, got in zip(by_chance.T, (score, f), strict=True)
    )
    mean = float(chance.mean())
    return [
        Measure("beat_f_ratio", f),
        Measure("beat_f_chance_ratio", float(by_chance[:, 1].mean())),
        Measure("beat_f_p_probability", f_p, "below 0.01", f_p < 0.01),
        Measure("beat_alignment_ratio", score),
        Measure("beat_alignment_chance_ratio", mean),
        Measure(
            "beat_alignment_corrected_ratio", (score - mean) / (1 - mean) if mean < 1 else 0.0, "above 0", score > mean
        ),
        Measure("beat_p_probability", p, "below 0.01", p < 0.01),
    ]


def intensity_measures(dance: Dance, music: Float, grid_s: Float) -> list[Measure]:
    """Report whether strong music is danced with much movement: ranks, so that order counts and not size.

    Parameters
    ----------
    dance : Dance
    music : (K,) float, how strong the music is between the beats
    grid_s : (K + 1,) float, seconds, the beats

    Returns
    -------
    list of Measure
        Spearman's rank correlation with the mean speed of the joints between the beats, -1 to 1; 0 where either does
        not change, and for fewer than three intervals inside the dance.
    """
    inside = (grid_s[:-1] >= 0) & (grid_s[1:] <= (dance.time_s[-1] if len(dance.time_s) else 0.0))
    found = 0.0
    if inside.sum() > 2:
        moved = speed_between(dance.position_xyz_m, dance.frame_rate_hz, time_s=np.maximum(grid_s, 0.0))[:-1][inside]
        found = rank_correlation(moved, music[inside])
    return [Measure("intensity_rank_correlation_ratio", found)]


def lag_measures(dance: Dance, steps: Choreography, music_beat_s: Float) -> list[Measure]:
    """Judge whether planned motion beats fall on music beats.

    Measured on the finished frames: where the dominant clip's time, read from the lineage, passes the step's start in
    the clip, against the music beat there. Steps that start on an added beat do not count.

    Parameters
    ----------
    dance : Dance
    steps : Choreography it was assembled from
    music_beat_s : (B,) float, seconds, as heard

    Returns
    -------
    list of Measure
        The worst lag, milliseconds; 0 where no step starts on a beat.
    """
    is_heard = [np.min(np.abs(music_beat_s - s), initial=np.inf) < 1e-6 for s in steps.song_start_s]
    crossed_s = [
        _crossing_s(dance, i, float(c)) if heard else None
        for i, (c, heard) in enumerate(zip(steps.clip_start_s, is_heard, strict=True))
    ]
    lag_ms = [1e3 * abs(c - s) for c, s in zip(crossed_s, steps.song_start_s, strict=True) if c is not None]
    worst_ms = float(max(lag_ms, default=0.0))
    half_frame_ms = 500.0 / dance.frame_rate_hz
    return [
        Measure(
            "beat_lag_ms", worst_ms, f"at most {half_frame_ms:.1f}, half an output frame", worst_ms <= half_frame_ms
        )
    ]


def warp_measures(steps: Choreography) -> list[Measure]:
    """Judge the pace: song time over clip time of every step.

    Parameters
    ----------
    steps : Choreography of at least one step

    Returns
    -------
    list of Measure
        Share of steps near their own pace, least and most warp ratio.
    """
    warp = steps.warp_ratio
    easy, least, most = (
        float(np.mean((warp >= EASY_WARP[0] - _SLACK) & (warp <= EASY_WARP[1] + _SLACK))),
        float(warp.min()),
        float(warp.max()),
    )
    within = f"{EASY_WARP[0]:.2f} to {EASY_WARP[1]:.2f}"
    return [
        Measure("warp_easy_ratio", easy, f"at least 0.95 of steps within {within}", easy >= 0.95),
        Measure("warp_least_ratio", least, f"never below {HARD_WARP[0]:.2f}", least >= HARD_WARP[0] - _SLACK),
        Measure("warp_most_ratio", most, f"never above {HARD_WARP[1]:.2f}", most <= HARD_WARP[1] + _SLACK),
    ]


_SLACK = 1e-6
"""Of ratios that are stored as float32. Chosen by hand, some roundings wide."""


def _crossing_s(dance: Dance, step: int, clip_s: float) -> float | None:
    """Song time at which a step's clip passes a clip time, by the frames of that step; None where it has too few."""
    frame = np.flatnonzero(dance.lineage.step_index == step)[:2]
    if len(frame) < 2:
        return None
    time_s, passed_s = frame / dance.frame_rate_hz, dance.lineage.clip_time_s[frame]
    slope = (passed_s[1] - passed_s[0]) / (time_s[1] - time_s[0])
    return float(time_s[0] + (clip_s - passed_s[0]) / slope) if slope > 0 else None


def catalogue_measures(steps: Choreography, catalogue_s: Mapping[str, float]) -> list[Measure]:
    """Report what share of the catalogue's time is danced, and how long the longest repeated run is.

    Parameters
    ----------
    steps : Choreography
    catalogue_s : seconds of every clip of the catalogue, by clip_id

    Returns
    -------
    list of Measure
        Clips danced; the union of the stretches danced over the seconds of the catalogue, 0 to 1, 0 where it is empty;
        the longest run of steps that comes twice.
    """
    word = [f"{c}@{round(s * 1000)}" for c, s in zip(steps.clip_id, steps.clip_start_s, strict=True)]
    total_s = sum(catalogue_s.values())
    return [
        Measure("clip_count", float(len(set(steps.clip_id)))),
        Measure("coverage_ratio", _danced_s(steps, catalogue_s) / total_s if total_s else 0.0),
        Measure("longest_repeat_steps", float(_longest_repeat(word))),
    ]


def _danced_s(steps: Choreography, catalogue_s: Mapping[str, float]) -> float:
    """Seconds of the clips that are danced, each counted once however often it is danced."""
    reached: dict[str, float] = {}
    danced_s = 0.0
    for start_s, end_s, clip_id in sorted(zip(steps.clip_start_s, steps.clip_end_s, steps.clip_id, strict=True)):
        low, high = max(float(start_s), reached.get(clip_id, 0.0)), min(float(end_s), catalogue_s.get(clip_id, 0.0))
        danced_s += max(high - low, 0.0)
        reached[clip_id] = max(high, reached.get(clip_id, 0.0))
    return danced_s


def _longest_repeat(word: list[str]) -> int:
    """Length of the longest run of steps that comes twice, without overlap, by dynamic programming."""
    n = len(word)
    best, previous = 0, np.zeros(n + 1, int)
    codes = np.unique(np.array(word), return_inverse=True)[1] if n else np.zeros(0, int)
    for i in range(n):
        row = np.zeros(n + 1, int)
        same = np.flatnonzero(codes[i + 1 :] == codes[i]) + i + 1
        row[same + 1] = np.minimum(previous[same] + 1, same - i)
        best = max(best, int(row.max(initial=0)))
        previous = row
    return best
