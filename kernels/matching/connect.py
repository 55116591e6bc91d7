"""Which candidate may follow which: link directions and their velocities at the joint.

After [Shiratori2006]: two pieces of motion connect where the directions of the body's links and how they change are
alike at the seam. Their thresholds are not in the copies we have; ours are measured inside the clips: what a body does
on its own while a blend lasts is no seam.

Conventions
-----------
``L`` links, body-centred unit directions at 120 Hz (:func:`kernels.motion.motion_features.link_directions`), weights of
sum 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kernels.motion.motion_features import FEATURE_RATE_HZ
from kernels.types import Float

LIKE_NEIGHBOURS_PERCENTILE = 95.0
"""Share of the pairs of neighbouring moments that pass. Chosen by hand, by convention of statistics."""

LEAST_POSE_RAD, LEAST_SPEED_RAD_PER_S = 0.05, 0.25
"""Thresholds are no lower, or clips that stand still would connect with nothing. Chosen by hand."""

VELOCITY_SPAN = 2
"""Frames on either side over which a velocity is taken, 17 ms in all. Chosen by hand."""


@dataclass(frozen=True)
class ConnectionThresholds:
    """Differences up to which two poses connect: radians, and radians a second, weighted means over links."""

    pose_rad: float
    speed_rad_per_s: float


@dataclass(frozen=True, eq=False)
class JointPoses:
    """Poses at one end of N candidates.

    Parameters
    ----------
    direction : (N, L, 3) float, unit
    velocity : (N, L, 3) float, radians a second of song
    """

    direction: Float
    velocity: Float


def poses_at(direction: Float, time_s: Float, *, pace: Float) -> JointPoses:
    """Poses of one clip at given times, as a dance at another pace passes them.

    Parameters
    ----------
    direction : (F, L, 3) float, unit, at 120 Hz, F >= 1
    time_s : (N,) float, seconds of the clip; held at its ends beyond them
    pace : (N,) float, > 0, seconds of clip per second of song

    Returns
    -------
    JointPoses
        Of the nearest frame; the velocity by differences over up to two frames on either side, 0 for one frame.
    """
    last = len(direction) - 1
    frame = np.clip(np.rint(np.asarray(time_s) * FEATURE_RATE_HZ).astype(np.int64), 0, last)
    before, after = np.maximum(frame - VELOCITY_SPAN, 0), np.minimum(frame + VELOCITY_SPAN, last)
    span_s = np.maximum(after - before, 1) / FEATURE_RATE_HZ
    velocity = (direction[after] - direction[before]) * (np.asarray(pace) / span_s)[:, None, None]
    return JointPoses(direction[frame], velocity)


def differences(end: JointPoses, start: JointPoses, weight: Float) -> tuple[Float, Float]:
    """Differences between every end and every start.

    Parameters
    ----------
    end, start : JointPoses of N and M candidates
    weight : (L,) float, >= 0, sum 1

    Returns
    -------
    pose_rad : (N, M) float64, weighted mean angle between link directions
    speed_rad_per_s : (N, M) float64, weighted mean length of the difference of their velocities
    """
    chord = np.linalg.norm(end.direction[:, None] - start.direction[None], axis=-1)
    pose = (2.0 * np.arcsin(np.clip(chord / 2.0, 0.0, 1.0))) @ weight
    speed = np.linalg.norm(end.velocity[:, None] - start.velocity[None], axis=-1) @ weight
    return pose, speed


def own_changes(direction: Float, weight: Float, *, apart_s: float) -> tuple[Float, Float]:
    """Measure how much one clip changes between moments a little apart.

    Parameters
    ----------
    direction : (F, L, 3) float, unit
    weight : (L,) float, sum 1
    apart_s : float, seconds, > 0

    Returns
    -------
    pose_rad, speed_rad_per_s : (n,) float64
        As :func:`differences` has them, for at most 200 even moments; none in a clip that is too short.
    """
    step = max(round(apart_s * FEATURE_RATE_HZ), 1)
    last = len(direction) - VELOCITY_SPAN - step
    if last <= VELOCITY_SPAN:
        return np.zeros(0), np.zeros(0)
    at = np.unique(np.linspace(VELOCITY_SPAN, last - 1, 200).astype(np.int64))
    pace = np.ones(len(at))
    first = poses_at(direction, at / FEATURE_RATE_HZ, pace=pace)
    second = poses_at(direction, (at + step) / FEATURE_RATE_HZ, pace=pace)
    chord = np.linalg.norm(first.direction - second.direction, axis=-1)
    pose = (2.0 * np.arcsin(np.clip(chord / 2.0, 0.0, 1.0))) @ weight
    return pose, np.linalg.norm(first.velocity - second.velocity, axis=-1) @ weight


def calibrate(changes: Sequence[tuple[Float, Float]]) -> ConnectionThresholds:
    """Set thresholds by what bodies do on their own.

    Parameters
    ----------
    changes : pose and speed of :func:`own_changes`, one pair a clip
        Moments half a blend apart: a seam is spread over a blend, so that is the time in which a body may change so
        much.

    Returns
    -------
    ConnectionThresholds
        The 95th percentiles over all clips, each clip given the same say, and at least 0.05 rad and 0.25 rad/s.
    """
    told = [(pose, speed) for pose, speed in changes if len(pose)]
    if not told:
        return ConnectionThresholds(LEAST_POSE_RAD, LEAST_SPEED_RAD_PER_S)
    share = np.concatenate([np.full(len(pose), 1.0 / len(pose)) for pose, _ in told])
    return ConnectionThresholds(
        max(_percentile(np.concatenate([pose for pose, _ in told]), share), LEAST_POSE_RAD),
        max(_percentile(np.concatenate([speed for _, speed in told]), share), LEAST_SPEED_RAD_PER_S),
    )


def _percentile(values: Float, share: Float) -> float:
    order = np.argsort(values, kind="stable")
    reached = np.cumsum(share[order]) / share.sum()
    return float(values[order][np.searchsorted(reached, LIKE_NEIGHBOURS_PERCENTILE / 100.0 - 1e-12)])


def connects(pose_rad: Float, speed_rad_per_s: Float, limits: ConnectionThresholds) -> NDArray[np.bool_]:
    """Whether both differences are within their thresholds, of the shape given.

    Parameters
    ----------
    pose_rad, speed_rad_per_s : float arrays of one shape, >= 0, of :func:`differences`
    limits : ConnectionThresholds

    Returns
    -------
    bool, of that shape
    """
    return np.asarray((pose_rad <= limits.pose_rad) & (speed_rad_per_s <= limits.speed_rad_per_s))
