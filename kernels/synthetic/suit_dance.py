"""The made-up dancer in a made-up suit: a warm-up that shows every joint, and then the dance."""

from __future__ import annotations

import numpy as np

from kernels import rotation
from kernels.assembly.blend import ease
from kernels.calibration.records import SENSORS
from kernels.skeleton.canonical import JOINTS as CANONICAL_JOINTS
from kernels.skeleton.canonical import LEG_LENGTH_M
from kernels.synthetic import dancer, suit
from kernels.types import Clip, Float

_BLEND_S = 0.8
_HIPS_OVER_LEGS_M = 0.04
# Canonical joints whose turns add up to a segment's, from the parent outwards.
_MADE_OF: dict[str, tuple[str, ...]] = {
    "pelvis": ("hips",),
    "thorax": ("spine", "chest", "upperChest"),
    "head": ("neck", "head"),
    "shoulder": ("Shoulder",),
    "upper_arm": ("UpperArm",),
    "forearm": ("LowerArm",),
    "hand": ("Hand",),
    "thigh": ("UpperLeg",),
    "shank": ("LowerLeg",),
    "foot": ("Foot",),
}
# What the canonical dancer holds stiff and a living one does not: standard deviation about x, y and z, degrees. The
# shin turns about its own length and the foot turns back, so that soles stay where they are.
_ALIVE_DEG: dict[str, tuple[float, float, float]] = {
    "head": (5.0, 8.0, 10.0),
    "shoulder": (5.0, 1.5, 4.5),
    "hand": (8.0, 2.0, 10.0),
    "shank": (0.0, 0.0, 4.0),
}


def danced(
    seed: int,
    body: suit.Body,
    *,
    moves: tuple[str, ...] = ("step", "wave", "twist", "kick"),
    warm_up_s: float = 30.0,
    frame_rate_hz: float = suit.FRAME_RATE_HZ,
) -> suit.Motion:
    """Dance in a suit: two seconds in a T-pose, a warm-up through every joint's range, then moves of the dancer.

    Parameters
    ----------
    seed : int, >= 0
        Of the warm-up.
    body : suit.Body
        Whose legs the dance is scaled to, so that planted feet stay planted.
    moves : keys of :data:`kernels.synthetic.dancer.MOVES`
    warm_up_s : float, seconds, > 3.5
        T-pose included.
    frame_rate_hz : float, > 0

    Returns
    -------
    suit.Motion
        Without a move, the warm-up alone.
    """
    rng = np.random.default_rng([seed, *b"alive"])
    warm_up = suit.range_of_motion(seed, n_frames=round(warm_up_s * frame_rate_hz), frame_rate_hz=frame_rate_hz)
    root, local = warm_up.root_xyz_m, warm_up.local_wxyz
    for label in moves:
        next_root, next_local = _in_suit(dancer.take(label, frame_rate_hz=frame_rate_hz).clip, body)
        next_local = _alive(next_local, rng, frame_rate_hz)
        # the dance goes on where the dancer stands
        next_root = next_root + (root[-1] - next_root[0]) * np.array([1.0, 1.0, 0.0])
        bridge_root, bridge_local = _bridge((root[-1], local[-1]), (next_root[0], next_local[0]), frame_rate_hz)
        root = np.concatenate([root, bridge_root, next_root])
        local = np.concatenate([local, bridge_local, next_local])
    return suit.Motion(frame_rate_hz, root, local)


def _in_suit(clip: Clip, body: suit.Body) -> tuple[Float, Float]:
    """Root (F, 3) and local rotations (F, 17, 4) of a canonical clip in the suit's world: x ahead, y left, z up."""
    at = {name: k for k, name in enumerate(CANONICAL_JOINTS)}
    local = np.zeros((clip.n_frames, len(SENSORS), 4))
    for k, name in enumerate(SENSORS):
        side = {"l_": "left", "r_": "right"}.get(name[:2], "") if name[:2] in ("l_", "r_") else ""
        turned = np.broadcast_to(rotation.IDENTITY, (clip.n_frames, 4))
        for joint in _MADE_OF[suit.part(name)]:
            turned = rotation.mul(turned, clip.rotation_wxyz[:, at[side + joint]])
        local[:, k] = turned[:, [0, 3, 1, 2]]
    legs = [SENSORS.index(name) for name in ("l_shank", "l_foot", "r_shank", "r_foot")]
    scale = float(np.sqrt(np.sum(body.offset_m[legs] ** 2, axis=-1)).sum()) / 2 / LEG_LENGTH_M
    middle = clip.root_xyz_m + rotation.apply(clip.rotation_wxyz[:, 0], np.array([0.0, -_HIPS_OVER_LEGS_M, 0.0]))
    return scale * middle[:, [2, 0, 1]], local


def _alive(local_wxyz: Float, rng: np.random.Generator, frame_rate_hz: float) -> Float:
    """Add what a living dancer does besides."""
    time_s = np.arange(len(local_wxyz)) / frame_rate_hz
    local = local_wxyz.copy()
    for k, name in enumerate(SENSORS):
        if suit.part(name) in _ALIVE_DEG:
            turn = rotation.exp(suit.sways(rng, time_s, np.array(_ALIVE_DEG[suit.part(name)]), pace_hz=0.4))
            local[:, k] = rotation.mul(local[:, k], turn)
            if suit.part(name) == "shank":
                local[:, k + 1] = rotation.mul(rotation.inv(turn), local[:, k + 1])
    return local


def _bridge(start: tuple[Float, Float], end: tuple[Float, Float], frame_rate_hz: float) -> tuple[Float, Float]:
    """Walk from one pose to the next with ease."""
    n = round(_BLEND_S * frame_rate_hz)
    share = ease(np.arange(1, n) / n) if n > 1 else np.zeros(0)
    root = (1 - share[:, None]) * start[0] + share[:, None] * end[0]
    local = rotation.slerp(start[1][None], end[1][None], share[:, None])
    return root, local
