"""A suit recording, from the file to a skeleton and its poses: the kernels in their order, and what stops them.

Shared by the capture area and by the command, which works without a studio; knows neither.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from assets.formats import suit, suit_columns
from assets.formats.suit_long import Suit
from assets.formats.suit_names import unknown_sensor
from kernels import rotation
from kernels.calibration.calibrate import calibrate
from kernels.calibration.cleaning import clean
from kernels.calibration.poses import solve_poses
from kernels.calibration.records import SENSORS, BodyPoses, Calibration, Cleaned, Recording, RecordingFinding
from kernels.calibration.solved_clip import Gauge, find_gauge, to_clip
from kernels.calibration.tree_solver import PoseSolver
from kernels.types import Clip
from schemas.settings import CalibrationSettings

# Of a method, its solver on a device; None for the NumPy reference.
Solvers = Callable[[str], PoseSolver | None]
Made = TypeVar("Made")


class CalibrationError(ValueError):
    """A recording no body can be had from.

    Parameters
    ----------
    findings : what is wrong with it, errors among them
    calibration : Calibration or None
        What was found all the same, where only some joints failed.
    seconds : how long each stage took
    """

    def __init__(
        self,
        findings: Iterable[RecordingFinding],
        calibration: Calibration | None = None,
        seconds: Mapping[str, float] | None = None,
    ) -> None:
        self.findings = tuple(findings)
        self.calibration = calibration
        self.seconds = dict(seconds or {})
        super().__init__("; ".join(self.errors))

    @property
    def errors(self) -> list[str]:
        """The sentences that are errors."""
        return [finding.sentence for finding in self.findings if finding.severity == "error"]


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A recording brought to a skeleton and its poses.

    Parameters
    ----------
    suit : as read; its sensors in our order
    cleaned, calibration, poses : of the kernels, in the recording's own world
    gauge : how it stands in our world
    clip : metres, Y up, on its own skeleton
    warnings : what is doubtful, one sentence each
    seconds : how long each stage took
    """

    suit: Suit
    cleaned: Cleaned
    calibration: Calibration
    poses: BodyPoses
    gauge: Gauge
    clip: Clip
    warnings: tuple[str, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)


class _Watch:
    """Seconds of stages, one after the other."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    def __call__(self, stage: str, make: Callable[[], Made]) -> Made:
        start = time.perf_counter()
        made = make()
        self.seconds[stage] = round(time.perf_counter() - start, 4)
        return made


def calibrate_file(
    path: Path,
    *,
    settings: CalibrationSettings,
    sensors: Mapping[str, str] | None = None,
    solvers: Solvers | None = None,
    max_bytes: int = suit_columns.MAX_BYTES,
) -> Calibrated:
    """Read a recording and calibrate the body in it.

    Parameters
    ----------
    path : file
    settings : the ``[calibration]`` section
    sensors : the ``[sensors]`` section: names in the file to ours
    solvers : where poses are solved; None for the NumPy references
    max_bytes : int
        Larger files are refused before they are read.

    Returns
    -------
    Calibrated

    Raises
    ------
    FormatError
        If the file is no recording, or its rows contradict each other.
    CalibrationError
        If the recording has a fault that no result may come from.
    OSError
        If it cannot be opened.
    """
    watch = _Watch()
    read = watch("read", lambda: suit.read(path, sensors=sensors, unit=settings.unit, max_bytes=max_bytes))
    with threadpool_limits(limits=1, user_api="blas"):
        return _calibrate(read, settings, solvers, watch)


def calibrate_recording(recording: Recording, *, settings: CalibrationSettings) -> Calibrated:
    """Calibrate the body in a recording that no file holds, on the NumPy references.

    Parameters
    ----------
    recording : Recording of the 17 sensors, in any order
    settings : CalibrationSettings

    Returns
    -------
    Calibrated

    Raises
    ------
    CalibrationError
        If sensors are missing or strange, or the recording has a fault that no result may come from.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        return _calibrate(Suit(recording, 0, 1.0), settings, None, _Watch())


def _calibrate(read: Suit, settings: CalibrationSettings, solvers: Solvers | None, watch: _Watch) -> Calibrated:
    recording = in_order(read.recording)
    cleaned = watch("clean", lambda: clean(recording, cutoff_hz=settings.low_pass_hz))
    _stop_at(cleaned.findings, None, watch)
    calibration = watch("calibrate", lambda: calibrate(cleaned))
    findings = tuple(dict.fromkeys((*cleaned.findings, *calibration.findings)))
    _stop_at(findings, calibration, watch)
    chosen: Any = settings.method
    poses = watch(
        "poses",
        lambda: solve_poses(
            cleaned,
            calibration,
            method=chosen,
            iterations=settings.iterations or None,
            device=solvers(settings.method) if solvers else None,
        ),
    )
    rate_hz = recording.frame_rate_hz
    gauge = find_gauge(poses, rate_hz)
    clip = watch("clip", lambda: to_clip(poses, rate_hz, gauge=gauge))
    doubts = [f.sentence for f in findings if f.severity == "warning"]
    whole = replace(read, recording=recording)
    return Calibrated(whole, cleaned, calibration, poses, gauge, clip, (*read.warnings, *doubts), watch.seconds)


def _stop_at(findings: Sequence[RecordingFinding], calibration: Calibration | None, watch: _Watch) -> None:
    if any(finding.severity == "error" for finding in findings):
        raise CalibrationError(findings, calibration, watch.seconds)


def up_axis(gauge: Gauge) -> str:
    """Find the axis of the recording's world that points up most.

    Parameters
    ----------
    gauge : Gauge

    Returns
    -------
    str
        ``X``, ``Y`` or ``Z``, with a minus where it points down.
    """
    up = rotation.apply(rotation.inv(gauge.up_wxyz), np.array([0.0, 1.0, 0.0]))
    axis = int(np.argmax(np.abs(up)))
    return ("-" if up[axis] < 0 else "") + "XYZ"[axis]


def in_order(recording: Recording) -> Recording:
    """Put the sensors of a suit in the order the kernels want.

    Parameters
    ----------
    recording : Recording of S sensors

    Returns
    -------
    Recording
        The same readings, sensors as in :data:`kernels.calibration.records.SENSORS`.

    Raises
    ------
    CalibrationError
        If one of the 17 is missing, or there is another.
    """
    there = set(recording.sensors)
    missing = [name for name in SENSORS if name not in there]
    strangers = [name for name in recording.sensors if name not in SENSORS]
    if missing and len(recording.sensors) < len(SENSORS) / 2:
        sentence = (
            f"sensors: want the {len(SENSORS)} of a suit, got {len(there)} ({', '.join(recording.sensors)}); a body "
            "cannot be calibrated from these, record with the whole suit"
        )
        raise CalibrationError([RecordingFinding("error", None, None, sentence)])
    errors = [RecordingFinding("error", name, None, unknown_sensor(name)) for name in strangers]
    errors += [
        RecordingFinding(
            "error", name, None, f"sensor {name}: want its rows, got none; switch it on, or name it so in the file"
        )
        for name in missing
    ]
    if errors:
        raise CalibrationError(errors)
    order = [recording.sensors.index(name) for name in SENSORS]
    return Recording(
        recording.frame_rate_hz,
        SENSORS,
        recording.position_xyz_m[:, order],
        recording.rotation_wxyz[:, order],
        recording.is_valid[:, order],
    )
