"""Made-up recordings of a 17-sensor suit, with the body, the mounts and the motion behind them known.

Nothing here is recorded from anybody. The body, its motion, the mounts and each kind of noise draw from random streams
of their own, so the same seed at another noise level has the same body and the same motion.

Conventions
-----------
World: metres, x forwards, y left, z up, as trackers are usually set up. Bone frames are parallel to the world's in the
T-pose that opens every recording.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kernels import rotation
from kernels.calibration.records import PARENT, SENSORS, Recording
from kernels.types import Float

N_DOCUMENT_FRAMES = 6907
"""Frames of the recording of [Kitsunai2007]."""

FRAME_RATE_HZ = 120.0
"""Chosen by hand: they last a minute."""

NEUTRAL_S, RAMP_S = 2.0, 1.5
"""How long the T-pose is held, and going over into the movement takes. Chosen by hand."""

# Proximal joint in the parent's frame, and the far end of segments without a further joint: an adult of 1.75 m, chosen
# by hand.
_OFFSET_MM: dict[str, tuple[float, float, float]] = {
    "pelvis": (0, 0, 0),
    "thorax": (-20, 0, 120),
    "head": (0, 0, 380),
    "shoulder": (50, 25, 330),
    "upper_arm": (-60, 155, 20),
    "forearm": (0, 290, 0),
    "hand": (0, 255, 0),
    "thigh": (0, 88, 0),
    "shank": (0, 0, -430),
    "foot": (0, 0, -420),
}
# Where sensors are strapped, in the segment's frame, chosen by hand.
_MOUNT_MM: dict[str, tuple[float, float, float]] = {
    "pelvis": (-90, 0, 30),
    "thorax": (-70, 0, 200),
    "head": (-60, 0, 130),
    "shoulder": (-40, 90, 40),
    "upper_arm": (0, 160, 50),
    "forearm": (10, 190, 35),
    "hand": (0, 70, 20),
    "thigh": (50, 55, -220),
    "shank": (45, 20, -180),
    "foot": (90, 10, -30),
}
# Standard deviation of the angles about the bone's x, y and z, degrees. Chosen by hand.
_RANGE_DEG: dict[str, tuple[float, float, float]] = {
    "thorax": (12, 14, 16),
    "head": (15, 20, 26),
    "shoulder": (6.5, 2.0, 5.5),
    "upper_arm": (34, 24, 26),
    "forearm": (4, 24, 36),
    "hand": (10, 2.5, 12),
    "thigh": (13, 26, 11),
    "shank": (1.6, 33, 3.3),
    "foot": (6.5, 15, 6),
}
# Soft tissue over that of other segments, chosen by hand: much flesh, and nearly none.
_WOBBLE: dict[str, float] = {"thigh": 1.5, "upper_arm": 1.2, "head": 0.2}


@dataclass(frozen=True, eq=False)
class SyntheticBody:
    """Bones and mounts of a made-up performer.

    Parameters
    ----------
    offset_m : (17, 3) float64, metres
        Proximal joint of each segment in the parent's bone frame.
    mount_m : (17, 3) float64, metres
        Sensor in the bone frame.
    mount_wxyz : (17, 4) float64
        From sensor to bone.
    """

    offset_m: Float
    mount_m: Float
    mount_wxyz: Float

    @property
    def in_parent_sensor_m(self) -> Float:
        """Joints in the frames of their parents' sensors, (16, 3) metres."""
        above = list(PARENT[1:])
        return rotation.apply(rotation.inv(self.mount_wxyz[above]), self.offset_m[1:] - self.mount_m[above])

    @property
    def in_child_sensor_m(self) -> Float:
        """Joints in the frames of their own sensors, (16, 3) metres."""
        return rotation.apply(rotation.inv(self.mount_wxyz[1:]), -self.mount_m[1:])


@dataclass(frozen=True, eq=False)
class BoneMotion:
    """How bones move: world position (F, 3) of the pelvis, local rotations (F, 17, 4), the pelvis's in the world."""

    frame_rate_hz: float
    root_xyz_m: Float
    local_wxyz: Float


@dataclass(frozen=True, eq=False)
class MadeUp:
    """A made-up recording and the truth behind it.

    Parameters
    ----------
    recording : Recording
    body : SyntheticBody
    joint_xyz_m : (F, 17, 3) float64, metres, world
        Proximal joints; the pelvis's own origin first.
    sensor_wxyz : (F, 17, 4) float64, world
        What perfect sensors glued to the bones would read.
    sensor_xyz_m : (F, 17, 3) float64, metres, world
        Where they would be.
    is_outlier : (F, 17) bool
    """

    recording: Recording
    body: SyntheticBody
    joint_xyz_m: Float
    sensor_wxyz: Float
    sensor_xyz_m: Float
    is_outlier: NDArray[np.bool_]


