"""From a clip on the canonical skeleton to the features of its beats: poses, velocities, and how much it moves there.

Conventions
-----------
Everything is taken in the body's own *heading frame*: the hips' horizontal position and heading
(:func:`kernels.rotation.heading_rad`) are removed, height and lean are kept. Times may fall between frames: positions
are interpolated linearly, rotations by slerp, so clips of 24 and of 240 frames a second are treated alike.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from kernels import rotation
from kernels.graph.distance import Metric, PoseFeatures, check_metric, concatenate, paired_distance
from kernels.motion.velocity import jerk
from kernels.skeleton.canonical import JOINTS, LEG_LENGTH_M
from kernels.types import Float

STEP_S = 1 / 30
"""Half-width of the central difference of a velocity, and the offset of the frames before and after a beat, seconds.
One frame of [Xu2015] at the commonest rate; chosen so that a clip at 120 Hz looks no stiller than one at 30."""

JERK_REACH_S = 0.2
"""How far around a beat the recording's own jerk counts, seconds. Chosen as half a usual blend."""

VELOCITY_TIME_S = 0.1
"""Default time constant of velocities, seconds: a mismatch of 1 m/s counts as much as one of 0.1 m. Chosen by hand."""


def _weights(big: str, middle: str, small: str) -> dict[str, float]:
    return {name: value for names, value in ((big, 1.0), (middle, 0.5), (small, 0.1)) for name in names.split()}


_LIMBS = {
    # a joint's position says what the bone above it does: the wrist is the forearm's end
    "position": _weights("hips LowerLeg Foot LowerArm Hand", "chest upperChest head UpperLeg UpperArm", "Toes"),
    # a joint's rotation moves everything below it: the wrist's own turns only the hand
    "rotation": _weights("hips UpperLeg LowerLeg UpperArm spine chest", "LowerArm upperChest", "neck Shoulder Foot"),
}


def default_weight(metric: Metric) -> Float:
    """Weights of the canonical joints, (22,) float64, summing to 1.

    Large for hips, legs, spine and arms, small for what a viewer hardly sees at a seam. For "position" the weight
    belongs to the joint's place (knees, ankles, elbows, wrists 1; hips 1; chest, head, shoulders, hip joints 0.5; toes
    0.1); for "rotation" to its local rotation (hips, thighs, knees, shoulders, spine 1; elbows 0.5; neck, ankles,
    collar bones 0.1; hands, toes, head 0), after the choice of [Lee2002], who give the extremities none.

    Raises
    ------
    ValueError
        If the metric is unknown.
    """
    check_metric(metric)
    table = _LIMBS[metric]
    weight = np.array([table.get(name.removeprefix("left").removeprefix("right"), 0.0) for name in JOINTS])
    return np.asarray(weight / weight.sum(), np.float64)


@dataclass(frozen=True, eq=False)
class BeatFeatures:
    """What the graph needs to know of each beat.

    Parameters
    ----------
    pose : PoseFeatures of N beats
    local_distance : (N,) float64, in the metric's unit squared, >= 0
        d(i) of equation 19: how far the pose moves across the beat.
    jerk_ratio : (N,) float64, >= 0, or None where it is not known
        How rough the recording itself is around the beat: 1 is the 99th percentile of its clip.

    Raises
    ------
    ValueError
        If the lengths differ or a value is not finite and >= 0.
    """

    pose: PoseFeatures
    local_distance: Float
    jerk_ratio: Float | None = None

    def __post_init__(self) -> None:
        for name in ("local_distance", "jerk_ratio"):
            value = getattr(self, name)
            if value is not None and value.shape != (len(self.pose),):
                raise ValueError(f"{name}: want ({len(self.pose)},), got {value.shape}")
            if value is not None and not (np.isfinite(value).all() and (value >= 0).all()):
                raise ValueError(f"{name}: want finite, >= 0")


def concatenate_beats(parts: Iterable[BeatFeatures]) -> BeatFeatures:
    """Stack the beats of several clips.

    Parameters
    ----------
    parts : at least one, all made alike

    Returns
    -------
    BeatFeatures of all rows, in order; ``jerk_ratio`` is None where one part's is

    Raises
    ------
    ValueError
        If there is no part, or two were made differently.
    """
    parts = list(parts)
    known = [part.jerk_ratio for part in parts if part.jerk_ratio is not None]
    return BeatFeatures(
        concatenate(part.pose for part in parts),
        np.concatenate([part.local_distance for part in parts]),
        np.concatenate(known) if len(known) == len(parts) else None,
    )


