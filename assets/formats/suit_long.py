"""Suit recordings with one row a frame and sensor: the columns they need, and what they hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from assets.formats.suit_columns import Columns, column
from assets.formats.suit_names import name_sensors
from kernels.calibration import timeline
from kernels.calibration.records import Recording
from kernels.types import Float, Int

METRES_PER_UNIT = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "inch": 0.0254}
"""By definition."""

_FRAME = ("frame", "frame_index", "frame_number", "frameindex", "frame_id")
_SENSOR = ("sensor", "sensor_name", "sensor_id", "segment", "segment_name", "station")
_VALID = ("is_valid", "valid", "isvalid", "ok")
# Seconds of each column's unit, by definition.
SECONDS = {"time_s": 1.0, "time": 1.0, "timestamp": 1.0, "timestamp_s": 1.0, "t": 1.0, "t_s": 1.0}
SECONDS |= {"time_ms": 1e-3, "timestamp_ms": 1e-3, "time_us": 1e-6, "timestamp_us": 1e-6, "time_ns": 1e-9}
_QUATERNION = ("q{}", "q_{}", "quat_{}", "rot_{}", "rotation_{}", "quaternion_{}")
_POSITION = ("p{}", "pos_{}", "position_{}", "p_{}", "{}")
WANTED = "frame, time_s, sensor, px_m, py_m, pz_m, qw, qx, qy, qz, is_valid"


@dataclass(frozen=True, eq=False)
class Suit:
    """A suit recording as read.

    Parameters
    ----------
    recording : Recording
        On an even grid of frames.
    first_frame_index : int
        Number of its first frame in the file.
    metres_per_unit : float
        What the file's lengths were multiplied by.
    notes : what was made of the file, one sentence each
    warnings : what was assumed of it, or is missing from it
    """

    recording: Recording
    first_frame_index: int
    metres_per_unit: float
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def is_long(names: list[str]) -> bool:
    """Whether columns are meant for this form: a sensor, and any of a quaternion.

    Parameters
    ----------
    names : of the columns, in lower case
    """
    return any(n in names for n in _SENSOR) and any(f.format(c) in names for f in _QUATERNION for c in "wxyz")


def parse(columns: Columns, own: dict[str, str] | None = None) -> Suit:
    """Read the long form.

    Parameters
    ----------
    columns : of the file
    own : names of sensors in the file to ours, the user's own

    Returns
    -------
    Suit
        Frames without a row for a sensor are not valid for it.

    Raises
    ------
    FormatError
        Naming the row, if a column is missing, a frame has a sensor twice, or time does not rise from frame to frame.
    """
    time_name, position_names, quaternion_names, scale = _needed(columns)
    number, names = columns.texts(next(n for n in _SENSOR if n in columns.names))
    try:
        sensors, said = name_sensors(names, own)
    except ValueError as error:
        raise columns.error(None, str(error)) from error
    time_s = columns.numbers(time_name) * SECONDS[time_name]
    _finite(columns, time_name, time_s)
    frame, first_frame, at_s = _frames(columns, time_s, len(sensors))
    _once(columns, frame, number, sensors)
    f, s = len(at_s), len(sensors)
    position, turned = np.full((f, s, 3), np.nan), np.full((f, s, 4), np.nan)
    valid = np.zeros((f, s), bool)
    for c, name in enumerate(position_names):
        position[frame, number, c] = columns.numbers(name) * scale
    for c, name in enumerate(quaternion_names):
        turned[frame, number, c] = columns.numbers(name)
    valid_name = column(columns, *_VALID)
    here = columns.flags(valid_name) if valid_name else np.ones(columns.n_rows, bool)
    valid[frame, number] = here
    warnings = [said] if said else []
    if not valid_name:  # a drop-out is then written as no numbers at all
        valid &= ~(np.isnan(position).all(-1) & np.isnan(turned).all(-1))
    n_missing = f * s - columns.n_rows
    if n_missing:
        warnings.append(f"{n_missing} of {f * s} rows are missing; their sensors count as not heard")
    try:
        line = timeline.timeline(at_s)
    except ValueError as error:
        raise columns.error(None, str(error)) from error
    notes, more = notes_on_time(line)
    position, turned, valid = timeline.onto_grid(line, at_s, position, turned, valid)
    return Suit(kept(line.rate_hz, sensors, position, turned, valid), first_frame, scale, notes, (*warnings, *more))


def kept(
    rate_hz: float, sensors: tuple[str, ...], position: Float, turned: Float, valid: NDArray[np.bool_]
) -> Recording:
    """Make a recording of the sensors that have a name.

    Parameters
    ----------
    rate_hz : float, > 0
    sensors : S names, "" for a sensor to leave out
    position : (F, S, 3) float64, metres
    turned : (F, S, 4) float64, ``wxyz``
    valid : (F, S) bool

    Returns
    -------
    Recording
        Of the sensors with a name, in the same order.

    Raises
    ------
    ValueError
        As :class:`kernels.calibration.records.Recording`.
    """
    k = [i for i, name in enumerate(sensors) if name]
    return Recording(rate_hz, tuple(sensors[i] for i in k), position[:, k], turned[:, k], valid[:, k])


def _needed(columns: Columns) -> tuple[str, list[str], list[str], float]:
    """Find the columns, or say which are missing."""
    names = columns.names
    time_name = column(columns, *SECONDS)
    quaternion = [[f.format(c) for f in _QUATERNION if f.format(c) in names] for c in "wxyz"]
    if not quaternion[0] and "w" in names:
        quaternion[0] = ["w"]
    found: dict[str, list[str]] = {}
    for unit in ("", *METRES_PER_UNIT):
        for pattern in _POSITION:
            spelt = [pattern.format(c) + (f"_{unit}" if unit else "") for c in "xyz"]
            here = [name for name in spelt if name in names]
            if here and len(here) > len(found.get("names", [])):
                found = {"names": here, "unit": [unit or "m"], "spelt": spelt}
    missing = [] if time_name else ["time_s"]
    missing += [n for n in found.get("spelt", ["px_m", "py_m", "pz_m"]) if n not in found.get("names", [])]
    missing += [f"q{c}" for c, spelt in zip("wxyz", quaternion, strict=True) if not spelt]
    if missing:
        what = f"want the columns {WANTED}, got none of {', '.join(missing)}; got {', '.join(names)}; name them so"
        raise columns.error(None, what)
    scale = METRES_PER_UNIT[found["unit"][0]]
    return str(time_name), found["names"], [spelt[0] for spelt in quaternion], scale


def _finite(columns: Columns, name: str, values: Float) -> None:
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        raise columns.error(bad[0], f"column {name!r}: want a number, got none in {len(bad)} rows; mend them")


def _frames(columns: Columns, time_s: Float, n_sensors: int) -> tuple[Int, int, Float]:
    """Frame of each row from 0, number of the first frame, and the time of each frame."""
    name = column(columns, *_FRAME)
    if name is None:
        at_s, frame = np.unique(time_s, return_inverse=True)
        return frame.astype(np.int64), 0, at_s
    said = columns.numbers(name)
    _finite(columns, name, said)
    whole = np.rint(said).astype(np.int64)
    if (whole != said).any():
        row = int(np.flatnonzero(whole != said)[0])
        raise columns.error(row, f"column {name!r}: want a whole number, got {said[row]:g}; mend the row")
    numbers, first_row, frame = np.unique(whole, return_index=True, return_inverse=True)
    at_s = time_s[first_row]
    step = np.diff(at_s)
    if (step <= 0).any():
        k = int(np.flatnonzero(step <= 0)[0]) + 1
        what = "repeated" if step[k - 1] == 0 else "not rising"
        raise columns.error(
            first_row[k],
            f"frame {numbers[k]}: want a time after {at_s[k - 1]:g} s of frame {numbers[k - 1]}, got {at_s[k]:g} s "
            f"({what}); sort the recording or export it again",
        )
    spread = np.abs(time_s - at_s[frame])
    if len(step) and spread.max() > np.median(step):
        row = int(spread.argmax())
        raise columns.error(
            row,
            f"frame {whole[row]}: want one time for all its sensors, got {time_s[row]:g} s and {at_s[frame[row]]:g} s; "
            "export it again",
        )
    return frame.astype(np.int64), int(numbers[0]), at_s


def _once(columns: Columns, frame: Int, number: Int, sensors: tuple[str, ...]) -> None:
    """Refuse a frame that has a sensor twice."""
    key = frame * len(sensors) + number
    order = np.argsort(key, kind="stable")
    again = np.flatnonzero(np.diff(key[order]) == 0)
    if len(again):
        row = int(order[again + 1].min())
        raise columns.error(
            row,
            f"frame {frame[row]}, sensor {sensors[number[row]]}: want one row, got another ({len(again)} in all); "
            "take out the repeated rows",
        )


def notes_on_time(line: timeline.Timeline) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Say what was made of the times of a recording, and what is doubtful about them.

    Parameters
    ----------
    line : the grid the samples were put on

    Returns
    -------
    notes, warnings : one sentence each; none for an even stream without a gap
    """
    if line.kind == "uneven":
        return (), (f"times are uneven; interpolated to {line.rate_hz:g} frames a second",)
    said = () if line.kind == "even" else (f"times come in bursts; samples counted at {line.rate_hz:g} a second",)
    return said, (f"{line.n_lost} frames are missing from the times; they count as not heard",) if line.n_lost else ()


def to_table(recording: Recording) -> pa.Table:
    """Write a recording as the long form, one row a frame and sensor, frames in order.

    Parameters
    ----------
    recording : Recording of F frames and S sensors

    Returns
    -------
    pyarrow.Table
        F S rows with the columns :data:`WANTED`: metres, seconds to the nanosecond, from frame 0.
    """
    f, s = recording.is_valid.shape
    p, q = recording.position_xyz_m.reshape(-1, 3), recording.rotation_wxyz.reshape(-1, 4)
    frame = np.repeat(np.arange(f, dtype=np.int32), s)
    values: dict[str, object] = {
        "frame": frame,
        "time_s": np.round(frame / recording.frame_rate_hz, 9),
        "sensor": pa.DictionaryArray.from_arrays(
            pa.array(np.tile(np.arange(s, dtype=np.int32), f)), pa.array(recording.sensors)
        ).cast(pa.string()),
    }
    values |= {f"p{c}_m": p[:, k] for k, c in enumerate("xyz")}
    values |= {f"q{c}": q[:, k] for k, c in enumerate("wxyz")}
    values["is_valid"] = recording.is_valid.reshape(-1)
    return pa.table(values)