@dataclass(frozen=True)
class Disturbance:
    """What spoils a made-up recording.

    Parameters
    ----------
    position_m, rotation_rad : float, >= 0
        Standard deviation an axis of white noise.
    wobble_m : float, >= 0
        Root mean square of soft tissue moving under the sensor, before each segment's own factor.
    outlier_ratio, dropped_ratio : float, 0 to 1
        Shares of entries in bursts of outliers, and missing.
    distortion_m : float, >= 0
        Size of a smooth magnetic distortion of positions.
    """

    position_m: float = 0.002
    rotation_rad: float = float(np.radians(1.0))
    wobble_m: float = 0.0
    outlier_ratio: float = 0.01
    dropped_ratio: float = 0.01
    distortion_m: float = 0.0


CLEAN = Disturbance(0.0, 0.0, 0.0, 0.0, 0.0)
"""None, by definition."""


def part(sensor: str) -> str:
    """Segment's name without its side: ``l_hand`` and ``r_hand`` are ``hand``."""
    return sensor[2:] if sensor[:2] in ("l_", "r_") else sensor


def make_body(seed: int) -> SyntheticBody:
    """Draw an adult body of about 1.75 m with sensors strapped on anyhow.

    Parameters
    ----------
    seed : int, >= 0

    Returns
    -------
    SyntheticBody
    """
    rng = _stream(seed, "body")
    size = rng.normal(1, 0.06)
    factor = {name: rng.normal(1, 0.04) for name in _OFFSET_MM}
    offset, mount = np.zeros((17, 3)), np.zeros((17, 3))
    for k, name in enumerate(SENSORS):
        mirrored = np.array([1.0, -1.0 if name.startswith("r_") else 1.0, 1.0])
        scale = size * factor[part(name)] * rng.normal(1, 0.008)
        offset[k] = scale * mirrored * _OFFSET_MM[part(name)] + rng.normal(0, 4, 3) * (k > 0)
        mount[k] = size * mirrored * _MOUNT_MM[part(name)] + rng.normal(0, 8, 3)
    return SyntheticBody(offset / 1000, mount / 1000, rotation.normalize(rng.normal(size=(17, 4))))


def range_of_motion(
    seed: int,
    *,
    n_frames: int = N_DOCUMENT_FRAMES,
    frame_rate_hz: float = FRAME_RATE_HZ,
    size: float = 1.0,
    frozen: tuple[str, ...] = (),
    hinged: tuple[str, ...] = (),
) -> BoneMotion:
    """Move every joint about all its axes, walking about, after two seconds in a T-pose.

    Parameters
    ----------
    seed : int, >= 0
    n_frames : int, >= 0
    frame_rate_hz : float, > 0
    size : float, >= 0
        Factor on all angles.
    frozen, hinged : segments
        Whose joints do not move at all, or only about their y axis.

    Returns
    -------
    BoneMotion
    """
    rng = _stream(seed, "motion")
    time_s = np.arange(n_frames) / frame_rate_hz
    ramp = np.clip((time_s - NEUTRAL_S) / RAMP_S, 0, 1)
    ease = (ramp * ramp * (3 - 2 * ramp))[:, None]
    local = np.zeros((n_frames, 17, 4))
    for k, name in enumerate(SENSORS):
        if k == 0:
            angle = sways(rng, time_s, np.array([5.0, 7.0, 40.0]), pace_hz=0.15)
        else:
            degrees = np.array(_RANGE_DEG[part(name)])
            mean = np.array([0.0, 0.0, 0.0])
            if part(name) == "shank":
                mean[1] = 45.0
            if part(name) == "forearm":
                mean[2] = 45.0 if name.startswith("r_") else -45.0
            if part(name) == "upper_arm":
                mean[0] = 35.0 if name.startswith("r_") else -35.0
            angle = sways(rng, time_s, degrees, pace_hz=0.45) + size * np.radians(mean)
            if part(name) == "shank":
                angle[:, 1] = np.maximum(angle[:, 1], np.log1p(np.exp(8 * angle[:, 1])) / 8)
            if name in hinged:
                angle *= np.array([0.0, 1.0, 0.0]) if part(name) != "forearm" else np.array([0.0, 0.0, 1.0])
            angle = angle * (0.0 if name in frozen else size)
        local[:, k] = rotation.exp(ease * angle)
    root = sways(rng, time_s, np.degrees([0.5, 0.5, 0.03]), pace_hz=0.12)
    return BoneMotion(frame_rate_hz, ease * root + np.array([0.9, 0.1, 0.95]), local)