def beat_features(
    rotation_wxyz: Float,
    position_xyz_m: Float,
    *,
    frame_rate_hz: float,
    time_s: Float,
    metric: Metric = "position",
    weight: Float | None = None,
    velocity_time_s: float = VELOCITY_TIME_S,
) -> BeatFeatures:
    """Take the features of a clip at its beats.

    Parameters
    ----------
    rotation_wxyz : (F, J, 4) float, unit, local to the parent; joint 0 is the hips, in the world
    position_xyz_m : (F, J, 3) float, metres, world
    frame_rate_hz : float, > 0
    time_s : (N,) float, seconds from the first frame, 0 to the clip's end (half a frame beyond is taken as the end)
    metric : "position" (equation 18) or "rotation" (equation 17)
    weight : (J,) float, >= 0, not all 0, or None
        Scaled to sum to 1. None: :func:`default_weight` of the canonical skeleton, J = 22.
    velocity_time_s : float, seconds, >= 0
        How much velocities count: their difference times this adds to that of the poses. 0 leaves them out.

    Returns
    -------
    BeatFeatures of N beats; empty when N is 0

    Raises
    ------
    ValueError
        If a shape does not fit, the metric is unknown, a value is not finite, or a time lies outside the clip.

    Notes
    -----
    With weights w_k (Σ w_k = 1) and τ = ``velocity_time_s``::

        position   d = Σ_k w_k (‖p_i,k − p_j,k‖² + τ²‖v_i,k − v_j,k‖²)
        rotation   d = Σ_k w_k (‖log(q_j,k⁻¹ q_i,k)‖² + τ²‖ω_i,k − ω_j,k‖²)
                       + w_0 ((h_i − h_j)² + τ²‖v_i,0 − v_j,0‖²) / L²

    p heading-free positions, v velocities (the travel of the hips included), q local rotations (the hips' without
    heading), ω angular velocities, h the hips' height, L the canonical leg, 0.82 m. Equation 17 alone cannot tell a
    crouch from a jump or walking from marching on the spot: the height and velocity of the hips are added to it.

    Velocities are central differences over ±1/30 s whatever the frame rate, one-sided at the clip's ends.
    ``local_distance`` is the distance of the poses 1/30 s before and after the beat, a fixed time too: with "one frame"
    a clip at 120 Hz would look sixteen times stiller than the same clip at 30 Hz, and hardly connect. Near an end the
    two instants are shifted inwards, keeping their spacing. At an extremum of motion the two poses nearly agree; the
    velocities, which turn there, keep d(i) from vanishing.

    ``jerk_ratio`` is the largest jerk of any joint within 0.2 s of the beat over the 99th percentile in the clip. Where
    a recording jumps, d(i) is large and equation 19 would draw seams to the jump; this tells such beats apart.
    """
    check_metric(metric)
    rotation_wxyz = np.asarray(rotation_wxyz, np.float64)
    position_xyz_m = np.asarray(position_xyz_m, np.float64)
    time_s = np.asarray(time_s, np.float64)
    frames, joints = rotation_wxyz.shape[:2] if rotation_wxyz.ndim == 3 else (0, 0)
    if rotation_wxyz.shape != (frames, joints, 4) or position_xyz_m.shape != (frames, joints, 3) or joints < 1:
        raise ValueError(
            f"rotation_wxyz, position_xyz_m: want (F, J, 4) and (F, J, 3) with J >= 1, got {rotation_wxyz.shape} and "
            f"{position_xyz_m.shape}"
        )
    if not (np.isfinite(rotation_wxyz).all() and np.isfinite(position_xyz_m).all()):
        raise ValueError("rotation_wxyz, position_xyz_m: not finite; mend or refuse the clip where it is read")
    if not (np.isfinite(frame_rate_hz) and frame_rate_hz > 0):
        raise ValueError(f"frame_rate_hz: want > 0, got {frame_rate_hz}")
    if not (np.isfinite(velocity_time_s) and velocity_time_s >= 0):
        raise ValueError(f"velocity_time_s: want >= 0, got {velocity_time_s}")
    duration_s = max(frames - 1, 0) / frame_rate_hz
    slack_s = 0.5 / frame_rate_hz
    if (
        time_s.ndim != 1
        or not ((time_s >= -slack_s) & (time_s <= duration_s + slack_s)).all()
        or (frames == 0 and time_s.size)
    ):
        raise ValueError(f"time_s: want (N,) seconds within the clip, 0 to {duration_s:.6g}, got {time_s}")
    clip = _Clip(rotation_wxyz, position_xyz_m, frame_rate_hz, duration_s)
    scaled = _scaled_weight(metric, weight, joints)

    def features(at_s: Float) -> PoseFeatures:
        make = _position_features if metric == "position" else _rotation_features
        return make(clip, np.clip(at_s, 0.0, duration_s), scaled, velocity_time_s)

    middle = np.clip(time_s, min(STEP_S, duration_s / 2), max(duration_s - STEP_S, duration_s / 2))
    local = paired_distance(features(middle - STEP_S), features(middle + STEP_S))
    return BeatFeatures(features(time_s), local, _jerk_ratio(position_xyz_m, frame_rate_hz, time_s))


