"""Records that the stages of calibration hand to each other, and the body they speak of.

Conventions
-----------
Axes: ``F`` frames, ``S`` the 17 sensors in the order of :data:`SENSORS`. A segment is named after the sensor strapped
to it, a joint after the segment it moves: ``l_forearm`` is the left elbow. Everything is in the recording's own world,
in metres; rotations are ``wxyz``, from sensor to world.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from kernels.types import Float

Bools = NDArray[np.bool_]

_LIMBS = ("shoulder", "upper_arm", "forearm", "hand"), ("thigh", "shank", "foot")

PARENT_SENSOR: dict[str, str | None] = {"pelvis": None, "thorax": "pelvis", "head": "thorax"}
for _side in ("l", "r"):
    for _limb, _root in zip(_LIMBS, ("thorax", "pelvis"), strict=True):
        for _above, _part in zip((None, *_limb[:-1]), _limb, strict=True):
            PARENT_SENSOR[f"{_side}_{_part}"] = _root if _above is None else f"{_side}_{_above}"

SENSORS: tuple[str, ...] = tuple(PARENT_SENSOR)
"""The 17 sensors, parents first."""

PARENT: tuple[int, ...] = tuple(-1 if name is None else SENSORS.index(name) for name in PARENT_SENSOR.values())
"""Index of the sensor each hangs from; the pelvis, 0, has -1."""

JOINTS: tuple[str, ...] = SENSORS[1:]
"""The 16 joints, each named after the segment it moves."""

Confidence = Literal["high", "medium", "low", "axis-unobserved", "none"]
Severity = Literal["error", "warning"]


@dataclass(frozen=True)
class RecordingFinding:
    """Something wrong or doubtful in a recording.

    Parameters
    ----------
    severity : "error" or "warning"
        An error stands for a result that must not be used.
    sensor : str or None
        The sensor it is about; None where it is about all of them.
    frame_index : int or None
        The first frame it is about; None where it is about all of them.
    sentence : str
        What was wanted, what came, and the remedy.
    """

    severity: Severity
    sensor: str | None
    frame_index: int | None
    sentence: str


@dataclass(frozen=True, eq=False)
class Recording:
    """What the sensors of a suit said, frame by frame.

    Parameters
    ----------
    frame_rate_hz : float, > 0
    sensors : S names
    position_xyz_m : (F, S, 3) float64, metres
    rotation_wxyz : (F, S, 4) float64, sensor to world
    is_valid : (F, S) bool
        Positions and rotations may be NaN only where this is False.

    Raises
    ------
    ValueError
        If a shape does not fit, a name comes twice, or the rate is not > 0. Values are judged by
        :func:`kernels.calibration.faults.check_recording`.
    """

    frame_rate_hz: float
    sensors: tuple[str, ...]
    position_xyz_m: Float
    rotation_wxyz: Float
    is_valid: Bools

    def __post_init__(self) -> None:
        f, s = len(self.position_xyz_m), len(self.sensors)
        if s < 1 or len(set(self.sensors)) != s:
            raise ValueError(f"sensors: want at least one and no name twice, got {self.sensors}")
        if not (np.isfinite(self.frame_rate_hz) and self.frame_rate_hz > 0):
            raise ValueError(f"frame_rate_hz: want > 0, got {self.frame_rate_hz}")
        for name, shape in (("position_xyz_m", (f, s, 3)), ("rotation_wxyz", (f, s, 4)), ("is_valid", (f, s))):
            if getattr(self, name).shape != shape:
                raise ValueError(f"{name}: want {shape}, got {getattr(self, name).shape}")

    @property
    def n_frames(self) -> int:
        """Number of frames, F."""
        return len(self.position_xyz_m)


@dataclass(frozen=True, eq=False)
class Cleaned:
    """A recording without gaps and glitches.

    Parameters
    ----------
    recording : Recording
        Filtered, every value finite, rotations unit and continuous in sign; ``is_valid`` as it was received, but for
        readings that say nothing (:mod:`kernels.calibration.silence`).
    is_filled : (F, S) bool
        Entries that were missing or judged an outlier, and were interpolated.
    position_noise_m : (S,) float64, metres
        Standard deviation an axis of the noise before filtering.
    rotation_noise_rad : (S,) float64, radians
        The same of the rotation vector.
    noise_gain : float, 0 to 1
        Share of the noise's power that the low-pass leaves.
    n_outliers : (S,) int64
        Entries judged outliers.
    findings : RecordingFinding each
    """

    recording: Recording
    is_filled: Bools
    position_noise_m: Float
    rotation_noise_rad: Float
    noise_gain: float
    n_outliers: NDArray[np.int64]
    findings: tuple[RecordingFinding, ...] = ()


@dataclass(frozen=True, eq=False)
class JointEstimate:
    """One joint of a calibrated body.

    Parameters
    ----------
    joint : str
        The child segment, ``l_upper_arm``.
    parent : str
        The segment it hangs from.
    length_m : float, metres
        From the joint of the parent segment to this one: the length of the bone that leads here. For the joints of
        the pelvis, from the point midway between the hips.
    in_parent_sensor_m, in_child_sensor_m : (3,) float64, metres
        The joint in the frames of the two sensors.
    confidence : "high", "medium", "low", "axis-unobserved" or "none"
    rank : int, 0 to 3
        Directions of the joint that the motion shows.
    residual_rms_m, residual_sigma_m : float, metres
        Distance between the joint as carried by either sensor: root mean square, and robust standard deviation an axis.
    conditioning : float, >= 1
        Ratio of the largest to the smallest singular value of the pair's equations.
    range_of_motion_rad : (3,) float64, radians, falling
        How far the joint was moved about its directions; the last decides.
    n_frames : int
        Frames in which both sensors were good.
    advice : str
        What the performer can do better; empty where there is nothing.
    """

    joint: str
    parent: str
    length_m: float
    in_parent_sensor_m: Float
    in_child_sensor_m: Float
    confidence: Confidence
    rank: int
    residual_rms_m: float
    residual_sigma_m: float
    conditioning: float
    range_of_motion_rad: Float
    n_frames: int
    advice: str = ""


@dataclass(frozen=True, eq=False)
class Calibration:
    """A body found from its sensors.

    Parameters
    ----------
    joints : JointEstimate each, in the order of :data:`JOINTS`
    findings : RecordingFinding each
        Those of cleaning included.
    residual_m : (F, 16) float64, metres
        Distance between each joint as carried by either sensor, frame by frame.
    """

    joints: tuple[JointEstimate, ...]
    findings: tuple[RecordingFinding, ...]
    residual_m: Float = field(default_factory=lambda: np.zeros((0, len(JOINTS))))

    @property
    def in_parent_sensor_m(self) -> Float:
        """Joints in the frames of their parents' sensors, (16, 3)."""
        return np.stack([joint.in_parent_sensor_m for joint in self.joints])

    @property
    def in_child_sensor_m(self) -> Float:
        """Joints in the frames of their own sensors, (16, 3)."""
        return np.stack([joint.in_child_sensor_m for joint in self.joints])


@dataclass(frozen=True, eq=False)
class BodyPoses:
    """A body closed at its joints, frame by frame.

    Parameters
    ----------
    joints : the 17 segments
        The first, the pelvis, stands for the point midway between the hips; the others for their proximal joints.
    position_xyz_m : (F, 17, 3) float64, metres, world
        Joint centres.
    rotation_wxyz : (F, 17, 4) float64, world
        Segments, in the gauge of their sensors: what a sensor glued to the bone would read.
    gap_before_m : (F, 16) float64, metres
        Distance between the two ends at each joint, each carried by its own sensor.
    gap_after_m : (F, 16) float64, metres
        The same after solving.
    """

    joints: tuple[str, ...]
    position_xyz_m: Float
    rotation_wxyz: Float
    gap_before_m: Float
    gap_after_m: Float