def record(body: SyntheticBody, motion: BoneMotion, *, seed: int, disturbance: Disturbance | None = None) -> MadeUp:
    """Strap the sensors on, move, and read them.

    Parameters
    ----------
    body : SyntheticBody
    motion : BoneMotion of F frames
    seed : int, >= 0
        Of noise, outliers and drop-outs, each in a stream of its own.
    disturbance : Disturbance, or None for 2 mm, 1 degree, 1 % outliers and 1 % drop-outs

    Returns
    -------
    MadeUp
    """
    how = Disturbance() if disturbance is None else disturbance
    f = len(motion.root_xyz_m)
    bone_xyz, bone_wxyz = np.zeros((f, 17, 3)), np.zeros((f, 17, 4))
    bone_xyz[:, 0], bone_wxyz[:, 0] = motion.root_xyz_m, motion.local_wxyz[:, 0]
    for k in range(1, 17):
        above = PARENT[k]
        bone_xyz[:, k] = bone_xyz[:, above] + rotation.apply(bone_wxyz[:, above], body.offset_m[k])
        bone_wxyz[:, k] = rotation.mul(bone_wxyz[:, above], motion.local_wxyz[:, k])
    true_wxyz = rotation.mul(bone_wxyz, body.mount_wxyz)
    true_xyz = bone_xyz + rotation.apply(bone_wxyz, body.mount_m)
    xyz, wxyz = true_xyz.copy(), true_wxyz.copy()
    if how.wobble_m > 0 and f > 2:
        slide, turn = _soft_tissue(seed, motion, bone_xyz, how.wobble_m)
        xyz += rotation.apply(bone_wxyz, slide)
        wxyz = rotation.mul(bone_wxyz, rotation.mul(rotation.exp(turn), body.mount_wxyz))
    if how.distortion_m > 0:
        rng = _stream(seed, "distortion")
        wave, phase, way = rng.normal(0, 2.0, (6, 3)), rng.uniform(0, 2 * np.pi, 6), rng.normal(0, 1, (6, 3))
        xyz += how.distortion_m / np.sqrt(3.0) * (np.sin(xyz @ wave.T + phase) @ way) / np.sqrt(3.0)
    rng = _stream(seed, "noise")
    xyz += how.position_m * rng.normal(size=xyz.shape)
    wxyz = rotation.mul(rotation.exp(how.rotation_rad * rng.normal(size=xyz.shape)), wxyz)
    is_outlier = _bursts(_stream(seed, "outliers"), (f, 17), how.outlier_ratio, mean_length=3)
    rng = _stream(seed, "outlier sizes")
    xyz = np.where(is_outlier[..., None], xyz + 0.15 * rng.normal(size=xyz.shape), xyz)
    wild = rotation.mul(rotation.exp(np.radians(20.0) * rng.normal(size=xyz.shape)), wxyz)
    wxyz = np.where(is_outlier[..., None], wild, wxyz)
    is_valid = ~_bursts(_stream(seed, "drop-outs"), (f, 17), how.dropped_ratio, mean_length=8)
    xyz[~is_valid], wxyz[~is_valid] = np.nan, np.nan
    made = Recording(motion.frame_rate_hz, SENSORS, xyz, wxyz, is_valid)
    return MadeUp(made, body, bone_xyz, true_wxyz, true_xyz, is_outlier & is_valid)


def made_up(
    seed: int,
    *,
    disturbance: Disturbance | None = None,
    n_frames: int = N_DOCUMENT_FRAMES,
    size: float = 1.0,
    frozen: tuple[str, ...] = (),
    hinged: tuple[str, ...] = (),
) -> MadeUp:
    """Record a made-up body going through its range of motion, all of one seed.

    Parameters
    ----------
    seed : int, >= 0
        Of the body, the motion and what spoils the recording.
    disturbance : Disturbance, or None
        As for :func:`record`.
    n_frames : int, >= 0, at 120 Hz
        The usual number makes 58 seconds.
    size, frozen, hinged
        As for :func:`range_of_motion`.

    Returns
    -------
    MadeUp
    """
    motion = range_of_motion(seed, n_frames=n_frames, size=size, frozen=frozen, hinged=hinged)
    return record(make_body(seed), motion, seed=seed, disturbance=disturbance)


