"""Motion beats: where a dancer's largest movement turns, as an even grid.

The method of [Xu2015], equations 3 to 16: principal components in short windows, joined
into one curve, whose extrema are beats. Equations 11 and 13 are images in every copy read; they are rebuilt from the
text around them. Ours, and marked so below: smoothing and a prominence before extrema are taken, the least-squares
refinement of the grid, the confidence, and the choice of octave.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy

from kernels import rotation
from kernels.types import Float, Int

Method = Literal["fft", "autocorrelation"]


@dataclass(frozen=True)
class BeatSettings:
    """How motion beats are looked for.

    Parameters
    ----------
    component : int, >= 1
        Principal component that carries the beat; 2 when, say, the body's turn is the largest movement.
    joints : joint indices, or empty for all
        The subset whose movement counts, for example the feet.
    method : "fft" or "autocorrelation" (in [Xu2015] the first, and the alternative it names)
    extrema_per_beat : 1, 2 or 0
        Whether every extremum is a beat, or every second one; 0 decides by rule (see :func:`motion_beats`).
    window_s : float, seconds
        Length of a window, 60 frames at 30 Hz; neighbours overlap by half.
    shortest_s, longest_s : float, seconds
        Bounds of the beat interval.
    smoothing_hz : float
        Cut-off of a zero-phase low-pass before extrema are taken; 0 for none.
    least_travel_m : float, metres
        A curve with a smaller standard deviation (root mean square over joints) is standing still: no beats.
    """

    component: int = 1
    joints: tuple[int, ...] = ()
    method: Method = "fft"
    extrema_per_beat: Literal[0, 1, 2] = 0
    window_s: float = 2.0
    shortest_s: float = 0.25
    longest_s: float = 2.0
    smoothing_hz: float = 5.0
    least_travel_m: float = 0.005

    def __post_init__(self) -> None:
        if self.component < 1:
            raise ValueError(f"component: want 1 or more, got {self.component}")
        if self.method not in ("fft", "autocorrelation"):
            raise ValueError(f"method: want fft or autocorrelation, got {self.method!r}")
        if self.extrema_per_beat not in (0, 1, 2):
            raise ValueError(f"extrema_per_beat: want 0 (by rule), 1 or 2, got {self.extrema_per_beat}")
        if not 0 < self.shortest_s < self.longest_s or not self.window_s > 0:
            raise ValueError(
                f"shortest_s, longest_s: want 0 < shortest < longest, got {self.shortest_s}, {self.longest_s}"
            )

    @property
    def shortest_extremum_s(self) -> float:
        """Shortest time between extrema: half the shortest beat where two extrema may make one."""
        return self.shortest_s / (1 if self.extrema_per_beat == 1 else 2)


@dataclass(frozen=True, eq=False)
class MotionBeats:
    """Beats of one clip.

    Parameters
    ----------
    time_s : (B,) float64, seconds from the first frame, evenly spaced
    interval_s : float, seconds; 0 without beats
    component_share : float, 0 to 1
        Share of the variance that the chosen component carries, mean over windows by their variance.
    peak_share : float, 0 to 1
        Share of the beat curve's spectrum inside the peak: 1 for a steady tempo.
    extremum_s : (X,) float64, seconds
        The extrema the grid was fitted to.
    curve : (F,) float64, metres times sqrt(joints)
        The joined component, for looking at.
    """

    time_s: Float
    interval_s: float
    component_share: float
    peak_share: float
    extremum_s: Float
    curve: Float

    @property
    def confidence(self) -> float:
        """Geometric mean of the two shares, 0 to 1; 0 without beats (ours)."""
        return float(np.sqrt(self.component_share * self.peak_share)) if len(self.time_s) else 0.0


def check_position(position_m: Float, frame_rate_hz: float) -> None:
    """Refuse positions that beats and speeds cannot be had from.

    Parameters
    ----------
    position_m : (F, J, 3) float, metres, world, J >= 1; F may be 0
    frame_rate_hz : float, > 0

    Raises
    ------
    ValueError
        If the shape is another, a value is not finite, or the rate is not > 0.
    """
    if position_m.ndim != 3 or position_m.shape[1] < 1 or position_m.shape[2] != 3:
        raise ValueError(f"position_m: want (F, J, 3) with J >= 1, got {position_m.shape}")
    if not np.isfinite(position_m).all():
        raise ValueError("position_m: not finite; fill gaps before looking for beats")
    if not frame_rate_hz > 0:
        raise ValueError(f"frame_rate_hz: want > 0, got {frame_rate_hz}")


def component_curve(relative_m: Float, window: int, component: int) -> tuple[Float, float]:
    """Join one principal component of half-overlapping windows into a curve (equations 4 to 11).

    Parameters
    ----------
    relative_m : (F, M) float, metres, joint coordinates relative to the root; F >= 2
    window : int, frames, >= 2
    component : int, from 1

    Returns
    -------
    curve : (F,) float64
    share : float, 0 to 1
        Variance of the component over all variance, windows weighted by their variance; 0 when nothing moves.
    """
    f, m = relative_m.shape
    window = min(window, f)
    hop = max(window // 2, 1)
    starts = np.unique(np.append(np.arange(0, f - window + 1, hop), f - window))
    pieces = np.stack([relative_m[s : s + window] for s in starts])
    pieces = pieces - pieces.mean(axis=1, keepdims=True)
    _, singular, right = np.linalg.svd(pieces, full_matrices=False)
    k = min(component, min(window, m)) - 1
    total = float(np.sum(singular**2))
    share = float(np.sum(singular[:, k] ** 2) / total) if total > 0 else 0.0
    coefficient = right[:, k]
    # The first window's sign is free: fix it, so that the same motion always gives the same curve.
    first = coefficient[0]
    coefficient[0] = first * (1.0 if first[np.argmax(np.abs(first))] >= 0 else -1.0)
    curve = np.zeros(f)
    curve[:window] = pieces[0] @ coefficient[0]
    for i in range(1, len(starts)):
        if coefficient[i] @ coefficient[i - 1] < 0:  # equation 9
            coefficient[i] = -coefficient[i]
        piece = pieces[i] @ coefficient[i]
        s, overlap = starts[i], starts[i - 1] + window - starts[i]
        piece = piece - piece[0] + curve[s]  # equation 10
        fade = np.arange(overlap) / overlap  # equation 11
        curve[s : s + overlap] = (1 - fade) * curve[s : s + overlap] + fade * piece[:overlap]
        curve[s + overlap : s + window] = piece[overlap:]
    return curve, share


def smooth(curve: Float, frame_rate_hz: float, cutoff_hz: float) -> Float:
    """Low-pass a curve forwards and backwards, without lag (ours; second-order Butterworth).

    Parameters
    ----------
    curve : (F,) float
    frame_rate_hz : float, > 0
    cutoff_hz : float, Hz
        0, or too near half the frame rate to act: the curve comes back as it is.

    Returns
    -------
    (F,) float64
    """
    if not 0 < cutoff_hz < 0.45 * frame_rate_hz or len(curve) < 5:
        return np.array(curve, np.float64)
    sections = scipy.signal.butter(2, cutoff_hz, fs=frame_rate_hz, output="sos")
    return np.asarray(
        scipy.signal.sosfiltfilt(sections, curve, padlen=min(len(curve) - 1, int(frame_rate_hz))), np.float64
    )


def find_extrema(curve: Float, frame_rate_hz: float, *, window_s: float = 2.0) -> Float:
    """Find the turning points of a curve, between samples by a parabola (equation 12).

    Parameters
    ----------
    curve : (F,) float, smooth
    frame_rate_hz : float, > 0
    window_s : float, seconds

    Returns
    -------
    (X,) float64, seconds, increasing
        Empty when F < 5 or the curve is constant.

    Notes
    -----
    Ours: the curve is divided by its own strength in the window around, and a turn counts from a prominence of half
    that strength, so that noise and tremor are no beats.
    """
    if len(curve) < 5:
        return np.zeros(0)
    kernel = np.ones(min(max(int(window_s * frame_rate_hz) | 1, 3), 2 * len(curve) - 1))
    count = scipy.signal.fftconvolve(np.ones(len(curve)), kernel, mode="same")
    mean = scipy.signal.fftconvolve(curve, kernel, mode="same") / count
    strength = np.sqrt(np.maximum(scipy.signal.fftconvolve((curve - mean) ** 2, kernel, mode="same") / count, 0.0))
    level = curve / np.maximum(strength, max(0.1 * float(strength.max()), 1e-9))
    frame = np.sort(np.concatenate([scipy.signal.find_peaks(sign * level, prominence=0.5)[0] for sign in (1.0, -1.0)]))
    # Strength that changes along the curve moves the turns of the quotient by a frame at most: go back to the curve's.
    frame = np.clip(frame + np.round(np.clip(_vertex(curve, frame), -1, 1)).astype(np.int64), 1, len(curve) - 2)
    extremum_s: Float = (frame + np.clip(_vertex(curve, frame), -0.5, 0.5)) / frame_rate_hz
    return extremum_s


def _vertex(curve: Float, frame: Int) -> Float:
    """Where the parabola through a frame and its neighbours turns, in frames from it; 0 where they lie on a line."""
    before, here, after = curve[frame - 1], curve[frame], curve[frame + 1]
    bend = before - 2 * here + after
    return np.where(np.abs(bend) > 1e-12, 0.5 * (before - after) / np.where(bend == 0, 1.0, bend), 0.0)


def _cosines(extremum: Float, n_frames: int) -> Float:
    """One period of a cosine between neighbouring extrema, 0 outside (equation 13), (F,)."""
    t = np.arange(n_frames)
    phase = np.interp(t, extremum, np.arange(len(extremum)))
    return np.where((t >= extremum[0]) & (t <= extremum[-1]), np.cos(2 * np.pi * phase), 0.0)


def _spectral_peak(series: Float, frame_rate_hz: float, settings: BeatSettings) -> tuple[float, float]:
    """Strongest frequency in the band, Hann-windowed and interpolated, and the share of power around it."""
    inside = np.flatnonzero(series)
    piece = series[inside[0] : inside[-1] + 1]
    n_fft = 1 << int(np.ceil(np.log2(max(8 * len(piece), 4096))))
    power = np.abs(np.fft.rfft(piece * np.hanning(len(piece)), n_fft)) ** 2
    hz = np.fft.rfftfreq(n_fft, 1 / frame_rate_hz)
    band = np.flatnonzero((hz >= 1 / settings.longest_s) & (hz <= 1 / settings.shortest_extremum_s))
    if len(band) == 0:
        return 0.0, 0.0
    best = int(band[np.argmax(power[band])])
    here = np.log(np.maximum(power[best - 1 : best + 2], 1e-30))
    bend = here[0] - 2 * here[1] + here[2] if len(here) == 3 else 0.0
    shift = 0.5 * (here[0] - here[2]) / bend if bend < 0 else 0.0
    lobe = np.abs(hz - hz[best]) <= 2 * frame_rate_hz / len(piece)  # half the width of Hann's main lobe
    return float(hz[best] + shift * hz[1]), float(power[lobe].sum() / power.sum())


def _autocorrelation_interval_s(curve: Float, frame_rate_hz: float, settings: BeatSettings) -> float:
    """Half the lag at which the curve most repeats itself: extrema come twice a cycle; 0 when it never does."""
    level = scipy.signal.detrend(curve)
    n = len(level)
    raw = scipy.signal.correlate(level, level, mode="full", method="fft")[n - 1 :]
    r = raw / np.maximum(np.arange(n, 0, -1), 1) / max(raw[0] / n, 1e-30)
    low, high = 2 * settings.shortest_extremum_s * frame_rate_hz, min(2 * settings.longest_s * frame_rate_hz, 0.75 * n)
    peaks = scipy.signal.find_peaks(r)[0]
    peaks = peaks[(peaks >= low) & (peaks <= high)]
    if len(peaks) == 0 or r[peaks].max() <= 0:
        return 0.0
    # Every multiple of the period fits as well: take the shortest lag that is nearly as good as the best.
    lag = float(peaks[r[peaks] >= 0.85 * r[peaks].max()][0])
    i = int(lag)
    bend = r[i - 1] - 2 * r[i] + r[i + 1]
    lag += 0.5 * (r[i - 1] - r[i + 1]) / bend if bend < 0 else 0.0
    return lag / frame_rate_hz / 2


def _refine(extremum_s: Float, interval_s: float, first_s: float) -> tuple[float, float]:
    """Least-squares grid through the extrema near it (ours): new interval and first beat.

    Grown from the middle outwards, so that a small error of the interval cannot miscount the far beats.
    """
    if len(extremum_s) == 0:
        return interval_s, first_s
    middle = extremum_s[len(extremum_s) // 2]
    start, slope = first_s + interval_s * np.round((middle - first_s) / interval_s), interval_s
    for reach in (3, 6, 12, 24, 48, np.inf):
        number = np.round((extremum_s - start) / slope)
        near = (np.abs(extremum_s - start - number * slope) < 0.25 * slope) & (np.abs(number) <= reach)
        if near.sum() < 3 or np.ptp(number[near]) < 2:
            continue
        fitted = np.polyfit(number[near], extremum_s[near], 1)
        if abs(fitted[0] / interval_s - 1) < 0.1:
            slope, start = fitted
    return float(slope), float(start)


def _every_second(
    curve: Float, frame_rate_hz: float, settings: BeatSettings, first_s: float, interval_s: float
) -> bool:
    """Whether two extrema make one beat, by the rule in :func:`motion_beats`."""
    if settings.extrema_per_beat:
        return settings.extrema_per_beat == 2
    if 2 * interval_s > settings.longest_s:
        return False
    if interval_s < _FASTEST_STEP_S:
        return True
    bend = _bend_by_parity(curve, frame_rate_hz, first_s, interval_s)
    return bool(interval_s < _SLOWEST_BOUNCE_S and max(bend) > 2.5 * min(bend))


_FASTEST_STEP_S = 0.28
_SLOWEST_BOUNCE_S = 0.45
"""Turns that follow each other faster than the first are half beats; those slower than the second are beats. Chosen by
hand, by the rule in :func:`motion_beats`: 214 and 133 steps a minute."""


def _bend_by_parity(curve: Float, frame_rate_hz: float, first_s: float, interval_s: float) -> tuple[float, float]:
    """How sharply the curve turns on the even and on the odd beats of a grid (mean absolute second difference)."""
    step = max(round(frame_rate_hz / 30), 1)
    bend = np.zeros(len(curve))
    bend[step:-step] = np.abs(curve[2 * step :] - 2 * curve[step:-step] + curve[: -2 * step])
    frame: Int = np.round(np.arange(first_s, (len(curve) - 1) / frame_rate_hz, interval_s) * frame_rate_hz).astype(
        np.int64
    )
    number = np.arange(len(frame))
    inside = (frame >= step) & (frame < len(curve) - step)
    even, odd = frame[inside & (number % 2 == 0)], frame[inside & (number % 2 == 1)]
    if min(len(even), len(odd)) < 2:
        return 1.0, 1.0
    return float(np.median(bend[even])), float(np.median(bend[odd]))


def motion_beats(
    position_m: Float, frame_rate_hz: float, *, heading_rad: Float | None = None, settings: BeatSettings | None = None
) -> MotionBeats:
    """Find the beats of a clip.

    After [Xu2015], "motion beats", equations 3 to 16; see the module docstring for what is ours.

    Parameters
    ----------
    position_m : (F, J, 3) float, metres, world; joint 0 is the root
    frame_rate_hz : float, > 0
    heading_rad : (F,) float, radians, or None
        Where the body faces (:func:`kernels.rotation.heading_rad`). Where it is given, the joints are looked at from
        the body: a dancer who turns is then not taken for one whose every joint swings (ours). None is the way of
        [Xu2015], joints relative to the root in the world's axes.
    settings : BeatSettings, or None for the defaults

    Returns
    -------
    MotionBeats
        Without beats when the clip is shorter than three extrema, stands still, or turns at no tempo in bounds.

    Raises
    ------
    ValueError
        If a shape does not fit, a value is not finite, the rate is not > 0, or a joint of the subset is not there.

    Notes
    -----
    The octave. Equation 13 puts one period between neighbouring extrema, so every extremum is a beat: right for a
    step or a swing, which reaches left on one beat and right on the next. A bounce turns twice a beat (down on it, up
    between). With ``extrema_per_beat=0`` every second extremum is a beat when single ones come faster than 0.28 s (214
    a minute, faster than dancers step), or when they come faster than 0.45 s and every second turn is more than 2.5
    times as sharp as those between. The beat then lies on the sharper kind of turn: where the body is stopped, not
    where it is let go.
    """
    settings = settings or BeatSettings()
    check_position(position_m, frame_rate_hz)
    f, j, _ = position_m.shape
    if any(not 0 <= k < j for k in settings.joints):
        raise ValueError(f"joints: want 0 to {j - 1}, got {settings.joints}")
    if heading_rad is not None and heading_rad.shape != (f,):
        raise ValueError(f"heading_rad: want ({f},), got {heading_rad.shape}")
    chosen = list(settings.joints) or list(range(1, j)) or [0]
    joint_m = position_m[:, chosen] - position_m[:, :1] if j > 1 else position_m
    if heading_rad is not None:
        joint_m = rotation.apply(rotation.from_heading(-heading_rad)[:, None], joint_m)
    relative = joint_m.reshape(f, 3 * joint_m.shape[1])
    nothing = MotionBeats(np.zeros(0), 0.0, 0.0, 0.0, np.zeros(0), np.zeros(f))
    if f < 5:
        return nothing
    curve, share = component_curve(relative, round(settings.window_s * frame_rate_hz), settings.component)
    nothing = MotionBeats(np.zeros(0), 0.0, share, 0.0, np.zeros(0), curve)
    if curve.std() < settings.least_travel_m * np.sqrt(len(chosen)):
        return nothing
    clean = smooth(curve, frame_rate_hz, settings.smoothing_hz)
    extremum_s = find_extrema(clean, frame_rate_hz, window_s=settings.window_s)
    if len(extremum_s) < 3:
        return nothing
    series = _cosines(extremum_s * frame_rate_hz, f)
    hz, peak_share = _spectral_peak(series, frame_rate_hz, settings)
    interval_s = 1 / hz if hz > 0 else 0.0
    if settings.method == "autocorrelation":
        interval_s = _autocorrelation_interval_s(clean, frame_rate_hz, settings)
    if not settings.shortest_extremum_s <= interval_s <= settings.longest_s:
        return nothing
    # Equations 14 and 15: the phase of the best-fitting cosine is that of the transform at its frequency.
    t = np.arange(f) / frame_rate_hz
    phase = float(np.angle(np.sum(series * np.exp(-2j * np.pi * t / interval_s))))
    first_s = -phase / (2 * np.pi) * interval_s
    if settings.smoothing_hz:  # now that the tempo is known, noise above it can be told from movement
        clean = smooth(curve, frame_rate_hz, min(settings.smoothing_hz, 1.5 / interval_s))
        extremum_s = find_extrema(clean, frame_rate_hz, window_s=settings.window_s)
    interval_s, first_s = _refine(extremum_s, interval_s, first_s)
    if _every_second(clean, frame_rate_hz, settings, first_s, interval_s):
        even, odd = _bend_by_parity(clean, frame_rate_hz, first_s, interval_s)
        first_s, interval_s = first_s + (interval_s if odd > even else 0.0), 2 * interval_s
    first_s -= np.floor(first_s / interval_s + 1e-9) * interval_s  # equation 16 from the first beat at or after 0
    duration_s = (f - 1) / frame_rate_hz
    time_s = first_s + interval_s * np.arange(max(int(np.floor((duration_s - first_s) / interval_s + 1e-9)) + 1, 0))
    if len(time_s) == 0:
        return nothing
    return MotionBeats(np.clip(time_s, 0.0, duration_s), interval_s, share, peak_share, extremum_s, curve)
