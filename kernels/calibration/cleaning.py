"""Gaps, glitches and noise of a suit recording.

Conventions
-----------
Series are (F, S, C): frames, sensors, components; every function works on all sensors at once. An entry is one sensor
at one frame.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from kernels import rotation
from kernels.calibration.faults import check_recording
from kernels.calibration.hemispheres import undo_hemispheres
from kernels.calibration.records import Bools, Cleaned, Finding, Recording
from kernels.types import Float

CUTOFF_HZ = 12.0
_LEAST_M, _LEAST_QUATERNION = 0.015, 0.05
_TURN_M_PER_S2, _TURN_RAD_PER_S2 = 30.0, 100.0
_MAX_OUTLIER_RATIO = 0.05
# Exchanges of a network after which the fifth of nine is their median (Devillard, 1998).
_NETWORK = "12 45 78 01 34 67 12 45 78 03 58 47 36 14 25 47 42 64 42"  # pairs of places, smaller to the first


def clean(recording: Recording, *, cutoff_hz: float = CUTOFF_HZ) -> Cleaned:
    """Undo hemisphere jumps, fill gaps and outliers, measure the noise, and filter it.

    Parameters
    ----------
    recording : Recording of F frames and S sensors
    cutoff_hz : float, Hz, > 0
        Of the low-pass, a Butterworth of order 2 run forwards and back. No filter where it is above 0.4 of the rate.

    Returns
    -------
    Cleaned
        With every value finite, except where a sensor never has one: there the position is 0 and the rotation the
        identity, and an error says so. Empty where F is 0.
    """
    findings = list(check_recording(recording))
    is_usable = recording.is_valid & _is_finite(recording)
    position = np.where(is_usable[..., None], recording.position_xyz_m, 0.0)
    turned = np.where(is_usable[..., None], recording.rotation_wxyz, rotation.IDENTITY)
    length = np.sqrt(np.sum(turned * turned, axis=-1, keepdims=True))
    turned = np.where(length > 1e-6, turned / np.maximum(length, 1e-6), rotation.IDENTITY)
    is_usable = np.asarray(is_usable & (length[..., 0] > 1e-6))
    position, jumps = undo_hemispheres(position, is_usable, sensors=recording.sensors)
    findings += jumps
    is_outlier = find_outliers(position, turned, is_usable, frame_rate_hz=recording.frame_rate_hz)
    is_good = is_usable & ~is_outlier
    position, turned = fill(position, is_good), fill(_aligned(turned, is_good), is_good)
    turned = rotation.continuous(rotation.normalize(turned))
    position_noise, rotation_noise = noise(position, turned, is_good)
    position, gain = low_pass(position, recording.frame_rate_hz, cutoff_hz=cutoff_hz)
    turned, _ = low_pass(turned, recording.frame_rate_hz, cutoff_hz=cutoff_hz)
    if all(finding.sensor is not None for finding in findings):  # in another unit, 1 cm is no measure of an outlier
        findings += _outlier_findings(recording, is_usable, is_outlier)
    return Cleaned(
        replace(recording, position_xyz_m=position, rotation_wxyz=rotation.normalize(turned)),
        ~is_good,
        position_noise,
        rotation_noise,
        gain,
        is_outlier.sum(axis=0),
        tuple(findings),
    )


def running_median(series: Float, *, stride: int = 1) -> Float:
    """Median of nine samples around each along the first axis, the ends repeated.

    Parameters
    ----------
    series : (F, ...) float
    stride : int, >= 1
        Samples from one to the next of the nine.

    Returns
    -------
    (F, ...) float64
    """
    if len(series) == 0:
        return series.copy()
    reach = 4 * stride
    padded = np.concatenate([np.repeat(series[:1], reach, axis=0), series, np.repeat(series[-1:], reach, axis=0)])
    tap = [padded[k * stride : k * stride + len(series)] for k in range(9)]
    for pair in _NETWORK.split():
        a, b = int(pair[0]), int(pair[1])
        tap[a], tap[b] = np.minimum(tap[a], tap[b]), np.maximum(tap[a], tap[b])
    return tap[4]


def find_outliers(
    position_xyz_m: Float, rotation_wxyz: Float, is_usable: Bools, *, frame_rate_hz: float, rounds: int = 3
) -> Bools:
    """Mark entries that stand out from the frames around them.

    Parameters
    ----------
    position_xyz_m : (F, S, 3) float, metres
    rotation_wxyz : (F, S, 4) float, unit
    is_usable : (F, S) bool
    frame_rate_hz : float, > 0
    rounds : int, >= 1
        What is marked is filled and the rest looked at again: bursts fall from their ends.

    Returns
    -------
    (F, S) bool
        A part of ``is_usable``.

    Notes
    -----
    Hampel's rule: an entry is an outlier where it lies further from the median of nine frames than six times what the
    sensor usually does, and than five times what it does within 20 frames, so that fast turns are not taken for
    outliers; but never within 15 mm, or 0.05 in the quaternion,
    nor within what 30 m/s² and 100 rad/s² do in two frames. The first and last four frames are held against a line
    through the medians next to them, four times as loosely: an outlier at an end must not vouch for itself.
    """
    is_outlier = np.zeros_like(is_usable)
    # at a turn the median of nine lies as far off as the body gets in two frames
    turn_s2 = (2.0 / frame_rate_hz) ** 2
    least_m = max(_LEAST_M, _TURN_M_PER_S2 * turn_s2 / 2)
    least_q = max(_LEAST_QUATERNION, _TURN_RAD_PER_S2 * turn_s2 / 4)
    for _ in range(rounds):
        is_good = is_usable & ~is_outlier
        found = np.zeros_like(is_usable)
        for series, floor in ((position_xyz_m, least_m), (_aligned(rotation_wxyz, is_good), least_q)):
            away = np.sqrt(np.sum((series - _expected(fill(series, is_good))) ** 2, axis=-1))
            usual = _median_where(away, is_good)
            near = _nearby(np.where(is_good, away, usual))
            least = np.full((len(away), 1), floor)
            least[:4], least[-4:] = 4 * floor, 4 * floor
            found |= away > np.maximum(least, np.maximum(6.0 * usual, 5.0 * near))
        found &= is_good
        if not found.any():
            break
        is_outlier |= found
    return is_outlier


def _expected(series: Float) -> Float:
    """Take the running median (F, S, C), drawn on in a line over the first and last four frames."""
    middle = running_median(series)
    if len(series) < 18:
        return middle
    step = np.arange(1, 5)[:, None, None]
    middle[3::-1] = middle[4] - step * (middle[8] - middle[4]) / 4.0
    middle[-4:] = middle[-5] + step * (middle[-5] - middle[-9]) / 4.0
    return middle


def _nearby(away: Float) -> Float:
    """Median (F, S) over nine samples within 20 frames; at the ends that of frame 20."""
    near = running_median(away, stride=5)
    if len(away) > 40:
        near[:20], near[-20:] = near[20], near[-21]
    return near


def fill(series: Float, is_good: Bools) -> Float:
    """Interpolate linearly over entries that are not good; the ends repeat the nearest good one.

    Parameters
    ----------
    series : (F, S, C) float
    is_good : (F, S) bool

    Returns
    -------
    (F, S, C) float64
        Unchanged for a sensor that is never good.
    """
    filled = np.array(series, np.float64)
    for s in np.flatnonzero(~is_good.all(axis=0) & is_good.any(axis=0)):
        good, bad = np.flatnonzero(is_good[:, s]), np.flatnonzero(~is_good[:, s])
        after = np.searchsorted(good, bad)
        left, right = good[np.maximum(after - 1, 0)], good[np.minimum(after, len(good) - 1)]
        share = ((bad - left) / np.maximum(right - left, 1))[:, None]
        share = np.where((right > left)[:, None], np.clip(share, 0, 1), 0.0)
        filled[bad, s] = (1 - share) * series[left, s] + share * series[right, s]
    return filled


def noise(position_xyz_m: Float, rotation_wxyz: Float, is_good: Bools) -> tuple[Float, Float]:
    """Estimate white noise from third differences, which motion hardly reaches.

    Parameters
    ----------
    position_xyz_m : (F, S, 3) float, metres
    rotation_wxyz : (F, S, 4) float, unit, continuous in sign
    is_good : (F, S) bool

    Returns
    -------
    position_noise_m : (S,) float64, metres
    rotation_noise_rad : (S,) float64, radians
        Standard deviation an axis: 1.4826 median|d3| / sqrt(20), twice that for a quaternion; 0 where fewer than four
        good frames follow each other.
    """
    if len(position_xyz_m) < 4:
        return np.zeros(is_good.shape[1]), np.zeros(is_good.shape[1])
    whole = is_good[3:] & is_good[2:-1] & is_good[1:-2] & is_good[:-3]
    size = [
        np.stack([_median_where(np.abs(np.diff(series[..., c], 3, axis=0)), whole) for c in range(series.shape[-1])])
        * (1.4826 / np.sqrt(20.0))
        for series in (position_xyz_m, rotation_wxyz)
    ]
    # Of four components of a quaternion three carry noise of half the angle, in directions that turn with it.
    return np.sqrt(np.mean(size[0] ** 2, axis=0)), 2.0 * np.sqrt(np.sum(size[1] ** 2, axis=0) / 3.0)


def low_pass(series: Float, frame_rate_hz: float, *, cutoff_hz: float = CUTOFF_HZ) -> tuple[Float, float]:
    """Filter without delay: a Butterworth of order 2, forwards and back.

    Parameters
    ----------
    series : (F, ...) float, finite
    frame_rate_hz, cutoff_hz : float, Hz, > 0

    Returns
    -------
    (F, ...) float64
    gain : float, 0 to 1
        Share of white noise's power that is left; 1 where nothing was filtered: cutoff above 0.4 of the rate, or fewer
        than 16 frames.
    """
    if cutoff_hz > 0.4 * frame_rate_hz or len(series) < 16:
        return np.array(series, np.float64), 1.0
    sections = signal.butter(2, cutoff_hz, fs=frame_rate_hz, output="sos")
    _, response = signal.sosfreqz(sections, worN=4096)
    flat = np.ascontiguousarray(np.moveaxis(series, 0, -1), np.float64)
    filtered = signal.sosfiltfilt(sections, flat, axis=-1)
    return np.ascontiguousarray(np.moveaxis(filtered, -1, 0)), float(np.mean(np.abs(response) ** 4))


def _is_finite(recording: Recording) -> Bools:
    finite = np.isfinite(recording.position_xyz_m).all(-1) & np.isfinite(recording.rotation_wxyz).all(-1)
    return np.asarray(finite)


def _aligned(rotation_wxyz: Float, is_good: Bools) -> Float:
    """Quaternions (F, S, 4), the good ones in the hemisphere of the good one before."""
    frame = np.arange(len(is_good))[:, None]
    last = np.maximum.accumulate(np.where(is_good, frame, 0), axis=0)
    held = np.take_along_axis(rotation_wxyz, last[..., None], axis=0)
    flip = np.ones(is_good.shape)
    flip[1:] = np.where(np.sum(held[1:] * held[:-1], axis=-1) < 0, -1.0, 1.0)
    sign = np.cumprod(flip, axis=0)
    same = np.sum(rotation_wxyz * held, axis=-1) < 0  # what is not good follows the good one before it too
    return rotation_wxyz * np.where(same & ~is_good, -sign, sign)[..., None]


def _median_where(values: Float, is_good: Bools) -> Float:
    """Median of each column (F, S) over its good rows; 0 where there is none."""
    return np.array(
        [np.median(values[is_good[:, s], s]) if is_good[:, s].any() else 0.0 for s in range(values.shape[1])]
    )


def _outlier_findings(recording: Recording, is_usable: Bools, is_outlier: Bools) -> list[Finding]:
    findings = []
    n: NDArray[np.int64] = is_usable.sum(axis=0)
    for s, sensor in enumerate(recording.sensors):
        share = is_outlier[:, s].sum() / max(n[s], 1)
        if share > _MAX_OUTLIER_RATIO:
            first = int(np.flatnonzero(is_outlier[:, s])[0])
            sentence = (
                f"{sensor}: want at most {_MAX_OUTLIER_RATIO:.0%} outliers, got {share:.1%}, the first at frame {first}"
                "; look for a loose strap, a bad cable, or metal near the sensor"
            )
            findings.append(Finding("warning", sensor, first, sentence))
    return findings
