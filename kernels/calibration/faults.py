"""What may be wrong with a recording before anything is computed from it: each fault with sensor, frame and remedy."""

from __future__ import annotations

import numpy as np

from kernels.calibration.records import SENSORS, Bools, Recording, RecordingFinding

MIN_FRAMES = 240
"""Frames of a recording. Measured on made-up recordings: with 120 frames some bone lengths are off by any amount."""

_MAX_DROPPED_RATIO = 0.2
"""Share of a sensor's frames. Chosen by hand."""

# Reach of a body, the median over frames of its largest distance between two sensors, and the unit that gives it.
# Chosen by hand around 1.4 to 1.6 m, measured on made-up recordings of a T-pose; the factors are by definition.
_UNITS = (
    (0.5, 3.0, "metres", 1.0),
    (20.0, 90.0, "inches", 0.0254),
    (100.0, 300.0, "centimetres", 0.01),
    (400.0, 3500.0, "millimetres", 0.001),
)


def check_recording(recording: Recording) -> tuple[RecordingFinding, ...]:
    """Judge the sensors and the values of a recording.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    tuple of RecordingFinding
        Empty where nothing is wrong.
    """
    finite_p = np.isfinite(recording.position_xyz_m).all(-1)
    finite_q = np.isfinite(recording.rotation_wxyz).all(-1)
    is_finite = np.asarray(finite_p & finite_q)
    is_usable = recording.is_valid & is_finite
    return (
        *_sensors(recording),
        *_frames(recording),
        *_not_finite(recording, is_finite),
        *_not_unit(recording, recording.is_valid & finite_q),
        *_units(recording, is_usable),
        *_dropped(recording, is_usable),
    )


def check_sensors(sensors: tuple[str, ...]) -> tuple[RecordingFinding, ...]:
    """Find which of the 17 sensors are missing, and which names are none of theirs.

    Parameters
    ----------
    sensors : names found in a recording

    Returns
    -------
    tuple of RecordingFinding
        An error each.
    """
    missing = [name for name in SENSORS if name not in sensors]
    unknown = [name for name in sensors if name not in SENSORS]
    found = []
    hint = f"; {', '.join(unknown)} may be meant" if unknown else ""
    for name in missing:
        found.append(
            RecordingFinding(
                "error",
                name,
                None,
                f"{name}: want all 17 sensors, got none of that name{hint}; rename it, or strap it on and record again",
            )
        )
    for name in unknown:
        found.append(
            RecordingFinding(
                "error",
                name,
                None,
                f"{name}: want one of {', '.join(SENSORS)}, got a sensor of another name; rename it or leave it out",
            )
        )
    return tuple(found)


def _sensors(recording: Recording) -> tuple[RecordingFinding, ...]:
    return check_sensors(recording.sensors)


def _frames(recording: Recording) -> list[RecordingFinding]:
    f = recording.n_frames
    if f >= MIN_FRAMES:
        return []
    sentence = f"recording: want at least {MIN_FRAMES} frames, got {f}; record a minute or more of whole-body movement"
    return [RecordingFinding("error", None, None, sentence)]


def _not_finite(recording: Recording, is_finite: Bools) -> list[RecordingFinding]:
    wrong = recording.is_valid & ~is_finite
    if not wrong.any():
        return []
    frame, s = (int(k[0]) for k in np.nonzero(wrong))
    name = recording.sensors[s]
    sentence = (
        f"{name}: want finite numbers where an entry is valid, got NaN or infinity at frame {frame} and in "
        f"{int(wrong.sum())} valid entries altogether; mark lost entries is_valid = false"
    )
    return [RecordingFinding("error", name, frame, sentence)]


def _not_unit(recording: Recording, is_usable: Bools) -> list[RecordingFinding]:
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.sqrt(np.sum(recording.rotation_wxyz**2, axis=-1))
    off = np.where(is_usable, np.abs(length - 1.0), 0.0)
    found = []
    for s, name in enumerate(recording.sensors):
        worst = float(off[:, s].max(initial=0.0))
        if worst <= 1e-3:
            continue
        severity, limit = ("error", 1e-2) if worst > 1e-2 else ("warning", 1e-3)
        frame = int(np.flatnonzero(off[:, s] > limit)[0])
        what = f"{name}: want unit quaternions, got one of length {length[frame, s]:.4f} at frame {frame}"
        cure = "check the columns qw qx qy qz" if severity == "error" else "it was made unit; export more decimals"
        found.append(RecordingFinding("error" if severity == "error" else "warning", name, frame, f"{what}; {cure}"))
    return found


def _units(recording: Recording, is_usable: Bools) -> list[RecordingFinding]:
    if recording.n_frames == 0 or len(recording.sensors) < len(SENSORS):
        return []
    step = max(recording.n_frames // 300, 1)
    position = np.where(is_usable[::step, :, None], recording.position_xyz_m[::step], np.nan)
    some = position[np.isfinite(position[..., 0]).sum(axis=1) >= len(SENSORS) // 2]
    if len(some) == 0:
        return []
    apart = np.sqrt(np.sum((some[:, :, None] - some[:, None]) ** 2, axis=-1))
    reach = float(np.median(np.nanmax(apart.reshape(len(some), -1), axis=1)))
    if 0.5 <= reach <= 3.0:
        return []
    unit = next((f"{name}: multiply by {factor}" for low, high, name, factor in _UNITS if low <= reach <= high), None)
    cure = (
        f"positions look like {unit}"
        if unit
        else "check the unit of px_m py_m pz_m, and that one body wears all sensors"
    )
    sentence = f"recording: want metres, sensors 0.5 to 3 m apart, got {reach:.4g} between the farthest two; {cure}"
    return [RecordingFinding("error", None, None, sentence)]


def _dropped(recording: Recording, is_usable: Bools) -> list[RecordingFinding]:
    found = []
    for s, name in enumerate(recording.sensors):
        share = 1.0 - float(is_usable[:, s].mean()) if recording.n_frames else 0.0
        if share > _MAX_DROPPED_RATIO:
            frame = int(np.flatnonzero(~is_usable[:, s])[0])
            sentence = (
                f"{name}: want at most {_MAX_DROPPED_RATIO:.0%} of frames lost, got {share:.1%}, the first at frame "
                f"{frame}; check its cable and its distance from the source, and record again"
            )
            found.append(RecordingFinding("error", name, frame, sentence))
    return found
