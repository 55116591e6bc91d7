"""Where one motion ends and the next begins: intervals between brakings of the body, with three key poses each.

After [Kameda2009]: the angular acceleration of 16 body parts, its extrema, and an interval minimum - maximum - minimum
as one motion. They do not say how the parts are combined nor how the derivative is taken; both are ours.

Conventions
-----------
*Acceleration* is the change of the body's angular speed: positive where it launches, negative where it brakes. A motion
therefore runs from braking over launching to braking. Its ends are put where the body is slowest between braking and
launching, at most a few hundredths of a second after the minimum: the moment that is seen as a stop, and that a dance
puts on a beat.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from kernels import rotation
from kernels.motion.motion_features import FEATURE_RATE_HZ, at_feature_rate
from kernels.skeleton.canonical import JOINTS
from kernels.types import Float, Int

PARTS: tuple[str, ...] = (
    "hips",
    "spine",
    "upperChest",
    "head",
    *(
        side + part
        for side in ("left", "right")
        for part in ("UpperArm", "LowerArm", "Hand", "UpperLeg", "LowerLeg", "Foot")
    ),
)
"""The 16 parts of the body, each by the canonical joint that turns it."""

PART_INDEX: Int = np.array([JOINTS.index(name) for name in PARTS], np.int64)

VELOCITY_SIGMA_S, ACCELERATION_SIGMA_S = 0.04, 0.06
"""Standard deviations of the Gaussians over the angular velocity vectors, and of the filter that differentiates the
speed. Chosen by hand."""

LEAST_PROMINENCE_RATIO, LEAST_PROMINENCE_RAD_PER_S2 = 0.06, 0.3
"""An extremum counts that stands out by so much of the clip's range of accelerations, and by so much at all. Chosen by
hand."""

SHORTEST_S, LONGEST_S = 0.25, 2.0
"""Lengths of a motion. Chosen by hand: an eighth note at 120 a minute, and a bar of four beats."""

CHANGE_WEIGHT = 2.0
"""How much what a motion changes of the body counts against the posture it starts from: the same step, danced a little
more upright, is the same step. Chosen by hand; with 1, tried on a made-up performer, drifts of posture became the
clusters."""


@dataclass(frozen=True, eq=False)
class KeyPoses:
    """Motions of a clip in order, (N,) each; each starts where the one before ended.

    Parameters
    ----------
    start_s, end_s : float64, seconds of the clip: the body is slowest
    peak_s : float64, seconds, start < peak < end: the body launches hardest
    """

    start_s: Float
    peak_s: Float
    end_s: Float


def angular_speed(orientation_wxyz: Float, frame_rate_hz: float) -> Float:
    """Mean angular speed of the body's parts at 120 Hz.

    Parameters
    ----------
    orientation_wxyz : (F, J, 4) float, unit, world, canonical joints
    frame_rate_hz : float, > 0

    Returns
    -------
    (G,) float64, radians a second, >= 0, at 120 Hz from the first frame
        The norm of each part's angular velocity, smoothed as a vector (so that noise cancels and a turn back passes
        through rest), averaged over the parts. Zeros for fewer than three frames.

    Raises
    ------
    ValueError
        If the shape does not fit, a value is not finite, or the rate is not > 0.
    """
    if orientation_wxyz.ndim != 3 or orientation_wxyz.shape[1:] != (len(JOINTS), 4):
        raise ValueError(f"orientation_wxyz: want (F, {len(JOINTS)}, 4), got {orientation_wxyz.shape}")
    if not np.isfinite(orientation_wxyz).all():
        raise ValueError("orientation_wxyz: not finite; mend or refuse the clip where it is read")
    if not (np.isfinite(frame_rate_hz) and frame_rate_hz > 0):
        raise ValueError(f"frame_rate_hz: want > 0, got {frame_rate_hz}")
    if len(orientation_wxyz) < 3:
        return np.zeros(max(int((len(orientation_wxyz) - 1) / frame_rate_hz * FEATURE_RATE_HZ) + 1, 0))
    turned = rotation.continuous(orientation_wxyz[:, PART_INDEX])
    between = rotation.log(rotation.mul(turned[1:], rotation.inv(turned[:-1]))) * frame_rate_hz
    # Of the steps on either side of a frame, so that the values stand on frames.
    velocity = np.concatenate([between[:1], (between[1:] + between[:-1]) / 2, between[-1:]])
    smooth = scipy.ndimage.gaussian_filter1d(velocity, VELOCITY_SIGMA_S * frame_rate_hz, axis=0, mode="nearest")
    speed = np.linalg.norm(smooth, axis=-1).mean(axis=-1)
    return np.maximum(at_feature_rate(speed, frame_rate_hz), 0.0)


def acceleration(speed_rad_per_s: Float) -> Float:
    """Differentiate a speed at 120 Hz by the derivative of a Gaussian.

    Parameters
    ----------
    speed_rad_per_s : (G,) float

    Returns
    -------
    (G,) float64, radians a second squared
    """
    if not len(speed_rad_per_s):
        return np.zeros(0)
    sigma = ACCELERATION_SIGMA_S * FEATURE_RATE_HZ
    slope = scipy.ndimage.gaussian_filter1d(speed_rad_per_s, sigma, order=1, mode="nearest") * FEATURE_RATE_HZ
    return np.asarray(slope, np.float64)


def key_poses(
    speed_rad_per_s: Float, *, shortest_s: float = SHORTEST_S, longest_s: float = LONGEST_S, first_s: float = 0.0
) -> KeyPoses:
    """Cut a clip into motions.

    Parameters
    ----------
    speed_rad_per_s : (G,) float, of :func:`angular_speed`
    shortest_s, longest_s : float, seconds, 0 < 2 * shortest <= longest
        A shorter motion is joined to its neighbour across the weaker braking; a longer one is cut evenly.
    first_s : float, seconds
        Time of the first value.

    Returns
    -------
    KeyPoses
        A clip that begins before any braking starts its first motion there; what follows the last braking is left
        out. Empty when nothing moves or the clip is shorter than the shortest motion.

    Raises
    ------
    ValueError
        If the bounds do not fit or the speed is not finite.
    """
    if not 0 < 2 * shortest_s <= longest_s:
        raise ValueError(f"shortest_s, longest_s: want 0 < 2 * shortest <= longest, got {shortest_s}, {longest_s}")
    if not np.isfinite(speed_rad_per_s).all():
        raise ValueError("speed_rad_per_s: want finite values")
    slope = acceleration(speed_rad_per_s)
    edges, depth = _stops(speed_rad_per_s, slope)
    edges = _longer(edges, depth, round(shortest_s * FEATURE_RATE_HZ))
    edges = _shorter(edges, round(longest_s * FEATURE_RATE_HZ))
    if len(edges) < 2:
        return KeyPoses(np.zeros(0), np.zeros(0), np.zeros(0))
    peak = np.array([a + 1 + int(np.argmax(slope[a + 1 : b])) for a, b in itertools.pairwise(edges)])
    at = [first_s + np.asarray(frame, np.float64) / FEATURE_RATE_HZ for frame in (edges[:-1], peak, edges[1:])]
    return KeyPoses(*at)


def _stops(speed: Float, slope: Float) -> tuple[Int, Float]:
    """Frames where motions meet, and how deep the braking at each is."""
    least = max(LEAST_PROMINENCE_RATIO * float(np.ptp(slope)) if len(slope) else 0.0, LEAST_PROMINENCE_RAD_PER_S2)
    launch = scipy.signal.find_peaks(slope, prominence=least)[0]
    brake = scipy.signal.find_peaks(-slope, prominence=least)[0]
    if not len(launch) or not len(brake):
        return np.zeros(0, np.int64), np.zeros(0)
    # Of brakings with no launch between, the hardest counts.
    group = np.searchsorted(launch, brake)
    kept = np.array([brake[group == g][np.argmin(slope[brake[group == g]])] for g in np.unique(group)], np.int64)
    until = np.append(launch, len(speed) - 1)[np.searchsorted(launch, kept)]
    stop = [b + int(np.argmin(speed[b : max(e, b) + 1])) for b, e in zip(kept, until, strict=True)]
    depth = -slope[kept]
    if launch[0] < kept[0]:
        first = int(np.argmin(speed[: launch[0] + 1]))
        return np.array([first, *stop], np.int64), np.append(np.inf, depth)
    return np.array(stop, np.int64), depth


def _longer(edges: Int, depth: Float, shortest: int) -> Int:
    """Take out the weaker end of the shortest motion until none is too short; the outermost ends stay."""
    edge, deep = list(edges), list(depth)
    while len(edge) > 2:
        length = np.diff(edge)
        short = int(np.argmin(length))
        if length[short] >= shortest:
            break
        inner = [i for i in (short, short + 1) if 0 < i < len(edge) - 1]
        out = min(inner, key=lambda i: (deep[i], i))
        del edge[out], deep[out]
    return np.array(edge if len(edge) > 1 and edge[1] - edge[0] >= shortest else [], np.int64)


def _shorter(edges: Int, longest: int) -> Int:
    """Cut evenly what is too long."""
    parts = [
        np.rint(np.linspace(a, b, -(-(b - a) // longest) + 1)).astype(np.int64)[:-1]
        for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)
    ]
    return np.concatenate([*parts, edges[-1:]]).astype(np.int64)


def pose_vectors(position_xyz_m: Float, root_wxyz: Float, frame_rate_hz: float, motions: KeyPoses) -> Float:
    """Three key poses of each motion as one vector, heading-free.

    Parameters
    ----------
    position_xyz_m : (F, J, 3) float, metres, world, F >= 1
    root_wxyz : (F, 4) float, unit, the hips' rotation in the world
    frame_rate_hz : float, > 0
    motions : KeyPoses of N motions

    Returns
    -------
    (N, 9 J) float64, metres
        Joints at start, peak and end, between frames by lines, seen from where the hips stand on the floor at the
        start and turned so that they face +Z there: where the dancer is and faces does not count, how far the motion
        carries and turns him does. The pose at the start, and the change from it to the other two, weighted by
        :data:`CHANGE_WEIGHT`.
    """
    last = len(position_xyz_m) - 1
    moments = [np.clip(at * frame_rate_hz, 0, last) for at in (motions.start_s, motions.peak_s, motions.end_s)]
    poses = []
    for at in moments:
        below = np.minimum(at.astype(np.int64), max(last - 1, 0))
        share = (at - below)[:, None, None]
        poses.append((1 - share) * position_xyz_m[below] + share * position_xyz_m[np.minimum(below + 1, last)])
    origin = poses[0][:, 0] * np.array([1.0, 0.0, 1.0])
    first = np.rint(moments[0]).astype(np.int64)
    facing = rotation.from_heading(-rotation.heading_rad(root_wxyz[first]))
    turned = [rotation.apply(facing[:, None], p - origin[:, None]) for p in poses]
    return to_vectors(np.stack(turned, axis=1))


def to_vectors(poses_xyz_m: Float) -> Float:
    """Weigh key poses, (N, 3, J, 3) metres, as motions are compared: vectors of :func:`pose_vectors`, (N, 9 J)."""
    start = poses_xyz_m[:, :1]
    parts = np.concatenate([start, CHANGE_WEIGHT * (poses_xyz_m[:, 1:] - start)], axis=1)
    return np.asarray(parts.reshape(len(parts), 9 * poses_xyz_m.shape[2]), np.float64)


def to_poses(vector: Float) -> NDArray[np.float64]:
    """Unpack vectors of :func:`pose_vectors`, (N, 9 J), to poses, (N, 3, J, 3) float64, metres."""
    parts = vector.reshape(len(vector), 3, -1, 3)
    start = parts[:, :1]
    return np.concatenate([start, start + parts[:, 1:] / CHANGE_WEIGHT], axis=1)
