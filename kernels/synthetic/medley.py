"""The made-up dancer in a suit: a T-pose, then move after move without a break, with every joint turned a little.

A suit wants each joint moved about all its axes, and the plain moves leave heads, wrists and forearms still. Slow sways
of those joints are laid over the dance, so that calibration has something to see while the feet stay where they were.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from kernels import rotation
from kernels.assembly.joins import ease
from kernels.calibration.records import PARENT, SENSORS
from kernels.skeleton import kinematics
from kernels.skeleton.canonical import CANONICAL, JOINTS, LEG_LENGTH_M
from kernels.synthetic.dancer import MOVES, Figure, SyntheticTake, pose
from kernels.synthetic.suit_performer import BoneMotion, SyntheticBody
from kernels.types import Clip, Float

_T_POSE_S, _RAMP_S = 1.5, 1.0
"""How long the dancer stands, and goes over into the dance. Chosen by hand."""

# Standard deviation of the sways about the joint's x, y and z in the T-pose, degrees, chosen by hand.
_SWAY_DEG: dict[str, tuple[float, float, float]] = {
    "spine": (4, 3, 4),
    "chest": (3, 3, 4),
    "head": (9, 14, 8),
    "Shoulder": (3, 5, 6),
    "UpperArm": (8, 5, 5),
    "LowerArm": (16, 0, 0),
    "Hand": (4, 8, 9),
    "LowerLeg": (0, 6, 0),
    "Foot": (3, 4, 3),
}
_OF_SENSOR = {
    "pelvis": "hips",
    "thorax": "upperChest",
    "head": "head",
    "shoulder": "Shoulder",
    "upper_arm": "UpperArm",
    "forearm": "LowerArm",
    "hand": "Hand",
    "thigh": "UpperLeg",
    "shank": "LowerLeg",
    "foot": "Foot",
}
# From our world, Y up and facing +Z, to the suit's, z up and facing x, by convention of both.
_TO_SUIT = rotation.from_matrix(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))


def medley(
    labels: Sequence[str],
    *,
    n_beats: int = 8,
    interval_s: float = 0.52,
    frame_rate_hz: float = 60.0,
    size: float = 1.0,
    seed: int = 0,
) -> SyntheticTake:
    """Dance several moves on end, after standing in a T-pose.

    Parameters
    ----------
    labels : keys of :data:`kernels.synthetic.dancer.MOVES`, at least one
    n_beats : int, >= 4, a multiple of 4
        Beats of each move; neighbours flow into each other over the beat between them.
    interval_s : float, seconds, > 0
    frame_rate_hz : float, > 0
    size : float, 0.5 to 1.2
    seed : int, >= 0
        Of the sways.

    Returns
    -------
    SyntheticTake
        Labelled ``medley``; the beats of ``idle`` are left out.

    Raises
    ------
    ValueError
        If there is no label, one is not known, or the beats are no multiple of 4.
    """
    if not labels or set(labels) - set(MOVES):
        raise ValueError(f"labels: want some of {', '.join(MOVES)}, got {', '.join(labels) or 'none'}")
    if n_beats < 4 or n_beats % 4:
        raise ValueError(f"n_beats: want a multiple of 4, got {n_beats}; turns then end where they began")
    lead_s = _T_POSE_S + _RAMP_S
    duration_s = lead_s + len(labels) * n_beats * interval_s
    time_s = np.arange(int(np.floor(duration_s * frame_rate_hz + 1e-9)) + 1) / frame_rate_hz
    beat = (time_s - lead_s) / interval_s
    figure = _t_pose(len(time_s))
    rise = ease((time_s - _T_POSE_S) / _RAMP_S)
    for k, label in enumerate(labels):
        share = ease(beat - k * n_beats + 0.5) if k else rise
        figure = _mixed(figure, _within(label, beat - k * n_beats, n_beats, size), share)
    plain = pose(_loosened(figure, time_s, rise, seed), frame_rate_hz)
    swayed = sway(plain, seed=seed, share=rise)
    beats = [
        lead_s + interval_s * (k * n_beats + np.arange(n_beats)) for k, name in enumerate(labels) if name != "idle"
    ]
    return SyntheticTake("medley", swayed, np.concatenate([*beats, np.zeros(0)]))


def sway(clip: Clip, *, seed: int, share: Float | float = 1.0) -> Clip:
    """Turn head, arms, hands, knees and feet slowly to and fro; ankles stay where they are.

    Parameters
    ----------
    clip : Clip on the canonical skeleton, F frames
    seed : int, >= 0
    share : (F,) float or one for all, 0 to 1
        How much of it.

    Returns
    -------
    Clip
    """
    rng = np.random.default_rng([seed, *b"sway"])
    time_s = np.arange(clip.n_frames) / clip.frame_rate_hz
    local = clip.rotation_wxyz.copy()
    _, world = kinematics.place(clip)
    for joint, name in enumerate(JOINTS):
        part = name.removeprefix("left").removeprefix("right")
        hz, phase = rng.uniform(0.08, 0.35, (2, 3)), rng.uniform(0, 2 * np.pi, (2, 3))
        if part not in _SWAY_DEG:
            continue
        angle = np.sin(2 * np.pi * hz * time_s[:, None, None] + phase).sum(axis=1)
        turn = rotation.exp(np.radians(_SWAY_DEG[part]) * angle * np.broadcast_to(share, time_s.shape)[:, None])
        local[:, joint] = rotation.mul(local[:, joint], turn)
        if part == "Foot":  # turned from where the foot stood, not from a shank that now turns too
            shank, thigh = int(CANONICAL.parent[joint]), int(CANONICAL.parent[CANONICAL.parent[joint]])
            turned_shank = rotation.mul(world[:, thigh], local[:, shank])
            local[:, joint] = rotation.mul(rotation.inv(turned_shank), rotation.mul(world[:, joint], turn))
    return replace(clip, rotation_wxyz=rotation.continuous(local))


def wear(clip: Clip, body: SyntheticBody) -> BoneMotion:
    """Let a made-up body in a suit move as a clip does.

    Parameters
    ----------
    clip : Clip on the canonical skeleton, F frames
    body : SyntheticBody

    Returns
    -------
    BoneMotion
        In the suit's world, z up; root travel is scaled by leg length.
    """
    _, world = kinematics.place(clip)
    order = [JOINTS.index(_joint(sensor)) for sensor in SENSORS]
    turned = rotation.mul(_TO_SUIT, rotation.mul(world[:, order], rotation.inv(_TO_SUIT)))
    local = turned.copy()
    for k, above in enumerate(PARENT):
        if above >= 0:
            local[:, k] = rotation.mul(rotation.inv(turned[:, above]), turned[:, k])
    leg_m = sum(float(np.linalg.norm(body.offset_m[SENSORS.index(name)])) for name in ("l_shank", "l_foot"))
    root = rotation.apply(_TO_SUIT, clip.root_xyz_m) * (leg_m / LEG_LENGTH_M)
    return BoneMotion(clip.frame_rate_hz, root, rotation.continuous(local))


def _loosened(figure: Figure, time_s: Float, share: Float, seed: int) -> Figure:
    """Let the hips turn and shift a little over the feet."""
    phase = np.random.default_rng([seed, *b"hips"]).uniform(0, 2 * np.pi, 3)
    turn, aside, ahead = (
        share * size * np.sin(2 * np.pi * hz * time_s + p)
        for size, hz, p in zip((0.12, 0.035, 0.03), (0.31, 0.23, 0.17), phase, strict=True)
    )
    shift = np.stack([aside, -0.01 * share, ahead], axis=1)
    hips = figure.hips_xyz_m + rotation.apply(rotation.from_heading(figure.heading), shift)
    return replace(figure, hip_turn=figure.hip_turn + turn, hips_xyz_m=hips)


def _joint(sensor: str) -> str:
    side = {"l_": "left", "r_": "right"}.get(sensor[:2], "")
    return side + _OF_SENSOR[sensor[2:] if side else sensor]


def _t_pose(f: int) -> Figure:
    still = MOVES["idle"](np.zeros(f), 0.0)
    return replace(still, raised=np.full((2, f), np.pi / 2), elbow=np.zeros((2, f)))


def _within(label: str, beat: Float, n_beats: int, size: float) -> Figure:
    """Dance a move from its beat 0 to its last, held before and after; whole turns made are taken back."""
    figure = MOVES[label](np.clip(beat, 0.0, float(n_beats)), size)
    whole = 2 * np.pi * np.round(figure.heading[-1] / (2 * np.pi))
    done = np.where(beat > n_beats - 0.5, whole, 0.0)
    return replace(figure, heading=figure.heading - done, foot_heading=figure.foot_heading - done)


def _mixed(one: Figure, other: Figure, share: Float) -> Figure:
    values = {}
    for item in fields(Figure):
        a, b = getattr(one, item.name), getattr(other, item.name)
        weight = share[:, None] if a.shape[-1] == 3 and a.ndim > 1 and a.shape[-2] == len(share) else share
        values[item.name] = (1 - weight) * a + weight * b
    return Figure(**values)
