"""The engine on plain arrays: beats of sound and of bodies, how well beats agree, matches of rhythms.

What cannot be meant is refused with the name of the argument: a transposed array, NaN, milliseconds for seconds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kernels.types import Float
from odori import inputs
from odori.answers import BeatTimes
from odori.exceptions import InputError, refused

LOUDEST = 16.0
"""Largest sample, full scale 1. Chosen by hand, between decoded sound, which stays near 1, and unscaled integers."""

LARGEST_RHYTHM = 1e100
"""Largest value of a rhythm. Chosen so that products of two stay finite."""

MOST_JOINTS = 150
"""Joints of a body at most, fingers and twists among them. Chosen by hand, to tell joints from frames."""


def track_beats(samples: ArrayLike, rate_hz: float) -> BeatTimes:
    """Find the beats of sound: where a listener would tap.

    Parameters
    ----------
    samples : (n,) or (n, C) float, full scale -1 to 1
    rate_hz : float, samples a second, 4,000 to 768,000

    Returns
    -------
    BeatTimes
        Empty where there is nothing to tap to: silence, noise without pulse, less than two beats.

    Raises
    ------
    InputError
        If samples have another shape, are transposed, (C, n), not finite, empty, or integers; or the rate is too low or
        too high.

    Examples
    --------
    Two clicks a second for ten seconds:

    >>> import numpy as np, odori
    >>> rate_hz = 22050
    >>> samples = np.zeros(10 * rate_hz)
    >>> for click in range(20):
    ...     at = click * rate_hz // 2
    ...     samples[at : at + 200] = np.hanning(200)
    >>> beats = odori.track_beats(samples, rate_hz)
    >>> round(beats.tempo_bpm)
    120
    >>> odori.track_beats(np.zeros((2, 44100)), 44100)
    Traceback (most recent call last):
    ...
    odori.exceptions.InputError: samples: want (n,) or (n, C), got (2, 44100), channels first; give samples.T

    See Also
    --------
    song_beats : of a file, MIDI too
    score_beats : how well they agree with others
    kernels.music.beats.track_beats : with candidates of tempo
    """
    from assets.formats.audio import FASTEST_HZ, SLOWEST_HZ

    sound = _samples(samples)
    rate = _number("rate_hz", rate_hz)
    if not SLOWEST_HZ <= rate <= FASTEST_HZ:
        hint = "; was it given in kHz?" if SLOWEST_HZ <= 1000 * rate <= FASTEST_HZ else ""
        raise InputError(f"rate_hz: want samples a second, {SLOWEST_HZ:.0f} to {FASTEST_HZ:.0f}, got {rate_hz}{hint}")
    from kernels.music.beats import track_beats as track

    with refused():
        grid = track(sound, rate).grid
    return BeatTimes(grid.time_s, grid.bar_number, grid.beat_in_bar_number, grid.confidence)


def score_beats(
    beats_s: ArrayLike | BeatTimes, reference_s: ArrayLike | BeatTimes, *, tolerance_s: float = 0.07
) -> float:
    """Say how well beats agree with others: their F-measure.

    Parameters
    ----------
    beats_s, reference_s : (B,) float, seconds, rising; or BeatTimes
    tolerance_s : float, seconds, above 0 and at most 1
        Beats no further apart count as the same, each at most once.

    Returns
    -------
    float, 0 to 1
        Twice the beats met over the beats of both; 0 where either is empty.

    Raises
    ------
    InputError
        If times do not rise, are negative, not finite, or cannot be seconds.

    Examples
    --------
    >>> import odori
    >>> odori.score_beats([0.5, 1.0, 1.5], [0.52, 1.01, 1.9])
    0.6666666666666666
    >>> odori.score_beats([500, 1000, 1500], [0.5, 1.0, 1.5])
    Traceback (most recent call last):
    ...
    odori.exceptions.InputError: beats_s: want seconds, got beats 500 apart; were they given in milliseconds?

    See Also
    --------
    track_beats : beats of sound
    motion_beats : beats of a body
    kernels.assembly.quality.beat_measures : with the level of chance
    """
    from kernels.assembly.quality import f_measure

    found, wanted = _times("beats_s", beats_s), _times("reference_s", reference_s)
    if not 0 < _number("tolerance_s", tolerance_s) <= 1:
        raise InputError(f"tolerance_s: want seconds, above 0 and at most 1, got {tolerance_s}")
    return f_measure(found, wanted, tolerance_s=float(tolerance_s))


def motion_beats(position_xyz_m: ArrayLike, rate_hz: float, *, method: str = "stops") -> Float:
    """Find when a body slows down: the beats that an onlooker sees.

    Parameters
    ----------
    position_xyz_m : (F, J, 3) float, metres, world, Y up; as :attr:`PoseSequence.position_xyz_m`
    rate_hz : float, frames a second, > 0
    method : ``stops`` or ``pulse``
        Every stop of the body, or the beats of a dancer's tempo, as a studio's table ``motion_beat`` has them.

    Returns
    -------
    (B,) float64, seconds from the first frame, rising
        Minima of the mean speed of the joints, empty where nothing moves and for fewer than four frames; or the beats
        of the pulse, empty where there is none.

    Raises
    ------
    InputError
        If the shape is another, a value is not finite, the rate is not > 0, or there is no such method.

    Examples
    --------
    >>> import numpy as np, odori
    >>> time_s = np.arange(240) / 60
    >>> swing = np.zeros((240, 1, 3))
    >>> swing[:, 0, 0] = np.sin(2 * np.pi * time_s)
    >>> odori.motion_beats(swing, 60).round(2).tolist()
    [0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3.25, 3.75]
    >>> pulse = odori.motion_beats(swing, 60, method="pulse")
    >>> bool(np.allclose(pulse, odori.motion_beats(swing, 60), atol=0.02))
    True

    See Also
    --------
    OpenStudio.poses : positions of a clip
    score_beats : how well they agree with a song's
    """
    from kernels.motion.dance_pulse import dance_pulse
    from kernels.motion.velocity import kinematic_beats

    position = _array("position_xyz_m", position_xyz_m).astype(np.float64)
    if position.ndim != 3 or position.shape[1] < 1 or position.shape[2] != 3:
        raise InputError(f"position_xyz_m: want (F, J, 3), got {position.shape}")
    if position.shape[1] > max(MOST_JOINTS, position.shape[0]):
        raise InputError(f"position_xyz_m: want (F, J, 3), got {position.shape}, joints first; swap the first two axes")
    _check_finite("position_xyz_m", position)
    if not _number("rate_hz", rate_hz) > 0:
        raise InputError(f"rate_hz: want frames a second, > 0, got {rate_hz}")
    if method == "pulse":
        return dance_pulse(position, float(rate_hz)).time_s
    if method != "stops":
        raise InputError(f"method: want stops or pulse, got {method!r}")
    return np.asarray(kinematic_beats(position, float(rate_hz)) / float(rate_hz), np.float64)


@dataclass(frozen=True)
class SegmentMatch:
    """A clip that may be danced to a segment of a song; names as of the table ``match``.

    Parameters
    ----------
    segment_index : int, from 0
    rank_number : int, from 1, the best first
    clip_id : str, or int where the clips were given without names
    scale_ratio : float, clip time over song time
    start_frame_index : int, frame of the clip under the segment's first
    score : float, >= 0
    music_ratio : float, 0 to 2, 1 where the motion equals the music
    mutual_ratio : float, 0 to 1, 1 only where they are equal
    """

    segment_index: int
    rank_number: int
    clip_id: str | int
    scale_ratio: float
    start_frame_index: int
    score: float
    music_ratio: float
    mutual_ratio: float


def match(
    segments: ArrayLike | Sequence[ArrayLike],
    clips: Mapping[str, ArrayLike] | Sequence[ArrayLike],
    *,
    k: int = 5,
    device: str = "reference",
) -> list[list[SegmentMatch]]:
    """Find for every segment of a song the clips whose rhythm is most like its own, at every pace and start.

    Parameters
    ----------
    segments : sequence of (L,) float, or one of them: rhythm of the music, finite, >= 0, L >= 1
    clips : by name, or in a sequence: (T,) float, rhythm of the motion at the same rate, finite, >= 0
    k : int, >= 1, clips wanted for each segment
    device : ``reference`` for NumPy, ``auto`` for the best OpenCL device, or a device as ``odori.toml`` names it
        The answer is the same to the bit.

    Returns
    -------
    list of SegmentMatch for each segment, the best first
        Clips are tried at 0.90 to 1.10 of their pace in steps of 0.02. Shorter lists where fewer clips are long enough.

    Raises
    ------
    InputError
        If an array is not one-dimensional, empty, negative or not finite, k is not >= 1, or there is no such device.

    Notes
    -----
    The score is the sum of a b / (a + b) over the frames of a segment, music a, motion b.

    Examples
    --------
    A segment cut out of the second clip is found there:

    >>> import numpy as np, odori
    >>> rng = np.random.default_rng(1)
    >>> clips = {"walk": rng.random(600), "step": rng.random(600)}
    >>> [best] = odori.match(clips["step"][100:340], clips, k=1)
    >>> best[0].clip_id, best[0].start_frame_index, best[0].scale_ratio, round(best[0].mutual_ratio, 6)
    ('step', 100, 1.0, 1.0)

    See Also
    --------
    OpenStudio.table : ``music_feature``, ``motion_feature`` and ``match`` hold a studio's own
    kernels.matching.score.reference_matches : the search that tries everything
    """
    from kernels.matching.score import SCALES

    for name, given in (("segments", segments), ("clips", clips)):
        if not isinstance(given, Mapping | Sequence) and not hasattr(given, "__array__"):
            raise InputError(f"{name}: want a sequence of (n,) arrays, got {type(given).__name__}")
    if isinstance(segments, np.ndarray) and segments.ndim != 1 and len(segments.shape) and segments.dtype != object:
        raise InputError(
            f"segments: want a sequence of (n,), got {segments.shape}; give list(segments) if rows are meant"
        )
    segments, clips = _from_table(segments), _from_table(clips)
    names: list[str] | list[int] = list(clips) if isinstance(clips, Mapping) else list(range(len(clips)))
    series = list(clips.values()) if isinstance(clips, Mapping) else list(clips)
    motions = [_rhythm(f"clips[{name!r}]", one) for name, one in zip(names, series, strict=True)]
    is_one = isinstance(segments, np.ndarray) and segments.ndim == 1
    is_one |= isinstance(segments, Sequence) and bool(segments) and np.ndim(segments[0]) == 0
    parts: Sequence[ArrayLike] = [segments] if is_one else list(segments)  # type: ignore[arg-type, list-item]
    music = [_rhythm(f"segments[{index}]", one) for index, one in enumerate(parts)]
    k = inputs.count("k", k)
    device = inputs.key("device", device)
    if not motions or not music:
        return [[] for _ in music]
    with refused():
        found = _matcher(device).matches(music, motions, k=k)
    return [
        [
            SegmentMatch(
                m.segment_index,
                m.rank_number,
                names[m.clip_index],
                SCALES[m.scale_index],
                m.start_frame_index,
                m.score,
                m.music_ratio,
                m.mutual_ratio,
            )
            for m in matches
        ]
        for matches in found
    ]


def _matcher(device: str) -> Any:  # noqa: ANN401 - a SegmentMatcher; its home loads Dagster
    if device == "reference":
        from kernels.matching.numpy_search import NumpyMatcher

        return NumpyMatcher()
    from pipelines.device_fallback import Devices
    from pipelines.twins import Matches
    from schemas.settings import MatchingSettings

    return Matches(Devices("" if device == "auto" else device), MatchingSettings())


def _samples(samples: ArrayLike) -> NDArray[np.floating]:
    sound = _plain("samples", samples)
    if sound.dtype.kind in "iu" and sound.size:
        raise InputError(
            f"samples: want float from -1 to 1, got {sound.dtype}; divide by {np.iinfo(sound.dtype).max + 1}"
        )
    if sound.ndim not in (1, 2):
        raise InputError(f"samples: want (n,) or (n, C), got {sound.shape}")
    if sound.size == 0:
        raise InputError(f"samples: want at least one sample, got none, {sound.shape}")
    if sound.ndim == 2 and sound.shape[0] < sound.shape[1]:
        raise InputError(f"samples: want (n,) or (n, C), got {sound.shape}, channels first; give samples.T")
    sound = _array("samples", sound)
    _check_finite("samples", sound)
    if np.abs(sound).max() > LOUDEST:
        raise InputError(
            f"samples: want full scale -1 to 1, got values to {np.abs(sound).max():g}; "
            "divide integers by their full scale"
        )
    return sound


def _rhythm(name: str, values: ArrayLike) -> NDArray[np.floating]:
    curve = _array(name, values)
    if curve.ndim != 1 or not len(curve):
        raise InputError(f"{name}: want (n,) with n >= 1, got {curve.shape}")
    _check_finite(name, curve)
    if (curve < 0).any() or float(curve.max()) > LARGEST_RHYTHM:
        raise InputError(f"{name}: want 0 to {LARGEST_RHYTHM:g}, got {curve.min():g} to {curve.max():g}")
    return curve


def _times(name: str, values: ArrayLike | BeatTimes) -> Float:
    time_s = _array(name, values.time_s if isinstance(values, BeatTimes) else values).astype(np.float64)
    from kernels.assembly.quality import check_beats

    with refused():
        check_beats(name, time_s)
    return time_s


def _array(name: str, values: ArrayLike) -> NDArray[np.floating]:
    """Take numbers as floats; strings, objects, booleans and complex numbers are none."""
    array = _plain(name, values)
    if array.dtype.kind not in "fiu":
        raise InputError(f"{name}: want numbers, got {array.dtype}")
    return array if array.dtype.kind == "f" else array.astype(np.float64)


def _from_table(values: Any) -> Any:  # noqa: ANN401 - a column of Arrow or Polars, or what was given
    return values.to_numpy() if hasattr(values, "to_numpy") and not hasattr(values, "columns") else values


def _plain(name: str, values: ArrayLike) -> NDArray[Any]:
    try:
        return np.asarray(_from_table(values))
    except ValueError as error:
        raise InputError(f"{name}: want an array of numbers, got rows of different lengths") from error


def _check_finite(name: str, values: NDArray[np.floating]) -> None:
    is_bad = ~np.isfinite(values)
    if is_bad.any():
        at = tuple(int(i) for i in np.argwhere(is_bad)[0])
        raise InputError(f"{name}: want finite values, got {values[at]} at {at[0] if len(at) == 1 else at}")


def _number(name: str, value: Any) -> float:  # noqa: ANN401 - whatever was given
    if isinstance(value, bool) or not isinstance(value, Real):
        raise InputError(f"{name}: want a number, got {value!r}")
    if not np.isfinite(float(value)):
        raise InputError(f"{name}: want a finite number, got {value}")
    return float(value)