def _jerk_ratio(position_xyz_m: Float, frame_rate_hz: float, time_s: Float) -> Float:
    """Peak jerk within reach of each moment over the clip's 99th percentile; 0 where the clip has none."""
    found = jerk(position_xyz_m, frame_rate_hz)
    usual = float(np.percentile(found[1:-2], 99)) if len(found) >= 4 else 0.0
    if usual == 0:
        return np.zeros(len(time_s))
    first = np.maximum(np.floor((time_s - JERK_REACH_S) * frame_rate_hz).astype(np.int64), 0)
    last = np.ceil((time_s + JERK_REACH_S) * frame_rate_hz).astype(np.int64)
    return np.array([found[a : b + 1].max() for a, b in zip(first, last, strict=True)]).reshape(-1) / usual


@dataclass(frozen=True, eq=False)
class _Clip:
    rotation_wxyz: Float
    position_xyz_m: Float
    frame_rate_hz: float
    duration_s: float

    def _between(self, time_s: Float) -> tuple[np.ndarray, np.ndarray, Float]:
        frame = time_s * self.frame_rate_hz
        last = max(len(self.rotation_wxyz) - 1, 0)
        low = np.clip(np.floor(frame).astype(np.int64), 0, last)
        return low, np.minimum(low + 1, last), np.clip(frame - low, 0.0, 1.0)

    def rotation_at(self, time_s: Float) -> Float:
        """Local rotations (N, J, 4)."""
        low, high, share = self._between(time_s)
        return rotation.normalize(rotation.slerp(self.rotation_wxyz[low], self.rotation_wxyz[high], share[:, None]))

    def position_at(self, time_s: Float) -> Float:
        """World positions (N, J, 3)."""
        low, high, share = self._between(time_s)
        share = share[:, None, None]
        start, end = self.position_xyz_m[low], self.position_xyz_m[high]
        return np.asarray((1.0 - share) * start + share * end, np.float64)

    def around(self, time_s: Float) -> tuple[Float, Float, Float]:
        """Instants before and after, cut at the clip's ends, and one over what lies between (0 where nothing does)."""
        before, after = np.maximum(time_s - STEP_S, 0.0), np.minimum(time_s + STEP_S, self.duration_s)
        span = after - before
        return before, after, np.where(span > 0, 1.0 / np.where(span > 0, span, 1.0), 0.0)


def _scaled_weight(metric: Metric, weight: Float | None, joints: int) -> Float:
    if weight is None:
        weight = default_weight(metric)
        if joints != len(weight):
            raise ValueError(f"rotation_wxyz: want the {len(weight)} canonical joints, got {joints}; or give weight")
    weight = np.asarray(weight, np.float64)
    if weight.shape != (joints,) or not np.isfinite(weight).all() or not (weight >= 0).all() or not weight.sum() > 0:
        raise ValueError(f"weight: want ({joints},) finite, >= 0, not all 0, got {weight}")
    return np.asarray(weight / weight.sum(), np.float64)


def _unheading(q_root: Float) -> Float:
    """Rotation about the vertical that makes the body face +Z, (N, 4)."""
    return rotation.from_heading(-rotation.heading_rad(q_root))


def _position_features(clip: _Clip, time_s: Float, weight: Float, velocity_time_s: float) -> PoseFeatures:
    used = np.flatnonzero(weight)
    turn = _unheading(clip.rotation_at(time_s)[:, 0])[:, None]
    position = clip.position_at(time_s)
    relative = position - position[:, :1] * np.array([1.0, 0.0, 1.0])
    before, after, per_s = clip.around(time_s)
    velocity = (clip.position_at(after) - clip.position_at(before)) * per_s[:, None, None]
    root = np.sqrt(weight[used])[:, None]
    parts = [root * rotation.apply(turn, relative[:, used])]
    parts.append(velocity_time_s * root * rotation.apply(turn, velocity[:, used]))
    linear = np.concatenate(parts, axis=1).reshape(len(time_s), 6 * len(used))
    return PoseFeatures("position", linear, np.zeros((len(time_s), 0, 4)), np.zeros(0))


def _rotation_features(clip: _Clip, time_s: Float, weight: Float, velocity_time_s: float) -> PoseFeatures:
    used = np.flatnonzero(weight)
    q = clip.rotation_at(time_s)
    turn = _unheading(q[:, 0])
    q[:, 0] = rotation.mul(turn, q[:, 0])
    before, after, per_s = clip.around(time_s)
    step = rotation.mul(clip.rotation_at(after), rotation.inv(clip.rotation_at(before)))
    spin = rotation.log(step) * per_s[:, None, None]
    spin[:, 0] = rotation.apply(turn, spin[:, 0])
    travel = (clip.position_at(after)[:, 0] - clip.position_at(before)[:, 0]) * per_s[:, None]
    hips = np.sqrt(weight[0]) / LEG_LENGTH_M
    linear = np.concatenate(
        [
            (velocity_time_s * np.sqrt(weight[used])[:, None] * spin[:, used]).reshape(len(time_s), 3 * len(used)),
            hips * clip.position_at(time_s)[:, 0, 1:2],
            velocity_time_s * hips * rotation.apply(turn, travel),
        ],
        axis=1,
    )
    return PoseFeatures("rotation", linear, q[:, used], weight[used])