def sways(rng: np.random.Generator, time_s: Float, degrees: Float, *, pace_hz: float) -> Float:
    """Sway about three axes, three sines each, of no common period.

    Parameters
    ----------
    rng : numpy.random.Generator
    time_s : (F,) float, seconds
    degrees : (3,) float
        Standard deviation of each angle.
    pace_hz : float, Hz
        Around which the sines lie.

    Returns
    -------
    (F, 3) float64, radians
    """
    hz = pace_hz * rng.uniform(0.35, 1.9, (3, 3))
    phase = rng.uniform(0, 2 * np.pi, (3, 3))
    weight = rng.uniform(0.6, 1.2, (3, 3))
    weight *= np.sqrt(2 / np.sum(weight**2, axis=0))
    angle = np.sum(weight * np.sin(2 * np.pi * hz * time_s[:, None, None] + phase), axis=1)
    swung: Float = np.radians(degrees) * angle
    return swung


def swap(recording: Recording, pairs: dict[str, str]) -> Recording:
    """Exchange sensors: each key gets what the value's sensor said, and the other way round.

    Parameters
    ----------
    recording : Recording
    pairs : sensor to sensor, one entry a pair; exchanged in order

    Returns
    -------
    Recording
        As it was where there are no pairs.

    Raises
    ------
    ValueError
        If a name is no sensor of the recording.
    """
    order = list(range(len(recording.sensors)))
    for one, other in pairs.items():
        a, b = recording.sensors.index(one), recording.sensors.index(other)
        order[a], order[b] = order[b], order[a]
    return replace(
        recording,
        position_xyz_m=recording.position_xyz_m[:, order],
        rotation_wxyz=recording.rotation_wxyz[:, order],
        is_valid=recording.is_valid[:, order],
    )


def _stream(seed: int, purpose: str) -> np.random.Generator:
    return np.random.default_rng([seed, *purpose.encode()])


def _bursts(rng: np.random.Generator, shape: tuple[int, int], ratio: float, *, mean_length: int) -> NDArray[np.bool_]:
    """Mark a share of entries, in runs of geometric length, sensor by sensor."""
    is_marked = np.zeros(shape, np.bool_)
    if ratio <= 0 or shape[0] == 0:
        return is_marked
    for s in range(shape[1]):
        n = max(round(ratio * shape[0] / mean_length), 1)
        for start, length in zip(rng.integers(0, shape[0], n), rng.geometric(1 / mean_length, n), strict=True):
            is_marked[start : start + length, s] = True
    return is_marked


def _soft_tissue(seed: int, motion: BoneMotion, bone_xyz_m: Float, wobble_m: float) -> tuple[Float, Float]:
    """Slide (F, 17, 3) metres and turn (F, 17, 3) radians of each sensor on its bone."""
    rng = _stream(seed, "soft tissue")
    f, rate = len(bone_xyz_m), motion.frame_rate_hz
    slide, turn = np.zeros((f, 17, 3)), np.zeros((f, 17, 3))
    acceleration = np.zeros((f, 17, 3))
    acceleration[1:-1] = np.diff(bone_xyz_m, 2, axis=0) * rate**2
    omega, damping = 2 * np.pi * 5.0, 0.15
    shaken, speed = np.zeros((f, 17, 3)), np.zeros((17, 3))
    for t in range(1, f):
        speed += (-acceleration[t] - 2 * damping * omega * speed - omega**2 * shaken[t - 1]) / rate
        shaken[t] = shaken[t - 1] + speed / rate
    for k, name in enumerate(SENSORS):
        angle = rotation.log(motion.local_wxyz[:, k])
        far = np.sin(np.sqrt(np.sum(angle**2, axis=-1, keepdims=True)))
        bent = far * rng.normal(size=3) + 0.5 * np.sin(angle) @ rng.normal(size=(3, 3))
        slid = bent / max(float(np.sqrt(np.mean(np.sum(bent**2, -1)))), 1e-9)
        shook = shaken[:, k] / max(float(np.sqrt(np.mean(np.sum(shaken[:, k] ** 2, -1)))), 1e-9)
        both = 0.85 * slid + 0.5 * shook
        size = wobble_m * _WOBBLE.get(part(name), 1.0) / max(float(np.sqrt(np.mean(np.sum(both**2, -1)))), 1e-9)
        slide[:, k] = size * both
        turn[:, k] = np.radians(0.25) * 1000 * slide[:, k] @ rng.normal(size=(3, 3)) / np.sqrt(3.0)
    return slide, turn
