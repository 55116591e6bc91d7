"""Gaps, glitches and noise of a suit recording.

Conventions
-----------
Series are (F, S, C): frames, sensors, components; every function works on all sensors at once. An entry is one sensor
at one frame.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy
from numpy.typing import NDArray

from kernels import rotation
from kernels.calibration.faults import check_recording
from kernels.calibration.gaps import aligned, bridge
from kernels.calibration.hampel import find_outliers, median_where
from kernels.calibration.hemispheres import undo_hemispheres
from kernels.calibration.joint_outliers import judge_by_joints
from kernels.calibration.records import SENSORS, Bools, Cleaned, Recording, RecordingFinding
from kernels.calibration.silence import find_silent
from kernels.types import Float

CUTOFF_HZ = 12.0
"""Of the low-pass. Tuned on made-up recordings: 6 to 12 Hz do alike up to three times the usual speed of movement."""

_MAX_OUTLIER_RATIO = 0.05
"""Share of outliers from which there is a warning. Chosen by hand; joints are still right with as many."""


def clean(recording: Recording, *, cutoff_hz: float = CUTOFF_HZ) -> Cleaned:
    """Leave out silent sensors, undo hemisphere jumps, fill gaps and outliers, measure the noise, and filter it.

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
    is_silent, findings = find_silent(recording)
    recording = replace(recording, is_valid=recording.is_valid & ~is_silent)
    findings += check_recording(recording)
    is_usable = recording.is_valid & _is_finite(recording)
    position = np.where(is_usable[..., None], recording.position_xyz_m, 0.0)
    turned = np.where(is_usable[..., None], recording.rotation_wxyz, rotation.IDENTITY)
    length = np.sqrt(np.sum(turned * turned, axis=-1, keepdims=True))
    turned = np.where(length > 1e-6, turned / np.maximum(length, 1e-6), rotation.IDENTITY)
    is_usable = np.asarray(is_usable & (length[..., 0] > 1e-6))
    position, jumps = undo_hemispheres(position, is_usable, sensors=recording.sensors)
    findings += jumps
    is_outlier = find_outliers(position, turned, is_usable, frame_rate_hz=recording.frame_rate_hz)
    if recording.sensors == SENSORS:
        is_outlier = judge_by_joints(position, turned, is_usable, is_outlier)
    is_good = is_usable & ~is_outlier
    rate_hz = recording.frame_rate_hz
    position = bridge(position, is_good, frame_rate_hz=rate_hz)
    turned = bridge(aligned(turned, is_good), is_good, frame_rate_hz=rate_hz)
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
        np.stack([median_where(np.abs(np.diff(series[..., c], 3, axis=0)), whole) for c in range(series.shape[-1])])
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
    sections = scipy.signal.butter(2, cutoff_hz, fs=frame_rate_hz, output="sos")
    _, response = scipy.signal.sosfreqz(sections, worN=4096)
    flat = np.ascontiguousarray(np.moveaxis(series, 0, -1), np.float64)
    filtered = scipy.signal.sosfiltfilt(sections, flat, axis=-1)
    return np.ascontiguousarray(np.moveaxis(filtered, -1, 0)), float(np.mean(np.abs(response) ** 4))


def _is_finite(recording: Recording) -> Bools:
    finite = np.isfinite(recording.position_xyz_m).all(-1) & np.isfinite(recording.rotation_wxyz).all(-1)
    return np.asarray(finite)


def _outlier_findings(recording: Recording, is_usable: Bools, is_outlier: Bools) -> list[RecordingFinding]:
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
            findings.append(RecordingFinding("warning", sensor, first, sentence))
    return findings
